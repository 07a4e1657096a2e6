//! Time expressions: lower bounds, some of them relative to starts that can still be delayed.

use smallvec::SmallVec;
use task::number::Int;

/// A time point of the network: the start of a running action that can still be delayed, by index.
pub(super) type TimePoint = u32;

/// Index of a time point.
pub(super) fn place(float: TimePoint) -> usize {
    float as usize
}

/// Lower bound on a time: at least `base`, and at least a lag after each of some time points.
#[derive(Debug, PartialEq, Eq, Default)]
pub(super) struct TimeExpression {
    pub(super) base: Int,
    /// Lag after each time point, sorted by time point.
    pub(super) lags: SmallVec<[(TimePoint, Int); 1]>,
}

impl Clone for TimeExpression {
    /// Avoids an allocation in the common case without lags.
    fn clone(&self) -> Self {
        let lags = if self.lags.is_empty() { SmallVec::new() } else { SmallVec::from_slice(&self.lags) };
        Self { base: self.base, lags }
    }
}

impl TimeExpression {
    pub(super) fn constant(base: Int) -> Self {
        Self { base, lags: SmallVec::new() }
    }

    pub(super) fn lag(&self, float: TimePoint) -> Option<Int> {
        self.lags.iter().find(|(point, _)| *point == float).map(|(_, lag)| *lag)
    }

    /// Expression shifted by an amount, which may be negative.
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
    pub(super) fn shifted(&self, by: Int) -> Self {
        Self { base: self.base + by, lags: self.lags.iter().map(|(float, lag)| (*float, lag + by)).collect() }
    }

    /// Raises the bound to at least `other + by`.
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
    pub(super) fn delay_to(&mut self, other: &Self, by: Int) {
        self.base = self.base.max(other.base + by);
        for (float, lag) in &other.lags {
            self.put_off_after(*float, lag + by);
        }
    }

    pub(super) fn put_off_after(&mut self, float: TimePoint, by: Int) {
        match self.lags.binary_search_by_key(&float, |(point, _)| *point) {
            Ok(position) => self.lags[position].1 = self.lags[position].1.max(by),
            Err(position) => self.lags.insert(position, (float, by)),
        }
    }

    /// Removes a time point, and returns the lag after it.
    pub(super) fn forget(&mut self, float: TimePoint) -> Option<Int> {
        let position = self.lags.iter().position(|(point, _)| *point == float)?;
        Some(self.lags.remove(position).1)
    }

    /// Returns `true` if this time is at least `by` before `other` for all values of the time
    /// points.
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
    pub(super) fn precedes(&self, other: &Self, by: Int) -> bool {
        self.base + by <= other.base
            && self.lags.iter().all(|(float, lag)| other.lag(*float).is_some_and(|later| lag + by <= later))
    }

    /// Renumbers the time points; those without a new number are removed.
    pub(super) fn renumber(&mut self, numbers: &[Option<TimePoint>]) {
        self.lags.retain(|(float, _)| match numbers[place(*float)] {
            Some(number) => {
                *float = number;
                true
            }
            None => false,
        });
        if self.lags.len() > 1 {
            self.lags.sort_unstable();
        }
    }
}
