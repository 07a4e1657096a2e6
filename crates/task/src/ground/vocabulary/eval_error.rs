//! Reasons why an expression of an instance has no value.

use crate::error::Error;
use crate::limits::Interrupted;

/// Reason for a missing value.
#[derive(Debug)]
pub enum Failure {
    /// The value is undefined: a fluent has no value, or a divisor is zero. The operator does not
    /// exist.
    Undefined,
    /// The expression is not supported.
    Error(Error),
}

impl From<Interrupted> for Failure {
    fn from(interrupted: Interrupted) -> Self {
        Self::Error(interrupted.into())
    }
}

/// Converts [`Failure::Undefined`] to `None`.
///
/// # Errors
/// All other failures.
pub fn possible<T>(result: Result<T, Failure>) -> Result<Option<T>, Failure> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(Failure::Undefined) => Ok(None),
        Err(error) => Err(error),
    }
}
