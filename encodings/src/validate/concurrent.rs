//! Overlapping actions, by the rules of PDDL 2.1: what happens at one time reads the state before it, and
//! happenings that interfere lie apart.

use num_rational::BigRational;
use num_traits::Signed;

use crate::pddl::ast::{ConditionTime, EffectTime};

use super::effects::Changes;
use super::execute::{Execution, Running, is_durative};
use super::interference::Footprint;
use super::step::Step;
use super::verdict::{Violation, ViolationKind};

/// The start or the end of a step that lies less than the separation back.
struct Recent<'e, 'p> {
    step: &'e Step<'p>,
    time: BigRational,
    footprint: Footprint,
}

/// Executes the steps at their times; `total_time` becomes the end of the last one.
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
        let Some(time) = next_start.into_iter().chain(next_end).min().cloned() else { return Ok(()) };
        // Timed initial literals come before whatever happens at their time.
        if let Some(timed) = execution.next_timed().filter(|timed| **timed <= time).cloned() {
            execution.apply_next_timed();
            check_running(execution, &running, &timed)?;
            continue;
        }
        let mut happening = Happening::default();
        while let Some((_, step)) = starts.pop_if(|(start, _)| *start == time) {
            let started = execution.begin(step, &time)?;
            happening.add(execution, &started, EffectTime::AtStart, &time)?;
            if is_durative(&started.instance) && started.end > time {
                running.push(started);
            } else if is_durative(&started.instance) {
                execution.check(&started, ConditionTime::AtEnd, &time)?;
                happening.add(execution, &started, EffectTime::AtEnd, &time)?;
            }
        }
        let (ending, going_on): (Vec<_>, Vec<_>) =
            running.into_iter().partition(|running| running.end == time);
        running = going_on;
        for ended in &ending {
            execution.check(ended, ConditionTime::AtEnd, &time)?;
            happening.add(execution, ended, EffectTime::AtEnd, &time)?;
        }
        *total_time = time.clone().max(total_time.clone());
        happening.keep_apart(execution, &time, &mut recent)?;
        happening.apply(execution, &time)?;
        check_running(execution, &running, &time)?;
    }
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

fn check_running<'e, 'p>(
    execution: &Execution<'e, 'p>,
    running: &[Running<'e, 'p>],
    time: &BigRational,
) -> Result<(), Box<Violation>> {
    running.iter().try_for_each(|running| execution.check(running, ConditionTime::OverAll, time))
}

/// All that happens at one time.
#[derive(Default)]
struct Happening<'e, 'p> {
    parts: Vec<(&'e Step<'p>, Changes, Footprint)>,
}

impl<'e, 'p> Happening<'e, 'p> {
    fn add(
        &mut self,
        execution: &Execution<'e, 'p>,
        running: &Running<'e, 'p>,
        when: EffectTime,
        time: &BigRational,
    ) -> Result<(), Box<Violation>> {
        let changes = execution.changes(running, when, time)?;
        let footprint = Footprint::of(execution.world, running, when, &changes);
        self.parts.push((running.step, changes, footprint));
        Ok(())
    }

    /// Checks that nothing here interferes with each other or with what happened just before.
    fn keep_apart(
        &mut self,
        execution: &Execution<'e, 'p>,
        time: &BigRational,
        recent: &mut Vec<Recent<'e, 'p>>,
    ) -> Result<(), Box<Violation>> {
        recent.retain(|earlier| &earlier.time + &execution.options.tolerance > *time);
        for (step, _, footprint) in &mut self.parts {
            for earlier in recent.iter().filter(|earlier| earlier.step.number != step.number) {
                if let Some((symbol, arguments)) = footprint.interferes(&earlier.footprint) {
                    let touched = execution.world.show(symbol, &arguments);
                    let gap = super::show_number(&(time - &earlier.time));
                    let other = earlier.step.show();
                    let message = format!(
                        "it interferes with step {} {other} at {touched}, {gap} apart",
                        earlier.step.number
                    );
                    return Err(step.violation(time, ViolationKind::Interference, message));
                }
            }
            recent.push(Recent { step, time: time.clone(), footprint: std::mem::take(footprint) });
        }
        Ok(())
    }

    fn apply(self, execution: &mut Execution<'e, 'p>, time: &BigRational) -> Result<(), Box<Violation>> {
        let mut all = Changes::default();
        let mut last = None;
        for (step, changes, _) in self.parts {
            all.merge(changes).map_err(|error| execution.effect_violation(step, time, &error))?;
            last = Some(step);
        }
        last.map_or(Ok(()), |step| execution.apply(step, time, all))
    }
}
