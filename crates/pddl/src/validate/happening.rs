//! Happenings: the start or the end of an action, both at once, or timed initial literals; see the [definition](super).

use num_rational::BigRational;
use num_traits::Zero;

use crate::ast::{ConditionTime, EffectTime};

use super::derive::close;
use super::effects::{Changes, Ground};
use super::execute::Execution;
use super::interference::Footprint;
use super::running::{Running, is_durative};
use super::step::Step;
use super::verdict::{Violation, ViolationKind};
use crate::number::show_number;

/// The part of an action that happens at one time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Start,
    End,
    /// An instantaneous action, or one that takes no time.
    Whole,
}

/// What happens at one time: what it changes, and what it reads and writes.
#[derive(Debug, Default)]
pub(super) struct Happening {
    pub(super) changes: Changes,
    pub(super) footprint: Footprint,
}

impl Running<'_, '_> {
    /// The part of this action that happens first.
    pub(super) fn first_part(&self) -> Part {
        if is_durative(&self.instance) && !self.duration.is_zero() { Part::Start } else { Part::Whole }
    }
}

impl<'e, 'p> Execution<'e, 'p> {
    /// A part of an action in the present state. The conditions at its start have been checked.
    pub(super) fn happening(
        &self,
        running: &Running<'e, 'p>,
        part: Part,
        time: &BigRational,
    ) -> Result<Happening, Box<Violation>> {
        let half = |when: EffectTime| {
            let changes = self.changes(running, when, time)?;
            let footprint = Footprint::of(self.world, running, when, &changes);
            Ok(Happening { changes, footprint })
        };
        if part == Part::Start || !is_durative(&running.instance) {
            return half(EffectTime::AtStart);
        }
        self.check(running, ConditionTime::AtEnd, time)?;
        let end = half(EffectTime::AtEnd)?;
        if part == Part::End {
            return Ok(end);
        }
        let mut start = half(EffectTime::AtStart)?;
        if let Some((symbol, arguments)) = start.footprint.interferes(&end.footprint) {
            let message = format!(
                "it takes no time, so its start and its end are one happening, and they interfere at {}",
                self.world.show(symbol, &arguments)
            );
            return Err(running.step.violation(time, ViolationKind::Interference, message));
        }
        let merged = start.changes.merge(end.changes);
        merged.map_err(|error| self.effect_violation(running.step, time, &error))?;
        start.footprint.join(end.footprint);
        Ok(start)
    }

    /// Lets all events before a time take place, or up to and including it.
    pub(super) fn pass(&mut self, time: &BigRational, inclusive: bool) {
        let is_due = |next: &BigRational| next < time || (inclusive && next == time);
        while self.next_timed().is_some_and(is_due) {
            self.apply_next_timed();
        }
    }

    /// Lets the events of the next time take place.
    pub(super) fn apply_next_timed(&mut self) {
        if let Some((time, event)) = self.take_next_timed() {
            self.apply_events(event.changes);
            self.record.note(&time, &self.state, true);
            self.last_event = Some((time, event.footprint));
        }
    }

    /// Lets events take place.
    pub(super) fn apply_events(&mut self, changes: Changes) {
        let concerns_axioms = changes.concern(&self.world.read_by_axioms);
        changes.apply_facts(&mut self.state);
        if concerns_axioms {
            close(self.world, &mut self.state);
        }
    }

    /// Takes the events of the next time out of those to come.
    pub(super) fn take_next_timed(&mut self) -> Option<(BigRational, Happening)> {
        let time = self.next_timed()?.clone();
        let mut changes = Changes::default();
        while self.next_timed() == Some(&time) {
            let (_, atom, holds) = self.pending.pop()?;
            let (there, gone) = if holds {
                (&mut changes.added, &mut changes.deleted)
            } else {
                (&mut changes.deleted, &mut changes.added)
            };
            gone.remove(&atom);
            there.insert(atom);
        }
        let footprint = Footprint::of_event(&changes);
        Some((time, Happening { changes, footprint }))
    }

    /// Executes a part of an action in sequence, with the events of its time, which must not interfere with it.
    pub(super) fn execute(
        &mut self,
        running: &Running<'e, 'p>,
        part: Part,
        time: &BigRational,
    ) -> Result<(), Box<Violation>> {
        let happening = self.happening(running, part, time)?;
        self.pass(time, true);
        let now = self.last_event.as_ref().filter(|(event, _)| event == time);
        if let Some(touched) = now.and_then(|(_, event)| happening.footprint.interferes(event)) {
            return Err(self.disturbed(running.step, time, time, &touched));
        }
        self.apply(running.step, time, happening.changes)?;
        self.record.note(time, &self.state, false);
        Ok(())
    }

    /// An action at one time, and an event at another one, that interfere.
    pub(super) fn disturbed(
        &self,
        step: &Step<'p>,
        time: &BigRational,
        event: &BigRational,
        (symbol, arguments): &Ground,
    ) -> Box<Violation> {
        let touched = self.world.show(*symbol, arguments);
        let gap = if time < event { event - time } else { time - event };
        let (event, gap) = (show_number(event), show_number(&gap));
        let message = format!(
            "it interferes with the timed initial literals of time {event} at {touched}, {gap} apart"
        );
        step.violation(time, ViolationKind::Interference, message)
    }
}
