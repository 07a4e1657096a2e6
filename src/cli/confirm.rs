//! A plan is shown only once the validator has executed it.

use encodings::Plan;
use metaplan::message::Message;
use metaplan::mission::{self, Mission, Reading};
use pddl::ast::Problem;

use crate::cli::common::{Exit, Failure};

/// Has the independent validator execute the plan; what it refuses, or measures otherwise, is not shown.
pub(super) fn confirm(
    mission: &Mission,
    problem: &Problem,
    plan: &Plan,
    reading: &Reading,
) -> Result<(), Failure> {
    mission::confirm(mission, problem, plan, reading).map_err(|reason| fault(&reason))
}

/// A fault of ours.
pub(super) fn fault(reason: &str) -> Failure {
    let text = format!("this is a fault of metaplan, not of your input; please report it: {reason}");
    Failure { exit: Exit::Fault, messages: vec![Message::error("M170", text)].into() }
}
