//! What the validator says about a plan.

use std::fmt;

use num_rational::BigRational;

/// Whether a plan is right, what it costs, and otherwise the first thing that is wrong with it.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Verdict {
    /// Executable, and the goal holds in the end.
    pub valid: bool,
    /// `total-time`, in the domain's time unit: one action after another, the sum of the durations;
    /// concurrently, the end of the last action.
    pub total_time: BigRational,
    /// The value of the metric after a valid plan, in the metric's unit; nothing without `:metric`, or
    /// where it is undefined.
    pub metric: Option<BigRational>,
    /// The functions that actions can change, as written, with their values after the last step that was
    /// executed; sorted.
    pub values: Vec<(String, BigRational)>,
    /// The first thing that is wrong.
    pub violation: Option<Box<Violation>>,
}

/// A condition that does not hold, or a step that cannot be executed.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Violation {
    /// The step, from 1 in the order of the plan's text; nothing for the goal.
    pub step: Option<usize>,
    /// The action of the step as written.
    pub action: Option<String>,
    /// When, in the domain's time unit.
    pub time: BigRational,
    /// What kind of thing is wrong.
    pub kind: ViolationKind,
    /// What is wrong, one sentence.
    pub message: String,
    /// The conditions that do not hold.
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
    /// The condition with its objects.
    pub condition: String,
    /// The functions in it, with their values.
    pub values: Vec<(String, Option<BigRational>)>,
}

/// What kind of thing is wrong with a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ViolationKind {
    /// The domain has no such action.
    UnknownAction,
    /// The problem has no such object.
    UnknownObject,
    /// The number or the types of the arguments are wrong.
    Arguments,
    /// The start or the duration is negative, missing, or not as the domain wants it.
    Duration,
    /// A precondition, or a condition at the start of an action.
    AtStart,
    /// A condition over all of an action.
    OverAll,
    /// A condition at the end of an action.
    AtEnd,
    /// A value that is needed is undefined.
    Undefined,
    /// Two effects at one time contradict each other.
    Conflict,
    /// Two steps overlap although actions are executed one after another.
    Overlap,
    /// Two actions that interfere are less than the separation apart.
    Interference,
    /// The goal.
    Goal,
    /// A constraint on the states that the plan goes through.
    Constraint,
}

impl ViolationKind {
    /// A stable word for it.
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
