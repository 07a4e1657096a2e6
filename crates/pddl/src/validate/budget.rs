//! Interruption of a validation by its caller.

use std::cell::Cell;
use std::fmt;

/// Maximum number of loop steps between two calls of the caller's stop function.
const STRIDE: u32 = 256;

/// Error: the caller stopped the validation, so there is no verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interrupted;

impl fmt::Display for Interrupted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a limit was reached before the plan was validated")
    }
}

impl std::error::Error for Interrupted {}

/// Stop condition of the caller. Once the condition holds, all loops end early and their results are
/// discarded.
pub(super) struct Budget<'s> {
    stop: &'s dyn Fn() -> bool,
    steps_left: Cell<u32>,
    is_spent: Cell<bool>,
}

impl<'s> Budget<'s> {
    pub(super) fn new(stop: &'s dyn Fn() -> bool) -> Self {
        Self { stop, steps_left: Cell::new(STRIDE), is_spent: Cell::new(false) }
    }

    pub(super) fn is_spent(&self) -> bool {
        let steps_left = self.steps_left.get();
        if steps_left > 0 {
            self.steps_left.set(steps_left.saturating_sub(1));
            return self.is_spent.get();
        }
        self.steps_left.set(STRIDE);
        self.poll()
    }

    /// Calls `stop` immediately, for loops with long steps. Returns `true` if the loop must end.
    pub(super) fn poll(&self) -> bool {
        self.is_spent.set(self.is_spent.get() || (self.stop)());
        self.is_spent.get()
    }

    pub(super) fn check<T>(&self, result: T) -> Result<T, Interrupted> {
        if self.is_spent.get() { Err(Interrupted) } else { Ok(result) }
    }
}

impl fmt::Debug for Budget<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Budget").field("is_spent", &self.is_spent).finish_non_exhaustive()
    }
}
