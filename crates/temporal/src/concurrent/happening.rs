//! Happenings and instances of durative actions.

use task::number::Int;
use task::task::{Fact, NumericId, OperatorId};

use crate::concurrent::interference::{Designs, InterferenceConstraints};

/// What a happening is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Role {
    /// The start of an instance.
    Start(u32),
    /// The end of an instance.
    End(u32),
    /// All of an action that takes no time.
    Whole,
    /// Timed initial literals, at this time.
    Timed(Int),
    /// A condition over all, or half of an instance that cannot be executed: never happens.
    #[default]
    Never,
}

/// A happening: an operator of the task with what concerns its time.
#[derive(Debug, Clone, Default)]
pub(super) struct Happening {
    pub(super) role: Role,
    pub(super) accesses: InterferenceConstraints,
    pub(super) designs: Designs,
    /// The atoms (even) and numbers (odd) that it writes, ascending.
    pub(super) writes: Vec<u32>,
    /// The variables that it sets and whose time of change matters.
    pub(super) sets: Vec<u32>,
}

/// A durative action with its arguments.
#[derive(Debug, Clone)]
pub(super) struct Instance {
    pub(super) start: OperatorId,
    pub(super) end: OperatorId,
    /// The operator whose condition must hold over all.
    pub(super) over_all: Option<OperatorId>,
    /// At least, if the state decides.
    pub(super) duration: Int,
    /// The number that holds the duration from the start to the end, if the state or the planner decides it, and by what it is multiplied.
    pub(super) timer: Option<(NumericId, Int)>,
    /// Whether the planner decides it.
    pub(super) is_chosen: bool,
    pub(super) designs: Designs,
    /// What a condition over all reads that several happenings can keep up together; numbered as `Happening::writes`.
    pub(super) joint: Vec<u32>,
    /// How many runs can be under way at a time so that it makes a difference.
    pub(super) most: u32,
    /// The fact that it is under way, if that is more than one.
    pub(super) under_way: Option<Fact>,
    /// Several runs at a time can make a difference, and one whose end changes nothing makes none.
    pub(super) counts_by_end: bool,
    /// Whether its end can come right after its start in a sequence, and nothing is lost.
    pub(super) compressible: bool,
}
