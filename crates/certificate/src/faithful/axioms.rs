//! What is known of derived atoms in every state of the witness.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::faithful::key::Key;
use crate::faithful::relation::Relation;

#[derive(Debug, Default)]
pub(super) struct Axioms {
    /// Derived atoms that may hold in a state of the witness.
    pub(super) may: FxHashSet<Key>,
    /// Those that hold in every one.
    pub(super) must: FxHashSet<Key>,
    /// All derived atoms that may hold, and possibly more: an upper bound, from which the objects of variables are taken.
    pub(super) bound: Relation,
    /// Those that depend on themselves and are variables of the task. All others are what their rules say.
    pub(super) linked: FxHashSet<Key>,
    /// Predicates and functions that the rules of each derived predicate mention.
    pub(super) reads: FxHashMap<u32, FxHashSet<u32>>,
}

impl Axioms {
    /// Whether a derived atom holds, if that is so in every state of the witness.
    pub(super) fn known(&self, key: &Key) -> Option<bool> {
        match (self.must.contains(key), self.may.contains(key)) {
            (true, _) => Some(true),
            (_, false) => Some(false),
            _ => None,
        }
    }

    /// Returns `true` if a derived predicate depends on one of some predicates and functions, by its own rules or by those of
    /// derived predicates in between.
    pub(super) fn depends(&self, symbol: u32, others: impl Iterator<Item = u32>) -> bool {
        let others: FxHashSet<u32> = others.collect();
        if others.is_empty() {
            return false;
        }
        let mut seen = FxHashSet::from_iter([symbol]);
        let mut open = vec![symbol];
        while let Some(own) = open.pop() {
            for below in self.reads.get(&own).into_iter().flatten() {
                if others.contains(below) {
                    return true;
                }
                if seen.insert(*below) {
                    open.push(*below);
                }
            }
        }
        false
    }
}
