//! Happenings (instantaneous operators) and ground durative actions of a temporal task.

use task::number::Int;
use task::task::{Fact, NumericId, OperatorId};

use crate::concurrent::interference::{Designs, InterferenceConstraints};
use crate::concurrent::time_number::TimeNumber;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Role {
    Start(u32),
    End(u32),
    /// A whole action: instantaneous or of duration 0.
    Whole,
    Timed(u32),
    /// Operator that never happens, for example an over-all condition, or the start or end of an action that
    /// cannot be executed.
    #[default]
    Never,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Happening<T: TimeNumber = Int> {
    pub(super) role: Role,
    pub(super) accesses: InterferenceConstraints<T>,
    pub(super) designs: Designs,
    /// Atoms and numbers that the happening writes, ascending. Atom `a` has the id `2a`, number `n`
    /// the id `2n + 1`.
    pub(super) writes: Vec<u32>,
    /// Variables that the happening sets, ascending. Limited to goal variables and guards (variables in
    /// `guards` of the task), because only the times of their changes are recorded.
    pub(super) sets: Vec<u32>,
}

#[derive(Debug, Clone)]
pub(super) struct Instance<T: TimeNumber = Int> {
    pub(super) start: OperatorId,
    pub(super) end: OperatorId,
    /// Operator whose condition is the action's over-all condition. `None` if there is no over-all condition
    /// that can change.
    pub(super) over_all: Option<OperatorId>,
    /// Duration in internal time units. Only a lower bound if the duration depends on the state or
    /// is chosen by the planner.
    pub(super) duration: T,
    /// Numeric variable that holds the duration while the action runs, and the factor from its value to
    /// internal time units. `None` if the duration is constant.
    pub(super) timer: Option<(NumericId, T)>,
    pub(super) is_chosen: bool,
    pub(super) designs: Designs,
    /// Atoms and numbers that the over-all condition reads, numbered as in `Happening::writes`.
    /// Empty unless several simultaneous happenings can maintain the condition jointly.
    pub(super) joint: Vec<u32>,
    /// Upper bound on the number of simultaneous runs that can be useful; `u32::MAX` if no bound is
    /// known.
    pub(super) most: u32,
    /// Fact that the action is running. `None` if at most one simultaneous run can be useful.
    pub(super) under_way: Option<Fact>,
    /// `true` if a run is useless whenever its end does not change the state; the search prunes such an end.
    /// Always `false` if at most one simultaneous run can be useful.
    pub(super) counts_by_end: bool,
    /// `true` if the end can directly follow its start in every sequence of happenings without loss of
    /// completeness.
    pub(super) compressible: bool,
}
