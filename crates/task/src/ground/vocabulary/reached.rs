//! The result of relaxed reachability.

use crate::ground::vocabulary::atom::{AtomSet, Binding};
use crate::lifted::{Arguments, PredicateId};

/// What can be if nothing is ever deleted.
#[derive(Default)]
pub struct RelaxedReachability {
    /// For each schema the bindings of its parameters apart from slots, ascending.
    pub(crate) instances: Vec<Vec<Binding>>,
    /// The fluent atoms that can become true.
    pub(crate) atoms: AtomSet,
    /// What follows by static derived predicates.
    pub(crate) derived: Vec<(PredicateId, Arguments)>,
}
