//! Reasons why a condition or expression cannot be evaluated for an action instance.

use crate::error::Error;
use crate::limits::Interrupted;

/// Reason why a condition or expression cannot be evaluated.
#[derive(Debug)]
pub enum Failure {
    /// The expression has no value, or the action instance is never applicable: for example, a function has no value,
    /// a divisor is zero, a condition is false, or effects conflict.
    Undefined,
    /// The task cannot be grounded: for example, a construct is not supported, a fluent has no initial value, or a
    /// limit is reached.
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
