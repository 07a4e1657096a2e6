//! Ground atoms and bindings of parameters.

use std::hash::Hash;

use indexmap::{Equivalent, IndexSet};
use rustc_hash::FxBuildHasher;
use smallvec::SmallVec;

use crate::lifted::{Arguments, ObjectId, PredicateId, Term};

/// Index of a ground atom in [`World::atoms`](super::world::World::atoms).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct AtomId(pub u32);

impl AtomId {
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// Set of ground atoms. A [`Key`] looks up an atom without allocating its arguments.
pub type AtomSet = IndexSet<(PredicateId, Arguments), FxBuildHasher>;

/// A symbol and its arguments, borrowed for look-ups; hashes like the owned pair `(K, Arguments)`.
#[derive(Hash)]
pub struct Key<'k, K>(pub K, pub &'k [ObjectId]);

impl<K: PartialEq> Equivalent<(K, Arguments)> for Key<'_, K> {
    fn equivalent(&self, (symbol, arguments): &(K, Arguments)) -> bool {
        self.0 == *symbol && *self.1 == **arguments
    }
}

/// A short-lived tuple of objects, for example for a look-up.
pub type Row = SmallVec<[ObjectId; 8]>;

/// Object assigned to each parameter and quantified variable; `None` for an unassigned variable or a slot.
pub type Binding = Vec<Option<ObjectId>>;

/// Returns the objects of the terms under a binding, which must assign all variables among the terms.
pub fn arguments(terms: &[Term], binding: &Binding) -> Row {
    terms
        .iter()
        .filter_map(|term| match term {
            Term::Object(object) => Some(*object),
            Term::Parameter(parameter) => binding[*parameter as usize],
        })
        .collect()
}
