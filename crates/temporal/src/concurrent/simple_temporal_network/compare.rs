//! Dominance between two simple temporal networks, and removal of accesses that no longer matter.

use crate::concurrent::simple_temporal_network::{Key, RunningAction, SimpleTemporalNetwork};
use crate::concurrent::time::TimeExpression;
use crate::concurrent::time_number::TimeNumber;

impl<T: TimeNumber> SimpleTemporalNetwork<T> {
    /// Appends to `out` the part that must be equal for two networks to be compared: the running actions and,
    /// while an over-all condition is violated, the time point that the next happenings share.
    pub(in crate::concurrent) fn signature(&self, out: &mut Vec<u32>) {
        for open in &self.opens {
            out.extend([open.instance, open.float]);
            open.offset.append_words(out);
            open.duration.append_words(out);
        }
        if let Some((float, offset)) = self.group {
            out.extend([u32::MAX, float]);
            offset.append_words(out);
        }
    }

    /// Removes accesses that can no longer delay a happening: those at least `separation` before the last
    /// timed initial literals, or before the last change of their guard (see `TemporalTask::guards`).
    pub(in crate::concurrent) fn forget(&mut self, guards: &[Option<u32>], separation: T) {
        let mut entries = std::mem::take(&mut self.entries);
        entries.retain(|(key, time)| !self.is_past(*key, time, guards, separation));
        self.entries = entries;
    }

    fn is_past(&self, key: Key, time: &TimeExpression<T>, guards: &[Option<u32>], separation: T) -> bool {
        if time.precedes(&TimeExpression::constant(self.floor), separation) {
            return true;
        }
        let guard = guards[key as usize].and_then(|guard| self.change(guard));
        guard.is_some_and(|guard| time.precedes(guard, separation))
    }

    /// Returns `true` if every continuation of `other` is possible after `self` and no later,
    /// ignoring access times. The signatures of both networks must be equal.
    pub(in crate::concurrent) fn dominates_ignoring_accesses(&self, other: &Self) -> bool {
        let floats = || self.floats.iter().zip(&other.floats);
        let lasts = || self.opens.iter().zip(&other.opens);
        let last = |(first, second): (&RunningAction<T>, &RunningAction<T>)| match (&first.last, &second.last)
        {
            (Some(first), Some(second)) => first.precedes(second, T::ZERO),
            _ => true,
        };
        self.floor <= other.floor
            && (!self.waits() || other.waits())
            && self.latest.precedes(&other.latest, T::ZERO)
            && floats().all(|(first, second)| {
                first.lower.precedes(&second.lower, T::ZERO) && first.upper >= second.upper
            })
            && lasts().all(last)
    }

    /// Returns `true` if the access times of `self` delay no continuation more than those of
    /// `other`. Complements [`SimpleTemporalNetwork::dominates_ignoring_accesses`].
    pub(in crate::concurrent) fn accesses_no_later(
        &self,
        other: &Self,
        guards: &[Option<u32>],
        separation: T,
    ) -> bool {
        let mut other_entries = other.entries.iter().peekable();
        self.entries.iter().all(|(key, time)| {
            while other_entries.next_if(|(candidate, _)| candidate < key).is_some() {}
            match other_entries.peek() {
                Some((candidate, later)) if candidate == key && time.precedes(later, T::ZERO) => true,
                _ => other.is_past(*key, time, guards, separation),
            }
        })
    }
}
