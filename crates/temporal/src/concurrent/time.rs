//! Time expressions: lower bounds, some of them relative to starts that can still be delayed.

use smallvec::SmallVec;
use task::number::Int;

/// A moment that can still be put off: the start of an action under way, by its position in the clocks.
pub(super) type TimePoint = u32;

/// The position of a float.
pub(super) fn place(float: TimePoint) -> usize {
    float as usize
}

/// The least time of a happening: at least `base`, and at least so long after each of some floats.
#[derive(Debug, PartialEq, Eq, Default)]
pub(super) struct TimeExpression {
    pub(super) base: Int,
    /// Ascending by float.
    pub(super) lags: SmallVec<[(TimePoint, Int); 1]>,
}

impl Clone for TimeExpression {
    /// Most times have no lags, and situations have many times.
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
        self.lags.iter().find(|(own, _)| *own == float).map(|(_, lag)| *lag)
    }

    /// Later, or earlier, by so much.
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
    pub(super) fn shifted(&self, by: Int) -> Self {
        Self { base: self.base + by, lags: self.lags.iter().map(|(float, lag)| (*float, lag + by)).collect() }
    }

    /// From now on not before `other` and so much more.
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
    pub(super) fn delay_to(&mut self, other: &Self, by: Int) {
        self.base = self.base.max(other.base + by);
        for (float, lag) in &other.lags {
            self.put_off_after(*float, lag + by);
        }
    }

    pub(super) fn put_off_after(&mut self, float: TimePoint, by: Int) {
        match self.lags.binary_search_by_key(&float, |(own, _)| *own) {
            Ok(position) => self.lags[position].1 = self.lags[position].1.max(by),
            Err(position) => self.lags.insert(position, (float, by)),
        }
    }

    /// Takes a float out; returns how long after it this was.
    pub(super) fn forget(&mut self, float: TimePoint) -> Option<Int> {
        let position = self.lags.iter().position(|(own, _)| *own == float)?;
        Some(self.lags.remove(position).1)
    }

    /// Whether this is so much before `other`, whatever the floats come to.
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
    pub(super) fn precedes(&self, other: &Self, by: Int) -> bool {
        self.base + by <= other.base
            && self.lags.iter().all(|(float, lag)| other.lag(*float).is_some_and(|later| lag + by <= later))
    }

    /// Gives the floats other numbers.
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
