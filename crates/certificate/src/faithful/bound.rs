//! An upper bound of the derived atoms that may hold in states of the witness: the least fixpoint of the rules in which everything but a
//! positive atom is possible. It is computed by semi-naive evaluation: each new atom is used once in each place that reads it.

use std::rc::Rc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::faithful::axioms::Axioms;
use crate::faithful::invariant::Invariant;
use crate::faithful::key::Key;
use crate::faithful::reader::{self, Reader};
use crate::faithful::verdict::Cause;
use crate::faithful::world::World;
use pddl::ast::{Atom, Condition, Derived, Name, Term, TypedName};

/// With more derived atoms, nothing is checked.
const ATOM_LIMIT: usize = 50_000;

/// Upper limit on the conjuncts around an atom that give candidates.
const CONJUNCT_LIMIT: usize = 64;

/// A place where a rule reads a derived atom that has to hold.
struct Occurrence<'w> {
    rule: &'w Derived,
    atom: &'w Atom,
    /// The variables of the existential quantifiers around it.
    variables: Rc<[&'w TypedName]>,
    /// Conditions that have to hold, too.
    others: Rc<[&'w Condition]>,
    /// `false` if a variable has the name of another one, so that a name does not tell which of them it is.
    has_distinct_names: bool,
}

/// Adds the bound to what is known of derived atoms.
pub(super) fn add(
    world: &World<'_>,
    invariant: &Invariant,
    axioms: &mut Axioms,
    stop: &dyn Fn() -> bool,
) -> Result<(), Cause> {
    let mut rules: Vec<&Derived> = world.derived().flat_map(|(_, rules)| rules.iter().copied()).collect();
    rules.sort_by_key(|rule| rule.span.start);
    let mut occurrences: FxHashMap<u32, Vec<Occurrence<'_>>> = FxHashMap::default();
    let mut open = Vec::new();
    for rule in rules {
        collect(world, rule, &rule.condition, (&Rc::default(), &Rc::default()), &mut occurrences)?;
        let heads = all_heads(world, invariant, axioms, rule)?;
        insert(axioms, heads, &mut open)?;
    }
    while let Some(key) = open.pop() {
        if stop() {
            return Err(Cause::Stopped);
        }
        for occurrence in occurrences.get(&key.0).into_iter().flatten() {
            let heads = if occurrence.has_distinct_names {
                occurrence.heads(world, invariant, axioms, &key)?
            } else {
                all_heads(world, invariant, axioms, occurrence.rule)?
            };
            insert(axioms, heads, &mut open)?;
        }
    }
    Ok(())
}

fn insert(axioms: &mut Axioms, heads: Vec<Key>, open: &mut Vec<Key>) -> Result<(), Cause> {
    for key in heads {
        if axioms.bound.insert(key.clone()) {
            open.push(key);
        }
        if axioms.bound.len() > ATOM_LIMIT {
            return Err(too_many());
        }
    }
    Ok(())
}

fn too_many() -> Cause {
    Cause::TooMany { what: "derived atoms".into(), limit: ATOM_LIMIT }
}

/// Collects the places where a condition reads derived atoms that have to hold.
fn collect<'w>(
    world: &World<'w>,
    rule: &'w Derived,
    condition: &'w Condition,
    (variables, others): (&Rc<[&'w TypedName]>, &Rc<[&'w Condition]>),
    found: &mut FxHashMap<u32, Vec<Occurrence<'w>>>,
) -> Result<(), Cause> {
    match condition {
        Condition::And(parts) => {
            let others = others.iter().copied().chain(parts).take(CONJUNCT_LIMIT).collect();
            parts.iter().try_for_each(|part| collect(world, rule, part, (variables, &others), found))
        }
        Condition::Or(parts) => {
            parts.iter().try_for_each(|part| collect(world, rule, part, (variables, others), found))
        }
        Condition::Exists(bound, inner) => {
            let variables = variables.iter().copied().chain(bound).collect();
            collect(world, rule, inner, (&variables, others), found)
        }
        Condition::Atom(atom) if world.is_derived(atom) => {
            let (variables, others) = (Rc::clone(variables), Rc::clone(others));
            let has_distinct_names = has_distinct_names(rule, &variables);
            let occurrence = Occurrence { rule, atom, variables, others, has_distinct_names };
            found.entry(world.symbol(&atom.predicate.name)?).or_default().push(occurrence);
            Ok(())
        }
        _ => Ok(()),
    }
}

/// Returns `true` if no parameter of a rule and no variable around an atom has the name of another.
fn has_distinct_names(rule: &Derived, variables: &[&TypedName]) -> bool {
    let all = rule.head.parameters.iter().chain(variables.iter().copied());
    let mut names = FxHashSet::default();
    all.into_iter().all(|own| names.insert(&own.identifier.name))
}

/// The heads of a rule that are new, by all its instances.
fn all_heads(
    world: &World<'_>,
    invariant: &Invariant,
    axioms: &Axioms,
    rule: &Derived,
) -> Result<Vec<Key>, Cause> {
    let symbol = world.symbol(&rule.head.identifier.name)?;
    let mut heads = Vec::new();
    let mut reader = Reader::new(world, invariant, axioms);
    let parameters = &rule.head.parameters;
    reader.each(parameters, Some(&rule.condition), &mut |own| {
        let objects = parameters.iter().map(|parameter| own.binding[&parameter.identifier.name]).collect();
        let key = (symbol, objects);
        if !own.axioms.bound.contains(&key) && own.is_possible(&rule.condition)? {
            heads.push(key);
        }
        Ok(true)
    })?;
    Ok(heads)
}

impl Occurrence<'_> {
    /// The heads that are new and that the rule concludes from an atom in this place.
    fn heads(
        &self,
        world: &World<'_>,
        invariant: &Invariant,
        axioms: &Axioms,
        key: &Key,
    ) -> Result<Vec<Key>, Cause> {
        let symbol = world.symbol(&self.rule.head.identifier.name)?;
        let parameters = &self.rule.head.parameters;
        let mut reader = Reader::new(world, invariant, axioms);
        if !self.unify(&mut reader, key) {
            return Ok(Vec::new());
        }
        // All bindings of the other parameters, one parameter after the other.
        let mut rows: Vec<Vec<(&Name, u32)>> = vec![Vec::new()];
        let open = parameters.iter().filter(|own| !reader.binding.contains_key(&own.identifier.name));
        for parameter in open.collect::<Vec<_>>() {
            let mut longer = Vec::new();
            for row in rows {
                let before = reader.binding.clone();
                reader.binding.extend(row.iter().copied());
                for object in reader.candidates_where(parameter, &self.others) {
                    let mut row = row.clone();
                    row.push((&parameter.identifier.name, object));
                    longer.push(row);
                }
                reader.binding = before;
                if longer.len() > ATOM_LIMIT {
                    return Err(too_many());
                }
            }
            rows = longer;
        }
        for own in self.variables.iter() {
            reader.binding.remove(&own.identifier.name);
        }
        let mut heads = Vec::new();
        for row in rows {
            reader.binding.extend(row);
            let objects = parameters.iter().map(|own| reader.binding[&own.identifier.name]).collect();
            let key = (symbol, objects);
            if !axioms.bound.contains(&key) && reader.is_possible(&self.rule.condition)? {
                heads.push(key);
            }
        }
        Ok(heads)
    }

    /// Binds the variables of the atom so that it is the given one; returns `false` if it cannot be.
    fn unify<'r>(&'r self, reader: &mut Reader<'r>, key: &Key) -> bool {
        let typed = || self.rule.head.parameters.iter().chain(self.variables.iter().copied());
        self.atom.arguments.len() == key.1.len()
            && self.atom.arguments.iter().zip(&key.1).all(|(term, object)| {
                if let Term::Variable(own) = term
                    && !reader.binding.contains_key(&own.name)
                {
                    let declared = typed().find(|typed| typed.identifier.name == own.name);
                    reader.binding.insert(&own.name, *object);
                    return declared.is_some_and(|typed| reader.world.is_of(*object, &typed.r#type));
                }
                reader.world.bound(term, &reader.binding) == Some(*object)
            })
    }
}

impl<'r> Reader<'r> {
    /// Returns `false` if a condition holds in no state of the witness: negations, implications and comparisons that change are
    /// taken to be possible.
    fn is_possible(&mut self, condition: &'r Condition) -> Result<bool, Cause> {
        self.count()?;
        match condition {
            Condition::And(parts) => {
                for part in parts {
                    if !self.is_possible(part)? {
                        return Ok(false);
                    }
                }
                Ok(true)
            }
            Condition::Or(parts) => {
                for part in parts {
                    if self.is_possible(part)? {
                        return Ok(true);
                    }
                }
                Ok(false)
            }
            Condition::Exists(bound, inner) => {
                let mut possible = false;
                self.each(bound, Some(inner), &mut |own| {
                    possible = own.is_possible(inner)?;
                    Ok(!possible)
                })?;
                Ok(possible)
            }
            Condition::Atom(atom) => {
                let key = self.world.key(atom, &self.binding)?;
                Ok(if self.world.rules(key.0).is_some() {
                    self.axioms.bound.contains(&key)
                } else {
                    !reader::atom(self.world, self.invariant, key, true).is(false)
                })
            }
            Condition::Equal(left, right, _) => self.equal(left, right),
            Condition::Not(inner) => Ok(match &**inner {
                Condition::Equal(left, right, _) => !self.equal(left, right)?,
                Condition::Atom(atom) if !self.world.is_derived(atom) => {
                    let key = self.world.key(atom, &self.binding)?;
                    !reader::atom(self.world, self.invariant, key, false).is(false)
                }
                _ => true,
            }),
            Condition::Imply(..) | Condition::ForAll(..) | Condition::Compare(..) => Ok(true),
        }
    }
}
