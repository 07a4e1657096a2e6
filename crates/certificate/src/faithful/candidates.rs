//! The candidates of a variable in a condition, that is, the objects for which the condition can hold: those that an equality, a fact that never changes, an atom of
//! the witness, or a derived atom that may hold gives it. With any other object the condition is false in every state of the witness.

use std::collections::BTreeSet;

use crate::faithful::reader::Reader;
use pddl::ast::{Atom, Condition, Name, Term, TypedName};

/// A conjunct is skipped if it has more rows than the known candidates times this factor.
const WORTHWHILE: usize = 16;

impl Reader<'_> {
    /// The objects that the first of some variables can stand for in a condition on all of them; all of its type without one.
    pub(super) fn candidates(&self, bound: &[TypedName], within: Option<&Condition>) -> Vec<u32> {
        let Some(first) = bound.first() else { return Vec::new() };
        let hidden: Vec<&Name> = bound.iter().map(|own| &own.identifier.name).collect();
        match within.and_then(|within| self.restricted(&first.identifier.name, within, &hidden)) {
            Some(some) => some.into_iter().filter(|own| self.world.is_of(*own, &first.r#type)).collect(),
            None => self.world.objects_of(&first.r#type),
        }
    }

    /// The candidates of a variable in a conjunction.
    pub(super) fn candidates_where(&self, variable: &TypedName, conditions: &[&Condition]) -> Vec<u32> {
        match self.restricted_by_all(&variable.identifier.name, conditions.iter().copied(), &[]) {
            Some(some) => some.into_iter().filter(|own| self.world.is_of(*own, &variable.r#type)).collect(),
            None => self.world.objects_of(&variable.r#type),
        }
    }

    /// The candidates of a variable in a conjunction, as [`Reader::restricted`].
    fn restricted_by_all<'c>(
        &self,
        name: &Name,
        parts: impl Iterator<Item = &'c Condition>,
        hidden: &[&Name],
    ) -> Option<BTreeSet<u32>> {
        // Small parts first; large ones are not worth the time that it takes to go through them.
        let mut parts: Vec<(usize, &Condition)> =
            parts.map(|part| (self.size(name, part, hidden), part)).collect();
        parts.sort_by_key(|(size, _)| *size);
        let mut best: Option<BTreeSet<u32>> = None;
        for (size, part) in parts {
            if best.as_ref().is_some_and(|best| size / WORTHWHILE > best.len()) {
                break;
            }
            let own = self.restricted(name, part, hidden);
            best = best.into_iter().chain(own).min_by_key(BTreeSet::len);
        }
        best
    }

    /// The candidates of a variable in a condition. Returns `None` if the condition does not restrict the variable. The values of `hidden` variables
    /// are not known.
    fn restricted(&self, name: &Name, condition: &Condition, hidden: &[&Name]) -> Option<BTreeSet<u32>> {
        match condition {
            Condition::And(parts) => self.restricted_by_all(name, parts.iter(), hidden),
            Condition::Exists(bound, inner) => {
                let own = bound.iter().map(|own| &own.identifier.name);
                if own.clone().any(|own| own == name) {
                    return None;
                }
                self.restricted(name, inner, &hidden.iter().copied().chain(own).collect::<Vec<_>>())
            }
            Condition::Equal(left, right, _) => {
                let other = if is(left, name) {
                    right
                } else if is(right, name) {
                    left
                } else {
                    return None;
                };
                self.known(other, hidden).map(|own| BTreeSet::from([own]))
            }
            Condition::Atom(atom) => self.in_atom(name, atom, hidden),
            _ => None,
        }
    }

    /// Upper bound on the rows that [`Reader::restricted`] looks at.
    fn size(&self, name: &Name, condition: &Condition, hidden: &[&Name]) -> usize {
        match condition {
            Condition::Equal(..) => 1,
            Condition::Atom(atom) if atom.arguments.iter().any(|term| is(term, name)) => {
                let Ok(symbol) = self.world.symbol(&atom.predicate.name) else { return usize::MAX };
                let known = |(place, term)| Some((place, self.known(term, hidden)?));
                let given = atom.arguments.iter().enumerate().find_map(known);
                if self.world.rules(symbol).is_some() {
                    self.axioms.bound.count(symbol, given)
                } else if self.world.changes(symbol) {
                    self.invariant.count(symbol, given)
                } else {
                    self.world.count(symbol, given)
                }
            }
            _ => usize::MAX,
        }
    }

    fn in_atom(&self, name: &Name, atom: &Atom, hidden: &[&Name]) -> Option<BTreeSet<u32>> {
        let place = atom.arguments.iter().position(|term| is(term, name))?;
        let symbol = self.world.symbol(&atom.predicate.name).ok()?;
        let known: Vec<Option<u32>> = atom.arguments.iter().map(|term| self.known(term, hidden)).collect();
        let fits = |row: &[u32]| {
            row.len() == known.len()
                && row.iter().zip(&known).all(|(own, known)| known.is_none_or(|known| known == *own))
        };
        let of = |row: &[u32]| row.get(place).copied().filter(|_| fits(row));
        let given = known.iter().enumerate().find_map(|(place, own)| Some((place, (*own)?)));
        if self.world.rules(symbol).is_some() {
            let rows = || self.axioms.bound.rows(symbol, given).filter_map(|key| of(&key.1)).collect();
            return (!self.is_touched(symbol)).then(rows);
        }
        if !self.world.changes(symbol) {
            return Some(self.world.rows(symbol, given).into_iter().filter_map(|row| of(row)).collect());
        }
        // What the start of the action adds, the witness of the state before need not have.
        let is_before = self.applied.truths.is_empty();
        is_before.then(|| self.invariant.rows(symbol, given).filter_map(|key| of(&key.1)).collect())
    }

    fn known(&self, term: &Term, hidden: &[&Name]) -> Option<u32> {
        match term {
            Term::Variable(own) if hidden.contains(&&own.name) => None,
            term => self.world.bound(term, &self.binding),
        }
    }
}

fn is(term: &Term, name: &Name) -> bool {
    matches!(term, Term::Variable(own) if own.name == *name)
}
