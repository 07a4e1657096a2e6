//! `--minimize` and `--pareto`: objectives in place of the problem's metric.

use std::fmt::Write as _;

use encodings::{Front, Point, Status};
use metaplan::answers::{Objective, ParetoAnswer, Preparation};
use metaplan::message::Message;
use metaplan::mission::{Mission, Reading};
use pddl::ast::{Metric, Problem};

use crate::cli::common::Failure;
use crate::cli::confirm::confirm;
use crate::cli::plan_answer::answer_text;
use crate::cli::plan_text::steps_text;

/// The objectives that the user asks for, in order; none for the problem's metric.
pub(super) struct Objectives {
    texts: Vec<String>,
    pub(super) metrics: Vec<Metric>,
}

impl Objectives {
    pub(super) fn read(
        mission: &Mission,
        problem: &Problem,
        minimize: &[String],
        pareto: Option<&str>,
    ) -> Result<Self, Failure> {
        let texts: Vec<String> = match pareto {
            Some(pair) => {
                let parts: Vec<_> = pair.split(',').map(|part| part.trim().to_owned()).collect();
                if parts.len() != 2 {
                    let text = format!(
                        "`--pareto {pair}` names {} objectives; it takes two, with a comma between",
                        parts.len()
                    );
                    return Err(Failure::usage(Message::error("M107", text)));
                }
                parts
            }
            None => minimize.to_vec(),
        };
        let mut metrics = Vec::new();
        let mut messages = Vec::new();
        for text in &texts {
            match mission.objective(problem, text) {
                Ok(metric) => metrics.push(metric),
                Err(more) => messages.extend(more),
            }
        }
        if messages.is_empty() { Ok(Self { texts, metrics }) } else { Err(messages.into()) }
    }

    /// As the user has written them.
    pub(super) fn texts(&self) -> &[String] {
        &self.texts
    }

    /// Has the validator execute the plan, and check its value by every objective.
    pub(super) fn confirm(
        &self,
        mission: &Mission,
        problem: &Problem,
        point: &Point,
        reading: &Reading,
    ) -> Result<(), Failure> {
        let Some(plan) = &point.solution.plan else { return Ok(()) };
        if self.metrics.is_empty() {
            return confirm(mission, problem, plan, reading);
        }
        for (metric, value) in self.metrics.iter().zip(&point.values) {
            let problem = Problem { metric: Some(metric.clone()), ..problem.clone() };
            let mut plan = plan.clone();
            plan.cost = value.clone();
            confirm(mission, &problem, &plan, reading)?;
        }
        Ok(())
    }

    /// The values of a plan by objective, for programs.
    pub(super) fn values(&self, point: &Point) -> Vec<Objective> {
        Objective::all(&self.texts, point)
    }

    /// A line with the values by objective, where there are several.
    pub(super) fn values_text(&self, point: &Point) -> String {
        if self.texts.len() < 2 || point.values.is_empty() {
            return String::new();
        }
        let pairs = self.texts.iter().zip(&point.values);
        let values: Vec<_> = pairs.map(|(text, value)| format!("{text} = {value}")).collect();
        format!("in order: {}\n", values.join(", "))
    }

    pub(super) fn front_text(&self, name: &str, front: &Front) -> String {
        let solved: Vec<_> = front.points.iter().filter(|point| point.solution.plan.is_some()).collect();
        let mut text = String::new();
        for (point, number) in solved.iter().zip(1..) {
            let pairs = self.texts.iter().zip(&point.values);
            let values: Vec<_> = pairs.map(|(text, value)| format!("{text} = {value}")).collect();
            let _ = writeln!(text, "point {number}: {}", values.join(", "));
            if let Some(plan) = &point.solution.plan {
                text += &steps_text(plan);
            }
            text.push('\n');
        }
        match (front.status, front.points.first()) {
            (Status::Optimal, _) => {
                let _ = writeln!(text, "{} on the front, proved: there are no others", solved.len());
            }
            (Status::Feasible, _) => {
                let _ = writeln!(
                    text,
                    "{} on the front; a limit came before it was proved that there are no others",
                    solved.len()
                );
            }
            (_, Some(point)) => text += &answer_text(name, &point.solution, false, &Preparation::default()),
            (_, None) => {}
        }
        text
    }

    /// The front for programs.
    pub(super) fn front_answer(&self, name: &str, front: &Front, preparation: &Preparation) -> ParetoAnswer {
        ParetoAnswer::new(name, &self.texts, front, preparation)
    }
}
