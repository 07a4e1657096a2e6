//! Timeline windows: the possible phases of an action's start and end relative to the timed events, and the
//! conditions under which events interfere (see `timeline` for the semantics).

use num_traits::One;

use crate::ground::evaluate::reads::{Reads, matches};
use crate::ground::instantiate::change::GroundChange;
use crate::ground::instantiate::simultaneous_effects::SimultaneousEffects;
use crate::ground::instantiate::timeline::Timeline;
use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::partial_eval::{Residual, constant_comparison};
use crate::ground::vocabulary::world::World;
use crate::lifted::Rational;
use crate::task::quantity::{Linear, NumericId, Quantity};
use crate::task::timing::Timing;

#[derive(Debug, Clone, Copy)]
pub(super) struct TimelineWindow<'t> {
    timeline: &'t Timeline,
    duration: &'t Quantity<Rational>,
    /// Phases of the start (`from`) and of the end (`to`). A phase is the number of events before or at this time.
    from: usize,
    to: usize,
    start: Start,
    end: End,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Start {
    /// At the end of the previous action or wait, possibly at the time of an event.
    Free,
    /// At the end of the previous action or wait, but later than the event that begins the phase.
    Later,
    /// A moment (a very short time) after the event that begins the phase.
    AfterEvent,
    /// At the required time of the end minus the duration. The required time is exactly at an event, or one moment (a
    /// very short time) after it.
    ByEnd,
    /// Like [`Start::ByEnd`], but later than the event that begins the phase of the start.
    LaterByEnd,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    /// Later than the event that begins the phase, or in the phase of the start.
    Inside,
    /// Exactly at the time of the event that begins the phase.
    AtEvent,
}

impl<'t> TimelineWindow<'t> {
    /// Returns the windows that are possible for an action of this duration, each with its interference conditions.
    /// Windows with unconditional interference are omitted.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions of phases, of which there is one more than events; there is one before an end at or after an event"
    )]
    pub(super) fn all(
        timeline: &'t Timeline,
        duration: &'t Quantity<Rational>,
        conflicts: &Conflicts,
    ) -> Vec<(Self, Interference)> {
        let extreme = |pick: fn(std::slice::Iter<'t, Rational>) -> Option<&'t Rational>| {
            let extremes = duration.tables.iter().filter_map(|table| pick(table.values.iter()));
            extremes.fold(duration.constant.clone(), |sum, value| sum + value)
        };
        let (least, most) = (extreme(Iterator::min), extreme(Iterator::max));
        let mut windows = Vec::new();
        for from in timeline.first..timeline.phases.len() {
            let before = from.checked_sub(1);
            let own: &[Residual] = before.map_or(&[], |event| &conflicts.start[event]);
            // The action starts at or after event `before`, so it ends in this phase or later.
            let earliest = before.map_or(least.clone(), |event| least.clone() + &timeline.events[event].0);
            let first = from + timeline.events[from..].partition_point(|(time, _)| *time <= earliest);
            for to in first..timeline.phases.len() {
                let apart = |later: usize, earlier: usize| {
                    timeline.events[later].0.clone() - &timeline.events[earlier].0
                };
                // The action starts before event `from`, which ends the phase of its start. It ends at or after event
                // `to - 1`, which begins the phase `to`. If the longest duration does not reach event `to - 1`, no
                // later phase is reached either.
                if to > from && most <= apart(to - 1, from) {
                    break;
                }
                let mut add = |start, end| {
                    let passage = Self { timeline, duration, from, to, start, end };
                    let at_event = matches!(start, Start::Free | Start::ByEnd);
                    let start = if at_event { own.to_vec() } else { Vec::new() };
                    let end = if end == End::AtEvent { conflicts.end[to - 1].clone() } else { Vec::new() };
                    if !start.contains(&Residual::True) && !end.contains(&Residual::True) {
                        windows.push((passage, Interference { start, end }));
                    }
                };
                if own.is_empty() || from < timeline.events.len() {
                    add(Start::Free, End::Inside);
                }
                if !own.is_empty() {
                    add(Start::AfterEvent, End::Inside);
                    if from < timeline.events.len() {
                        add(Start::Later, End::Inside);
                    }
                }
                if to > from {
                    // An action that ends one moment after an event never starts exactly at an event, because
                    // times composed of events and durations differ by at least two moments. So a single
                    // window suffices.
                    add(if own.is_empty() { Start::ByEnd } else { Start::LaterByEnd }, End::Inside);
                    add(Start::ByEnd, End::AtEvent);
                    if !own.is_empty() {
                        add(Start::LaterByEnd, End::AtEvent);
                    }
                }
            }
        }
        windows
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions of phases, of which there is one more than events; there is one before an end at or after an event"
    )]
    fn start(&self) -> Linear<Rational> {
        let events = &self.timeline.events;
        match self.start {
            Start::Free | Start::Later => Linear::variable(self.timeline.clock),
            Start::AfterEvent => self.later(&events[self.from - 1].0),
            Start::ByEnd | Start::LaterByEnd => {
                let mut start = match self.end {
                    End::Inside => self.later(&events[self.to - 1].0),
                    End::AtEvent => Linear::constant(events[self.to - 1].0.clone()),
                };
                let mut duration = self.duration.clone();
                duration.scale(&-Rational::one());
                start.quantity.add(&duration);
                start
            }
        }
    }

    fn later(&self, time: &Rational) -> Linear<Rational> {
        let mut later = Linear::variable(self.timeline.moment);
        later.quantity.constant = time.clone();
        later
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions of phases, of which there is one more than events; there is one before an end at or after an event"
    )]
    pub(super) fn conditions(&self) -> Vec<Residual> {
        let Timeline { clock, phases, events, .. } = self.timeline;
        let mut conditions = vec![Residual::Literal { atom: phases[self.from], positive: true }];
        let start = self.start();
        let mut end = start.clone();
        end.quantity.add(self.duration);
        let mut require_order = |earlier: &Linear<Rational>, mut later: Linear<Rational>, strict: bool| {
            later.add(&earlier.clone().negated());
            conditions.push(
                constant_comparison(&later, strict).unwrap_or(Residual::Compare { linear: later, strict }),
            );
        };
        let time = |event: usize| Linear::constant(events[event].0.clone());
        if self.from < events.len() {
            // After the last event, every start can be delayed, so no order is required.
            if !matches!(self.start, Start::Free | Start::Later) {
                require_order(&Linear::variable(*clock), start.clone(), false);
            }
            require_order(&start, time(self.from), true);
            if matches!(self.start, Start::Later | Start::LaterByEnd) {
                require_order(&time(self.from - 1), start.clone(), true);
            }
        }
        if self.to > self.from && self.end == End::Inside {
            require_order(&time(self.to - 1), end.clone(), true);
        }
        if self.to < events.len() {
            require_order(&end, time(self.to), true);
        }
        conditions
    }

    /// Returns the changes of each event after the start and strictly before the end, in order.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions of phases, of which there is one more than events; there is one before an end at or after an event"
    )]
    pub(super) fn events(&self) -> impl Iterator<Item = &'t [(AtomId, bool)]> + use<'t> {
        let last = if self.end == End::AtEvent { self.to - 1 } else { self.to };
        self.timeline.events[self.from..last].iter().map(|(_, changes)| &changes[..])
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions of phases, of which there is one more than events; there is one before an end at or after an event"
    )]
    pub(super) fn event_at_end(&self) -> Option<&'t [(AtomId, bool)]> {
        (self.end == End::AtEvent).then(|| &self.timeline.events[self.to - 1].1[..])
    }

    pub(super) fn changes(&self) -> Vec<(AtomId, bool)> {
        let phases = &self.timeline.phases;
        let mut changes = vec![(self.timeline.waited, false)];
        if self.from != self.to {
            changes.extend([(phases[self.from], false), (phases[self.to], true)]);
        }
        changes
    }

    /// Returns the clock variable and its value after the action, or `None` if the clock does not change. The
    /// clock stops at the last event, so that it has finitely many values.
    pub(super) fn clock(&self) -> Option<(NumericId, Linear<Rational>)> {
        let Timeline { clock, events, .. } = self.timeline;
        if self.from == events.len() {
            return None;
        }
        if self.to == events.len() {
            return events.last().map(|(last, _)| (*clock, Linear::constant(last.clone())));
        }
        let mut end = self.start();
        end.quantity.add(self.duration);
        Some((*clock, end))
    }

    /// Returns lower bounds on the times of the start and of the end, where an event implies them. If the flag is
    /// `true`, the bound is one moment (a very short time) after the given time.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions of phases, of which there is one more than events; there is one before an end at or after an event"
    )]
    pub(super) fn timing(&self) -> Timing<(Rational, bool)> {
        let events = &self.timeline.events;
        let by_end = matches!(self.start, Start::ByEnd | Start::LaterByEnd);
        Timing {
            start: (self.start == Start::AfterEvent).then(|| (events[self.from - 1].0.clone(), true)),
            end: by_end.then(|| (events[self.to - 1].0.clone(), self.end == End::Inside)),
        }
    }
}

/// For each event, the conditions under which the start or the end of an instance interferes with the event.
/// [`Residual::True`] represents unconditional interference.
pub(super) struct Conflicts {
    start: Vec<Vec<Residual>>,
    end: Vec<Vec<Residual>>,
}

impl Conflicts {
    pub(super) fn new(
        world: &World<'_>,
        timeline: &Timeline,
        (start, at_start): (&Reads, &SimultaneousEffects),
        (end, at_end): (&Reads, &SimultaneousEffects),
    ) -> Self {
        let per_event = |reads: &Reads, moment: &SimultaneousEffects| {
            let events = timeline.events.iter();
            events.map(|(_, changes)| interference(world, changes, reads, moment)).collect()
        };
        Self { start: per_event(start, at_start), end: per_event(end, at_end) }
    }
}

fn interference(
    world: &World<'_>,
    event: &[(AtomId, bool)],
    reads: &Reads,
    moment: &SimultaneousEffects,
) -> Vec<Residual> {
    let is_read = |(atom, _): &(AtomId, bool)| {
        let (predicate, arguments) = world.atom_key(*atom);
        reads.atoms.iter().any(|pattern| matches(pattern, predicate, arguments))
    };
    if event.iter().any(is_read) {
        return vec![Residual::True];
    }
    let opposite = |change: &GroundChange| match change {
        GroundChange::Atom(atom, holds) => event.contains(&(*atom, !holds)),
        GroundChange::Number { .. } => false,
    };
    let changes = moment.changes.iter().filter(|(_, change)| opposite(change));
    changes.map(|(condition, _)| condition.clone()).collect()
}

/// Conditions under which the start or the end of a window interferes with the event at its time. All must be
/// false in the state before the start or the end; the lists are empty if there is no such event.
pub(super) struct Interference {
    pub(super) start: Vec<Residual>,
    pub(super) end: Vec<Residual>,
}
