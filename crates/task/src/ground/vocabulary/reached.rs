//! The result of relaxed reachability.

use crate::ground::vocabulary::atom::{AtomSet, Binding};
use crate::lifted::{Arguments, PredicateId};

/// Result of relaxed reachability.
#[derive(Default)]
pub struct RelaxedReachability {
    /// Bindings of the parameters of each schema except slots, ascending.
    pub(crate) instances: Vec<Vec<Binding>>,
    /// Reachable fluent atoms.
    pub(crate) atoms: AtomSet,
    /// Facts of static derived predicates.
    pub(crate) derived: Vec<(PredicateId, Arguments)>,
}
