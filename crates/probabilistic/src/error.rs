//! What can be wrong with a model or a property, and with how large it is.

use diagnostics::Errors;
use thiserror::Error;

/// A place in a text: line and column from 1, the column in characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Place {
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1, in characters.
    pub column: usize,
}

/// One thing that is wrong with a text.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{}:{}: {message}", place.line, place.column)]
#[non_exhaustive]
pub struct Diagnostic {
    /// The stable code of the cause, `Q…`.
    pub code: &'static str,
    /// Where.
    pub place: Place,
    /// What is wrong, and what would be right.
    pub message: String,
}

impl Diagnostic {
    pub(crate) fn new(code: &'static str, place: Place, message: impl Into<String>) -> Self {
        Self { code, place, message: message.into() }
    }
}

/// Why there is no answer.
#[derive(Debug, Clone, Error)]
#[non_exhaustive]
pub enum Error {
    /// The model cannot be read, or does something in a reachable state that it must not do.
    #[error("the model is wrong:\n{0}")]
    Model(Errors<Diagnostic>),
    /// The property cannot be read, or does not fit the model.
    #[error("the property is wrong:\n{0}")]
    Property(Errors<Diagnostic>),
    /// A constant that is set from outside is not there, or a value does not fit it.
    #[error("{0}")]
    Constant(String),
    /// There are more states than allowed.
    #[error("more than {limit} states; {states} were reached")]
    StateLimit {
        /// States that were reached.
        states: usize,
        /// The limit.
        limit: usize,
    },
    /// The caller asked to stop.
    #[error("stopped after {states} states")]
    Interrupted {
        /// States that were reached.
        states: usize,
    },
    /// A policy does not fit the model.
    #[error("{0}")]
    Policy(String),
}

impl Error {
    /// What is wrong with the text of the model or of the property, with places; nothing where it is not for them.
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
