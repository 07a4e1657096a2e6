//! The work budget of exact arithmetic, and the caller's request to cancel.

use std::fmt;

use crate::number::Number;

/// Default budget of exact arithmetic, in work units of about 1 ns.
pub const DEFAULT_BUDGET: u64 = 3_000_000_000;

/// Default width of the bounds computed in doubles, relative to the value.
pub const TIGHT: f64 = 1e-7;

/// Callback that receives the number of states; its result `false` cancels the computation.
pub type Progress<'p> = &'p dyn Fn(usize) -> bool;

/// Number of evaluated entries between two calls of the callback.
const ENTRIES_PER_CALL: u64 = 1 << 20;

/// The remaining work budget of exact arithmetic, and the required width of bounds in doubles.
/// Arithmetic in doubles costs nothing.
#[derive(Clone, Copy)]
pub struct Work<'p> {
    remaining: u64,
    /// The callback, with the number of states of the process.
    progress: Option<(Progress<'p>, usize)>,
    entries_until_call: u64,
    is_cancelled: bool,
    /// Required width of bounds, relative to the value. A method stops as soon as its bounds are narrower.
    pub tight: f64,
    spare: u64,
    touched: u64,
}

/// Size in bits up to which a fraction usually has a numerator and denominator of one word each.
const SHORT_BITS: u64 = 126;

/// Total budget, in work units, for solving components again in rationals if their bounds in doubles
/// are insufficient.
const SPARE_BUDGET: u64 = 1_000_000_000;

impl fmt::Debug for Work<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Work").field("remaining", &self.remaining).finish_non_exhaustive()
    }
}

impl<'p> Work<'p> {
    pub const fn new(remaining: u64) -> Self {
        Self {
            remaining,
            progress: None,
            entries_until_call: ENTRIES_PER_CALL,
            is_cancelled: false,
            tight: TIGHT,
            spare: SPARE_BUDGET,
            touched: 0,
        }
    }

    /// Sets the callback that can cancel the computation, and the number of states that it receives.
    pub const fn with_progress(self, progress: Progress<'p>, states: usize) -> Self {
        Self { progress: Some((progress, states)), ..self }
    }

    /// Counts evaluated entries and calls the callback when it is due. Returns `None` if the caller has cancelled
    /// the computation.
    pub fn poll(&mut self, entries: usize) -> Option<()> {
        self.entries_until_call = self.entries_until_call.saturating_sub(entries as u64);
        if self.entries_until_call == 0 {
            self.entries_until_call = ENTRIES_PER_CALL;
            self.is_cancelled |= self.progress.is_some_and(|(progress, states)| !progress(states));
        }
        if self.is_cancelled { None } else { Some(()) }
    }

    /// Restores the default budget of exact arithmetic.
    pub const fn refill(&mut self) {
        (self.remaining, self.spare) = (DEFAULT_BUDGET, SPARE_BUDGET);
    }

    /// Adopts the counters of a copy.
    pub const fn continue_from(&mut self, copy: &Work<'_>) {
        self.remaining = copy.remaining;
        self.entries_until_call = copy.entries_until_call;
        self.is_cancelled = copy.is_cancelled;
        self.spare = copy.spare;
        self.touched = copy.touched;
    }

    /// Subtracts the cost of `operations` operations whose results are about as long as `result`. Returns
    /// `None` if the budget is exhausted. Operations in doubles cost nothing and always yield `Some(())`.
    ///
    /// The cost is quadratic in the length because fractions are reduced. Long fractions also have a constant
    /// cost, for allocating memory.
    pub fn spend<N: Number>(&mut self, result: &N, operations: usize) -> Option<()> {
        if !N::EXACT {
            return Some(());
        }
        let bits = result.size();
        let unit_cost = if bits <= SHORT_BITS {
            40
        } else {
            bits.saturating_mul((bits / 64).saturating_add(1)).saturating_add(200)
        };
        let cost = unit_cost.saturating_mul(u64::try_from(operations).unwrap_or(u64::MAX));
        self.remaining = self.remaining.saturating_sub(cost);
        if self.is_spent() { None } else { Some(()) }
    }

    pub const fn touch(&mut self, entries: u64) {
        self.touched = self.touched.saturating_add(entries);
    }

    /// Returns the number of entries that elimination has visited.
    pub const fn touched(self) -> u64 {
        self.touched
    }

    /// Runs `operation` with a separate budget, which is taken from the spare budget and is at most
    /// `limit` work units.
    pub fn spared<T>(&mut self, limit: u64, operation: impl FnOnce(&mut Self) -> T) -> T {
        let granted = self.spare.min(limit);
        let mut work = Self { remaining: granted, tight: TIGHT, spare: SPARE_BUDGET, touched: 0, ..*self };
        let result = operation(&mut work);
        self.spare = self.spare.saturating_sub(granted.saturating_sub(work.remaining));
        self.entries_until_call = work.entries_until_call;
        self.is_cancelled = work.is_cancelled;
        result
    }

    pub const fn is_spent(self) -> bool {
        self.remaining == 0
    }

    /// Returns `true` if the caller has cancelled the computation.
    pub const fn is_cancelled(self) -> bool {
        self.is_cancelled
    }
}
