//! Formats the answer of `metaplan plan` as text.

use std::fmt::Write as _;

use crate::answers::{Preparation, milliseconds};
use planner::{PlannerPart, Solution, Status};

use crate::cli::output::counted;
use crate::cli::plan_text::steps_text;

pub(super) fn answer_text(name: &str, solution: &Solution, columns: Option<u16>) -> String {
    let mut text = String::new();
    if let Some(plan) = &solution.plan {
        if plan.steps.is_empty() {
            text += "nothing has to be done: the goal holds already\n";
        }
        text += &steps_text(plan, columns);
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
    text += &solution.verdict();
    text.push('\n');
    text
}

pub(super) fn statistics_text(solution: &Solution, preparation: &Preparation) -> String {
    let statistics = &solution.statistics;
    let families: Vec<_> =
        statistics.families.iter().map(|(family, count)| format!("{family} {count}")).collect();
    let mut text = String::new();
    let found_by = match statistics.found_by {
        Some(PlannerPart::Search) => "plan by search; ",
        Some(PlannerPart::Satisficing) => "plan by relaxed plans and landmarks; ",
        Some(PlannerPart::Sat) => "plan by the SAT solver; ",
        None => "",
    };
    let _ = writeln!(
        text,
        "{found_by}{} expanded, {} generated, {} evaluated, {}",
        counted(statistics.expanded, "state"),
        statistics.generated,
        statistics.evaluated,
        counted(statistics.restarts, "restart")
    );
    for moment in &statistics.history {
        let cost =
            moment.cost.as_ref().map_or_else(|| "no plan yet".to_owned(), |cost| format!("cost {cost}"));
        let time = milliseconds(moment.time);
        let _ = writeln!(text, "after {time} ms: {cost}, lower bound {}", moment.lower_bound);
    }
    let _ = write!(
        text,
        "{}; {}, {} ({}); {} in {}\n\
         read {} ms, ground {} ms, search {} ms, encode {} ms, solve {} ms\n",
        counted(statistics.operators, "operator"),
        counted(statistics.variables, "variable"),
        counted(statistics.clauses, "clause"),
        families.join(", "),
        counted(statistics.conflicts, "conflict"),
        counted(statistics.calls, "solver call"),
        milliseconds(preparation.read),
        milliseconds(preparation.ground),
        milliseconds(statistics.search),
        milliseconds(statistics.encode),
        milliseconds(statistics.solve),
    );
    text
}
