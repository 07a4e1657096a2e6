//! A comparison to a table for people, JSON and CSV; and rows that users add to it.

use std::fmt::Write as _;
use std::time::Duration;

use metaplan::comparison::{Candidate, Comparison, Costs, Measures, Stages};
use metaplan::file::source;
use metaplan::message::Message;
use serde_json::{Map, Value, json};

use crate::cli::common::Failure;
use crate::cli::output;

/// Start and goal, where a comparison is one of many.
pub type Pair = (String, String);

/// The measures of the table, in its order.
const MEASURES: [&str; 12] = [
    "goal",
    "goal_with_reserve",
    "no_collision",
    "collisions",
    "time",
    "energy",
    "reconfigurations",
    "time_if_successful",
    "energy_if_successful",
    "penalised_time",
    "replans",
    "states",
];

fn values(measures: &Measures) -> [Option<f64>; 12] {
    [
        Some(measures.goal),
        Some(measures.goal_with_reserve),
        Some(measures.no_collision),
        Some(measures.collisions),
        measures.time,
        measures.energy,
        measures.reconfigurations,
        measures.time_if_successful,
        measures.energy_if_successful,
        measures.penalised_time,
        Some(measures.replans),
        Some(measures.states as f64),
    ]
}

/// A row of the table.
#[derive(Debug, Clone)]
pub struct Row {
    pair: Option<(String, String)>,
    pub kind: String,
    name: String,
    values: Vec<Option<f64>>,
}

fn row(pair: Option<&Pair>, kind: char, name: &str, values: Vec<Option<f64>>) -> Row {
    Row { pair: pair.cloned(), kind: kind.to_string(), name: name.to_owned(), values }
}

/// The rows of the candidates that have been measured.
pub fn begun_rows(pair: Option<&Pair>, candidates: &[Candidate]) -> Vec<Row> {
    let measured = candidates
        .iter()
        .map(|candidate| row(pair, candidate.kind, &candidate.name, values(&candidate.measures).to_vec()));
    measured.collect()
}

pub fn rows(pair: Option<&Pair>, comparison: &Comparison) -> Vec<Row> {
    let mut rows = begun_rows(pair, &comparison.candidates);
    let [time, energy] = comparison.hindsight;
    let bound = |measure: &str| match measure {
        "time" | "penalised_time" => time.expected,
        "energy" => energy.expected,
        "time_if_successful" => time.least,
        "energy_if_successful" => energy.least,
        _ => None,
    };
    let bounds = MEASURES.iter().map(|measure| bound(measure)).collect();
    rows.push(row(pair, 'f', "hindsight bound, for the goal reached", bounds));
    rows
}

pub fn published_rows(path: &std::path::Path) -> Result<Vec<Row>, Failure> {
    let file = source(path)?;
    let wrong = |text: String| Message::at("M126", file.name(), None, text);
    let json: Value = serde_json::from_str(file.text()).map_err(|error| {
        Message::at("M126", file.name(), Some((error.line(), error.column())), format!("no JSON: {error}"))
    })?;
    let list = json.as_array().ok_or_else(|| wrong("a list of objects is needed".to_owned()))?;
    let mut rows = Vec::new();
    for (number, entry) in list.iter().enumerate() {
        let fields = entry.as_object().ok_or_else(|| wrong(format!("entry {}: no object", number + 1)))?;
        let unknown = fields.keys().find(|key| *key != "name" && !MEASURES.contains(&key.as_str()));
        if let Some(unknown) = unknown {
            let text = format!(
                "entry {}: `{unknown}` is no measure; these are: {}",
                number + 1,
                MEASURES.join(", ")
            );
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

/// The greatest resident memory since this was last asked, in megabytes; none where the system does not forget it.
pub fn memory_since() -> Option<u64> {
    let peak = peak_memory();
    // Linux: 5 resets the peak.
    std::fs::write("/proc/self/clear_refs", "5").ok().and(peak)
}

/// The greatest resident memory of this program in megabytes, where the system tells it.
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

pub fn row_json(row: &Row) -> Value {
    let mut fields = Map::new();
    fields.insert("kind".to_owned(), json!(row.kind));
    fields.insert("name".to_owned(), json!(row.name));
    fields.extend(MEASURES.iter().zip(&row.values).map(|(name, value)| ((*name).to_owned(), json!(value))));
    Value::Object(fields)
}

pub fn as_json(pair: Option<&Pair>, c: &Comparison) -> Value {
    let loss = c.loss.as_ref().map(|loss| {
        let steps = loss.steps.iter().map(|step| {
            json!({
                "moves": step.moves,
                "open_loop": step.open_loop,
                "replanned": step.replanned,
                "solved_again": step.solved_again,
                "anticipated": step.anticipated,
            })
        });
        json!({ "component": loss.component, "rate": loss.rate, "steps": steps.collect::<Vec<_>>() })
    });
    json!({
        "start": pair.map(|(start, _)| start),
        "goal": pair.map(|(_, goal)| goal),
        "candidates": rows(pair, c).iter().map(row_json).collect::<Vec<_>>(),
        "front": c.front,
        "penalty": c.penalty,
        "price_of_determinism": c.price_of_determinism(),
        "price_provably_zero": c.no_price,
        "price_of_open_loop": c.price_of_open_loop(),
        "value_of_replanning": c.value_of_replanning(),
        "loss": loss,
        "complete": true,
        "costs": costs_json(&c.costs),
    })
}

/// A comparison that is not done.
pub fn begun_json(pair: Option<&Pair>, candidates: &[Candidate], costs: &Costs) -> Value {
    json!({
        "start": pair.map(|(start, _)| start),
        "goal": pair.map(|(_, goal)| goal),
        "candidates": begun_rows(pair, candidates).iter().map(row_json).collect::<Vec<_>>(),
        "complete": false,
        "costs": costs_json(costs),
    })
}

fn costs_json(costs: &Costs) -> Value {
    let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
    json!({
        "states": costs.states,
        "transitions": costs.transitions,
        "plans": costs.plans,
        "variables": costs.variables,
        "clauses": costs.clauses,
        "decisions": costs.decisions,
        "milliseconds": {
            "build": milliseconds(costs.process.build),
            "solve": milliseconds(costs.process.solve),
            "extract": milliseconds(costs.process.extract),
            "first_plan": milliseconds(costs.first_plan.total()),
            "first_plan_build": milliseconds(costs.first_plan.build),
            "first_plan_solve": milliseconds(costs.first_plan.solve),
            "first_plan_extract": milliseconds(costs.first_plan.extract),
            "more_plans": milliseconds(costs.more_plans),
        },
        "peak_memory_mb": costs.process_memory.max(costs.plan_memory),
        "process_memory_mb": costs.process_memory,
        "first_plan_memory_mb": costs.plan_memory,
    })
}
