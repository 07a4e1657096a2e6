//! Errors of grounding, i.e. of the conversion of a checked PDDL task to a ground task. Each has a stable code.

use crate::limits::Interrupted;
use pddl::ast::Span;

/// The text that contains a source location.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum File {
    /// The domain file.
    Domain,
    /// The problem file.
    Problem,
    /// The text of the objective at this index of
    /// [`GroundConfig::objectives`](crate::ground::GroundConfig::objectives).
    Objective(usize),
}

/// A source location in one of the two PDDL files, or in an objective.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// The file or the objective.
    pub file: File,
    /// Text range in the file or objective.
    pub span: Span,
}

/// The errors that were found in a task.
pub type Errors = diagnostics::Errors<Error>;

/// Reason why a task cannot be grounded or encoded.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A construct that the planner does not support, although it can be parsed and possibly validated.
    #[error("the planner does not support {construct}; supported: {instead}")]
    Unsupported {
        /// The construct in the file.
        construct: String,
        /// A supported alternative.
        instead: String,
        /// Source location.
        place: Place,
    },
    /// A numeric fluent that is read or changed but has no initial value.
    #[error("`{name}` has no initial value; state it in `:init`")]
    NoValue {
        /// Name of the function.
        name: String,
        /// Source location of the expression or effect that contains the fluent.
        place: Place,
    },
    /// An undeclared name, which `pddl::check` would have rejected.
    #[error("unknown {kind} `{name}`")]
    Unknown {
        /// `predicate`, `function`, `object` or `variable`.
        kind: &'static str,
        /// The undeclared name.
        name: String,
        /// Source location.
        place: Place,
    },
    /// A product, quotient or scaling effect that is not linear in the numeric fluents that actions change. Also a
    /// scaling effect whose factor depends on the design of a slot.
    #[error("the expression is not linear in the fluents that actions change")]
    NonLinear {
        /// Source location.
        place: Place,
    },
    /// A quotient in a metric whose divisor is 0. A metric must have a value; elsewhere, such a quotient is only
    /// undefined.
    #[error("the divisor is 0, so the expression has no value")]
    ZeroDivisor {
        /// Source location of the quotient.
        place: Place,
    },
    /// A number that is too large for the integers of the planner after scaling, or fractions that no
    /// admissible factor scales to integers.
    #[error(
        "{what}: a number is too large after scaling to integers, or no admissible factor scales all fractions to integers"
    )]
    Overflow {
        /// Description of the quantity that contains the number.
        what: String,
        /// Source location of the objective, metric or action that contains the number, if known.
        place: Option<Place>,
    },
    /// The deadline passed or the run was interrupted before grounding was complete.
    #[error("a limit was reached while grounding")]
    Interrupted,
    /// An action or axiom with too many variables for relaxed reachability, or a rule of its program that the
    /// Datalog engine rejects.
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
    /// Creates an overflow error without a location.
    pub fn overflow(what: &str) -> Self {
        Self::Overflow { what: what.to_owned(), place: None }
    }

    /// Appends `name` to the description in an overflow error and, if the error has no location yet, sets it to
    /// `place`. Returns other errors unchanged.
    #[must_use]
    pub fn within(self, name: &str, place: Option<Place>) -> Self {
        match self {
            Self::Overflow { what, place: existing } => {
                Self::Overflow { what: format!("{what} ({name})"), place: existing.or(place) }
            }
            other => other,
        }
    }

    /// Returns `true` if the error reports a numeric fluent without an initial value ([`Error::NoValue`]).
    pub fn is_value_missing(&self) -> bool {
        matches!(self, Self::NoValue { .. })
    }

    /// Returns the stable error code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unsupported { .. } | Self::NoValue { .. } => "E301",
            Self::Unknown { .. } => "E302",
            Self::NonLinear { .. } | Self::ZeroDivisor { .. } => "E303",
            Self::Overflow { .. } => "E304",
            Self::Rules(_) => "E305",
            Self::Interrupted => "E306",
        }
    }

    /// Returns the source location of the error, or `None` if it has none.
    pub fn place(&self) -> Option<Place> {
        match self {
            Self::Unsupported { place, .. }
            | Self::NoValue { place, .. }
            | Self::Unknown { place, .. }
            | Self::NonLinear { place }
            | Self::ZeroDivisor { place } => Some(*place),
            Self::Overflow { place, .. } => *place,
            Self::Rules(_) | Self::Interrupted => None,
        }
    }
}
