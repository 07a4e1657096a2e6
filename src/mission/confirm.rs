//! Validates a plan with the independent validator before it is shown.

use ::mission::Mission;
use ::verify::measure::measure;
use num_rational::BigRational;
use pddl::ast::{Name, Problem};
use pddl::validate::{Interrupted, Options, PlanStep, PlanText, Verdict, validate_within};
use planner::{Limits, Plan};

/// Semantics with which the validator executes a plan: sequential or overlapping actions.
#[derive(Debug, Clone)]
pub struct Reading {
    options: Options,
    /// `true` if the cost of a plan without a metric is its total time, `false` if it is the number
    /// of steps.
    timed: bool,
}

/// Reason why the validator did not confirm a plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unconfirmed {
    /// The validator rejects the plan or computes another cost: a fault of the planner.
    Refused(String),
    /// A limit was reached before the validator had executed the plan.
    Interrupted,
}

impl Reading {
    /// Semantics for sequential actions. `timed` is `true` if the cost of a plan without a metric is its total time.
    pub fn sequential(timed: bool) -> Self {
        Self { options: Options::default(), timed }
    }

    /// Semantics for overlapping actions. Interfering happenings (starts and ends of actions) are at least `separation`
    /// apart, in the domain's time unit.
    pub fn concurrent(separation: &BigRational) -> Self {
        Self {
            options: Options::default().with_concurrent(true).with_tolerance(separation.clone()),
            timed: true,
        }
    }

    /// Executes the plan with the validator and returns its value by the problem's metric. Returns `None` if the plan
    /// is invalid, if the value is undefined, or if a limit is reached.
    pub(super) fn value(
        &self,
        mission: &Mission,
        problem: &Problem,
        plan: &Plan,
        limits: &Limits,
    ) -> Option<BigRational> {
        let verdict = verdict_of(mission, problem, plan, self, limits).ok()?;
        measure(problem, &verdict, plan.steps.len(), self.timed).filter(|_| verdict.valid)
    }
}

/// Returns a plan as the validator reads it, with all starts and durations.
pub(crate) fn plan_text(plan: &Plan) -> PlanText {
    let steps = plan.steps.iter().map(|step| PlanStep {
        action: Name::new(&step.action),
        arguments: step.arguments.iter().map(|argument| Name::new(argument)).collect(),
        start: Some(step.start.to_rational()),
        duration: Some(step.duration.to_rational()),
        line: 0,
    });
    PlanText { steps: steps.collect() }
}

pub(super) fn verdict_of(
    mission: &Mission,
    problem: &Problem,
    plan: &Plan,
    reading: &Reading,
    limits: &Limits,
) -> Result<Verdict, Interrupted> {
    validate_within(mission.domain(), problem, &plan_text(plan), &reading.options, &|| limits.reached())
}

/// Checks a plan by executing it with the independent validator. `problem` was returned by
/// [`Mission::filled`]. Since plans are often found at the time limit, the validator gets the
/// additional time of [`Limits::extended`]. The cost is not compared if the metric is undefined after
/// the plan.
///
/// # Errors
/// The plan is invalid, its cost differs, or the time does not suffice.
pub fn confirm(
    mission: &Mission,
    problem: &Problem,
    plan: &Plan,
    reading: &Reading,
    limits: &Limits,
) -> Result<(), Unconfirmed> {
    let verdict = verdict_of(mission, problem, plan, reading, &limits.extended());
    let verdict = verdict.map_err(|Interrupted| Unconfirmed::Interrupted)?;
    let refused = |reason: String| Err(Unconfirmed::Refused(reason));
    match (&verdict.violation, measure(problem, &verdict, plan.steps.len(), reading.timed)) {
        (Some(violation), _) => {
            refused(format!("the validator refuses the plan that was found: {}", violation.message))
        }
        (None, Some(value)) if value != plan.cost.to_rational() => {
            refused(format!("the plan that was found costs {value}, and not {} as claimed", plan.cost))
        }
        (None, _) => Ok(()),
    }
}
