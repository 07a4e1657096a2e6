//! Formats the values of plans for the objectives of `--minimize` and `--pareto`.

use std::fmt::Write as _;

use planner::{Exact, Front, Status};

use crate::cli::plan_answer::answer_text;
use crate::cli::plan_text::steps_text;

pub(super) fn values_text(objectives: &[String], values: &[Exact]) -> String {
    if objectives.len() < 2 || values.is_empty() {
        return String::new();
    }
    format!("in order: {}\n", pairs(objectives, values))
}

pub(super) fn front_text(name: &str, objectives: &[String], front: &Front, columns: Option<u16>) -> String {
    let solved: Vec<_> = front.points.iter().filter(|point| point.solution.plan.is_some()).collect();
    let mut text = String::new();
    for (point, number) in solved.iter().zip(1..) {
        let _ = writeln!(text, "point {number}: {}", pairs(objectives, &point.values));
        if let Some(plan) = &point.solution.plan {
            text += &steps_text(plan, columns);
        }
        text.push('\n');
    }
    match (front.status, front.points.first()) {
        (Status::Optimal, _) => {
            let _ = writeln!(text, "{} on the front, proved: there are no others", solved.len());
        }
        (Status::Feasible, _) => {
            let proved = solved.iter().filter(|point| point.solution.status == Status::Optimal).count();
            // The last point may be unproved: a plan that dominates it may exist.
            let open = if proved < solved.len() { ", and one more that is not proved to be" } else { "" };
            let _ = writeln!(
                text,
                "{proved} on the front{open}; a limit was reached before it was proved that there are no others"
            );
        }
        (_, Some(point)) => text += &answer_text(name, &point.solution, columns),
        (_, None) => {}
    }
    text
}

fn pairs(objectives: &[String], values: &[Exact]) -> String {
    let pairs = objectives.iter().zip(values);
    pairs.map(|(text, value)| format!("{text} = {value}")).collect::<Vec<_>>().join(", ")
}
