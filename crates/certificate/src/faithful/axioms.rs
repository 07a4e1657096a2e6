//! Facts about derived atoms that hold in every state of the witness, i.e. of the
//! over-approximation of the reachable states.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::faithful::key::Key;
use crate::faithful::relation::Relation;

#[derive(Debug, Default)]
pub(super) struct Axioms {
    /// The derived atoms that may hold in a state of the witness.
    pub(super) may: FxHashSet<Key>,
    /// The derived atoms that hold in every state of the witness.
    pub(super) must: FxHashSet<Key>,
    /// A superset of `may`, from which the candidate objects of variables are taken.
    pub(super) bound: Relation,
    /// The derived atoms that are variables of the task and lie on dependency cycles or between cycles. Every other
    /// derived atom is replaced by its rules.
    pub(super) linked: FxHashSet<Key>,
    pub(super) reads: FxHashMap<u32, FxHashSet<u32>>,
}

impl Axioms {
    pub(super) fn known(&self, key: &Key) -> Option<bool> {
        match (self.must.contains(key), self.may.contains(key)) {
            (true, _) => Some(true),
            (_, false) => Some(false),
            _ => None,
        }
    }

    /// Returns `true` if the derived predicate `symbol` depends on one of `symbols`, directly or
    /// through other derived predicates.
    pub(super) fn depends(&self, symbol: u32, symbols: impl Iterator<Item = u32>) -> bool {
        let symbols: FxHashSet<u32> = symbols.collect();
        if symbols.is_empty() {
            return false;
        }
        let mut visited = FxHashSet::from_iter([symbol]);
        let mut open = vec![symbol];
        while let Some(reader) = open.pop() {
            for below in self.reads.get(&reader).into_iter().flatten() {
                if symbols.contains(below) {
                    return true;
                }
                if visited.insert(*below) {
                    open.push(*below);
                }
            }
        }
        false
    }
}
