//! Why there is no answer yet: something is wrong, or exact arithmetic takes too long.

use crate::error::{Diagnostic, Error, Place};

/// Why there is no answer.
#[derive(Debug)]
pub enum Stop {
    /// Something is wrong.
    Wrong(Error),
    /// Exact arithmetic takes too long.
    TooMuchWork,
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Wrong(error)
    }
}

/// Something that was asked for.
pub type Asked<T> = Result<T, Stop>;

/// What exact arithmetic came to.
pub fn worked<T>(found: Option<T>) -> Asked<T> {
    found.ok_or(Stop::TooMuchWork)
}

/// Something that is wrong with a property.
pub fn property_error(code: &'static str, place: Place, text: &str) -> Error {
    Error::Property(Diagnostic::new(code, place, text).into())
}

/// Something that is wrong with a property, at a place that is not known.
pub fn refusal(code: &'static str, text: &str) -> Stop {
    Stop::Wrong(property_error(code, Place { line: 1, column: 1 }, text))
}
