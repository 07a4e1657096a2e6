//! The objects that a variable can stand for where a condition holds: those that an equality, a fact that never changes, an atom of
//! the witness, or a derived atom that may hold gives it. With any other object the condition is false in every state of the witness.

use std::collections::BTreeSet;

use crate::faithful::reader::Reader;
use pddl::ast::{Atom, Condition, Name, Term, TypedName};

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

    /// What a conjunct leaves for a variable; none if none of them restricts it. What `hidden` variables stand for is not known.
    fn restricted(&self, name: &Name, condition: &Condition, hidden: &[&Name]) -> Option<BTreeSet<u32>> {
        match condition {
            Condition::And(parts) => {
                let parts = parts.iter().filter_map(|part| self.restricted(name, part, hidden));
                parts.min_by_key(BTreeSet::len)
            }
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
        is_before.then(|| self.invariant.rows(symbol).filter_map(of).collect())
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
