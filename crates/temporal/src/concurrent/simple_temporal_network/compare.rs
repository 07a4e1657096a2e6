//! Dominance between two simple temporal networks, and the time points that still matter.

use task::number::{Int, words};

use crate::concurrent::simple_temporal_network::{Key, RunningAction, SimpleTemporalNetwork};
use crate::concurrent::time::TimeExpression;

impl SimpleTemporalNetwork {
    /// What must agree between clocks that can be compared.
    pub(in crate::concurrent) fn signature(&self, out: &mut Vec<u32>) {
        for open in &self.opens {
            out.extend([open.instance, open.float]);
            out.extend(words(open.offset));
            out.extend(words(open.duration));
        }
        if let Some((float, offset)) = self.group {
            out.extend([u32::MAX, float]);
            out.extend(words(offset));
        }
    }

    /// Forgets accesses that put nothing off any more: everything that heeds one comes after its guard has changed.
    pub(in crate::concurrent) fn forget(&mut self, guards: &[Option<u32>], separation: Int) {
        let mut entries = std::mem::take(&mut self.entries);
        entries.retain(|(key, time)| !self.is_past(*key, time, guards, separation));
        self.entries = entries;
    }

    fn is_past(&self, key: Key, time: &TimeExpression, guards: &[Option<u32>], separation: Int) -> bool {
        if time.precedes(&TimeExpression::constant(self.floor), separation) {
            return true;
        }
        let guard = guards[key as usize].and_then(|guard| self.change(guard));
        guard.is_some_and(|guard| time.precedes(guard, separation))
    }

    /// Whether whatever can follow `other` can follow `self`, no later, as far as accesses do not matter. Their signatures must agree.
    pub(in crate::concurrent) fn dominates_ignoring_accesses(&self, other: &Self) -> bool {
        let floats = || self.floats.iter().zip(&other.floats);
        let lasts = || self.opens.iter().zip(&other.opens);
        let last = |(own, other): (&RunningAction, &RunningAction)| match (&own.last, &other.last) {
            (Some(own), Some(other)) => own.precedes(other, 0),
            _ => true,
        };
        self.floor <= other.floor
            && (!self.waits() || other.waits())
            && self.latest.precedes(&other.latest, 0)
            && floats().all(|(own, other)| own.lower.precedes(&other.lower, 0) && own.upper >= other.upper)
            && lasts().all(last)
    }

    /// The same of accesses alone.
    pub(in crate::concurrent) fn accesses_no_later(
        &self,
        other: &Self,
        guards: &[Option<u32>],
        separation: Int,
    ) -> bool {
        let mut theirs = other.entries.iter().peekable();
        self.entries.iter().all(|(key, time)| {
            while theirs.next_if(|(other, _)| other < key).is_some() {}
            match theirs.peek() {
                Some((other, later)) if other == key && time.precedes(later, 0) => true,
                _ => other.is_past(*key, time, guards, separation),
            }
        })
    }
}
