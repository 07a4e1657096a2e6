//! Converts a goal sequence of happenings to a plan: optimal durations first, then the earliest
//! times.

use num_traits::One;
use pddl::to_decimal;
use task::limits::{Interrupted, Limits};
use task::number::Rational;
use task::plan::{Plan, Step};

use crate::concurrent::flexible_durations::affine::Affine;
use crate::concurrent::flexible_durations::linear_program::Program;
use crate::concurrent::flexible_durations::partial_plan_lp::{Course, MAKESPAN, duration_of};
use crate::concurrent::happening::Role;
use crate::concurrent::temporal_task::TemporalTask;

#[derive(Debug, Clone)]
pub(super) struct Answer {
    /// Metric value in the integer scale of [`crate::concurrent::measure::Measure`].
    pub(super) value: Rational,
    /// Optimal metric value of the same sequence if durations need not be decimals.
    pub(super) least: Rational,
    pub(super) plan: Plan,
}

/// Returns the best plan of a sequence, or `None` if no times and durations reach the goal.
///
/// Minimises, in this order: metric, makespan, sum of durations, sum of the times of all happenings.
/// A metric without a minimum is skipped. Durations that are no decimals are then rounded to decimals if [`rounded`]
/// succeeds before a limit, even if that increases the metric slightly.
pub(super) fn answer(
    concurrent: &TemporalTask,
    course: &Course,
    search_limits: &Limits,
) -> Result<Option<Answer>, Interrupted> {
    let Some(goal) = course.goal(concurrent) else { return Ok(None) };
    let mut program = course.program.clone();
    if !program.constrain(&goal, search_limits)? {
        return Ok(None);
    }
    // There is a plan, which is not lost if a limit is reached meanwhile.
    let limits = &search_limits.extended();
    let value = course.value_of_plan(concurrent);
    let durations: Vec<Affine> =
        course.chosen(concurrent).map(|position| Affine::column(duration_of(position))).collect();
    let exact = best(&program, &[&value, &Affine::column(MAKESPAN), &sum(&durations)], limits)?;
    let least = exact.value(&value);
    let fixed = fix(&exact, &durations, limits)?;
    let is_decimal = durations.iter().all(|duration| is_decimal(concurrent, &exact.value(duration)));
    // Rounding solves several linear programs for each duration, so an interruption ends it.
    let rounded = if is_decimal {
        None
    } else {
        let limits = search_limits.extended_until_interrupted();
        rounded(concurrent, &program, (&value, &durations), &limits).unwrap_or(None)
    };
    let times: Vec<Affine> = course.passed.iter().map(|passed| passed.time.clone()).collect();
    let program = best(&rounded.unwrap_or(fixed), &[&Affine::column(MAKESPAN), &sum(&times)], limits)?;
    let at = |expression: &Affine| program.value(expression);
    let value = at(&value);
    Ok(Some(Answer { plan: in_names(concurrent, course, &value, &at), value, least }))
}

fn sum(expressions: &[Affine]) -> Affine {
    expressions.iter().fold(Affine::default(), |sum, expression| sum.plus(expression, &Rational::one()))
}

/// Optimises several objectives lexicographically, the most important first. An objective without a
/// minimum is skipped. Returns the program, constrained to the optimum of each objective.
fn best(program: &Program, objectives: &[&Affine], limits: &Limits) -> Result<Program, Interrupted> {
    let mut best = program.clone();
    for objective in objectives {
        let mut next = best.clone();
        if next.minimise(objective, limits)? {
            let slack = Affine::constant(next.least().clone()).minus(objective);
            if next.constrain([&slack], limits)? {
                best = next;
            }
        }
    }
    Ok(best)
}

fn fix(program: &Program, durations: &[Affine], limits: &Limits) -> Result<Program, Interrupted> {
    let mut fixed = program.clone();
    for duration in durations {
        let value = Affine::constant(program.value(duration));
        let is_feasible = fixed.constrain(&[value.minus(duration), duration.minus(&value)], limits)?;
        debug_assert!(is_feasible, "an optimum has values");
    }
    Ok(fixed)
}

/// Returns `true` if a time, converted to PDDL time units, has a finite decimal expansion.
fn is_decimal(concurrent: &TemporalTask, time: &Rational) -> bool {
    let unit = Rational::from_integer(concurrent.unit);
    to_decimal(&(time.clone() / unit).to_big()).is_some()
}

/// Rounds the durations to decimals one after another. Each duration becomes the neighbouring
/// multiple of [`grain`] that is feasible and gives the better metric; a duration that is already a
/// decimal is kept. Earlier roundings are not revised. Returns `None` if neither neighbour of some
/// duration is feasible or the granularity overflows.
fn rounded(
    concurrent: &TemporalTask,
    program: &Program,
    (value, durations): (&Affine, &[Affine]),
    limits: &Limits,
) -> Result<Option<Program>, Interrupted> {
    let Some(grain) = grain(concurrent) else { return Ok(None) };
    let mut rounded = program.clone();
    for duration in durations {
        let exact = best(&rounded, &[value, &Affine::column(MAKESPAN)], limits)?.value(duration);
        let low = Rational::from_big((exact.clone() / grain.clone()).to_big().floor()) * &grain;
        let near = if is_decimal(concurrent, &exact) { vec![exact] } else { vec![low.clone() + &grain, low] };
        let mut feasible: Option<(Rational, Program)> = None;
        for candidate in near {
            let candidate = Affine::constant(candidate);
            let mut with = rounded.clone();
            if with.constrain(&[candidate.minus(duration), duration.minus(&candidate)], limits)? {
                let worth = best(&with, &[value], limits)?.value(value);
                if feasible.as_ref().is_none_or(|(least, _)| worth < *least) {
                    feasible = Some((worth, with));
                }
            }
        }
        let Some((_, with)) = feasible else { return Ok(None) };
        rounded = with;
    }
    Ok(Some(rounded))
}

/// Granularity of rounded durations, in internal time units: the greatest 10^-n PDDL time units (n
/// ≥ 0) that is at most a thousandth of the separation. `None` on overflow.
fn grain(concurrent: &TemporalTask) -> Option<Rational> {
    let unit = Rational::from_integer(concurrent.unit);
    let limit = Rational::from_integer(concurrent.separation) / Rational::from_integer(1000);
    let powers = std::iter::successors(Some(1_i128), |power| power.checked_mul(10));
    let mut grains = powers.map(|power| unit.clone() / Rational::from_integer(power));
    grains.find(|grain| *grain <= limit)
}

fn in_names(
    concurrent: &TemporalTask,
    course: &Course,
    value: &Rational,
    at: &dyn Fn(&Affine) -> Rational,
) -> Plan {
    let task = &concurrent.task;
    let unit = Rational::from_integer(concurrent.unit);
    let mut steps = Vec::new();
    let mut before = at(&Course::new(concurrent).measured(concurrent));
    // Running actions in the order of their starts: instance and index of the step.
    let mut open: Vec<(u32, usize)> = Vec::new();
    for passed in &course.passed {
        let operator = &task.operators[passed.operator.index()];
        let measured = at(&passed.measured);
        let cost = Rational::from_integer(operator.cost.constant) + &(measured.clone() - &before);
        before = measured;
        let step = (at(&passed.time), passed.operator, at(&passed.duration), cost.clone());
        match concurrent.happenings[passed.operator.index()].role {
            Role::Start(instance) => {
                open.push((instance, steps.len()));
                steps.push(step);
            }
            Role::Whole => steps.push(step),
            Role::End(instance) => {
                let mut runs = (0..open.len()).filter(|position| open[*position].0 == instance);
                if let Some(position) = runs.nth(passed.run as usize) {
                    let (_, start) = open.remove(position);
                    steps[start].3 += cost;
                }
            }
            _ => {}
        }
    }
    steps.sort_by(|a, b| (&a.0, a.1).cmp(&(&b.0, b.1)));
    let steps = steps.into_iter().map(|(start, id, duration, cost)| {
        let cost = if task.objective.maximize { -cost } else { cost };
        let [start, duration] = [start, duration].map(|time| time / unit.clone());
        Step::new(task, &task.operators[id.index()], &[], (start, duration, cost))
    });
    let mut plan = Plan { steps: steps.collect(), cost: concurrent.measure.metric(value) };
    plan.note_reconfigured();
    plan
}
