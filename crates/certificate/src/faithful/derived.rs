//! Derived atoms: which of them always or never hold, and which the task knows.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::faithful::axioms::Axioms;
use crate::faithful::bound;
use crate::faithful::formula::Formula;
use crate::faithful::invariant::Invariant;
use crate::faithful::key::Key;
use crate::faithful::reader::Reader;
use crate::faithful::verdict::Cause;
use crate::faithful::world::World;
use pddl::ast::{Condition, Expression};

/// What the witness says of derived atoms.
pub(super) fn axioms(
    world: &World<'_>,
    invariant: &Invariant,
    linked: &FxHashSet<Key>,
    stop: &dyn Fn() -> bool,
) -> Result<Axioms, Cause> {
    let mut axioms = Axioms { reads: reads(world)?, ..Axioms::default() };
    if axioms.reads.is_empty() {
        return Ok(axioms);
    }
    bound::add(world, invariant, &mut axioms, stop)?;
    let bodies = bodies(world, invariant, &axioms)?;
    // Each set is sound if the other one is, and each gets better with the other one.
    loop {
        let may = fixpoint(&bodies, |formula, own| possible(world, formula, own, &axioms.must));
        let must = fixpoint(&bodies, |formula, own| certain(world, formula, own, &may));
        let settled = may == axioms.may && must == axioms.must;
        (axioms.may, axioms.must) = (may, must);
        if settled {
            break;
        }
    }
    axioms.bound = axioms.may.iter().cloned().collect();
    let circular = circular(&axioms, &bodies);
    axioms.linked = linked.iter().filter(|key| circular.contains(*key)).cloned().collect();
    Ok(axioms)
}

/// The derived atoms on cycles of dependencies, and those on paths between such cycles: what remains after repeated removal of atoms that depend on no
/// remaining atom, or on which none depends.
fn circular<'b>(axioms: &Axioms, bodies: &'b [(Key, Formula)]) -> FxHashSet<&'b Key> {
    let mut below: FxHashMap<&Key, FxHashSet<&Key>> = FxHashMap::default();
    for (key, body) in bodies.iter().filter(|(key, _)| axioms.known(key).is_none()) {
        atoms(body, below.entry(key).or_default());
    }
    let mut remaining: FxHashSet<&Key> = below.keys().copied().collect();
    for own in below.values_mut() {
        own.retain(|key| remaining.contains(key));
    }
    let mut above: FxHashMap<&Key, FxHashSet<&Key>> = FxHashMap::default();
    for (key, own) in &below {
        for lower in own {
            above.entry(*lower).or_default().insert(*key);
        }
    }
    for (links, opposite) in [(&below, &above), (&above, &below)] {
        take_ends_away(&mut remaining, links, opposite);
    }
    remaining
}

/// Takes away the atoms without a link to one that remains, again and again.
#[expect(clippy::arithmetic_side_effects, reason = "a link is taken away once")]
fn take_ends_away<'b>(
    remaining: &mut FxHashSet<&'b Key>,
    links: &FxHashMap<&'b Key, FxHashSet<&'b Key>>,
    opposite: &FxHashMap<&'b Key, FxHashSet<&'b Key>>,
) {
    let count = |key: &'b Key| {
        let own = links.get(key).into_iter().flatten();
        (key, own.filter(|other| remaining.contains(*other)).count())
    };
    let mut counts: FxHashMap<&Key, usize> = remaining.iter().copied().map(count).collect();
    let mut open: Vec<&Key> = counts.iter().filter(|(_, count)| **count == 0).map(|(key, _)| *key).collect();
    while let Some(key) = open.pop() {
        remaining.remove(key);
        for other in opposite.get(key).into_iter().flatten() {
            if let Some(count) = counts.get_mut(other) {
                *count -= 1;
                if *count == 0 {
                    open.push(*other);
                }
            }
        }
    }
}

/// Derived atoms with the conditions under which they hold, in terms of atoms of both kinds.
fn bodies(world: &World<'_>, invariant: &Invariant, axioms: &Axioms) -> Result<Vec<(Key, Formula)>, Cause> {
    let mut heads: Vec<Key> = axioms.bound.atoms().cloned().collect();
    heads.sort_unstable();
    let body = |key: Key| {
        let mut reader = Reader::new(world, invariant, axioms);
        reader.opaque = true;
        let body = reader.unfold(&key)?;
        Ok((key, body))
    };
    heads.into_iter().map(body).collect()
}

/// All atoms in a formula.
fn atoms<'f>(formula: &'f Formula, found: &mut FxHashSet<&'f Key>) {
    match formula {
        Formula::All(parts) | Formula::Any(parts) => parts.iter().for_each(|part| atoms(part, found)),
        Formula::Atom(key, _) => {
            found.insert(key);
        }
        Formula::Compare(..) => {}
    }
}

/// The least set of atoms whose bodies hold by the set. A body that holds by a set holds by every larger one, so that it is read
/// again only when an atom in it has joined.
fn fixpoint(bodies: &[(Key, Formula)], holds: impl Fn(&Formula, &FxHashSet<Key>) -> bool) -> FxHashSet<Key> {
    let mut readers: FxHashMap<&Key, Vec<usize>> = FxHashMap::default();
    for (place, (_, body)) in bodies.iter().enumerate() {
        let mut below = FxHashSet::default();
        atoms(body, &mut below);
        for key in below {
            readers.entry(key).or_default().push(place);
        }
    }
    let mut own: FxHashSet<Key> = FxHashSet::default();
    let mut open: Vec<usize> = (0..bodies.len()).rev().collect();
    while let Some(place) = open.pop() {
        let (key, body) = &bodies[place];
        if !own.contains(key) && holds(body, &own) {
            own.insert(key.clone());
            open.extend(readers.get(key).into_iter().flatten());
        }
    }
    own
}

/// Whether a body may hold where derived atoms hold only if they are in one set, and surely if they are in the other one.
fn possible(world: &World<'_>, formula: &Formula, may: &FxHashSet<Key>, must: &FxHashSet<Key>) -> bool {
    match formula {
        Formula::All(parts) => parts.iter().all(|part| possible(world, part, may, must)),
        Formula::Any(parts) => parts.iter().any(|part| possible(world, part, may, must)),
        Formula::Atom(key, true) => may.contains(key) || world.rules(key.0).is_none(),
        Formula::Atom(key, false) => !must.contains(key),
        Formula::Compare(..) => true,
    }
}

/// Whether a body holds in any case.
fn certain(world: &World<'_>, formula: &Formula, must: &FxHashSet<Key>, may: &FxHashSet<Key>) -> bool {
    match formula {
        Formula::All(parts) => parts.iter().all(|part| certain(world, part, must, may)),
        Formula::Any(parts) => parts.iter().any(|part| certain(world, part, must, may)),
        Formula::Atom(key, true) => must.contains(key),
        Formula::Atom(key, false) => world.rules(key.0).is_some() && !may.contains(key),
        Formula::Compare(..) => false,
    }
}

/// The predicates and functions that the rules of each derived predicate mention.
fn reads(world: &World<'_>) -> Result<FxHashMap<u32, FxHashSet<u32>>, Cause> {
    let mut reads: FxHashMap<u32, FxHashSet<u32>> = FxHashMap::default();
    for (symbol, rules) in world.derived() {
        let own = reads.entry(symbol).or_default();
        for rule in rules {
            in_condition(world, &rule.condition, own)?;
        }
    }
    Ok(reads)
}

fn in_condition(world: &World<'_>, condition: &Condition, found: &mut FxHashSet<u32>) -> Result<(), Cause> {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => {
            parts.iter().try_for_each(|part| in_condition(world, part, found))
        }
        Condition::Not(inner) | Condition::Exists(_, inner) | Condition::ForAll(_, inner) => {
            in_condition(world, inner, found)
        }
        Condition::Imply(left, right) => {
            in_condition(world, left, found)?;
            in_condition(world, right, found)
        }
        Condition::Atom(atom) => {
            found.insert(world.symbol(&atom.predicate.name)?);
            Ok(())
        }
        Condition::Equal(..) => Ok(()),
        Condition::Compare(_, left, right, _) => {
            in_expression(world, left, found)?;
            in_expression(world, right, found)
        }
    }
}

fn in_expression(
    world: &World<'_>,
    expression: &Expression,
    found: &mut FxHashSet<u32>,
) -> Result<(), Cause> {
    match expression {
        Expression::Fluent(atom) => {
            found.insert(world.symbol(&atom.predicate.name)?);
            Ok(())
        }
        Expression::Operation(_, parts, _) => {
            parts.iter().try_for_each(|part| in_expression(world, part, found))
        }
        Expression::Number(..) | Expression::Duration(_) | Expression::TotalTime(_) => Ok(()),
    }
}
