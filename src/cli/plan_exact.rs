//! `metaplan plan` where numbers are too large for the integers of formulas: by search alone, in exact rationals.

use encodings::{Config, ExactTask, Point, optimize_exact};
use metaplan::message::Errors;
use metaplan::message::Message;
use metaplan::mission::{Mission, Planning as _, Reading};
use pddl::ast::Problem;

use crate::cli::objectives::Objectives;
use crate::cli::output;

/// Whether numbers that are too large are all that is wrong with a task.
pub(super) fn is_too_large(messages: &[Message]) -> bool {
    !messages.is_empty() && messages.iter().all(|message| message.code == "E304")
}

/// Plans it; `refused` is why it cannot be planned otherwise.
///
/// # Errors
/// `refused`, if there is more than one objective; or what else cannot be planned with.
pub(super) fn solve(
    mission: &Mission,
    problem: &Problem,
    objectives: &Objectives,
    config: &Config,
    refused: Errors,
) -> Result<(ExactTask, Point, Reading), Errors> {
    if objectives.metrics.len() > 1 {
        return Err(refused);
    }
    let task = mission.ground_exact(problem, &objectives.metrics, &config.limits)?;
    let solution = optimize_exact(&task, config);
    let values = solution.plan.iter().map(|plan| plan.cost.clone()).collect();
    let reading = Reading::sequential(task.is_timed());
    Ok((task, Point { values, solution }, reading))
}

/// Says why this is not planned as other tasks are.
pub(super) fn explain(refused: &[Message]) {
    for message in refused {
        output::note(&format!("planned by search alone, in exact numbers: {}\n", message.message));
    }
}
