//! `metaplan plan --alternatives`: further optimal plans, and their common parts.

use std::fmt::Write as _;

use crate::planner::Planned;
use planner::{Alternatives, Status};

use crate::cli::plan_text::steps_text;

pub(super) fn text(found: Option<&Alternatives>, planned: &Planned<'_>, columns: Option<u16>) -> String {
    let Some(found) = found else {
        return if planned.solution.status == Status::Optimal {
            "\nequally good plans were not searched for: the metric depends on the state\n".to_owned()
        } else {
            "\nequally good plans were not searched for: the plan is not proved optimal\n".to_owned()
        };
    };
    let mut text = String::new();
    for (plan, number) in found.plans.iter().zip(1..) {
        let _ = write!(text, "\nalternative {number}\n{}", steps_text(plan, columns));
    }
    text += match (found.plans.is_empty(), found.complete) {
        (true, true) => "\nproved: no other plan is equally good, apart from plans with idle actions\n",
        (false, true) => {
            "\nproved: there are no other equally good plans, apart from plans with idle actions\n"
        }
        (_, false) if planned.is_at_limit() => {
            "\na limit was reached: there may be other equally good plans\n"
        }
        (_, false) => "\nthere may be other equally good plans\n",
    };
    let steps = planned.solution.plan.iter().flat_map(|plan| &plan.steps);
    for ((step, forced), number) in steps.zip(found.forced.iter().flatten()).zip(1..) {
        let action = if forced.action { vec![step.action.as_str()] } else { Vec::new() };
        let names: Vec<_> = action.into_iter().chain(forced.functions.iter().map(String::as_str)).collect();
        let names = if names.is_empty() { "nothing".to_owned() } else { names.join(", ") };
        let _ = writeln!(text, "step {number}: in every equally good plan: {names}");
    }
    if found.complete || found.forced.is_some() {
        text += "idle actions are not counted: they cost nothing, and nothing depends on their effects\n";
    }
    text
}
