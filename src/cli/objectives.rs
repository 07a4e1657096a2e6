//! `--minimize` and `--pareto`: objectives in place of the problem's metric.

use std::fmt::Write as _;

use encodings::{Front, Point, Status};
use metaplan::message::Message;
use metaplan::mission::Mission;
use pddl::ast::{Metric, Problem};
use serde_json::{Value, json};

use crate::cli::common::Failure;
use crate::cli::confirm::{Reading, confirm};
use crate::cli::output;
use crate::cli::plan_answer::answer_text as plan_text;
use crate::cli::plan_json::json as plan_json;
use crate::cli::plan_stages::{Stages, status_word};

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
                    return Err(Failure::usage(Message::error("M109", text)));
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

    fn values(&self, point: &Point) -> Vec<Value> {
        let pairs = self.texts.iter().zip(&point.values);
        pairs.map(|(text, value)| json!({ "minimize": text, "value": output::number(value) })).collect()
    }

    /// Adds the values by objective to a plan in JSON.
    pub(super) fn attach(&self, answer: &mut Value, point: &Point) {
        if let Some(object) = answer.as_object_mut().filter(|_| !self.texts.is_empty()) {
            object.insert("objectives".into(), self.values(point).into());
        }
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
                text += &crate::cli::plan_text::steps_text(plan);
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
            (_, Some(point)) => text += &plan_text(name, &point.solution, false, &Stages::default()),
            (_, None) => {}
        }
        text
    }

    pub(super) fn front_json(&self, name: &str, front: &Front, stages: &Stages) -> Value {
        let solved = front.points.iter().filter(|point| point.solution.plan.is_some());
        let points = solved.map(|point| {
            let mut plan = plan_json(name, &point.solution, stages);
            self.attach(&mut plan, point);
            plan
        });
        json!({
            "format": "metaplan-pareto/1",
            "mission": name,
            "status": status_word(front.status),
            "objectives": self.texts,
            "points": points.collect::<Vec<_>>(),
        })
    }
}
