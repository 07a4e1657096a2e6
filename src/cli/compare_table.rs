//! Formats a comparison as text and CSV, reads additional rows from a file, and measures peak memory.

use std::fmt::Write as _;

use crate::answers::{MEASURES, Pair, Row};
use crate::comparison::{Comparison, Costs, Stages};
use crate::file::source;
use crate::message::Message;
use serde_json::Value;

use crate::cli::common::Failure;
use crate::cli::output;

pub fn published_rows(path: &std::path::Path) -> Result<Vec<Row>, Failure> {
    let file = source(path)?;
    let wrong = |text: String| Message::at("M126", file.name(), None, text);
    let json: Value = serde_json::from_str(file.text()).map_err(|error| {
        Message::at(
            "M126",
            file.name(),
            Some((error.line(), error.column())),
            format!("this is not JSON: {error}"),
        )
        .with_source(file.text())
    })?;
    let list = json.as_array().ok_or_else(|| wrong("a list of objects is needed".to_owned()))?;
    let mut rows = Vec::new();
    for (number, entry) in list.iter().enumerate() {
        let fields = entry.as_object().ok_or_else(|| wrong(format!("entry {}: no object", number + 1)))?;
        let unknown = fields.keys().find(|key| *key != "name" && !MEASURES.contains(&key.as_str()));
        if let Some(unknown) = unknown {
            let text = format!(
                "entry {}: `{unknown}` is not a measure; these are: {}",
                number + 1,
                MEASURES.join(", ")
            );
            return Err(wrong(text).into());
        }
        let is_fitting = |(key, value): &(&String, &Value)| match key.as_str() {
            "name" => value.is_string(),
            _ => value.is_null() || value.as_f64().is_some(),
        };
        if let Some((key, value)) = fields.iter().find(|field| !is_fitting(field)) {
            let expected = if key == "name" { "a text" } else { "a number, or null if it is not known" };
            let text = format!("entry {}: `{key}` is {value}, but should be {expected}", number + 1);
            return Err(wrong(text).into());
        }
        rows.push(Row {
            pair: None,
            kind: "+".to_owned(),
            name: entry["name"].as_str().unwrap_or("published").to_owned(),
            values: MEASURES.iter().map(|measure| entry[*measure].as_f64()).collect(),
        });
    }
    Ok(rows)
}

fn shown(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{}", (value * 1e6).round() / 1e6))
}

pub fn as_text(rows: &[Row], comparisons: &[(Option<Pair>, Comparison)]) -> String {
    let columns = [
        "P(goal)",
        "P(reserve)",
        "P(no hit)",
        "hits",
        "time",
        "energy",
        "reconf.",
        "time|goal",
        "energy|goal",
        "penalised",
        "re-plans",
    ];
    let mut header = vec!["", "candidate"];
    header.extend(columns);
    let name = |row: &Row| match &row.pair {
        Some((start, goal)) => format!("{start}-{goal}: {}", row.name),
        None => row.name.clone(),
    };
    let table = output::table(
        &header,
        rows.iter().map(|row| {
            let cells = row.values.iter().take(columns.len()).map(|value| shown(*value));
            [row.kind.clone(), name(row)].into_iter().chain(cells).collect()
        }),
    );
    let mut text = table;
    for (pair, c) in comparisons {
        let of = pair.as_ref().map(|(start, goal)| format!("{start}-{goal}: ")).unwrap_or_default();
        let _ = writeln!(text, "\n{of}a mission that fails costs {}", shown(Some(c.penalty)));
        let proved = c.no_price.map(|why| format!(" (provably zero: {why})")).unwrap_or_default();
        let _ = writeln!(text, "price of determinism {}{proved}", shown(c.price_of_determinism()));
        let _ = writeln!(
            text,
            "price of the open loop {}, value of re-planning {}",
            shown(c.price_of_open_loop()),
            shown(c.value_of_replanning())
        );
        let front: Vec<_> =
            c.front.iter().map(|[t, p]| format!("({}, {})", shown(Some(*t)), shown(Some(*p)))).collect();
        let _ = writeln!(text, "front of time and P(goal, no collision): {}", front.join(" "));
        if let Some(loss) = &c.loss {
            let _ = writeln!(text, "{} is lost after …", loss.component);
            let steps = loss.steps.iter().map(|step| {
                let times = [step.open_loop, step.replanned, step.solved_again, step.anticipated];
                std::iter::once(step.moves.to_string()).chain(times.map(shown)).collect()
            });
            text += &output::table(
                &["moves", "plan carried on", "new plan", "solved again", "anticipating"],
                steps,
            );
        }
        let _ = writeln!(text, "{}", costs_text(&c.costs));
    }
    text
}

pub fn costs_text(k: &Costs) -> String {
    let stages = |times: &Stages| {
        let seconds = [times.build, times.solve, times.extract].map(|time| time.as_secs_f64());
        format!(
            "built in {:.3} s, solved in {:.3} s, read out in {:.4} s",
            seconds[0], seconds[1], seconds[2]
        )
    };
    let memory = |peak: Option<u64>| peak.map(|peak| format!(", at most {peak} MB")).unwrap_or_default();
    format!(
        "process: {} states, {} transitions, {}{}\n\
         plans: {}, formula of {} variables and {} clauses; the first {}{}; the others in {:.3} s",
        k.states,
        k.transitions,
        stages(&k.process),
        memory(k.process_memory),
        k.plans,
        k.variables,
        k.clauses,
        stages(&k.first_plan),
        memory(k.plan_memory),
        k.more_plans.as_secs_f64()
    )
}

/// Returns the peak resident memory in megabytes since the last call, or since the start of the
/// program, and resets the peak. Returns `None` if the system does not support this.
pub fn memory_since() -> Option<u64> {
    let peak = peak_memory();
    // Linux: 5 resets the peak.
    std::fs::write("/proc/self/clear_refs", "5").ok().and(peak)
}

/// Returns the peak resident memory of this program in megabytes.
pub fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse::<u64>().ok().map(|kilobytes| kilobytes / 1024)
}

pub fn csv(rows: &[Row]) -> String {
    let mut text = format!("start,goal_place,kind,candidate,{}\n", MEASURES.join(","));
    for row in rows {
        let (start, goal) = row.pair.clone().unwrap_or_default();
        let values: Vec<_> =
            row.values.iter().map(|value| value.map(|v| v.to_string()).unwrap_or_default()).collect();
        let name = row.name.replace('"', "\"\"");
        let _ = writeln!(text, "{start},{goal},{},\"{name}\",{}", row.kind, values.join(","));
    }
    text
}
