//! The objectives of a plan, and the check of their values by the validator.

use pddl::ast::Problem;
use planner::{Limits, Point};

use crate::message::{Errors, Message};
use crate::mission::{Mission, ParsedObjective, Reading, Unconfirmed, confirm};

/// Objectives that replace the problem's metric, the most important first. Empty if the problem's
/// metric is kept.
#[derive(Debug, Clone)]
pub(super) struct Objectives {
    pub(super) texts: Vec<String>,
    pub(super) parsed: Vec<ParsedObjective>,
}

impl Objectives {
    pub(super) fn read(mission: &Mission, problem: &Problem, texts: &[String]) -> Result<Self, Errors> {
        let mut parsed = Vec::new();
        let mut messages = Vec::new();
        for text in texts {
            match mission.objective(problem, text) {
                Ok(objective) => parsed.push(objective),
                Err(more) => messages.extend(more),
            }
        }
        Errors::unless_empty(messages)?;
        Ok(Self { texts: texts.to_vec(), parsed })
    }

    /// Executes the plan of `point`, if there is one, with the validator, and compares the value of
    /// each objective with the planner's value.
    ///
    /// # Errors
    /// M170 if the validator rejects the plan or computes another value; M130 if a limit is
    /// reached.
    pub(super) fn confirm(
        &self,
        mission: &Mission,
        problem: &Problem,
        point: &Point,
        reading: &Reading,
        limits: &Limits,
    ) -> Result<(), Errors> {
        let Some(plan) = &point.solution.plan else { return Ok(()) };
        if self.parsed.is_empty() {
            confirm(mission, problem, plan, reading, limits).map_err(unconfirmed)?;
        }
        for (objective, value) in self.parsed.iter().zip(&point.values) {
            let problem = Problem { metric: Some(objective.metric.clone()), ..problem.clone() };
            let mut plan = plan.clone();
            plan.cost = value.clone();
            confirm(mission, &problem, &plan, reading, limits).map_err(unconfirmed)?;
        }
        Ok(())
    }
}

pub(super) fn unconfirmed(reason: Unconfirmed) -> Message {
    match reason {
        Unconfirmed::Refused(reason) => fault(&reason),
        Unconfirmed::Interrupted => Message::error(
            "M130",
            "a limit was reached before the validator had executed the plan that was found",
        ),
    }
}

pub(super) fn fault(reason: &str) -> Message {
    let text = format!("this is a fault of metaplan, not of your input; please report it: {reason}");
    Message::error("M170", text)
}
