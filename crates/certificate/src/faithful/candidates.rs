//! Candidate objects of a quantified variable in a condition. A candidate is admitted by an
//! equality, a static fact, an atom of the witness (the over-approximation of the reachable
//! states), or a possible derived atom. With any other object, the condition is false in every
//! state of the witness.

use std::collections::BTreeSet;

use crate::faithful::reader::Reader;
use pddl::ast::{Atom, Condition, Name, Term, TypedName};

/// A conjunct is skipped if it has more rows (possible facts) than about this factor times the
/// number of candidates found up to now.
const WORTHWHILE: usize = 16;

impl Reader<'_> {
    /// Returns the candidate objects of the first variable in `bound` under the condition `within`. Empty if `bound`
    /// is empty. Returns all objects of its type if there is no condition, or if the condition does not restrict the
    /// variable.
    pub(super) fn candidates(&self, bound: &[TypedName], within: Option<&Condition>) -> Vec<u32> {
        let Some(first) = bound.first() else { return Vec::new() };
        let hidden: Vec<&Name> = bound.iter().map(|variable| &variable.identifier.name).collect();
        match within.and_then(|within| self.restricted(&first.identifier.name, within, &hidden)) {
            Some(objects) => {
                objects.into_iter().filter(|object| self.world.is_of(*object, &first.r#type)).collect()
            }
            None => self.world.objects_of(&first.r#type),
        }
    }

    pub(super) fn candidates_where(&self, variable: &TypedName, conditions: &[&Condition]) -> Vec<u32> {
        match self.restricted_by_all(&variable.identifier.name, conditions.iter().copied(), &[]) {
            Some(objects) => {
                objects.into_iter().filter(|object| self.world.is_of(*object, &variable.r#type)).collect()
            }
            None => self.world.objects_of(&variable.r#type),
        }
    }

    fn restricted_by_all<'c>(
        &self,
        name: &Name,
        parts: impl Iterator<Item = &'c Condition>,
        hidden: &[&Name],
    ) -> Option<BTreeSet<u32>> {
        // Small conjuncts are visited first, because visiting the rows of a large conjunct takes more time than
        // its restriction saves.
        let mut parts: Vec<(usize, &Condition)> =
            parts.map(|part| (self.size(name, part, hidden), part)).collect();
        parts.sort_by_key(|(size, _)| *size);
        let mut best: Option<BTreeSet<u32>> = None;
        for (size, part) in parts {
            if best.as_ref().is_some_and(|best| size / WORTHWHILE > best.len()) {
                break;
            }
            let objects = self.restricted(name, part, hidden);
            best = best.into_iter().chain(objects).min_by_key(BTreeSet::len);
        }
        best
    }

    /// Returns the candidate objects of a variable in a condition, or `None` if the condition does
    /// not restrict the variable. The variables in `hidden` count as unbound: a quantifier hides
    /// their outer values.
    fn restricted(&self, name: &Name, condition: &Condition, hidden: &[&Name]) -> Option<BTreeSet<u32>> {
        match condition {
            Condition::And(parts) => self.restricted_by_all(name, parts.iter(), hidden),
            Condition::Exists(bound, inner) => {
                let names = bound.iter().map(|variable| &variable.identifier.name);
                if names.clone().any(|inner_name| inner_name == name) {
                    return None;
                }
                self.restricted(name, inner, &hidden.iter().copied().chain(names).collect::<Vec<_>>())
            }
            Condition::Equal(left, right, _) => {
                let term = if is(left, name) {
                    right
                } else if is(right, name) {
                    left
                } else {
                    return None;
                };
                self.known(term, hidden).map(|object| BTreeSet::from([object]))
            }
            Condition::Atom(atom) => self.in_atom(name, atom, hidden),
            _ => None,
        }
    }

    /// Returns an upper bound on the number of rows (possible facts) that [`Reader::restricted`]
    /// visits; `usize::MAX` if the number is not estimated.
    fn size(&self, name: &Name, condition: &Condition, hidden: &[&Name]) -> usize {
        match condition {
            Condition::Equal(..) => 1,
            Condition::Atom(atom) if atom.arguments.iter().any(|term| is(term, name)) => {
                let Ok(symbol) = self.world.symbol(&atom.predicate.name) else { return usize::MAX };
                let bound_argument = |(place, term)| Some((place, self.known(term, hidden)?));
                let key = atom.arguments.iter().enumerate().find_map(bound_argument);
                if self.world.rules(symbol).is_some() {
                    self.axioms.bound.count(symbol, key)
                } else if self.world.changes(symbol) {
                    self.invariant.count(symbol, key)
                } else {
                    self.world.count(symbol, key)
                }
            }
            _ => usize::MAX,
        }
    }

    fn in_atom(&self, name: &Name, atom: &Atom, hidden: &[&Name]) -> Option<BTreeSet<u32>> {
        let place = atom.arguments.iter().position(|term| is(term, name))?;
        let symbol = self.world.symbol(&atom.predicate.name).ok()?;
        let arguments: Vec<Option<u32>> =
            atom.arguments.iter().map(|term| self.known(term, hidden)).collect();
        let fits = |row: &[u32]| {
            row.len() == arguments.len()
                && row
                    .iter()
                    .zip(&arguments)
                    .all(|(object, argument)| argument.is_none_or(|bound| bound == *object))
        };
        let of = |row: &[u32]| row.get(place).copied().filter(|_| fits(row));
        let key = arguments.iter().enumerate().find_map(|(place, argument)| Some((place, (*argument)?)));
        if self.world.rules(symbol).is_some() {
            let rows = || self.axioms.bound.rows(symbol, key).filter_map(|key| of(&key.1)).collect();
            return (!self.is_touched(symbol)).then(rows);
        }
        if !self.world.changes(symbol) {
            return Some(self.world.rows(symbol, key).into_iter().filter_map(|row| of(row)).collect());
        }
        // Start effects may add atoms that the witness does not contain, so the witness restricts
        // only conditions on the state before the start.
        let is_before = self.applied.truths.is_empty();
        is_before.then(|| self.invariant.rows(symbol, key).filter_map(|key| of(&key.1)).collect())
    }

    fn known(&self, term: &Term, hidden: &[&Name]) -> Option<u32> {
        match term {
            Term::Variable(variable) if hidden.contains(&&variable.name) => None,
            term => self.world.bound(term, &self.binding),
        }
    }
}

fn is(term: &Term, name: &Name) -> bool {
    matches!(term, Term::Variable(variable) if variable.name == *name)
}
