//! Execution of overlapping actions. Simultaneous happenings are evaluated in the preceding state;
//! interfering happenings must be separated.

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

/// A checked happening that takes place now, or earlier by less than the separation.
struct Recent<'e, 'p> {
    /// Step of the action; `None` for events (timed initial literals).
    step: Option<&'e Step<'p>>,
    time: BigRational,
    footprint: Footprint,
}

/// Executes the steps at their start times until the first violation or until the budget is spent. Sets
/// `total_time` to the time of the last executed start or end, and applies all events (timed initial
/// literals) up to this time.
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
        // The next event (timed initial literal) is handled now if it is not later than the next start or
        // end.
        let time = execution.next_timed().filter(|timed| *timed <= next).unwrap_or(next).clone();
        let mut parts = Simultaneous::default();
        if execution.next_timed() == Some(&time)
            && let Some((_, event)) = execution.take_next_timed()
        {
            parts.happenings.push((None, event));
        }
        let (ending, mut continuing): (Vec<_>, Vec<_>) =
            running.into_iter().partition(|running| running.end == time);
        while let Some((_, step)) = starts.pop_if(|(start, _)| *start == time) {
            let running_action = execution.begin(step, &time)?;
            let part = running_action.first_part();
            execution.record_preferences(&running_action, ConditionTime::AtStart, &time)?;
            if part == Part::Whole {
                execution.record_preferences(&running_action, ConditionTime::AtEnd, &time)?;
            }
            parts.happenings.push((Some(step), execution.happening(&running_action, part, &time)?));
            if part == Part::Start {
                continuing.push(running_action);
            }
            *total_time = time.clone();
        }
        for ending_action in &ending {
            execution.record_preferences(ending_action, ConditionTime::AtEnd, &time)?;
            parts
                .happenings
                .push((Some(ending_action.step), execution.happening(ending_action, Part::End, &time)?));
            *total_time = time.clone();
        }
        running = continuing;
        parts.check_separation(execution, &time, &mut recent)?;
        let is_event = parts.happenings.iter().all(|(step, _)| step.is_none());
        // All happenings were evaluated in the preceding state; their changes are applied only now.
        parts.apply(execution, &time)?;
        execution.record.note(&time, &execution.state, is_event);
        for running in &running {
            // The interval is open. An action that ends now is no longer running; an action that starts now
            // is running.
            execution.check(running, ConditionTime::OverAll, &time)?;
        }
    }
    execution.apply_events_until(total_time, true);
    // Later events no longer change the outcome, but they must respect the separation.
    let safe = &*total_time + &execution.options.tolerance;
    while execution.next_timed().is_some_and(|next| *next < safe)
        && let Some((time, event)) = execution.take_next_timed()
    {
        let mut parts = Simultaneous { happenings: vec![(None, event)] };
        parts.check_separation(execution, &time, &mut recent)?;
    }
    Ok(())
}

/// Returns the steps with their start times, the latest first. A step without a start time, or with a
/// negative one, is a violation.
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

#[derive(Default)]
struct Simultaneous<'e, 'p> {
    happenings: Vec<(Option<&'e Step<'p>>, Happening)>,
}

impl<'e, 'p> Simultaneous<'e, 'p> {
    /// Checks that the happenings interfere neither with each other nor with the `recent` happenings, except
    /// events among themselves and the two happenings of one step. Adds the happenings to `recent`.
    fn check_separation(
        &mut self,
        execution: &Execution<'e, 'p>,
        time: &BigRational,
        recent: &mut Vec<Recent<'e, 'p>>,
    ) -> Result<(), Box<Violation>> {
        // Only happenings within the separation can violate it.
        recent.retain(|earlier| &earlier.time + &execution.options.tolerance > *time);
        for (step, Happening { footprint, .. }) in &mut self.happenings {
            for earlier in recent.iter() {
                if execution.world.budget.is_spent() {
                    return Ok(());
                }
                check_pair(execution, (*step, time, footprint), earlier)?;
            }
            recent.push(Recent { step: *step, time: time.clone(), footprint: std::mem::take(footprint) });
        }
        Ok(())
    }

    fn apply(self, execution: &mut Execution<'e, 'p>, time: &BigRational) -> Result<(), Box<Violation>> {
        let mut merged = Changes::default();
        let mut last = None;
        for (step, Happening { changes, .. }) in self.happenings {
            let Some(step) = step else {
                // Events come first and do not interfere with the other happenings.
                execution.apply_events(changes);
                continue;
            };
            merged.merge(changes).map_err(|error| execution.effect_violation(step, time, &error))?;
            last = Some(step);
        }
        last.map_or(Ok(()), |step| execution.apply(step, time, merged))
    }
}

fn check_pair<'p>(
    execution: &Execution<'_, 'p>,
    (step, time, footprint): (Option<&Step<'p>>, &BigRational, &Footprint),
    earlier: &Recent<'_, 'p>,
) -> Result<(), Box<Violation>> {
    let is_same_step = |earlier_step: &Step<'p>| step.is_some_and(|step| step.number == earlier_step.number);
    if earlier.step.is_some_and(is_same_step) {
        return Ok(());
    }
    let Some(touched) = footprint.interferes(&earlier.footprint) else { return Ok(()) };
    match (step, earlier.step) {
        (Some(step), Some(earlier_step)) => {
            let gap = show_number(&(time - &earlier.time));
            let (number, earlier_step) = (earlier_step.number, earlier_step.show());
            let touched = execution.world.show(touched.0, &touched.1);
            let message =
                format!("it interferes with step {number} {earlier_step} at {touched}, {gap} apart");
            Err(step.violation(time, ViolationKind::Interference, message))
        }
        (Some(step), None) => Err(execution.disturbed(step, time, &earlier.time, &touched)),
        (None, Some(step)) => Err(execution.disturbed(step, &earlier.time, time, &touched)),
        (None, None) => Ok(()),
    }
}
