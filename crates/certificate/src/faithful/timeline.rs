//! Timed initial literals when actions are executed one after another, by the definition in
//! `crates/pddl/src/validate/definition.md`.
//!
//! All literals of the same time form an event. Events divide time into phases: phase 0 begins with the plan,
//! and phase i with event i (counted from 1). The effect of events on an action depends on its *passage*, i.e.
//! on the phases of its start and end, and on whether start or end coincides with an event. The plan may start
//! the action at any time that the passage permits.
//!
//! The task has its own clock. All times of events and all durations are multiples of a *unit*. Let `k` be an
//! integer. A clock value of `k` units represents all times from `k` units on. A clock value between `k` and
//! `k + 1` units represents all times after `k` units. So the clock may be ahead of a represented time, but
//! by less than a unit, which no action can observe.

use std::collections::BTreeMap;

use num_bigint::BigInt;
use num_integer::Integer as _;
use num_rational::BigRational;
use num_traits::{One, Signed, Zero};
use smallvec::{SmallVec, smallvec};

use crate::faithful::formula::Formula;
use crate::faithful::key::{CLOCK, Key, PHASE, WAITED};
use crate::faithful::linear::Linear;

pub(super) type Truths = BTreeMap<Key, bool>;

#[derive(Debug, Clone)]
pub(super) struct Event {
    pub(super) time: BigRational,
    pub(super) truths: Truths,
}

/// An end of a time range; the flag is `true` if the end itself is excluded.
type End = (BigRational, bool);

#[derive(Debug, Default)]
pub(super) struct Timeline {
    pub(super) events: Vec<Event>,
    /// Number of events at time 0 (0 or 1).
    pub(super) begun: usize,
}

/// The position of an action relative to the events, and the times that it permits. The action
/// starts in phase `from` and ends in phase `to`.
#[derive(Debug, Clone)]
pub(super) struct Passage {
    from: usize,
    to: usize,
    /// Whether the action starts exactly at the event that begins phase `from`. The flag `at_end`
    /// states this for the end and phase `to`.
    at_start: bool,
    at_end: bool,
    latest: Option<End>,
    pub(super) end: End,
}

pub(super) fn phase(number: usize) -> Key {
    (PHASE, smallvec![u32::try_from(number).unwrap_or(u32::MAX)])
}

pub(super) fn waited() -> Key {
    (WAITED, SmallVec::new())
}

pub(super) fn clock() -> Key {
    (CLOCK, SmallVec::new())
}

impl Timeline {
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "phases are counted from 0, and each but the first one begins with an event"
    )]
    pub(super) fn add(&mut self, time: &BigRational, key: Key, holds: bool) {
        let place = self.events.partition_point(|event| event.time < *time);
        if self.events.get(place).is_none_or(|event| event.time != *time) {
            self.events.insert(place, Event { time: time.clone(), truths: Truths::new() });
            self.begun += usize::from(time.is_zero());
        }
        self.events[place].truths.insert(key, holds);
    }

    pub(super) fn is_empty(&self) -> bool {
        self.events.is_empty()
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "phases are counted from 0, and each but the first one begins with an event"
    )]
    fn time(&self, number: usize) -> &BigRational {
        &self.events[number - 1].time
    }

    /// Returns the end time of a phase; `None` for the last phase.
    fn over(&self, phase: usize) -> Option<&BigRational> {
        self.events.get(phase).map(|event| &event.time)
    }

    pub(super) fn passages(&self, duration: &BigRational) -> Vec<Passage> {
        if self.is_empty() {
            let end = (duration.clone(), false);
            return vec![Passage { from: 0, to: 0, at_start: false, at_end: false, latest: None, end }];
        }
        let mut passages = Vec::new();
        // Phase in which an action that starts at a certain time ends.
        let phase_of_end = |start: &BigRational| {
            let end = start + duration;
            self.events.partition_point(|event| event.time <= end)
        };
        for from in self.begun..=self.events.len() {
            let begin = if from == 0 { BigRational::zero() } else { self.time(from).clone() };
            let last = self.over(from).map_or(self.events.len(), phase_of_end);
            for to in phase_of_end(&begin)..=last {
                for at_start in [false, true] {
                    for at_end in [false, true] {
                        passages.extend(self.passage(duration, (from, to), (at_start, at_end)));
                    }
                }
            }
        }
        passages
    }

    fn passage(
        &self,
        duration: &BigRational,
        (from, to): (usize, usize),
        (at_start, at_end): (bool, bool),
    ) -> Option<Passage> {
        // No event begins phase 0.
        if at_start && from == 0 || at_end && to == 0 {
            return None;
        }
        // The range of start times, as restricted by the phases of start and end.
        let mut range = Range { low: (BigRational::zero(), false), high: None };
        if from > 0 {
            range.begin(self.time(from), at_start);
        }
        if to > 0 {
            range.begin(&(self.time(to) - duration), at_end);
        }
        for end in self.over(from).cloned().into_iter().chain(self.over(to).map(|time| time - duration)) {
            range.before((end, true));
        }
        let end = (&range.low.0 + duration, range.low.1);
        (!range.is_empty()).then_some(Passage { from, to, at_start, at_end, latest: range.high, end })
    }

    /// Returns the greatest fraction 1/n that divides the times of all events and the given durations.
    pub(super) fn unit<'d>(&'d self, durations: impl Iterator<Item = &'d BigRational>) -> BigRational {
        let times = self.events.iter().map(|event| &event.time);
        let common = times.chain(durations).fold(BigInt::one(), |common, time| common.lcm(time.denom()));
        BigRational::new(BigInt::one(), common)
    }
}

struct Range {
    low: End,
    high: Option<End>,
}

impl Range {
    /// Restricts the range to times after `time` or, if `at`, to `time` alone.
    fn begin(&mut self, time: &BigRational, at: bool) {
        self.low = self.low.clone().max((time.clone(), !at));
        if at {
            self.before((time.clone(), false));
        }
    }

    fn before(&mut self, (time, left_out): End) {
        let is_earlier = |(own, own_left_out): &End| (&time, !left_out) < (own, !own_left_out);
        if self.high.as_ref().is_none_or(is_earlier) {
            self.high = Some((time, left_out));
        }
    }

    fn is_empty(&self) -> bool {
        self.high
            .as_ref()
            .is_some_and(|high| self.low.0 > high.0 || self.low.0 == high.0 && (self.low.1 || high.1))
    }
}

impl Passage {
    pub(super) fn wait(phase: usize, time: &BigRational) -> Self {
        let end = (time.clone(), false);
        Self { from: phase, to: phase, at_start: false, at_end: false, latest: None, end }
    }

    /// Returns the condition on phase and clock before an action with this passage: the phase
    /// matches, and the clock is between 0 and the latest start time. Without events, the condition
    /// is true.
    pub(super) fn condition(&self, timeline: &Timeline) -> Formula {
        if timeline.is_empty() {
            return Formula::truth(true);
        }
        let conditions =
            [Formula::Atom(phase(self.from), true), Formula::Compare(Linear::fluent(clock()), false)];
        let limit = self.latest.as_ref().map(|(time, left_out)| {
            let slack = Linear::constant(time.clone()).minus(&Linear::fluent(clock()));
            Formula::Compare(slack, *left_out)
        });
        Formula::junction(conditions.into_iter().chain(limit), true)
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "phases are counted from 0, and each but the first one begins with an event"
    )]
    pub(super) fn at_start<'t>(&self, timeline: &'t Timeline) -> Option<&'t Event> {
        self.at_start.then(|| &timeline.events[self.from - 1])
    }

    /// Returns the events strictly between start and end of the action.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "phases are counted from 0, and each but the first one begins with an event"
    )]
    pub(super) fn between<'t>(&self, timeline: &'t Timeline) -> &'t [Event] {
        &timeline.events[self.from..self.to - usize::from(self.at_end && self.to > self.from)]
    }

    /// Returns the event that coincides with the end of the action. `None` if there is no such event, or if the
    /// start is in the same phase.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "phases are counted from 0, and each but the first one begins with an event"
    )]
    pub(super) fn at_end<'t>(&self, timeline: &'t Timeline) -> Option<&'t Event> {
        (self.at_end && self.to > self.from).then(|| &timeline.events[self.to - 1])
    }

    pub(super) fn truths(&self, timeline: &Timeline) -> Truths {
        if timeline.is_empty() {
            return Truths::new();
        }
        let mut truths = Truths::from([(phase(self.from), false), (waited(), false)]);
        truths.insert(phase(self.to), true);
        truths
    }
}

/// Returns `true` if the clock value `set` represents every time in a range with this lower end (see the head
/// of this file).
pub(super) fn stands_for(set: &BigRational, (end, left_out): &End, unit: &BigRational) -> bool {
    let mark = (set / unit).floor() * unit;
    if set.is_negative() {
        return false;
    }
    if mark == *set { *end >= mark } else { *end > mark || *end == mark && *left_out }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quarters(count: i64) -> BigRational {
        BigRational::new(count.into(), 4.into())
    }

    #[test]
    fn passages_partition_the_start_times() {
        for (events, duration) in [
            (&[][..], 3),
            (&[0], 4),
            (&[4], 0),
            (&[4, 12], 8),
            (&[4, 12], 3),
            (&[0, 4, 8, 13], 4),
            (&[1, 2, 3], 30),
        ] {
            let mut timeline = Timeline::default();
            for time in events {
                timeline.add(&quarters(*time), phase(0), true);
            }
            let passages = timeline.passages(&quarters(duration));
            for at in 0..60 {
                let (start, end) = (quarters(at), quarters(at + duration));
                let holds = |own: &&Passage| {
                    let earliest = &own.end.0 - quarters(duration);
                    let late_enough = earliest < start || earliest == start && !own.end.1;
                    let limit = own.latest.as_ref();
                    late_enough && limit.is_none_or(|(time, out)| start < *time || start == *time && !out)
                };
                let matching: Vec<&Passage> = passages.iter().filter(holds).collect();
                let before = |time: i64| events.iter().filter(|event| **event <= time).count();
                let expected = (
                    before(at),
                    before(at + duration),
                    events.contains(&at),
                    events.contains(&(at + duration)),
                );
                let actual: Vec<_> = matching
                    .iter()
                    .map(|actual| (actual.from, actual.to, actual.at_start, actual.at_end))
                    .collect();
                assert_eq!(actual, [expected], "{events:?} {duration}: {start} to {end}");
            }
        }
    }

    #[test]
    fn a_clock_represents_times_from_its_mark_on() {
        let unit = quarters(2);
        for (set, end, expected) in [
            (4, (4, false), true),
            (4, (4, true), true),
            (5, (4, false), false),
            (5, (4, true), true),
            (5, (5, false), true),
            (6, (5, true), false),
            (-1, (4, true), false),
        ] {
            let (end, left_out) = end;
            assert_eq!(
                stands_for(&quarters(set), &(quarters(end), left_out), &unit),
                expected,
                "{set} {end}"
            );
        }
    }
}
