//! Outcomes of the grounding check, and the reasons for rejecting a certificate.

use thiserror::Error;

/// Outcome of the grounding check.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Faithful {
    /// The task refines the files.
    Yes {
        /// Number of action instances that the witness does not rule out.
        instances: usize,
        /// Number of instances among them that do not change the task state.
        idle: usize,
        /// `true` if plans are measured by duration, because there is no metric.
        timed: bool,
    },
    /// The first difference.
    No(Difference),
    /// The check cannot decide.
    Undecided(Cause),
}

/// A difference between the task or the witness and the files.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Difference {
    /// The task is not well-formed.
    #[error("it is not a task: {reason}")]
    Form {
        /// Description of the error.
        reason: String,
    },
    /// The initial states differ.
    #[error("{what} is another one at first")]
    Initial {
        /// A variable, a number, or the metric.
        what: String,
    },
    /// The goal of the files does not imply the goal of the task.
    #[error("the goal of the files can hold where that of the task does not")]
    Goal,
    /// An instance of an action can be executed, but no operator has its arguments.
    #[error("{instance}: no operator stands for it")]
    NoOperatorFor {
        /// The action with its arguments.
        instance: String,
    },
    /// Every matching operator requires a condition that the instance does not require.
    #[error("{instance}: the operator requires more")]
    WrongCondition {
        /// The action with its arguments.
        instance: String,
    },
    /// The operator has a different effect on a variable or a number.
    #[error("{instance}: the operator makes something else of {what}")]
    WrongEffect {
        /// The action with its arguments.
        instance: String,
        /// The values of the variable, or the number.
        what: String,
    },
    /// The operator costs more than the instance.
    #[error("{instance}: it costs {cost}, and the operator more")]
    WrongCost {
        /// The action with its arguments.
        instance: String,
        /// Cost of the instance, in units of the metric.
        cost: String,
    },
    /// The rules of a derived atom are not equivalent.
    #[error("the rules of {atom} are others")]
    WrongRules {
        /// The derived atom.
        atom: String,
    },
    /// The witness does not contain the initial state, or an instance leaves it.
    #[error("the witness leaves out what can become of {what}")]
    Witness {
        /// An atom or a number.
        what: String,
    },
    /// A mutex group of the witness is not proved.
    #[error("nothing shows that at most one of {atoms} holds, as the witness has it")]
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

/// The reason why the check cannot decide.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Cause {
    /// The files or the task contain a construct that is not supported.
    #[error("the comparison of the task with the files does not cover {construct}")]
    Unsupported {
        /// The construct.
        construct: String,
    },
    /// A limit on the size is exceeded.
    #[error("the comparison of the task with the files ends at {limit} {what}")]
    TooMany {
        /// The kind of the counted items.
        what: String,
        /// The limit.
        limit: usize,
    },
    /// An instance is not proved to keep the atoms of a variable exclusive.
    #[error(
        "cannot tell whether the ground task stands for the files: it takes at most one of {atoms} to hold, and neither \
         {instance} nor the witness by itself shows that this stays so; no difference was found"
    )]
    Exclusion {
        /// The action with its arguments.
        instance: String,
        /// The values of the variable.
        atoms: String,
    },
    /// The time or memory limit was reached, or the user cancelled the check.
    #[error("the comparison of the task with the files was stopped")]
    Stopped,
}

impl Cause {
    pub(super) fn unsupported(construct: impl Into<String>) -> Self {
        Self::Unsupported { construct: construct.into() }
    }
}

/// The reason for ending the check early.
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
