//! Errors about models, properties and limits.

use diagnostics::Errors;
use thiserror::Error;

/// A position in a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Place {
    /// Line number, from 1.
    pub line: usize,
    /// Column number in characters, from 1.
    pub column: usize,
}

/// An error at a position in the text of a model or property.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{}:{}: {message}", place.line, place.column)]
#[non_exhaustive]
pub struct Diagnostic {
    /// The stable code of the kind of error, `Q…`.
    pub code: &'static str,
    /// Position of the error.
    pub place: Place,
    /// Description of the error.
    pub message: String,
}

impl Diagnostic {
    pub(crate) fn new(code: &'static str, place: Place, message: impl Into<String>) -> Self {
        Self { code, place, message: message.into() }
    }
}

/// The reason why a check has no answer.
#[derive(Debug, Clone, Error)]
#[non_exhaustive]
pub enum Error {
    /// The model is malformed, or is invalid in a reachable state.
    #[error("the model is wrong:\n{0}")]
    Model(Errors<Diagnostic>),
    /// The property is malformed or does not match the model.
    #[error("the property is wrong:\n{0}")]
    Property(Errors<Diagnostic>),
    /// An undefined constant has no value, or a value does not match a constant.
    #[error("{0}")]
    Constant(String),
    /// The model has more states than allowed, or more choices or transitions than can be numbered.
    #[error("more than {limit} states; {states} were reached")]
    StateLimit {
        /// Number of reached states.
        states: usize,
        /// Upper limit on the number of states. It equals `states` if the model has too many choices or
        /// transitions instead of too many states.
        limit: usize,
    },
    /// The caller cancelled the exploration or the computation of the values.
    #[error("stopped after {states} states")]
    Interrupted {
        /// Number of reached states.
        states: usize,
    },
    /// A value cannot be computed in doubles with a relative precision of `precision`.
    #[error("a value cannot be computed with a relative precision of {precision}")]
    Imprecise {
        /// The required precision.
        precision: f64,
    },
    /// The text of a policy is malformed, or a policy does not match the model.
    #[error("{0}")]
    Policy(String),
}

impl Error {
    /// Returns the errors located in the text of the model or the property. Empty for other kinds of error.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        match self {
            Self::Model(problems) | Self::Property(problems) => problems,
            _ => &[],
        }
    }
}

impl From<Diagnostic> for Error {
    fn from(diagnostic: Diagnostic) -> Self {
        Self::Model(diagnostic.into())
    }
}
