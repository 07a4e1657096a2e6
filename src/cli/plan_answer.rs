//! A solution as text.

use std::fmt::Write as _;

use encodings::{Solution, Status};

use crate::cli::plan_stages::{Stages, milliseconds};
use crate::cli::plan_text::steps_text;
use crate::cli::plan_verdict::verdict;

pub(super) fn answer_text(name: &str, solution: &Solution, verbose: bool, stages: &Stages) -> String {
    let mut text = String::new();
    if let Some(plan) = &solution.plan {
        if plan.steps.is_empty() {
            text += "nothing has to be done: the goal holds already\n";
        }
        text += &steps_text(plan);
        let _ = write!(
            text,
            "\n{}cost {}",
            if name.is_empty() { String::new() } else { format!("{name}: ") },
            plan.cost
        );
        if let Some(bound) = solution.lower_bound.as_ref().filter(|_| solution.status != Status::Optimal) {
            let _ = write!(text, ", lower bound {bound}");
        }
        text += ": ";
    }
    text += &verdict(solution);
    if verbose {
        text += &statistics_text(solution, stages);
    }
    text
}

fn statistics_text(solution: &Solution, stages: &Stages) -> String {
    let statistics = &solution.statistics;
    let families: Vec<_> =
        statistics.families.iter().map(|(family, count)| format!("{family} {count}")).collect();
    format!(
        "{} operators; {} variables, {} clauses ({}); {} conflicts in {} solver calls\n\
         read {} ms, ground {} ms, search {} ms, encode {} ms, solve {} ms\n",
        statistics.operators,
        statistics.variables,
        statistics.clauses,
        families.join(", "),
        statistics.conflicts,
        statistics.calls,
        milliseconds(stages.read),
        milliseconds(stages.ground),
        milliseconds(statistics.search),
        milliseconds(statistics.encode),
        milliseconds(statistics.solve),
    )
}
