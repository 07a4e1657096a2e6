//! JSON Schemas of a recording's topics, and the assignment of answers to topics by kind.

use schemars::Schema;
use serde_json::{Value, json};

pub(super) const DIAGNOSTICS: &str = "/diagnostics";

pub(super) const EVENTS: &str = "/metaplan/events";

pub(super) const EVENT: &str = "metaplan.Event";

pub(super) const ANSWER: &str = "metaplan.Answer";

/// Topics of answers, each with the kinds of its answers. Kinds that are not listed belong to the
/// last topic.
pub(super) const ANSWERS: [(&str, &[&str]); 4] = [
    ("/metaplan/inferences", &["inferred", "contradicted", "unconcluded", "filtered", "silent"]),
    ("/metaplan/plans", &["plan_requested", "planning", "plan_found", "plan_kept", "plan_none"]),
    (
        "/metaplan/effects",
        &[
            "reconfigure",
            "request_action",
            "cancel_action",
            "suspend_action",
            "resume_action",
            "goal_reached",
        ],
    ),
    ("/metaplan/loop", &[]),
];

pub(super) fn topic(kind: &str) -> usize {
    ANSWERS.iter().position(|(_, kinds)| kinds.contains(&kind)).unwrap_or(ANSWERS.len() - 1)
}

pub(super) fn event() -> Value {
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": EVENT,
        "description": "A line of input of the loop",
        "type": "object",
        "properties": {
            "line": {"type": "integer", "description": "number of the line, from 1"},
            "nanoseconds": {"type": "integer", "description": "time since the start of the mission, measured by the loop"},
            "event": {
                "type": "object",
                "description": "the unchanged line, in the format metaplan-events/1",
                "properties": {
                    "event": {"type": "string"},
                    "seq": {"type": "integer"},
                    "time": {"type": "number", "description": "seconds since the start of the mission, given by the sender"}
                }
            },
            "text": {"type": "string", "description": "the unchanged line, if it is not a JSON object"}
        },
        "required": ["line", "nanoseconds"]
    })
}

/// Returns the JSON Schema of the loop's answers, with or without a plan.
pub fn answer_schema() -> Schema {
    let mut schema = answer();
    // The answer `ready` of `run --configure` lists the names of the objectives.
    schema["properties"]["objectives"]["items"]["type"] = json!(["object", "string"]);
    Schema::try_from(schema).unwrap_or_default()
}

pub(super) fn answer() -> Value {
    let texts = json!({"type": "array", "items": {"type": "string"}});
    let step = json!({
        "type": "object",
        "properties": {
            "action": {"type": "string"},
            "arguments": texts,
            "configuration": {"type": "object", "additionalProperties": {"type": "string"}},
            "duration": {"type": "number"},
            "cost": {"type": "number"}
        }
    });
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": ANSWER,
        "description": "An answer of the loop, in the format metaplan-events/1",
        "type": "object",
        "properties": {
            "answer": {"type": "string", "description": "kind of the answer"},
            "line": {"type": "integer", "description": "number of the line that it answers; 0 before the first"},
            "designs": {"type": "array", "items": {"type": "object", "properties": {
                "design": {"type": "string"}, "available": {"type": "boolean"}, "because": texts
            }}},
            "objectives": {"type": "array", "items": {"type": "object", "properties": {
                "objective": {"type": "string"}, "statuses": texts, "because": texts
            }}},
            "cost": {"type": ["number", "null"], "description": "contribution of a plan or a step to the metric"},
            "lower_bound": {"type": ["number", "null"], "description": "lower bound on the contribution of every plan"},
            "optimal": {"type": "boolean"},
            "steps": {"type": "array", "items": step},
            "status": {"type": "string"},
            "effect": {"type": ["integer", "null"], "description": "number of an effect; null if an acknowledged action is overdue"},
            "action": {"type": "integer", "description": "number of the action to which an effect belongs"},
            "name": {"type": "string", "description": "name of a requested action"},
            "arguments": texts,
            "configuration": {"type": "object", "additionalProperties": {"type": "string"}},
            "duration": {"type": "number"},
            "function": {"type": ["string", "null"]},
            "from": {"type": ["string", "null"]},
            "to": {"type": ["string", "null"]},
            "objective": {"type": "string", "description": "without a task plan: the objective that a design is for"},
            "seconds": {"type": "integer"},
            "microseconds": {"type": "integer"},
            "code": {"type": ["string", "null"]},
            "message": {"type": ["string", "null"]}
        },
        "required": ["answer"]
    })
}
