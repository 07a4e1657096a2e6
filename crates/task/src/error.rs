//! Errors between a checked PDDL task and its ground task, each with a stable code.

use crate::limits::Interrupted;
use pddl::ast::Span;

/// Which of the two PDDL files a place lies in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum File {
    /// The domain file.
    Domain,
    /// The problem file.
    Problem,
}

/// A place in one of the two PDDL files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub file: File,
    /// The region of its text.
    pub span: Span,
}

/// Everything that is wrong with a task.
pub type Errors = diagnostics::Errors<Error>;

/// Why a task cannot be grounded or encoded.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A construct that the planner does not handle (the parser and the validator may).
    #[error("{construct} cannot be planned with: {instead}")]
    Unsupported {
        /// What the file uses.
        construct: String,
        /// What would be accepted.
        instead: String,
        /// Where.
        place: Place,
    },
    /// A numeric fluent that is read, and has no value at first.
    #[error("`{name}` without an initial value cannot be planned with: a value for it in `:init`")]
    NoValue {
        /// The function.
        name: String,
        /// Where it is read.
        place: Place,
    },
    /// A name that the checker would have refused.
    #[error("unknown {kind} `{name}`")]
    Unknown {
        /// `predicate`, `function`, `object`, `type` or `variable`.
        kind: &'static str,
        /// The name.
        name: String,
        /// Where.
        place: Place,
    },
    /// A product or quotient that is not linear in the fluents.
    #[error("the expression is not linear in the fluents that actions change")]
    NonLinear {
        /// Where.
        place: Place,
    },
    /// A number that does not fit the exact integer arithmetic of the encoder.
    #[error(
        "{what}: a number exceeds 2^118 after scaling to integers, or has fractions that no scale makes integers"
    )]
    Overflow {
        /// The quantity.
        what: String,
        /// The action or the metric, where it is one that is too much.
        place: Option<Place>,
    },
    /// A limit was reached before the task was ground.
    #[error("a limit was reached while grounding")]
    Interrupted,
    /// A rule of the relaxed reachability program that the rule engine refuses.
    #[error("grounding: {0}")]
    Rules(String),
}

impl From<Interrupted> for Error {
    fn from(Interrupted: Interrupted) -> Self {
        Self::Interrupted
    }
}

impl From<Interrupted> for Errors {
    fn from(interrupted: Interrupted) -> Self {
        Error::from(interrupted).into()
    }
}

impl Error {
    /// That numbers do not fit, wherever they stand.
    pub fn overflow(what: &str) -> Self {
        Self::Overflow { what: what.to_owned(), place: None }
    }

    /// The same error, if numbers are too large, with where they are.
    #[must_use]
    pub fn within(self, name: &str, place: Option<Place>) -> Self {
        match self {
            Self::Overflow { what, place: known } => {
                Self::Overflow { what: format!("{what} ({name})"), place: known.or(place) }
            }
            other => other,
        }
    }

    /// Whether a fluent is read that has no value at first.
    pub fn is_value_missing(&self) -> bool {
        matches!(self, Self::NoValue { .. })
    }

    /// The stable code of the cause.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unsupported { .. } | Self::NoValue { .. } => "E301",
            Self::Unknown { .. } => "E302",
            Self::NonLinear { .. } => "E303",
            Self::Overflow { .. } => "E304",
            Self::Rules(_) => "E305",
            Self::Interrupted => "E306",
        }
    }

    /// Where the cause stands, if it stands in a file.
    pub fn place(&self) -> Option<Place> {
        match self {
            Self::Unsupported { place, .. }
            | Self::NoValue { place, .. }
            | Self::Unknown { place, .. }
            | Self::NonLinear { place } => Some(*place),
            Self::Overflow { place, .. } => *place,
            Self::Rules(_) | Self::Interrupted => None,
        }
    }
}
