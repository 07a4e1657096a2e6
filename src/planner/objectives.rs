//! What plans are measured by, and that they are.

use pddl::ast::{Metric, Problem};
use planner::{Limits, Point};

use crate::message::{Errors, Message};
use crate::mission::{Mission, Reading, Unconfirmed, confirm};

/// Objectives in order; none for the problem's metric.
#[derive(Debug, Clone)]
pub(super) struct Objectives {
    /// As the user has written them.
    pub(super) texts: Vec<String>,
    pub(super) metrics: Vec<Metric>,
}

impl Objectives {
    /// # Errors
    /// All that is wrong with each of them.
    pub(super) fn read(mission: &Mission, problem: &Problem, texts: &[String]) -> Result<Self, Errors> {
        let mut metrics = Vec::new();
        let mut messages = Vec::new();
        for text in texts {
            match mission.objective(problem, text) {
                Ok(metric) => metrics.push(metric),
                Err(more) => messages.extend(more),
            }
        }
        Errors::unless_empty(messages)?;
        Ok(Self { texts: texts.to_vec(), metrics })
    }

    /// Has the validator execute the plan, and check its value by every objective.
    ///
    /// # Errors
    /// M170, what the validator refuses or measures otherwise; or M130, the time does not suffice.
    pub(super) fn confirm(
        &self,
        mission: &Mission,
        problem: &Problem,
        point: &Point,
        reading: &Reading,
        limits: &Limits,
    ) -> Result<(), Errors> {
        let Some(plan) = &point.solution.plan else { return Ok(()) };
        if self.metrics.is_empty() {
            confirm(mission, problem, plan, reading, limits).map_err(unconfirmed)?;
        }
        for (metric, value) in self.metrics.iter().zip(&point.values) {
            let problem = Problem { metric: Some(metric.clone()), ..problem.clone() };
            let mut plan = plan.clone();
            plan.cost = value.clone();
            confirm(mission, &problem, &plan, reading, limits).map_err(unconfirmed)?;
        }
        Ok(())
    }
}

/// Why a plan that was found is not shown.
pub(super) fn unconfirmed(reason: Unconfirmed) -> Message {
    match reason {
        Unconfirmed::Refused(reason) => fault(&reason),
        Unconfirmed::Interrupted => Message::error(
            "M130",
            "a limit was reached before the validator had executed the plan that was found",
        ),
    }
}

/// A fault of ours.
pub(super) fn fault(reason: &str) -> Message {
    let text = format!("this is a fault of metaplan, not of your input; please report it: {reason}");
    Message::error("M170", text)
}
