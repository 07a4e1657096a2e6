//! The result type of checks, with the two reasons for stopping without a result.

use crate::error::{Diagnostic, Error, Place};

#[derive(Debug)]
pub enum Stop {
    Wrong(Error),
    /// Exact arithmetic exceeds its budget, so the caller solves the property in floating-point arithmetic; or the
    /// caller has cancelled the computation.
    TooMuchWork,
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Wrong(error)
    }
}

pub type Checked<T> = Result<T, Stop>;

/// Converts the result of a computation. `None` means that exact arithmetic exceeds its budget, or that the caller has
/// cancelled the computation.
pub fn within_budget<T>(result: Option<T>) -> Checked<T> {
    result.ok_or(Stop::TooMuchWork)
}

pub fn property_error(code: &'static str, place: Place, text: &str) -> Error {
    Error::Property(Diagnostic::new(code, place, text).into())
}

/// Creates an error in a property, placed at line 1, column 1 because the real place is unknown.
pub fn refusal(code: &'static str, text: &str) -> Stop {
    Stop::Wrong(property_error(code, Place { line: 1, column: 1 }, text))
}
