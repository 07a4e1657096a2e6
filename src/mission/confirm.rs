//! A plan is shown only once the validator has executed it.

use ::mission::Mission;
use ::verify::measure::measure;
use encodings::Plan;
use num_rational::BigRational;
use pddl::ast::{Name, Problem};
use pddl::validate::{Options, PlanStep, PlanText, Verdict, validate};

/// How the validator is to read a plan.
#[derive(Debug, Clone)]
pub struct Reading {
    options: Options,
    /// Whether a plan without a metric is measured by its time.
    timed: bool,
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

    /// What the validator says a plan with this reading comes to, by the problem's metric; none of an invalid plan.
    pub(super) fn value(&self, mission: &Mission, problem: &Problem, plan: &Plan) -> Option<BigRational> {
        let verdict = verdict_of(mission, problem, plan, self);
        measure(problem, &verdict, plan.steps.len(), self.timed).filter(|_| verdict.valid)
    }
}

/// What the independent validator says of a plan.
pub(super) fn verdict_of(mission: &Mission, problem: &Problem, plan: &Plan, reading: &Reading) -> Verdict {
    let steps = plan.steps.iter().map(|step| PlanStep {
        action: Name::new(&step.action),
        arguments: step.arguments.iter().map(|argument| Name::new(argument)).collect(),
        start: Some(step.start.to_rational()),
        duration: (!step.duration.is_zero()).then(|| step.duration.to_rational()),
        line: 0,
    });
    validate(mission.domain(), problem, &PlanText { steps: steps.collect() }, &reading.options)
}

/// Has the independent validator execute a plan for a problem that [`Mission::filled`] has made.
///
/// # Errors
/// Why the plan is none, or that it costs something else: a fault of the planner.
pub fn confirm(mission: &Mission, problem: &Problem, plan: &Plan, reading: &Reading) -> Result<(), String> {
    let verdict = verdict_of(mission, problem, plan, reading);
    match (&verdict.violation, measure(problem, &verdict, plan.steps.len(), reading.timed)) {
        (Some(violation), _) => {
            Err(format!("the validator refuses the plan that was found: {}", violation.message))
        }
        (None, Some(value)) if value != plan.cost.to_rational() => {
            Err(format!("the plan that was found costs {value}, and not {} as claimed", plan.cost))
        }
        (None, _) => Ok(()),
    }
}
