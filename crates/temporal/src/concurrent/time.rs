//! Time expressions: lower bounds on times, possibly relative to starts of running actions that can
//! still be delayed.

use smallvec::SmallVec;
use task::number::Int;

use crate::concurrent::time_number::TimeNumber;

/// Index of a time point of the network that can still be delayed, such as the start of a running
/// action.
pub(super) type TimePoint = u32;

pub(super) fn place(float: TimePoint) -> usize {
    float as usize
}

/// Lower bound on a time: at least `base`, and at least the given lag after each listed time point.
#[derive(Debug, PartialEq, Eq, Default)]
pub(super) struct TimeExpression<T: TimeNumber = Int> {
    pub(super) base: T,
    /// Least distance after each time point, sorted by time point.
    pub(super) lags: SmallVec<[(TimePoint, T); 1]>,
}

impl<T: TimeNumber> Clone for TimeExpression<T> {
    /// Avoids an allocation in the common case without lags.
    fn clone(&self) -> Self {
        let lags = if self.lags.is_empty() { SmallVec::new() } else { SmallVec::from_slice(&self.lags) };
        Self { base: self.base, lags }
    }
}

impl<T: TimeNumber> TimeExpression<T> {
    pub(super) fn constant(base: T) -> Self {
        Self { base, lags: SmallVec::new() }
    }

    pub(super) fn lag(&self, float: TimePoint) -> Option<T> {
        self.lags.iter().find(|(point, _)| *point == float).map(|(_, lag)| *lag)
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
    )]
    pub(super) fn shifted(&self, by: T) -> Self {
        Self {
            base: self.base + by,
            lags: self.lags.iter().map(|(float, lag)| (*float, *lag + by)).collect(),
        }
    }

    /// Raises this lower bound to at least `other + by`.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
    )]
    pub(super) fn delay_to(&mut self, other: &Self, by: T) {
        self.base = self.base.max(other.base + by);
        for (float, lag) in &other.lags {
            self.put_off_after(*float, *lag + by);
        }
    }

    /// Raises this lower bound to at least `by` after the time point.
    pub(super) fn put_off_after(&mut self, float: TimePoint, by: T) {
        match self.lags.binary_search_by_key(&float, |(point, _)| *point) {
            Ok(position) => self.lags[position].1 = self.lags[position].1.max(by),
            Err(position) => self.lags.insert(position, (float, by)),
        }
    }

    pub(super) fn forget(&mut self, float: TimePoint) -> Option<T> {
        let position = self.lags.iter().position(|(point, _)| *point == float)?;
        Some(self.lags.remove(position).1)
    }

    /// Returns `true` if this time is certainly at least `by` before the time `other`, for all values
    /// of the time points.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
    )]
    pub(super) fn precedes(&self, other: &Self, by: T) -> bool {
        self.base + by <= other.base
            && self.lags.iter().all(|(float, lag)| other.lag(*float).is_some_and(|later| *lag + by <= later))
    }

    /// Renumbers the time points by `numbers`. Time points without a new number are removed.
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
