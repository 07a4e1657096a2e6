//! A plan is shown only once the validator has executed it.

use ::mission::Mission;
use ::verify::measure::measure;
use num_rational::BigRational;
use pddl::ast::{Name, Problem};
use pddl::validate::{Interrupted, Options, PlanStep, PlanText, Verdict, validate_within};
use planner::{Limits, Plan};

/// How the validator is to read a plan.
#[derive(Debug, Clone)]
pub struct Reading {
    options: Options,
    /// Whether a plan without a metric is measured by its time.
    timed: bool,
}

/// Why a plan is not shown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unconfirmed {
    /// The validator refuses it, or measures it otherwise: a fault of the planner.
    Refused(String),
    /// A limit was reached before the validator had executed it.
    Interrupted,
}

impl Reading {
    /// Actions are executed one after another.
    pub fn sequential(timed: bool) -> Self {
        Self { options: Options::default(), timed }
    }

    /// Actions overlap; those that interfere lie so far apart.
    pub fn concurrent(separation: &BigRational) -> Self {
        Self {
            options: Options::default().with_concurrent(true).with_tolerance(separation.clone()),
            timed: true,
        }
    }

    /// What the validator says a plan with this reading comes to, by the problem's metric. Returns `None` for an invalid plan, and if a
    /// limit is reached.
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

/// The verdict of the independent validator on a plan.
///
/// # Errors
/// A limit was reached.
pub(super) fn verdict_of(
    mission: &Mission,
    problem: &Problem,
    plan: &Plan,
    reading: &Reading,
    limits: &Limits,
) -> Result<Verdict, Interrupted> {
    let steps = plan.steps.iter().map(|step| PlanStep {
        action: Name::new(&step.action),
        arguments: step.arguments.iter().map(|argument| Name::new(argument)).collect(),
        start: Some(step.start.to_rational()),
        duration: (!step.duration.is_zero()).then(|| step.duration.to_rational()),
        line: 0,
    });
    let plan = PlanText { steps: steps.collect() };
    validate_within(mission.domain(), problem, &plan, &reading.options, &|| limits.reached())
}

/// Has the independent validator execute a plan for a problem that [`Mission::filled`] has made. A plan is often found at the limits: so
/// the validator has the time of [`Limits::extended`].
///
/// # Errors
/// The plan is invalid or costs something else, or the time does not suffice.
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
