//! Reasons why an expression of an instance has no value.

use crate::error::Error;
use crate::limits::Interrupted;

/// Why an expression has no value here.
#[derive(Debug)]
pub enum Failure {
    /// It reads a function that has no value, or divides by zero: the operator does not exist.
    Undefined,
    /// The planner cannot handle it.
    Error(Error),
}

impl From<Interrupted> for Failure {
    fn from(interrupted: Interrupted) -> Self {
        Self::Error(interrupted.into())
    }
}

/// Nothing where something cannot be.
///
/// # Errors
/// Each failure except [`Failure::Undefined`].
pub fn possible<T>(result: Result<T, Failure>) -> Result<Option<T>, Failure> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(Failure::Undefined) => Ok(None),
        Err(error) => Err(error),
    }
}
