//! Budgets of exact arithmetic.

use crate::number::Number;

/// Default budget of exact arithmetic, in units of about a nanosecond.
pub const DEFAULT_BUDGET: u64 = 3_000_000_000;

/// Default width of bounds in doubles, relative to the value.
pub const TIGHT: f64 = 1e-7;

/// Remaining budget of exact arithmetic, and required width of bounds in doubles. Doubles cost nothing.
#[derive(Debug, Clone, Copy)]
pub struct Work {
    remaining: u64,
    /// Required width of bounds, relative to the value; tighter bounds are not computed.
    pub tight: f64,
    /// Remaining budget for components whose bounds in doubles are insufficient.
    spare: u64,
    /// Entries that elimination has touched, including elimination in doubles.
    touched: u64,
}

/// Size of a fraction whose numerator and denominator usually fit into a word each, in bits.
const SHORT_BITS: u64 = 126;

/// Budget for components whose bounds in doubles are insufficient, all of them together.
const SPARE_BUDGET: u64 = 1_000_000_000;

impl Work {
    /// Creates a budget.
    pub const fn new(remaining: u64) -> Self {
        Self { remaining, tight: TIGHT, spare: SPARE_BUDGET, touched: 0 }
    }

    /// Pays for operations whose results are about as long as `result`. Returns `None` if the budget is exhausted.
    ///
    /// Fractions are reduced, which takes quadratic time. The constant part is the cost of allocating long ones.
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

    /// Adds to the number of entries that elimination has touched.
    pub const fn touch(&mut self, entries: u64) {
        self.touched = self.touched.saturating_add(entries);
    }

    /// Number of entries that elimination has touched.
    pub const fn touched(self) -> u64 {
        self.touched
    }

    /// Runs an operation in rationals within a part of the spare budget, of at most `limit` units.
    pub fn spared<T>(&mut self, limit: u64, operation: impl FnOnce(&mut Self) -> T) -> T {
        let granted = self.spare.min(limit);
        let mut work = Self::new(granted);
        let result = operation(&mut work);
        self.spare = self.spare.saturating_sub(granted.saturating_sub(work.remaining));
        result
    }

    /// Returns `true` if the budget is exhausted.
    pub const fn is_spent(self) -> bool {
        self.remaining == 0
    }
}
