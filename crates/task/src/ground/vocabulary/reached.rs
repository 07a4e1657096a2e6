//! The result of relaxed reachability.

use crate::ground::vocabulary::atom::{AtomSet, Binding};
use crate::lifted::{Arguments, PredicateId};

/// Reachable instances and atoms in the delete relaxation.
#[derive(Default)]
pub struct RelaxedReachability {
    /// For each schema: the reachable bindings in ascending order. Slots are unassigned.
    pub(crate) instances: Vec<Vec<Binding>>,
    pub(crate) atoms: AtomSet,
    pub(crate) derived: Vec<(PredicateId, Arguments)>,
}
