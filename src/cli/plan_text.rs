//! Formats in which a plan can be written, and the table of a plan's steps.

use clap::ValueEnum;

use planner::{Plan, Step};

use crate::cli::output;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum PlanFormat {
    /// Lines `(action arguments)` or `start: (action arguments) [duration]`.
    Ipc,
    /// Format that the POPF plugin of `PlanSys2` parses.
    Plansys2,
    /// XML of BehaviorTree.CPP 4: a sequence of actions with mode changes between them.
    Btcpp,
    /// JSON, as with `--format json`.
    Json,
    /// A table for people, with cost and proof; `validate` cannot read it.
    Table,
}

pub(super) fn steps_text(plan: &Plan, columns: Option<u16>) -> String {
    let rows = plan.steps.iter().enumerate().map(|(index, step)| {
        let configuration: Vec<_> =
            step.configuration.iter().map(|(f, design)| format!("{f} = {design}")).collect();
        let changed = if step.reconfigured.is_empty() { "" } else { " (changed)" };
        vec![
            (index + 1).to_string(),
            step.start.to_string(),
            step.duration.to_string(),
            format!("{} {}", step.action, route(step).join(" ")).trim_end().to_owned(),
            configuration.join(", ") + changed,
            step.cost.to_string(),
        ]
    });
    let rows: Vec<_> = rows.collect();
    output::table_within(columns, &["step", "start", "duration", "action", "configuration", "cost"], rows)
}

/// Returns the arguments of a step without the functions and designs of its configuration.
fn route(step: &Step) -> Vec<&str> {
    let configured =
        |argument: &String| step.configuration.iter().any(|(f, design)| f == argument || design == argument);
    step.arguments.iter().filter(|argument| !configured(argument)).map(String::as_str).collect()
}
