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

/// Set of ground atoms, with look-up by borrowed keys.
pub type AtomSet = IndexSet<(PredicateId, Arguments), FxBuildHasher>;

/// Borrowed key of a symbol with arguments; hashes like `(K, Arguments)`.
#[derive(Hash)]
pub struct Key<'k, K>(pub K, pub &'k [ObjectId]);

impl<K: PartialEq> Equivalent<(K, Arguments)> for Key<'_, K> {
    fn equivalent(&self, (symbol, arguments): &(K, Arguments)) -> bool {
        self.0 == *symbol && *self.1 == **arguments
    }
}

/// Temporary arguments for a look-up.
pub type Row = SmallVec<[ObjectId; 8]>;

/// Objects of the parameters. Slots are `None`.
pub type Binding = Vec<Option<ObjectId>>;

/// Returns the arguments under a binding of all their variables.
pub fn arguments(terms: &[Term], binding: &Binding) -> Row {
    terms
        .iter()
        .filter_map(|term| match term {
            Term::Object(object) => Some(*object),
            Term::Parameter(parameter) => binding[*parameter as usize],
        })
        .collect()
}
