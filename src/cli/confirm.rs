//! A plan is shown only once the validator has executed it.

use encodings::Plan;
use metaplan::measure::measure;
use metaplan::message::Message;
use metaplan::mission::Mission;
use num_rational::BigRational;
use pddl::ast::{Name, Problem};
use pddl::validate::{Options, PlanStep, PlanText, validate};

use crate::cli::common::{Exit, Failure};

/// How the validator is to read a plan.
pub(super) struct Reading {
    pub(super) options: Options,
    /// Whether a plan without a metric is measured by its time.
    pub(super) timed: bool,
}

impl Reading {
    /// Actions are executed one after another.
    pub(super) fn sequential(timed: bool) -> Self {
        Self { options: Options::default(), timed }
    }

    /// Actions overlap.
    pub(super) fn concurrent(separation: &BigRational) -> Self {
        Self { options: Options { concurrent: true, tolerance: separation.clone() }, timed: true }
    }
}

/// Has the independent validator execute the plan; what it refuses, or measures otherwise, is not shown.
pub(super) fn confirm(
    mission: &Mission,
    problem: &Problem,
    plan: &Plan,
    reading: &Reading,
) -> Result<(), Failure> {
    let steps = plan.steps.iter().map(|step| PlanStep {
        action: Name::new(&step.action),
        arguments: step.arguments.iter().map(|argument| Name::new(argument)).collect(),
        start: Some(step.start.to_rational()),
        duration: (!step.duration.is_zero()).then(|| step.duration.to_rational()),
        line: 0,
    });
    let verdict = validate(mission.domain(), problem, &PlanText { steps: steps.collect() }, &reading.options);
    let reason = match (&verdict.violation, measure(problem, &verdict, plan.steps.len(), reading.timed)) {
        (Some(violation), _) => {
            format!("the validator refuses the plan that was found: {}", violation.message)
        }
        (None, Some(value)) if value != plan.cost.to_rational() => {
            format!("the plan that was found costs {value}, and not {} as claimed", plan.cost)
        }
        (None, _) => return Ok(()),
    };
    Err(fault(&reason))
}

/// A fault of ours.
pub(super) fn fault(reason: &str) -> Failure {
    let text = format!("this is a fault of metaplan, not of your input; please report it: {reason}");
    Failure { exit: Exit::Fault, messages: vec![Message::error("M170", text)] }
}
