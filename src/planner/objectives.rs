//! The objectives of a plan, and the validator's check of their values.

use pddl::ast::{Metric, Problem};
use planner::{Limits, Point};

use crate::message::{Errors, Message};
use crate::mission::{Mission, Reading, Unconfirmed, confirm};

/// The objectives in order. Empty for the problem's metric.
#[derive(Debug, Clone)]
pub(super) struct Objectives {
    /// The objectives as the user wrote them.
    pub(super) texts: Vec<String>,
    pub(super) metrics: Vec<Metric>,
}

impl Objectives {
    /// # Errors
    /// All faults of each objective.
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

    /// Lets the validator execute the plan and check its value by every objective.
    ///
    /// # Errors
    /// M170 if the validator rejects the plan or computes another value; M130 if the time limit is
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

/// Error for a plan that the validator did not confirm.
pub(super) fn unconfirmed(reason: Unconfirmed) -> Message {
    match reason {
        Unconfirmed::Refused(reason) => fault(&reason),
        Unconfirmed::Interrupted => Message::error(
            "M130",
            "a limit was reached before the validator had executed the plan that was found",
        ),
    }
}

/// Message about an internal fault of the planner (M170).
pub(super) fn fault(reason: &str) -> Message {
    let text = format!("this is a fault of metaplan, not of your input; please report it: {reason}");
    Message::error("M170", text)
}
