//! Computes an upper bound on the derived atoms that may hold in states of the witness (the
//! over-approximation of the reachable states), as the least fixpoint of relaxed rules. Relaxed
//! conditions consist of positive derived atoms, literals over other atoms, and equalities; all
//! other conditions are assumed to hold.
//!
//! Evaluation is semi-naive: each new atom is used once in each rule position that reads it.

use std::rc::Rc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::faithful::axioms::Axioms;
use crate::faithful::invariant::Invariant;
use crate::faithful::key::Key;
use crate::faithful::reader::{self, Reader};
use crate::faithful::verdict::Cause;
use crate::faithful::world::World;
use pddl::ast::{Atom, Condition, Derived, Name, Term, TypedName};

/// Upper limit on the number of derived atoms, and on the number of partial bindings of one rule.
const ATOM_LIMIT: usize = 50_000;

/// Upper limit on the number of conjuncts by which an [`Occurrence`] restricts the candidate objects of parameters.
const CONJUNCT_LIMIT: usize = 64;

struct Occurrence<'w> {
    rule: &'w Derived,
    atom: &'w Atom,
    variables: Rc<[&'w TypedName]>,
    others: Rc<[&'w Condition]>,
    has_distinct_names: bool,
}

/// Stores an upper bound on the derived atoms that may hold in states of the witness in
/// `axioms.bound`. Fails if there are too many atoms, or if `stop` returns `true`.
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

/// Collects the positive occurrences of derived atoms in the condition of a rule, by predicate.
/// Occurrences inside negations, implications and universal quantifiers are omitted, because these
/// conditions are assumed to hold.
fn collect<'w>(
    world: &World<'w>,
    rule: &'w Derived,
    condition: &'w Condition,
    (variables, others): (&Rc<[&'w TypedName]>, &Rc<[&'w Condition]>),
    occurrences: &mut FxHashMap<u32, Vec<Occurrence<'w>>>,
) -> Result<(), Cause> {
    match condition {
        Condition::And(parts) => {
            let conjuncts = others.iter().copied().chain(parts).take(CONJUNCT_LIMIT).collect();
            parts.iter().try_for_each(|part| collect(world, rule, part, (variables, &conjuncts), occurrences))
        }
        Condition::Or(parts) => {
            parts.iter().try_for_each(|part| collect(world, rule, part, (variables, others), occurrences))
        }
        Condition::Exists(bound, inner) => {
            let variables = variables.iter().copied().chain(bound).collect();
            collect(world, rule, inner, (&variables, others), occurrences)
        }
        Condition::Atom(atom) if world.is_derived(atom) => {
            let (variables, others) = (Rc::clone(variables), Rc::clone(others));
            let has_distinct_names = has_distinct_names(rule, &variables);
            let occurrence = Occurrence { rule, atom, variables, others, has_distinct_names };
            occurrences.entry(world.symbol(&atom.predicate.name)?).or_default().push(occurrence);
            Ok(())
        }
        _ => Ok(()),
    }
}

fn has_distinct_names(rule: &Derived, variables: &[&TypedName]) -> bool {
    let variables_in_scope = rule.head.parameters.iter().chain(variables.iter().copied());
    let mut names = FxHashSet::default();
    variables_in_scope.into_iter().all(|variable| names.insert(&variable.identifier.name))
}

/// Returns the heads of all possible instances of a rule, except heads that are already in
/// `axioms.bound`.
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
    reader.each(parameters, Some(&rule.condition), &mut |reader| {
        let objects = parameters.iter().map(|parameter| reader.binding[&parameter.identifier.name]).collect();
        let key = (symbol, objects);
        if !reader.axioms.bound.contains(&key) && reader.is_possible(&rule.condition)? {
            heads.push(key);
        }
        Ok(true)
    })?;
    Ok(heads)
}

impl Occurrence<'_> {
    /// Returns the heads of possible rule instances in which the derived atom `key` matches this
    /// occurrence, except heads that are already in `axioms.bound`.
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
        // Each row is a partial binding. Each round extends every row by the candidates of one unbound
        // parameter.
        let mut rows: Vec<Vec<(&Name, u32)>> = vec![Vec::new()];
        let open =
            parameters.iter().filter(|parameter| !reader.binding.contains_key(&parameter.identifier.name));
        for parameter in open.collect::<Vec<_>>() {
            let mut longer = Vec::new();
            for row in rows {
                // The parameters that a row binds restrict the candidates of later parameters.
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
        for variable in self.variables.iter() {
            reader.binding.remove(&variable.identifier.name);
        }
        let mut heads = Vec::new();
        for row in rows {
            reader.binding.extend(row);
            let objects =
                parameters.iter().map(|parameter| reader.binding[&parameter.identifier.name]).collect();
            let key = (symbol, objects);
            if !axioms.bound.contains(&key) && reader.is_possible(&self.rule.condition)? {
                heads.push(key);
            }
        }
        Ok(heads)
    }

    /// Binds the variables of the atom to the objects of `key`. Returns `false` if the atom does
    /// not match `key`; some variables may be bound then.
    fn unify<'r>(&'r self, reader: &mut Reader<'r>, key: &Key) -> bool {
        let typed = || self.rule.head.parameters.iter().chain(self.variables.iter().copied());
        self.atom.arguments.len() == key.1.len()
            && self.atom.arguments.iter().zip(&key.1).all(|(term, object)| {
                if let Term::Variable(variable) = term
                    && !reader.binding.contains_key(&variable.name)
                {
                    let declared = typed().find(|typed| typed.identifier.name == variable.name);
                    reader.binding.insert(&variable.name, *object);
                    return declared.is_some_and(|typed| reader.world.is_of(*object, &typed.r#type));
                }
                reader.world.bound(term, &reader.binding) == Some(*object)
            })
    }
}

impl<'r> Reader<'r> {
    /// Returns `true` if a condition may hold in a state of the witness, provided that no derived
    /// atoms hold except those of `axioms.bound`; `false` means that it certainly does not.
    /// Implications, universal conditions and comparisons are assumed to be possible. So are
    /// negations, except those of equalities and of basic atoms.
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
                self.each(bound, Some(inner), &mut |reader| {
                    possible = reader.is_possible(inner)?;
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
