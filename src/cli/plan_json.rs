//! Plans to JSON: the format `metaplan-plan/1`, which the README lists field by field.

use encodings::{Proof, Solution, Step, Unbounded};
use serde_json::{Value, json};

use crate::cli::output;
use crate::cli::plan_stages::{Stages, milliseconds, status_word};

/// A step of a plan as JSON has it.
pub(super) fn step_json(step: &Step) -> Value {
    let configuration: serde_json::Map<String, Value> =
        step.configuration.iter().map(|(function, design)| (function.clone(), json!(design))).collect();
    json!({
        "action": step.action,
        "arguments": step.arguments,
        "configuration": configuration,
        "start": output::number(&step.start),
        "duration": output::number(&step.duration),
        "cost": output::number(&step.cost),
        "reconfigured": step.reconfigured,
    })
}

/// The answer with its proof and its figures.
pub(super) fn json(name: &str, solution: &Solution, stages: &Stages) -> Value {
    let statistics = &solution.statistics;
    let families: serde_json::Map<String, Value> =
        statistics.families.iter().map(|(family, count)| ((*family).to_owned(), json!(count))).collect();
    let proof = match &solution.proof {
        None => Value::Null,
        Some(Proof::Sat { step_bound }) => match &statistics.unchecked {
            Some(program) => json!({ "by": "sat", "step_bound": step_bound, "unchecked": program }),
            None => json!({ "by": "sat", "step_bound": step_bound }),
        },
        Some(Proof::Bound) => json!({ "by": "bound" }),
        Some(Proof::Search) => json!({ "by": "search" }),
        Some(Proof::Relaxation(reason)) => json!({ "by": "relaxation", "reason": reason }),
    };
    let unbounded = solution.unbounded.map(|unbounded| match unbounded {
        Unbounded::Proved => "proved",
        Unbounded::Suspected => "suspected",
    });
    json!({
        "format": "metaplan-plan/1",
        "mission": name,
        "status": status_word(solution.status),
        "cost": solution.plan.as_ref().map(|plan| output::number(&plan.cost)),
        "lower_bound": solution.lower_bound.as_ref().map(output::number),
        "horizon": solution.horizon,
        "proof": proof,
        "unbounded": unbounded,
        "steps": solution.plan.as_ref().map(|plan| plan.steps.iter().map(step_json).collect::<Vec<_>>()).unwrap_or_default(),
        "statistics": {
            "operators": statistics.operators,
            "variables": statistics.variables,
            "clauses": statistics.clauses,
            "families": families,
            "conflicts": statistics.conflicts,
            "solver_calls": statistics.calls,
            "milliseconds": {
                "read": milliseconds(stages.read),
                "ground": milliseconds(stages.ground),
                "search": milliseconds(statistics.search),
                "encode": milliseconds(statistics.encode),
                "solve": milliseconds(statistics.solve),
            },
        },
    })
}
