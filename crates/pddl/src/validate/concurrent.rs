//! Overlapping actions: what happens at one time reads the state before it, and happenings that interfere lie apart.

use num_rational::BigRational;
use num_traits::Signed;

use crate::ast::ConditionTime;

use super::effects::Changes;
use super::execute::Execution;
use super::happening::{Happening, Part};
use super::interference::Footprint;
use super::running::Running;
use super::step::Step;
use super::verdict::{Violation, ViolationKind};
use crate::number::show_number;

/// A happening that lies less than the separation back.
struct Recent<'e, 'p> {
    /// None for events.
    step: Option<&'e Step<'p>>,
    time: BigRational,
    footprint: Footprint,
}

/// Executes the steps at their times; `total_time` becomes the end of the last one. In the end, all events up to it have taken place.
pub(super) fn run<'e, 'p>(
    execution: &mut Execution<'e, 'p>,
    steps: &'e [Step<'p>],
    total_time: &mut BigRational,
) -> Result<(), Box<Violation>> {
    let mut starts = starts(steps, total_time)?;
    let mut running: Vec<Running<'e, 'p>> = Vec::new();
    let mut recent: Vec<Recent<'e, 'p>> = Vec::new();
    loop {
        let next_start = starts.last().map(|(time, _)| time);
        let next_end = running.iter().map(|running| &running.end).min();
        let Some(next) = next_start.into_iter().chain(next_end).min() else { break };
        if execution.world.budget.poll() {
            break;
        }
        let time = execution.next_timed().filter(|timed| *timed <= next).unwrap_or(next).clone();
        let mut parts = Simultaneous::default();
        if execution.next_timed() == Some(&time)
            && let Some((_, event)) = execution.take_next_timed()
        {
            parts.happenings.push((None, event));
        }
        let (ending, mut going_on): (Vec<_>, Vec<_>) =
            running.into_iter().partition(|running| running.end == time);
        while let Some((_, step)) = starts.pop_if(|(start, _)| *start == time) {
            let started = execution.begin(step, &time)?;
            let part = started.first_part();
            execution.prefer(&started, ConditionTime::AtStart, &time)?;
            if part == Part::Whole {
                execution.prefer(&started, ConditionTime::AtEnd, &time)?;
            }
            parts.happenings.push((Some(step), execution.happening(&started, part, &time)?));
            if part == Part::Start {
                going_on.push(started);
            }
            *total_time = time.clone();
        }
        for ended in &ending {
            execution.prefer(ended, ConditionTime::AtEnd, &time)?;
            parts.happenings.push((Some(ended.step), execution.happening(ended, Part::End, &time)?));
            *total_time = time.clone();
        }
        running = going_on;
        parts.keep_apart(execution, &time, &mut recent)?;
        let is_event = parts.happenings.iter().all(|(step, _)| step.is_none());
        parts.apply(execution, &time)?;
        execution.record.note(&time, &execution.state, is_event);
        for running in &running {
            execution.check(running, ConditionTime::OverAll, &time)?;
        }
    }
    execution.pass(total_time, true);
    // Events after the end change nothing any more, but they must not come too soon either.
    let safe = &*total_time + &execution.options.tolerance;
    while execution.next_timed().is_some_and(|next| *next < safe)
        && let Some((time, event)) = execution.take_next_timed()
    {
        let mut parts = Simultaneous { happenings: vec![(None, event)] };
        parts.keep_apart(execution, &time, &mut recent)?;
    }
    Ok(())
}

/// The starts of all steps, the last one first.
fn starts<'e, 'p>(
    steps: &'e [Step<'p>],
    zero: &BigRational,
) -> Result<Vec<(BigRational, &'e Step<'p>)>, Box<Violation>> {
    let mut starts = Vec::new();
    for step in steps {
        match &step.text.start {
            Some(start) if !start.is_negative() => starts.push((start.clone(), step)),
            Some(start) => {
                return Err(step.violation(start, ViolationKind::Duration, "it starts before the plan does"));
            }
            None => {
                let message = "the plan does not say when this starts, which concurrent execution needs";
                return Err(step.violation(zero, ViolationKind::Duration, message));
            }
        }
    }
    starts.sort_by(|left, right| right.0.cmp(&left.0).then(right.1.number.cmp(&left.1.number)));
    Ok(starts)
}

/// All that happens at one time.
#[derive(Default)]
struct Simultaneous<'e, 'p> {
    happenings: Vec<(Option<&'e Step<'p>>, Happening)>,
}

impl<'e, 'p> Simultaneous<'e, 'p> {
    /// Checks that nothing here interferes with each other or with what happened just before.
    fn keep_apart(
        &mut self,
        execution: &Execution<'e, 'p>,
        time: &BigRational,
        recent: &mut Vec<Recent<'e, 'p>>,
    ) -> Result<(), Box<Violation>> {
        recent.retain(|earlier| &earlier.time + &execution.options.tolerance > *time);
        for (step, Happening { footprint, .. }) in &mut self.happenings {
            for earlier in recent.iter() {
                apart(execution, (*step, time, footprint), earlier)?;
            }
            recent.push(Recent { step: *step, time: time.clone(), footprint: std::mem::take(footprint) });
        }
        Ok(())
    }

    fn apply(self, execution: &mut Execution<'e, 'p>, time: &BigRational) -> Result<(), Box<Violation>> {
        let mut all = Changes::default();
        let mut last = None;
        for (step, Happening { changes, .. }) in self.happenings {
            let Some(step) = step else {
                // They come first, and do not interfere with what follows.
                execution.apply_events(changes);
                continue;
            };
            all.merge(changes).map_err(|error| execution.effect_violation(step, time, &error))?;
            last = Some(step);
        }
        last.map_or(Ok(()), |step| execution.apply(step, time, all))
    }
}

/// Whether a happening of another action, or an event, lies far enough back not to disturb one.
fn apart<'p>(
    execution: &Execution<'_, 'p>,
    (step, time, footprint): (Option<&Step<'p>>, &BigRational, &Footprint),
    earlier: &Recent<'_, 'p>,
) -> Result<(), Box<Violation>> {
    let own = |other: &Step<'p>| step.is_some_and(|step| step.number == other.number);
    if earlier.step.is_some_and(own) {
        return Ok(());
    }
    let Some(touched) = footprint.interferes(&earlier.footprint) else { return Ok(()) };
    match (step, earlier.step) {
        (Some(step), Some(other)) => {
            let gap = show_number(&(time - &earlier.time));
            let (number, other) = (other.number, other.show());
            let touched = execution.world.show(touched.0, &touched.1);
            let message = format!("it interferes with step {number} {other} at {touched}, {gap} apart");
            Err(step.violation(time, ViolationKind::Interference, message))
        }
        (Some(step), None) => Err(execution.disturbed(step, time, &earlier.time, &touched)),
        (None, Some(step)) => Err(execution.disturbed(step, &earlier.time, time, &touched)),
        (None, None) => Ok(()),
    }
}
