//! Happenings: the start or the end of an action, both at once, or timed initial literals. See the
//! [definition](super).

use num_rational::BigRational;
use num_traits::Zero;

use crate::ast::{ConditionTime, EffectTime};

use super::derive::derive_facts;
use super::effects::{Changes, Ground};
use super::execute::Execution;
use super::interference::Footprint;
use super::running::{Running, is_durative};
use super::step::Step;
use super::verdict::{Violation, ViolationKind};
use crate::number::show_number;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Start,
    End,
    /// An instantaneous action, or a durative action of duration 0.
    Whole,
}

#[derive(Debug, Default)]
pub(super) struct Happening {
    pub(super) changes: Changes,
    pub(super) footprint: Footprint,
}

impl Running<'_, '_> {
    pub(super) fn first_part(&self) -> Part {
        if is_durative(&self.instance) && !self.duration.is_zero() { Part::Start } else { Part::Whole }
    }
}

impl<'e, 'p> Execution<'e, 'p> {
    /// Computes the changes of a part of an action in the current state. If the part includes the end, checks
    /// the conditions at end; if it is the whole durative action, checks that start and end do not interfere.
    /// The caller must have checked the conditions at start.
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

    pub(super) fn apply_events_until(&mut self, time: &BigRational, inclusive: bool) {
        let is_due = |next: &BigRational| next < time || (inclusive && next == time);
        while self.next_timed().is_some_and(is_due) {
            self.apply_next_timed();
        }
    }

    pub(super) fn apply_next_timed(&mut self) {
        if let Some((time, event)) = self.take_next_timed() {
            self.apply_events(event.changes);
            self.record.note(&time, &self.state, true);
            self.last_event = Some((time, event.footprint));
        }
    }

    pub(super) fn apply_events(&mut self, changes: Changes) {
        let concerns_axioms = changes.concern(&self.world.read_by_axioms);
        changes.apply_facts(&mut self.state);
        if concerns_axioms {
            derive_facts(self.world, &mut self.state);
        }
    }

    /// Removes the pending events of the next event time and returns them as one happening with
    /// this time. `None` if no events are pending.
    pub(super) fn take_next_timed(&mut self) -> Option<(BigRational, Happening)> {
        let time = self.next_timed()?.clone();
        let mut changes = Changes::default();
        while self.next_timed() == Some(&time) {
            let (_, atom, holds) = self.pending.pop()?;
            let (target, opposite) = if holds {
                (&mut changes.added, &mut changes.deleted)
            } else {
                (&mut changes.deleted, &mut changes.added)
            };
            // A later literal overrides an earlier literal about the same atom and time.
            opposite.remove(&atom);
            target.insert(atom);
        }
        let footprint = Footprint::of_event(&changes);
        Some((time, Happening { changes, footprint }))
    }

    /// Executes a part of an action in sequential execution. Evaluates the part in the current
    /// state, applies the pending events up to `time`, and then the changes of the part. Events at
    /// `time` must not interfere with the part.
    pub(super) fn execute(
        &mut self,
        running: &Running<'e, 'p>,
        part: Part,
        time: &BigRational,
    ) -> Result<(), Box<Violation>> {
        let happening = self.happening(running, part, time)?;
        self.apply_events_until(time, true);
        let simultaneous = self.last_event.as_ref().filter(|(event, _)| event == time);
        if let Some(touched) = simultaneous.and_then(|(_, event)| happening.footprint.interferes(event)) {
            return Err(self.disturbed(running.step, time, time, &touched));
        }
        self.apply(running.step, time, happening.changes)?;
        self.record.note(time, &self.state, false);
        Ok(())
    }

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
