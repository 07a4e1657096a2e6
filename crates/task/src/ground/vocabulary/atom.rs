//! Ground atoms and bindings of parameters.

use std::hash::Hash;

use indexmap::{Equivalent, IndexSet};
use rustc_hash::FxBuildHasher;
use smallvec::SmallVec;

use crate::lifted::{Arguments, ObjectId, PredicateId, Term};

/// A ground atom over a fluent predicate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct AtomId(pub u32);

impl AtomId {
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// Ground atoms, looked up without making one.
pub type AtomSet = IndexSet<(PredicateId, Arguments), FxBuildHasher>;

/// A symbol and arguments that lie elsewhere; hashes as `(K, Arguments)` does.
#[derive(Hash)]
pub struct Key<'k, K>(pub K, pub &'k [ObjectId]);

impl<K: PartialEq> Equivalent<(K, Arguments)> for Key<'_, K> {
    fn equivalent(&self, (symbol, arguments): &(K, Arguments)) -> bool {
        self.0 == *symbol && *self.1 == **arguments
    }
}

/// Arguments that are looked up and forgotten.
pub type Row = SmallVec<[ObjectId; 8]>;

/// The objects that the parameters stand for; slots are open.
pub type Binding = Vec<Option<ObjectId>>;

/// The arguments under a binding that covers them.
pub fn arguments(terms: &[Term], binding: &Binding) -> Row {
    terms
        .iter()
        .filter_map(|term| match term {
            Term::Object(object) => Some(*object),
            Term::Parameter(parameter) => binding[*parameter as usize],
        })
        .collect()
}
