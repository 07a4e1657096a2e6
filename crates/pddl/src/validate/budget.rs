//! When an execution has to stop before its end.

use std::cell::Cell;
use std::fmt;

/// Number of steps between two calls of the caller's function.
const STRIDE: u32 = 256;

/// The validation ended at a limit of its caller, without a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interrupted;

impl fmt::Display for Interrupted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a limit was reached before the plan was validated")
    }
}

impl std::error::Error for Interrupted {}

/// The caller's limits. Once they are reached, every loop of the execution ends, and what it has found is discarded.
pub(super) struct Budget<'s> {
    stop: &'s dyn Fn() -> bool,
    left: Cell<u32>,
    is_spent: Cell<bool>,
}

impl<'s> Budget<'s> {
    /// Limits that are reached when the function returns `true`.
    pub(super) fn new(stop: &'s dyn Fn() -> bool) -> Self {
        Self { stop, left: Cell::new(STRIDE), is_spent: Cell::new(false) }
    }

    /// Notes one step of a loop. Returns `true` if the loop has to end.
    pub(super) fn is_spent(&self) -> bool {
        let left = self.left.get();
        if left > 0 {
            self.left.set(left.saturating_sub(1));
            return self.is_spent.get();
        }
        self.left.set(STRIDE);
        self.poll()
    }

    /// Returns `true` if a loop has to end whose steps may take long.
    pub(super) fn poll(&self) -> bool {
        self.is_spent.set(self.is_spent.get() || (self.stop)());
        self.is_spent.get()
    }

    /// The result of an execution, unless a loop of it was cut short.
    pub(super) fn check<T>(&self, result: T) -> Result<T, Interrupted> {
        if self.is_spent.get() { Err(Interrupted) } else { Ok(result) }
    }
}

impl fmt::Debug for Budget<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Budget").field("is_spent", &self.is_spent).finish_non_exhaustive()
    }
}
