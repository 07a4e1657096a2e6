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
    /// Predicates and functions on which a derived predicate depends.
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

    /// Whether a derived predicate depends on one of some predicates and functions.
    pub(super) fn depends(&self, symbol: u32, mut others: impl Iterator<Item = u32>) -> bool {
        self.reads.get(&symbol).is_some_and(|own| others.any(|other| own.contains(&other)))
    }
}
