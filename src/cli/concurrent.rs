//! `--concurrent` of `plan` and `report`: plans whose actions overlap.

use clap::Args;
use encodings::{Improvement, Limits, Plan, Point, optimize_concurrent};
use metaplan::mission::{Mission, Planning as _, Reading, lean};
use num_rational::BigRational;
use pddl::ast::Problem;

use crate::cli::common::{Exit, Failure};
use crate::cli::objectives::Objectives;
use crate::cli::values::time;

/// Whether and how actions overlap.
#[derive(Debug, Args)]
pub(super) struct Overlap {
    /// Actions may overlap, by the rules of PDDL 2.1: `total-time` is the makespan, which is minimised where the problem has no
    /// metric.
    #[arg(long)]
    concurrent: bool,
    /// With `--concurrent`: how far apart actions that interfere begin and end, in the domain's time unit.
    #[arg(long, value_name = "TIME", default_value = "0.001", value_parser = positive, requires = "concurrent")]
    epsilon: BigRational,
}

fn positive(text: &str) -> Result<BigRational, String> {
    time(text)
        .ok()
        .filter(|value| *value > BigRational::default())
        .ok_or_else(|| format!("`{text}` is not a time above 0 such as 0.001"))
}

impl Overlap {
    /// The separation of actions that interfere; none if actions are executed one after another.
    pub(super) fn separation(&self) -> Option<&BigRational> {
        self.concurrent.then_some(&self.epsilon)
    }
}

/// Finds a plan whose actions overlap; `report` hears of improvements.
pub(super) fn solve(
    mission: &Mission,
    problem: &Problem,
    objectives: &Objectives,
    separation: &BigRational,
    limits: &Limits,
    report: &mut dyn FnMut(Improvement),
) -> Result<Point, Failure> {
    let task =
        mission.ground_concurrent(problem, &objectives.metrics, separation, limits).map_err(|messages| {
            let exit = if limits.reached() { Exit::NothingFound } else { Exit::BadInput };
            Failure { exit, messages }
        })?;
    let mut solution = optimize_concurrent(&task, limits, report);
    if let Some(plan) = solution.plan.take() {
        let mut problem = problem.clone();
        problem.metric = objectives.metrics.first().cloned().or(problem.metric);
        solution.plan = Some(lean(mission, &problem, plan, &Reading::concurrent(separation)));
    }
    let values = solution.plan.iter().map(|plan| plan.cost.clone());
    Ok(Point { values: values.filter(|_| !objectives.metrics.is_empty()).collect(), solution })
}

/// A line about the makespan.
pub(super) fn makespan_text(plan: Option<&Plan>) -> String {
    plan.map_or_else(String::new, |plan| format!("makespan {}\n", plan.makespan()))
}
