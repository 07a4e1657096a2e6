//! The work budget of exact arithmetic.

use crate::number::Number;

/// Default budget of exact arithmetic, in work units of about 1 ns.
pub const DEFAULT_BUDGET: u64 = 3_000_000_000;

/// Default width of the bounds computed in doubles, relative to the value.
pub const TIGHT: f64 = 1e-7;

/// The remaining work budget of exact arithmetic, and the required width of bounds in doubles.
/// Arithmetic in doubles costs nothing.
#[derive(Debug, Clone, Copy)]
pub struct Work {
    remaining: u64,
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

impl Work {
    pub const fn new(remaining: u64) -> Self {
        Self { remaining, tight: TIGHT, spare: SPARE_BUDGET, touched: 0 }
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
        let mut work = Self::new(granted);
        let result = operation(&mut work);
        self.spare = self.spare.saturating_sub(granted.saturating_sub(work.remaining));
        result
    }

    pub const fn is_spent(self) -> bool {
        self.remaining == 0
    }
}
