//! Outcomes of checking a ground task against its PDDL files, and reasons for rejecting it.

use thiserror::Error;

use crate::check::Fault;

/// Outcome of checking a ground task against its PDDL files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Faithful {
    /// The task is faithful: it permits every plan of the PDDL files without overlapping actions, at no more cost.
    Yes {
        /// Number of action instances that may be executable in a state of the witness.
        instances: usize,
        /// Number of those instances that need no operator, because they do not change the task
        /// state and their cost is not negative.
        idle: usize,
        /// Whether plans are measured by their duration, because the problem has no metric and actions take
        /// time.
        timed: bool,
    },
    /// The task is rejected because of the first difference found. The difference may concern only
    /// unreachable states of the witness.
    No(Difference),
    /// The check cannot decide whether the task is faithful.
    Undecided(Cause),
}

/// A difference for which the task or the witness (an over-approximation of the reachable states)
/// is rejected.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Difference {
    /// The task is malformed.
    #[error("it is not a task: {reason}")]
    Form {
        /// Description of the error.
        reason: String,
    },
    /// The initial states differ, or the direction or the initial value of the metric does.
    #[error("{what} differs in the initial state")]
    Initial {
        /// Description of the variable, number, or metric.
        what: String,
    },
    /// The goal of the PDDL files does not imply the goal of the task.
    #[error("the goal of the files can hold where that of the task does not")]
    Goal,
    /// An action instance may be executable, but no operator has its action and arguments.
    #[error("{instance}: no operator corresponds to it")]
    NoOperatorFor {
        /// The action with its arguments.
        instance: String,
    },
    /// Every operator with these arguments requires a condition that the instance does not imply.
    #[error("{instance}: the operator requires more")]
    WrongCondition {
        /// The action with its arguments.
        instance: String,
    },
    /// The operator changes a variable or number differently than the instance.
    #[error("{instance}: the operator has a different effect on {what}")]
    WrongEffect {
        /// The action with its arguments.
        instance: String,
        /// The values of the variable, or the name of the number.
        what: String,
    },
    /// The operator costs more than the instance.
    #[error("{instance}: it costs {cost}, but the operator costs more")]
    WrongCost {
        /// The action with its arguments.
        instance: String,
        /// Cost of the instance, in units of the metric.
        cost: String,
    },
    /// The rules of the task and of the PDDL files for a derived atom are not equivalent.
    #[error("the rules of {atom} differ")]
    WrongRules {
        /// The derived atom.
        atom: String,
    },
    /// The witness does not contain the initial state, or an action instance or an event leads out
    /// of the witness.
    #[error("the witness does not cover all values of {what} that it may reach")]
    Witness {
        /// The atom or number that is outside the witness.
        what: String,
    },
    /// A mutex group (atoms of which at most one holds) that the witness lists is not proved.
    #[error("it is not proved that at most one of {atoms} holds, as the witness claims")]
    Exclusive {
        /// The atoms of the group.
        atoms: String,
    },
    /// The witness is malformed.
    #[error("it is not a witness: {reason}")]
    WitnessForm {
        /// Description of the error.
        reason: String,
    },
}

impl From<&Fault> for Difference {
    fn from(fault: &Fault) -> Self {
        let reason = match fault {
            Fault::Form { reason, .. } => reason.clone(),
            other => other.to_string(),
        };
        Self::Form { reason }
    }
}

/// The reason why the check cannot decide.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Cause {
    /// The PDDL files or the task contain an unsupported construct.
    #[error("the comparison of the task with the files does not cover {construct}")]
    Unsupported {
        /// Description of the construct.
        construct: String,
    },
    /// A limit on sizes is exceeded.
    #[error("the comparison of the task with the files ends at {limit} {what}")]
    TooMany {
        /// Description of the counted items.
        what: String,
        /// The upper limit on their number.
        limit: usize,
    },
    /// It is not proved that at most one atom of a variable holds after an instance. Or too many partial states
    /// would have to be examined to compare the effects of the instance.
    #[error(
        "cannot tell whether the ground task represents the files: at most one of {atoms} has to hold, and neither \
         {instance} nor the witness alone proves that this is preserved; no difference was found"
    )]
    Exclusion {
        /// The action with its arguments.
        instance: String,
        /// The values of the variable.
        atoms: String,
    },
    /// The check was cancelled: `stop` returned `true`.
    #[error("the comparison of the task with the files was stopped")]
    Stopped,
}

impl Cause {
    pub(super) fn unsupported(construct: impl Into<String>) -> Self {
        Self::Unsupported { construct: construct.into() }
    }

    pub(super) fn within(self, part: &str) -> Self {
        match self {
            Self::Unsupported { construct } => Self::unsupported(format!("{construct}; it occurs in {part}")),
            other => other,
        }
    }
}

#[derive(Debug)]
pub(super) enum Obstacle {
    Differs(Difference),
    Open(Cause),
}

impl From<Difference> for Obstacle {
    fn from(difference: Difference) -> Self {
        Self::Differs(difference)
    }
}

impl From<Cause> for Obstacle {
    fn from(cause: Cause) -> Self {
        Self::Open(cause)
    }
}
