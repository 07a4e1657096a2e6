//! Plan validator: executes a plan by the definition below, with exact rational numbers.
//!
//! The validator uses neither grounding nor encoding: conditions are evaluated on the syntax tree.
//! Derived predicates are the least fixpoint of their axioms, stratum by stratum (S. Thiébaux, J. Hoffmann,
//! B. Nebel: In defense of PDDL axioms, AIJ 168, 2005).
//!
#![doc = include_str!("definition.md")]

mod advance;
mod axioms;
mod budget;
mod changeable;
mod concurrent;
mod course;
mod derive;
mod effects;
mod evaluate;
mod execute;
mod explain;
mod happening;
mod interference;
mod options;
mod plan;
mod record;
mod relevant;
mod running;
mod sequential;
mod solve;
mod step;
mod targets;
mod trace;
mod trajectory;
mod verdict;
mod world;

use num_rational::BigRational;
use num_traits::Zero;

use crate::ast::{Direction, Domain, Name, Problem};

pub use advance::{Advance, ValueChange, advance, advance_defined, advance_each, metric_after};
pub use budget::Interrupted;
pub use course::{Course, CourseMoment, NumberBound, course};
pub use options::Options;
pub use plan::{PlanStep, PlanText};
pub use relevant::may_read;
pub use verdict::{Unmet, Verdict, Violation, ViolationKind};

use evaluate::metric;
use evaluate::{Bindings, Evaluator};
use execute::Execution;
use explain::unmet;
use relevant::relevant;
use step::Step;
use targets::changeable_values;
use world::{State, World};

/// Maximum number of readings of a plan; if there are more, none is tried. A reading chooses one schema for each step that
/// fits several.
const MAX_READINGS: usize = 4096;

/// Executes a plan and returns the verdict. Domain and problem must have passed [`check`](crate::check());
/// atoms with undeclared names are false.
///
/// A step whose name and objects fit several schemas can be an instance of any of them. A plan is valid if some
/// reading of it is valid. Of several valid readings, the best by the metric (or, without a metric, by the total
/// time) counts. If there are more than 4,096 readings, each ambiguous step is an instance of the first schema that
/// can start.
pub fn validate(domain: &Domain, problem: &Problem, plan: &PlanText, options: &Options) -> Verdict {
    judge_readings(&World::new(domain, problem, &|| false), plan, options)
}

/// Executes a plan like [`validate`], but ends early once `stop` returns `true`. `stop` is called at the beginning,
/// and then regularly in most loops, but not while the initial state is indexed.
///
/// # Errors
/// Returns [`Interrupted`] if `stop` has returned `true`.
pub fn validate_within(
    domain: &Domain,
    problem: &Problem,
    plan: &PlanText,
    options: &Options,
    stop: &dyn Fn() -> bool,
) -> Result<Verdict, Interrupted> {
    if stop() {
        return Err(Interrupted);
    }
    let world = World::new(domain, problem, stop);
    let verdict = judge_readings(&world, plan, options);
    world.budget.check(verdict)
}

/// Returns the metric value of a plan, as [`validate`] computes it with [`Options::chosen_durations`], but
/// faster in a large initial state. Returns `None` if the plan is not valid, or if the metric is missing or
/// undefined.
pub fn metric_of(domain: &Domain, problem: &Problem, plan: &PlanText) -> Option<BigRational> {
    let reduced = relevant(domain, problem, &plan.steps, Some(&problem.goal));
    let world = World::new(domain, reduced.as_ref().unwrap_or(problem), &|| false);
    judge_readings(&world, plan, &Options::default().with_chosen_durations(true)).metric
}

/// Executes all readings of a plan (choices of one schema for each ambiguous step) and returns the
/// best valid verdict. If no reading is valid, or if there are more than [`MAX_READINGS`], executes
/// the plan with the first schema that can start for each step. After an interruption, the verdict
/// is meaningless.
#[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
fn judge_readings(world: &World<'_>, plan: &PlanText, options: &Options) -> Verdict {
    let steps: Vec<_> =
        plan.steps.iter().enumerate().map(|(index, step)| step::resolve(world, index + 1, step)).collect();
    let mut best: Option<Verdict> = None;
    for steps in step::readings(&steps, MAX_READINGS) {
        if world.budget.poll() {
            break;
        }
        let verdict = judge(world, &steps, options);
        if verdict.valid && best.as_ref().is_none_or(|best| is_better(world.problem, &verdict, best)) {
            best = Some(verdict);
        }
    }
    best.unwrap_or_else(|| judge(world, &steps, options))
}

fn judge<'p>(world: &World<'p>, steps: &[Step<'p>], options: &Options) -> Verdict {
    let mut execution = Execution::new(world, options);
    let mut total_time = BigRational::zero();
    let result = if options.concurrent {
        concurrent::run(&mut execution, steps, &mut total_time)
    } else {
        sequential::run(&mut execution, steps, &mut total_time)
    };
    let result = result.and_then(|()| goal_holds(world, &execution.state, &total_time));
    let violations = result.and_then(|()| execution.check_trajectory(&total_time));
    let metric = violations
        .as_ref()
        .ok()
        .and_then(|violated| metric_value(world, &execution.state, violated, &total_time));
    // The final values are reported even if the plan is invalid.
    let violation = violations.err();
    let values = changeable_values(world, &execution.state);
    Verdict { valid: violation.is_none(), total_time, metric, values, violation }
}

fn is_better(problem: &Problem, candidate: &Verdict, incumbent: &Verdict) -> bool {
    match (&problem.metric, &candidate.metric, &incumbent.metric) {
        (Some(metric), Some(candidate), Some(incumbent)) => match metric.direction {
            Direction::Minimize => candidate < incumbent,
            Direction::Maximize => candidate > incumbent,
        },
        (Some(_), candidate, incumbent) => candidate.is_some() && incumbent.is_none(),
        (None, ..) => candidate.total_time < incumbent.total_time,
    }
}

fn goal_holds(world: &World<'_>, state: &State, time: &BigRational) -> Result<(), Box<Violation>> {
    let evaluator = Evaluator::new(world, state);
    let goal = &world.problem.goal;
    let mut bindings = Bindings::default();
    if evaluator.holds(goal, &mut bindings) == Ok(true) {
        return Ok(());
    }
    Err(Box::new(Violation {
        step: None,
        action: None,
        time: time.clone(),
        kind: ViolationKind::Goal,
        message: "the goal does not hold in the end".to_owned(),
        unmet: unmet(evaluator, goal, &mut bindings),
    }))
}

fn metric_value(
    world: &World<'_>,
    state: &State,
    violated: &[Name],
    total_time: &BigRational,
) -> Option<BigRational> {
    if world.has_preferences() {
        return metric(world, &world.with_violations(violated, state), total_time);
    }
    metric(world, state, total_time)
}
