//! What exact arithmetic may cost.

use crate::number::Number;

/// How much exact arithmetic may cost, in units of about a nanosecond, before it is given up.
pub const MOST: u64 = 3_000_000_000;

/// How wide bounds in doubles may be, relative to the value, unless it is said.
pub const TIGHT: f64 = 1e-7;

/// What is left of a budget of exact arithmetic, and how tight bounds in doubles have to be. Doubles cost nothing.
#[derive(Debug, Clone, Copy)]
pub struct Work {
    left: u64,
    /// How wide bounds may be, relative to the value; no more is done once they are within.
    pub tight: f64,
    /// What may still be spent on components that doubles cannot tell enough of.
    spare: u64,
    /// Entries that elimination has touched so far, in doubles, too.
    touched: u64,
}

/// Bits of a numerator and a denominator that fit into a word each, mostly.
const SHORT: u64 = 126;

/// What may be spent on such components, all together.
const SPARE: u64 = 1_000_000_000;

impl Work {
    /// A budget of so many units.
    pub const fn new(left: u64) -> Self {
        Self { left, tight: TIGHT, spare: SPARE, touched: 0 }
    }

    /// Pays for so many operations whose results are about as long as this one; none where the budget is spent.
    ///
    /// Fractions are reduced, which takes the square of their length; the constant part is for the memory that long ones take.
    pub fn spend<N: Number>(&mut self, result: &N, operations: usize) -> Option<()> {
        if !N::EXACT {
            return Some(());
        }
        let bits = result.size();
        let one = if bits <= SHORT {
            40
        } else {
            bits.saturating_mul((bits / 64).saturating_add(1)).saturating_add(200)
        };
        let cost = one.saturating_mul(u64::try_from(operations).unwrap_or(u64::MAX));
        self.left = self.left.saturating_sub(cost);
        if self.is_spent() { None } else { Some(()) }
    }

    /// Notes that elimination touched so many entries.
    pub const fn touch(&mut self, entries: u64) {
        self.touched = self.touched.saturating_add(entries);
    }

    /// Entries that elimination has touched so far.
    pub const fn touched(self) -> u64 {
        self.touched
    }

    /// Does something in rationals within a part of what is spare.
    pub fn spared<T>(&mut self, most: u64, what: impl FnOnce(&mut Self) -> T) -> T {
        let given = self.spare.min(most);
        let mut work = Self::new(given);
        let result = what(&mut work);
        self.spare = self.spare.saturating_sub(given.saturating_sub(work.left));
        result
    }

    /// Whether nothing is left.
    pub const fn is_spent(self) -> bool {
        self.left == 0
    }
}
