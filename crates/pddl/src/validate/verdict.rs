//! Result of plan validation.

use std::fmt;

use num_rational::BigRational;

/// Validity and metric value of a plan, or the first violation.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Verdict {
    /// Whether the plan is executable, reaches the goal, and satisfies all mandatory constraints.
    pub valid: bool,
    /// `total-time`, in the domain's time unit: the sum of the durations for sequential execution, and the
    /// end of the last action for concurrent execution. After a violation, only the executed part counts.
    pub total_time: BigRational,
    /// Metric value of a valid plan, in the metric's unit. `None` without `:metric` or if the value is
    /// undefined.
    pub metric: Option<BigRational>,
    /// Functions that actions can change, with their values after the last executed step; sorted.
    pub values: Vec<(String, BigRational)>,
    /// First violation, if any.
    pub violation: Option<Box<Violation>>,
}

/// Reason why a plan is invalid.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Violation {
    /// Number of the step, from 1 in the order of the plan's text. `None` for the goal and for constraints.
    pub step: Option<usize>,
    /// Action of the step as written.
    pub action: Option<String>,
    /// Time of the violation, in the domain's time unit.
    pub time: BigRational,
    /// Kind of violation.
    pub kind: ViolationKind,
    /// Description, one sentence.
    pub message: String,
    /// Conjuncts that do not hold, if the violation is an unsatisfied condition or goal.
    pub unmet: Vec<Unmet>,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Violation {}

/// A condition that does not hold.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Unmet {
    /// Condition with objects for its free variables.
    pub condition: String,
    /// Functions in the condition without quantified variables, with their values if defined.
    pub values: Vec<(String, Option<BigRational>)>,
}

/// Kind of violation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ViolationKind {
    /// The domain has no such action.
    UnknownAction,
    /// The problem has no such object.
    UnknownObject,
    /// The number or the types of the arguments are wrong.
    Arguments,
    /// The start or the duration is negative, missing, or violates the domain's constraints.
    Duration,
    /// A precondition or a condition at the start of an action does not hold.
    AtStart,
    /// An over-all condition of an action does not hold.
    OverAll,
    /// A condition at the end of an action does not hold.
    AtEnd,
    /// A required value is undefined or too large.
    Undefined,
    /// Two simultaneous effects conflict.
    Conflict,
    /// Two steps overlap by more than the tolerance in sequential execution.
    Overlap,
    /// Two interfering happenings are simultaneous, or less than the separation apart.
    Interference,
    /// The goal does not hold at the end.
    Goal,
    /// A trajectory constraint does not hold.
    Constraint,
}

impl ViolationKind {
    /// Returns a stable identifier.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::UnknownAction => "unknown_action",
            Self::UnknownObject => "unknown_object",
            Self::Arguments => "arguments",
            Self::Duration => "duration",
            Self::AtStart => "at_start",
            Self::OverAll => "over_all",
            Self::AtEnd => "at_end",
            Self::Undefined => "undefined",
            Self::Conflict => "conflict",
            Self::Overlap => "overlap",
            Self::Interference => "interference",
            Self::Goal => "goal",
            Self::Constraint => "constraint",
        }
    }
}
