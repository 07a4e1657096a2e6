//! The result type of checks: an error, or an exceeded budget of exact arithmetic.

use crate::error::{Diagnostic, Error, Place};

/// The reason for ending a computation without a result.
#[derive(Debug)]
pub enum Stop {
    /// An error in the input, or an exceeded limit.
    Wrong(Error),
    /// Exact arithmetic exceeds its budget.
    TooMuchWork,
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Wrong(error)
    }
}

/// The result of a part of a check.
pub type Checked<T> = Result<T, Stop>;

/// Converts `None`, the result of exact arithmetic that exceeded its budget, to an error.
pub fn within_budget<T>(result: Option<T>) -> Checked<T> {
    result.ok_or(Stop::TooMuchWork)
}

/// An error in a property.
pub fn property_error(code: &'static str, place: Place, text: &str) -> Error {
    Error::Property(Diagnostic::new(code, place, text).into())
}

/// An error in a property at an unknown place.
pub fn refusal(code: &'static str, text: &str) -> Stop {
    Stop::Wrong(property_error(code, Place { line: 1, column: 1 }, text))
}
