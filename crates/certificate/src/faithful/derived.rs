//! Analyses the derived atoms. Proves of some that they hold in all states or in no state of the witness (the
//! over-approximation of the reachable states). Also computes which derived variables of the task lie on
//! dependency cycles or between cycles.

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

/// Computes bounds on the derived atoms that hold in states that satisfy the invariant. `linked` contains
/// the derived atoms that are variables of the task.
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
    // After each iteration, `may` is an upper and `must` a lower bound on the derived atoms that
    // hold. The next iteration may tighten each bound with the help of the other one.
    loop {
        let may =
            fixpoint(&bodies, |formula, atoms_so_far| possible(world, formula, atoms_so_far, &axioms.must));
        let must = fixpoint(&bodies, |formula, atoms_so_far| certain(world, formula, atoms_so_far, &may));
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

/// Returns the derived atoms on dependency cycles and on paths between cycles, except atoms with a known
/// truth value. Atoms without a remaining predecessor or successor are removed until a fixpoint is reached.
fn circular<'b>(axioms: &Axioms, bodies: &'b [(Key, Formula)]) -> FxHashSet<&'b Key> {
    let mut below: FxHashMap<&Key, FxHashSet<&Key>> = FxHashMap::default();
    for (key, body) in bodies.iter().filter(|(key, _)| axioms.known(key).is_none()) {
        atoms(body, below.entry(key).or_default());
    }
    let mut remaining: FxHashSet<&Key> = below.keys().copied().collect();
    for links in below.values_mut() {
        links.retain(|key| remaining.contains(key));
    }
    let mut above: FxHashMap<&Key, FxHashSet<&Key>> = FxHashMap::default();
    for (key, links) in &below {
        for lower in links {
            above.entry(*lower).or_default().insert(*key);
        }
    }
    for (links, opposite) in [(&below, &above), (&above, &below)] {
        take_ends_away(&mut remaining, links, opposite);
    }
    remaining
}

/// Removes from `remaining` the atoms that have no link to a remaining atom, until a fixpoint is
/// reached. `opposite` contains the reversed links.
#[expect(clippy::arithmetic_side_effects, reason = "a link is taken away once")]
fn take_ends_away<'b>(
    remaining: &mut FxHashSet<&'b Key>,
    links: &FxHashMap<&'b Key, FxHashSet<&'b Key>>,
    opposite: &FxHashMap<&'b Key, FxHashSet<&'b Key>>,
) {
    let count = |key: &'b Key| {
        let targets = links.get(key).into_iter().flatten();
        (key, targets.filter(|target| remaining.contains(*target)).count())
    };
    let mut counts: FxHashMap<&Key, usize> = remaining.iter().copied().map(count).collect();
    let mut open: Vec<&Key> = counts.iter().filter(|(_, count)| **count == 0).map(|(key, _)| *key).collect();
    while let Some(key) = open.pop() {
        remaining.remove(key);
        for target in opposite.get(key).into_iter().flatten() {
            if let Some(count) = counts.get_mut(target) {
                *count -= 1;
                if *count == 0 {
                    open.push(*target);
                }
            }
        }
    }
}

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

fn atoms<'f>(formula: &'f Formula, keys: &mut FxHashSet<&'f Key>) {
    match formula {
        Formula::All(parts) | Formula::Any(parts) => parts.iter().for_each(|part| atoms(part, keys)),
        Formula::Atom(key, _) => {
            keys.insert(key);
        }
        Formula::Compare(..) => {}
    }
}

/// Computes the least set of atoms that contains each atom whose body holds under the set. `holds` must be
/// monotone in the set; so a body is evaluated again only when one of its atoms is added.
fn fixpoint(bodies: &[(Key, Formula)], holds: impl Fn(&Formula, &FxHashSet<Key>) -> bool) -> FxHashSet<Key> {
    let mut readers: FxHashMap<&Key, Vec<usize>> = FxHashMap::default();
    for (place, (_, body)) in bodies.iter().enumerate() {
        let mut below = FxHashSet::default();
        atoms(body, &mut below);
        for key in below {
            readers.entry(key).or_default().push(place);
        }
    }
    let mut fixpoint: FxHashSet<Key> = FxHashSet::default();
    let mut open: Vec<usize> = (0..bodies.len()).rev().collect();
    while let Some(place) = open.pop() {
        let (key, body) = &bodies[place];
        if !fixpoint.contains(key) && holds(body, &fixpoint) {
            fixpoint.insert(key.clone());
            open.extend(readers.get(key).into_iter().flatten());
        }
    }
    fixpoint
}

fn possible(world: &World<'_>, formula: &Formula, may: &FxHashSet<Key>, must: &FxHashSet<Key>) -> bool {
    match formula {
        Formula::All(parts) => parts.iter().all(|part| possible(world, part, may, must)),
        Formula::Any(parts) => parts.iter().any(|part| possible(world, part, may, must)),
        Formula::Atom(key, true) => may.contains(key) || world.rules(key.0).is_none(),
        Formula::Atom(key, false) => !must.contains(key),
        Formula::Compare(..) => true,
    }
}

fn certain(world: &World<'_>, formula: &Formula, must: &FxHashSet<Key>, may: &FxHashSet<Key>) -> bool {
    match formula {
        Formula::All(parts) => parts.iter().all(|part| certain(world, part, must, may)),
        Formula::Any(parts) => parts.iter().any(|part| certain(world, part, must, may)),
        Formula::Atom(key, true) => must.contains(key),
        Formula::Atom(key, false) => world.rules(key.0).is_some() && !may.contains(key),
        Formula::Compare(..) => false,
    }
}

fn reads(world: &World<'_>) -> Result<FxHashMap<u32, FxHashSet<u32>>, Cause> {
    let mut reads: FxHashMap<u32, FxHashSet<u32>> = FxHashMap::default();
    for (symbol, rules) in world.derived() {
        let symbols = reads.entry(symbol).or_default();
        for rule in rules {
            in_condition(world, &rule.condition, symbols)?;
        }
    }
    Ok(reads)
}

fn in_condition(world: &World<'_>, condition: &Condition, symbols: &mut FxHashSet<u32>) -> Result<(), Cause> {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => {
            parts.iter().try_for_each(|part| in_condition(world, part, symbols))
        }
        Condition::Not(inner) | Condition::Exists(_, inner) | Condition::ForAll(_, inner) => {
            in_condition(world, inner, symbols)
        }
        Condition::Imply(left, right) => {
            in_condition(world, left, symbols)?;
            in_condition(world, right, symbols)
        }
        Condition::Atom(atom) => {
            symbols.insert(world.symbol(&atom.predicate.name)?);
            Ok(())
        }
        Condition::Equal(..) => Ok(()),
        Condition::Compare(_, left, right, _) => {
            in_expression(world, left, symbols)?;
            in_expression(world, right, symbols)
        }
    }
}

fn in_expression(
    world: &World<'_>,
    expression: &Expression,
    symbols: &mut FxHashSet<u32>,
) -> Result<(), Cause> {
    match expression {
        Expression::Fluent(atom) => {
            symbols.insert(world.symbol(&atom.predicate.name)?);
            Ok(())
        }
        Expression::Operation(_, parts, _) => {
            parts.iter().try_for_each(|part| in_expression(world, part, symbols))
        }
        Expression::Number(..) | Expression::Duration(_) | Expression::TotalTime(_) => Ok(()),
    }
}
