//! What can come of a comparison, cause by cause.

use thiserror::Error;

/// What came of the comparison of a task with its files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Faithful {
    /// It stands for them.
    Yes {
        /// Instances of actions that the witness does not rule out.
        instances: usize,
        /// Those of them that change nothing that the task knows.
        idle: usize,
        /// Whether plans are measured by the durations of their actions where there is no metric.
        timed: bool,
    },
    /// The first thing that differs.
    No(Difference),
    /// The comparison cannot tell.
    Undecided(Cause),
}

/// What a task or a witness has otherwise than the files.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Difference {
    /// The task does not have its form.
    #[error("it is not a task: {reason}")]
    Form {
        /// What is wrong with it.
        reason: String,
    },
    /// Something else holds at first.
    #[error("{what} is another one at first")]
    Initial {
        /// A variable, a number, or the metric.
        what: String,
    },
    /// The goal of the files does not imply that of the task.
    #[error("the goal of the files can hold where that of the task does not")]
    Goal,
    /// An instance of an action can be executed, and no operator has its arguments.
    #[error("{instance}: no operator stands for it")]
    NoOperatorFor {
        /// The action with its arguments.
        instance: String,
    },
    /// Every operator requires something that the instance does not.
    #[error("{instance}: the operator requires more")]
    WrongCondition {
        /// The action with its arguments.
        instance: String,
    },
    /// The operator makes something else of a variable or number, or nothing.
    #[error("{instance}: the operator makes something else of {what}")]
    WrongEffect {
        /// The action with its arguments.
        instance: String,
        /// The values of the variable, or the number.
        what: String,
    },
    /// The operator costs more.
    #[error("{instance}: it costs {cost}, and the operator more")]
    WrongCost {
        /// The action with its arguments.
        instance: String,
        /// In units of the metric.
        cost: String,
    },
    /// A derived atom holds elsewhere.
    #[error("the rules of {atom} are others")]
    WrongRules {
        /// The derived atom.
        atom: String,
    },
    /// The witness does not hold at first, or an instance leaves it.
    #[error("the witness leaves out what can become of {what}")]
    Witness {
        /// An atom or a number.
        what: String,
    },
    /// The witness says that at most one of some atoms holds, and that is not shown.
    #[error("nothing shows that at most one of {atoms} holds, as the witness has it")]
    Exclusive {
        /// The atoms.
        atoms: String,
    },
    /// The witness cannot be read.
    #[error("it is not a witness: {reason}")]
    WitnessForm {
        /// What is wrong with it.
        reason: String,
    },
}

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Cause {
    /// The files or the task have what the comparison does not cover.
    #[error("the comparison of the task with the files does not cover {construct}")]
    Unsupported {
        /// What it is.
        construct: String,
    },
    /// There is too much to go through.
    #[error("the comparison of the task with the files ends at {limit} {what}")]
    TooMany {
        /// Of what.
        what: String,
        /// How many are gone through.
        limit: usize,
    },
    /// It does not follow that an instance keeps the atoms of a variable exclusive.
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
    /// Time or memory was up, or the user had enough.
    #[error("the comparison of the task with the files was stopped")]
    Stopped,
}

impl Cause {
    pub(super) fn unsupported(construct: impl Into<String>) -> Self {
        Self::Unsupported { construct: construct.into() }
    }
}

/// Why a comparison ends early.
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
