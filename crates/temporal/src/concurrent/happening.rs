//! Happenings and instances of durative actions.

use task::number::Int;
use task::task::{Fact, NumericId, OperatorId};

use crate::concurrent::interference::{Designs, InterferenceConstraints};

/// Role of an operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Role {
    /// The start of an instance.
    Start(u32),
    /// The end of an instance.
    End(u32),
    /// A whole action without duration.
    Whole,
    /// Timed initial literals at this time.
    Timed(Int),
    /// A condition over all, or half of an instance that cannot be executed. Never takes place.
    #[default]
    Never,
}

/// Temporal properties of an operator.
#[derive(Debug, Clone, Default)]
pub(super) struct Happening {
    pub(super) role: Role,
    pub(super) accesses: InterferenceConstraints,
    pub(super) designs: Designs,
    /// Atoms (even) and numbers (odd) that it writes, ascending.
    pub(super) writes: Vec<u32>,
    /// Variables that it sets and whose time of change matters.
    pub(super) sets: Vec<u32>,
}

/// A ground durative action.
#[derive(Debug, Clone)]
pub(super) struct Instance {
    pub(super) start: OperatorId,
    pub(super) end: OperatorId,
    /// Operator whose condition must hold over all.
    pub(super) over_all: Option<OperatorId>,
    /// Duration. Only a lower bound if the duration depends on the state.
    pub(super) duration: Int,
    /// Number that holds the duration between start and end, and its factor, if the state or the
    /// planner determines the duration.
    pub(super) timer: Option<(NumericId, Int)>,
    /// Whether the planner chooses the duration.
    pub(super) is_chosen: bool,
    pub(super) designs: Designs,
    /// Atoms and numbers read by the condition over all if several happenings can maintain it
    /// jointly, numbered as in `Happening::writes`.
    pub(super) joint: Vec<u32>,
    /// Number of simultaneous runs that can be useful.
    pub(super) most: u32,
    /// Fact that the instance is running, if several simultaneous runs can be useful.
    pub(super) under_way: Option<Fact>,
    /// Whether several runs can be useful, but a run whose end changes nothing cannot.
    pub(super) counts_by_end: bool,
    /// Whether its end can directly follow its start in a sequence without loss of completeness.
    pub(super) compressible: bool,
}
