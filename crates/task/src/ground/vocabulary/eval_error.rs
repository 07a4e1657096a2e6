//! Reasons why a condition or expression cannot be evaluated for an action instance.

use crate::error::Error;
use crate::limits::Interrupted;

/// Reason why a condition or expression cannot be evaluated.
#[derive(Debug)]
pub enum Failure {
    /// A fluent has no value, a divisor is zero, or a condition is false.
    Undefined,
    /// The expression or condition is not supported, or the deadline has passed or the run was interrupted.
    Error(Error),
}

impl From<Interrupted> for Failure {
    fn from(interrupted: Interrupted) -> Self {
        Self::Error(interrupted.into())
    }
}

/// Converts [`Failure::Undefined`] to `Ok(None)`.
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
