//! A plan to a verdict: executes it by the definition below, with exact numbers.
//!
//! Nothing here is shared with grounding and encoding: conditions are evaluated on the syntax tree.
//! Derived predicates are the least fixpoint of their axioms, layer by layer (S. Thiébaux, J. Hoffmann, B. Nebel: In
//! defense of PDDL axioms, AIJ 168, 2005).
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

pub use advance::{Advance, ValueChange, advance, advance_each, metric_after};
pub use budget::Interrupted;
pub use course::{Course, CourseMoment, NumberBound, course};
pub use options::Options;
pub use plan::{PlanStep, PlanText};
pub use verdict::{Unmet, Verdict, Violation, ViolationKind};

use evaluate::{Bindings, Evaluator};
use execute::Execution;
use explain::unmet;
use step::Step;
use targets::changeable_values;
use world::{State, World};

/// How many ways to read a plan are tried where schemas share a name.
const READINGS: usize = 4096;

/// Executes a plan. Domain and problem must have passed [`check`](crate::check()); names that are declared
/// nowhere hold for nothing.
///
/// A step whose name and objects fit several schemas stands for any of them: a plan is valid if some reading of it is, and
/// the best one counts. Beyond 4,096 readings each such step is the first schema that can start.
pub fn validate(domain: &Domain, problem: &Problem, plan: &PlanText, options: &Options) -> Verdict {
    judge_readings(&World::new(domain, problem, &|| false), plan, options)
}

/// Executes a plan as [`validate`] does, unless `stop` returns `true` before the end. It is called every few hundred steps of each
/// loop.
///
/// # Errors
/// `stop` has returned `true`.
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

/// The verdict on the best reading of a plan.
#[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
fn judge_readings(world: &World<'_>, plan: &PlanText, options: &Options) -> Verdict {
    let steps: Vec<_> =
        plan.steps.iter().enumerate().map(|(index, step)| step::resolve(world, index + 1, step)).collect();
    let mut best = judge(world, &steps, options);
    for steps in step::readings(&steps, READINGS) {
        if world.budget.poll() {
            break;
        }
        let verdict = judge(world, &steps, options);
        if is_better(world.problem, &verdict, &best) {
            best = verdict;
        }
    }
    best
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
    let judged = result.and_then(|()| execution.judge(&total_time));
    let metric = judged
        .as_ref()
        .ok()
        .and_then(|violated| metric_value(world, &execution.state, violated, &total_time));
    let violation = judged.err();
    let values = changeable_values(world, &execution.state);
    Verdict { valid: violation.is_none(), total_time, metric, values, violation }
}

/// Whether one reading of a plan is better than another: valid, and by the metric, or by time without one.
fn is_better(problem: &Problem, own: &Verdict, other: &Verdict) -> bool {
    if !own.valid || !other.valid {
        return own.valid && !other.valid;
    }
    match (&problem.metric, &own.metric, &other.metric) {
        (Some(metric), Some(own), Some(other)) => match metric.direction {
            Direction::Minimize => own < other,
            Direction::Maximize => own > other,
        },
        (Some(_), own, other) => own.is_some() && other.is_none(),
        (None, ..) => own.total_time < other.total_time,
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
    let metric = world.problem.metric.as_ref()?;
    let counted = world.counted(violated, state);
    let evaluator = Evaluator { total_time: Some(total_time), ..Evaluator::new(world, &counted) };
    evaluator.value(&metric.expression, &Bindings::default()).ok()
}
