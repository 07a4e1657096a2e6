//! Validates the plan of a certificate and compares its metric with the claim.

use num_rational::BigRational;
use num_traits::Zero;
use pddl::ast::{ActionBody, Comparison, Domain, InitialElement, Name, Problem};
use pddl::validate::{Options, PlanText, validate_within};
use pddl::{Source, to_decimal};

use crate::manifest::PLAN;
use crate::measure::measure;

/// Executes the plan text in the validator and compares its metric with the claimed one. Returns a
/// summary and the metric value. The validation is aborted when `stop` returns `true`.
///
/// # Errors
/// The plan is malformed, contains `Solution Found`, cannot be executed, or has no metric or one other than claimed; or
/// the validation was aborted.
pub fn plan(
    domain: &Domain,
    problem: &Problem,
    timed: bool,
    text: &str,
    claimed: &str,
    stop: &dyn Fn() -> bool,
) -> Result<(String, BigRational), String> {
    // Other readers do not skip the steps before this text, even in a comment.
    if text.contains(PlanText::ANNOUNCEMENT) {
        return Err(format!("{PLAN} contains `{}`", PlanText::ANNOUNCEMENT));
    }
    let mut plan = PlanText::parse(&Source::new(PLAN, text))
        .map_err(|errors| errors.first().map_or_else(String::new, |diagnostic| diagnostic.message.clone()))?;
    if plan.steps.iter().all(|step| step.start.is_some()) {
        plan.steps.sort_by(|left, right| left.start.cmp(&right.start));
    }
    // The steps are executed in sequence. Durations are those of the PDDL files unless the files
    // leave a choice, because written times may be rounded. Without timed events, each step starts
    // when the previous one has ended. With timed events, each step starts at its written time or
    // within the tolerance after it.
    let is_timed = problem.init.iter().any(|element| matches!(element, InitialElement::Timed(..)));
    for step in &mut plan.steps {
        step.start = step.start.take().filter(|_| is_timed);
        step.duration = step.duration.take().filter(|_| is_chosen(domain, &step.action));
    }
    let tolerance = if is_timed { Options::default().tolerance } else { BigRational::zero() };
    let options = Options::default().with_tolerance(tolerance);
    let verdict = validate_within(domain, problem, &plan, &options, stop)
        .map_err(|_| "the validator was stopped before the end of the plan".to_owned())?;
    if let Some(violation) = verdict.violation {
        return Err(violation.message);
    }
    let steps = plan.steps.len();
    let value = measure(problem, &verdict, steps, timed).ok_or("the metric has no value after the plan")?;
    // The claim is written as a decimal if the value has a finite one, otherwise as a fraction.
    if value.to_string() != claimed && to_decimal(&value).is_none_or(|decimal| decimal != claimed) {
        return Err(format!("its metric is {value}, where {claimed} is claimed"));
    }
    let ending = if steps == 1 { "" } else { "s" };
    Ok((format!("{steps} step{ending}, valid, metric {claimed}"), value))
}

/// Returns `true` if a durative action of this name has duration constraints other than a single
/// equation.
fn is_chosen(domain: &Domain, name: &Name) -> bool {
    let mut bodies =
        domain.actions.iter().filter(|action| action.identifier.name == *name).map(|action| &action.body);
    bodies.any(|body| match body {
        ActionBody::Durative { duration, .. } => {
            !matches!(&duration[..], [only] if only.operator == Comparison::Equal)
        }
        ActionBody::Instantaneous { .. } => false,
    })
}
