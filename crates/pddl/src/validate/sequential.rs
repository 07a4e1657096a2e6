//! Sequential execution of actions, in the order of their start times or, if a start time is missing, of the
//! plan's text.

use num_rational::BigRational;
use num_traits::Zero;

use crate::ast::ConditionTime;

use super::execute::Execution;
use super::happening::Part;
use super::running::Running;
use super::step::Step;
use super::verdict::{Violation, ViolationKind};
use crate::number::show_number;

/// Executes the steps one after another until the first violation or until the budget is spent. Sums their
/// durations in `total_time`. Applies all events (timed initial literals) up to the end of the last step.
pub(super) fn run<'e, 'p>(
    execution: &mut Execution<'e, 'p>,
    steps: &'e [Step<'p>],
    total_time: &mut BigRational,
) -> Result<(), Box<Violation>> {
    let is_timed = steps.iter().all(|step| step.text.start.is_some());
    let mut order: Vec<_> = steps.iter().collect();
    // If a start time is missing, the order of the text counts.
    if is_timed {
        order.sort_by(|left, right| left.text.start.cmp(&right.text.start));
    }
    let mut clock = BigRational::zero();
    for step in order {
        if execution.world.budget.poll() {
            break;
        }
        let stated = step.text.start.as_ref().filter(|_| is_timed).unwrap_or(&clock);
        check_start(execution, step, stated, &clock)?;
        // A step that starts too early within the tolerance is delayed.
        let time = stated.max(&clock).clone();
        // Events at this time are applied with the start, which must not interfere with them.
        execution.apply_events_until(&time, false);
        let running = execution.begin(step, &time)?;
        let part = running.first_part();
        execution.record_preferences(&running, ConditionTime::AtStart, &time)?;
        if part == Part::Whole {
            execution.record_preferences(&running, ConditionTime::AtEnd, &time)?;
        }
        execution.execute(&running, part, &time)?;
        if part == Part::Start {
            finish(execution, &running)?;
        }
        *total_time += &running.duration;
        clock = running.end;
    }
    execution.apply_events_until(&clock, true);
    Ok(())
}

/// Applies the events (timed initial literals) before the end of an action, then executes the end. Checks the
/// over-all conditions in each state in between.
fn finish<'e, 'p>(
    execution: &mut Execution<'e, 'p>,
    running: &Running<'e, 'p>,
) -> Result<(), Box<Violation>> {
    execution.check(running, ConditionTime::OverAll, &running.start)?;
    while let Some(next) = execution.next_timed().filter(|next| **next < running.end).cloned() {
        execution.apply_next_timed();
        execution.check(running, ConditionTime::OverAll, &next)?;
    }
    execution.record_preferences(running, ConditionTime::AtEnd, &running.end)?;
    execution.execute(running, Part::End, &running.end)
}

fn check_start(
    execution: &Execution<'_, '_>,
    step: &Step<'_>,
    time: &BigRational,
    clock: &BigRational,
) -> Result<(), Box<Violation>> {
    if time + &execution.options.tolerance >= *clock {
        return Ok(());
    }
    let (time_text, clock_text) = (show_number(time), show_number(clock));
    let message = format!(
        "it starts at {time_text}, before the step before it ends at {clock_text}; actions are executed one after another"
    );
    Err(step.violation(time, ViolationKind::Overlap, message))
}
