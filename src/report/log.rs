//! Converts a journal of a loop to a picture.

use picture::{Happening, Kind, Log, Reason};
use serde_json::Value;

use crate::journal::JournalReport;

/// Returns the picture of a journal; `name` is its title.
pub fn log_picture(name: &str, journal: &JournalReport) -> Log {
    let mut happenings = Vec::new();
    let mut time = 0.0;
    for entry in &journal.entries {
        let record = entry.record;
        if let Some(microseconds) = entry.time {
            time = microseconds as f64 / 1e6;
        }
        match &entry.content {
            Value::String(line) => {
                let text = line.clone();
                happenings.push(Happening { record, time, kind: Kind::Event, text, because: Vec::new() });
            }
            Value::Array(answers) => happenings.extend(answers.iter().map(|answer| {
                let (kind, text, because) = happening(answer);
                Happening { record, time, kind, text, because }
            })),
            _ => {}
        }
    }
    let verdict = if journal.is_sound() { "The journal can be used." } else { "The journal cannot be used." };
    let messages = journal.messages.iter().map(|message| message.text().trim_end().to_owned());
    Log {
        name: name.to_owned(),
        verdict: verdict.to_owned(),
        parts: journal.parts.clone(),
        messages: messages.collect(),
        happenings,
    }
}

fn happening(answer: &Value) -> (Kind, String, Vec<Reason>) {
    let word = |field: &str| plain(&answer[field]);
    match answer["answer"].as_str().unwrap_or_default() {
        "inferred" => inferred(answer),
        "contradicted" => (
            Kind::Inference,
            "the knowledge has become inconsistent, or consistent again".to_owned(),
            lines(&answer["contradictions"]),
        ),
        "unconcluded" => {
            (Kind::Inference, format!("the conclusions are unknown: {}", word("message")), Vec::new())
        }
        "plan_requested" => (Kind::Plan, "planning has started".to_owned(), lines(&answer["because"])),
        "plan_found" => {
            let steps: Vec<Reason> =
                list(&answer["steps"]).iter().map(|step| leaf(action(step, "action"))).collect();
            let proved = if answer["optimal"] == Value::Bool(true) { ", optimal" } else { "" };
            (Kind::Plan, format!("a plan of {} steps, cost {}{proved}", steps.len(), word("cost")), steps)
        }
        "plan_kept" => (Kind::Plan, format!("the plan is kept: {}", word("because")), Vec::new()),
        "plan_none" => (
            Kind::Plan,
            format!("no plan ({}): {}", word("status"), word("because")),
            lines(&answer["blocking"]),
        ),
        "goal_reached" => (Kind::Plan, "the goal is reached".to_owned(), Vec::new()),
        "request_action" => (Kind::Effect, format!("begin {}", action(answer, "name")), Vec::new()),
        "reconfigure" => {
            let from = answer["from"].as_str().map(|from| format!(" in place of {from}")).unwrap_or_default();
            let to = answer["to"].as_str().unwrap_or("no design");
            (Kind::Effect, format!("{} gets {to}{from}", word("function")), lines(&answer["because"]))
        }
        "unserved" => {
            (Kind::Effect, format!("no design can serve {}", word("objective")), lines(&answer["because"]))
        }
        "cancel_action" => (Kind::Effect, format!("cancel: {}", word("because")), Vec::new()),
        "suspend_action" => (Kind::Effect, format!("suspend: {}", word("because")), Vec::new()),
        "resume_action" => (Kind::Effect, "resume".to_owned(), Vec::new()),
        "filtered" => {
            let text = format!("{} {} is not adopted yet: {}", word("name"), word("value"), word("because"));
            (Kind::Inference, text, Vec::new())
        }
        "silent" => {
            let value = answer["value"].as_number().map(|value| format!(", {value}")).unwrap_or_default();
            (Kind::Inference, format!("{} is silent: {}{value}", word("name"), word("outcome")), Vec::new())
        }
        "error" => (Kind::Refusal, format!("{}: {}", word("code"), word("message")), Vec::new()),
        other => (Kind::Refusal, other.to_owned(), Vec::new()),
    }
}

fn inferred(answer: &Value) -> (Kind, String, Vec<Reason>) {
    let designs = list(&answer["designs"]).iter().map(|design| {
        let is = if design["available"] == Value::Bool(true) { "is available" } else { "is not available" };
        Reason { text: format!("{} {is}", plain(&design["design"])), supports: lines(&design["because"]) }
    });
    let objectives = list(&answer["objectives"]).iter().map(|objective| {
        let statuses: Vec<String> = list(&objective["statuses"]).iter().map(plain).collect();
        let statuses = if statuses.is_empty() { "no error".to_owned() } else { statuses.join(", ") };
        Reason {
            text: format!("{}: {statuses}", plain(&objective["objective"])),
            supports: lines(&objective["because"]),
        }
    });
    let reasons: Vec<Reason> = designs.chain(objectives).collect();
    let text: Vec<&str> = reasons.iter().map(|reason| reason.text.as_str()).collect();
    (Kind::Inference, text.join("; "), reasons)
}

fn action(step: &Value, name: &str) -> String {
    let arguments = list(&step["arguments"]).iter().map(plain);
    let words: Vec<String> = std::iter::once(plain(&step[name])).chain(arguments).collect();
    let designs = step["configuration"].as_object().into_iter().flatten();
    let designs: Vec<String> =
        designs.map(|(function, design)| format!("{function} = {}", plain(design))).collect();
    if designs.is_empty() { words.join(" ") } else { format!("{} ({})", words.join(" "), designs.join(", ")) }
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map(Vec::as_slice).unwrap_or_default()
}

fn lines(value: &Value) -> Vec<Reason> {
    match value {
        Value::Array(all) => all.iter().map(|entry| leaf(plain(entry))).collect(),
        Value::String(text) => vec![leaf(text.clone())],
        _ => Vec::new(),
    }
}

fn leaf(text: String) -> Reason {
    Reason { text, supports: Vec::new() }
}

fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), ToOwned::to_owned)
}
