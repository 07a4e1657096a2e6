//! Enumeration of the objects that bound variables can stand for, driven by the facts that must hold.
//!
//! `exists` and `forall` range over products of types; most of their elements fail a static atom. So the atoms of the
//! body are joined, each looked up by the arguments that are bound already, and only what they leave open is tried.

use rustc_hash::FxHashMap;

use crate::ground::evaluate::{Binding, World};
use crate::lifted::{Arguments, Bound, Formula, ObjectId, PredicateId, Term};
use crate::limits::Interrupted;

/// Rows of relations by the values of some of their columns.
#[derive(Default)]
pub(crate) struct JoinIndex {
    /// For a predicate and a set of columns (bit i for column i): rows by the values in those columns.
    rows: FxHashMap<(PredicateId, u64), FxHashMap<Arguments, Vec<Arguments>>>,
}

/// An atom that must be able to hold.
type Guard<'f> = (PredicateId, &'f [Term]);

/// The atoms without which the body of an existential quantifier fails.
pub(crate) fn guards_of_exists(body: &Formula) -> Vec<Guard<'_>> {
    let mut guards = Vec::new();
    match body {
        Formula::And(parts) => guards.extend(parts.iter().flat_map(guards_of_exists)),
        Formula::Exists(_, inner) => guards.extend(guards_of_exists(inner)),
        Formula::Literal { positive: true, predicate, terms } => guards.push((*predicate, terms.as_slice())),
        _ => {}
    }
    guards
}

/// The atoms without which the body of a universal quantifier holds.
pub(crate) fn guards_of_forall(body: &Formula) -> Vec<Guard<'_>> {
    let mut guards = Vec::new();
    match body {
        Formula::Or(parts) => guards.extend(parts.iter().flat_map(guards_of_forall)),
        Formula::ForAll(_, inner) => guards.extend(guards_of_forall(inner)),
        Formula::Literal { positive: false, predicate, terms } => guards.push((*predicate, terms.as_slice())),
        _ => {}
    }
    guards
}

/// The limits are looked at after so many bindings that nothing guards.
const BETWEEN_LOOKS: u32 = 256;

impl World<'_> {
    /// Calls `visit` with every binding of the variables under which all guards can hold, until it returns
    /// false; the variables are unbound again afterwards, unless a limit ends it all. Returns whether `visit` never returned false.
    pub(crate) fn each_binding(
        &mut self,
        bound: &[Bound],
        guards: &[Guard<'_>],
        binding: &mut Binding,
        visit: &mut dyn FnMut(&mut Self, &mut Binding) -> bool,
    ) -> Result<bool, Interrupted> {
        let open = |term: &&Term, binding: &Binding| match term {
            Term::Parameter(variable) if binding[*variable as usize].is_none() => Some(*variable),
            _ => None,
        };
        let own = |variable: u32| bound.iter().any(|b| b.variable == variable);
        let useful = guards.iter().enumerate().filter_map(|(position, (_, terms))| {
            let variables: Vec<_> = terms.iter().filter_map(|term| open(&term, binding)).collect();
            let joins = !variables.is_empty() && variables.iter().all(|v| own(*v)) && terms.len() <= 64;
            joins.then_some((variables.len(), position))
        });
        let Some((_, position)) = useful.min() else {
            return self.each_candidate(bound, binding, visit);
        };
        let (predicate, terms) = guards[position];
        let rest: Vec<_> =
            guards.iter().enumerate().filter(|(i, _)| *i != position).map(|(_, guard)| *guard).collect();
        for row in self.rows(predicate, terms, binding) {
            let mut fresh = Vec::new();
            let fits = terms.iter().zip(row.iter()).all(|(term, object)| match term {
                Term::Object(constant) => constant == object,
                Term::Parameter(variable) => {
                    if let Some(known) = binding[*variable as usize] {
                        return known == *object;
                    }
                    binding[*variable as usize] = Some(*object);
                    fresh.push(*variable);
                    let ranges =
                        |b: &Bound| b.variable == *variable && b.candidates.binary_search(object).is_ok();
                    bound.iter().any(ranges)
                }
            });
            let go_on = !fits || self.each_binding(bound, &rest, binding, visit)?;
            for variable in fresh {
                binding[variable as usize] = None;
            }
            if !go_on {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Every object for every variable that is still open.
    fn each_candidate(
        &mut self,
        bound: &[Bound],
        binding: &mut Binding,
        visit: &mut dyn FnMut(&mut Self, &mut Binding) -> bool,
    ) -> Result<bool, Interrupted> {
        let Some(first) = bound.iter().find(|b| binding[b.variable as usize].is_none()) else {
            self.visited += 1;
            if self.visited.0.is_multiple_of(BETWEEN_LOOKS) {
                self.limits.check()?;
            }
            return Ok(visit(self, binding));
        };
        for object in first.candidates.iter() {
            binding[first.variable as usize] = Some(*object);
            let go_on = self.each_candidate(bound, binding, visit)?;
            binding[first.variable as usize] = None;
            if !go_on {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The rows of a relation that agree with the bound terms, in ascending order.
    fn rows(&mut self, predicate: PredicateId, terms: &[Term], binding: &Binding) -> Vec<Arguments> {
        let value = |term: &Term| match term {
            Term::Object(object) => Some(*object),
            Term::Parameter(variable) => binding[*variable as usize],
        };
        let columns = terms.iter().enumerate().filter(|(_, term)| value(term).is_some());
        let mask = columns.fold(0_u64, |mask, (column, _)| mask | (1 << column));
        let key: Vec<ObjectId> = terms.iter().filter_map(value).collect();
        if !self.joins.rows.contains_key(&(predicate, mask)) {
            let mut rows: FxHashMap<Arguments, Vec<Arguments>> = FxHashMap::default();
            for row in self.relation(predicate) {
                let key = row.iter().enumerate().filter(|(column, _)| mask & (1 << column) != 0);
                rows.entry(key.map(|(_, object)| *object).collect()).or_default().push(row);
            }
            for rows in rows.values_mut() {
                rows.sort_unstable();
            }
            self.joins.rows.insert((predicate, mask), rows);
        }
        self.joins.rows[&(predicate, mask)].get(key.as_slice()).cloned().unwrap_or_default()
    }
}
