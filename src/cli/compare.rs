//! `metaplan compare`.

use std::fmt::Write as _;
use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use encodings::Limits;
use indicatif::{ProgressBar, ProgressDrawTarget};
use metaplan::message::Message;
use metaplan::mission::{Mission, source};
use metaplan::probabilistic::{
    Action, Coadaptation, Comparison, Config, Failure as Unfinished, Measures, Planned, Risk, Roles,
    Situation, compare,
};
use serde_json::{Map, Value, json};

use crate::cli::check::failure as process_failure;
use crate::cli::{Common, Exit, Failure, Format, Situation as Given, output};

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A mission's manifest, or a PDDL domain and a PDDL problem.
    #[arg(required = true, num_args = 1..=2, value_name = "MISSION | DOMAIN PROBLEM")]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    situation: Given,
    /// The component that may be lost on the way, and with which probability at each move.
    #[arg(long, value_name = "COMPONENT=RATE", value_parser = loss)]
    loss: Option<(String, f64)>,
    /// The time that a mission costs which does not get to its goal; ten times our plan's by default.
    #[arg(long, value_name = "TIME")]
    penalty: Option<f64>,
    /// What the published procedure puts first.
    #[arg(long, value_enum, default_value_t = Priority::Time)]
    priority: Priority,
    /// How much battery one level of the process stands for; the manifest's, or 1.
    #[arg(long, value_name = "UNITS", value_parser = clap::value_parser!(u32).range(1..))]
    battery_unit: Option<u32>,
    /// Leave the battery out of the process (not of our plan).
    #[arg(long)]
    no_battery: bool,
    /// Stop beyond so many states.
    #[arg(long, value_name = "N", default_value_t = 20_000_000)]
    state_limit: usize,
    /// Compare for pairs of start and goal in place of the mission's: so many, spread evenly over all pairs.
    #[arg(long, value_name = "N")]
    pairs: Option<usize>,
    /// Write the table as CSV, too.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Rows to add to the table, as JSON: a list of objects with `name` and any of the table's measures.
    #[arg(long, value_name = "FILE")]
    published: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Priority {
    Time,
    Energy,
    Safety,
}

fn loss(text: &str) -> Result<(String, f64), String> {
    let wrong = || format!("`{text}` is not of the form COMPONENT=RATE with a rate from 0 to 1");
    let (component, rate) = text.split_once('=').ok_or_else(wrong)?;
    let rate: f64 = rate.parse().map_err(|_| wrong())?;
    if (0.0..=1.0).contains(&rate) { Ok((component.to_owned(), rate)) } else { Err(wrong()) }
}

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
struct Row {
    pair: Option<(String, String)>,
    kind: String,
    name: String,
    values: Vec<Option<f64>>,
}

/// Runs the command.
pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let mission = arguments.situation.mission(&arguments.inputs)?;
    let mut roles = mission.roles().clone();
    if let Some((component, rate)) = &arguments.loss {
        roles.loss_component = Some(component.clone());
        roles.loss_rate = *rate;
    }
    if let Some(unit) = arguments.battery_unit {
        roles.battery_unit = unit;
    }
    let (problem, warnings) = mission.filled()?;
    output::warnings(common, mission.warnings().chain(&warnings));
    let coadaptation = Coadaptation::new(&mission, &problem, &roles)?;
    if let Some(loss) = &coadaptation.loss
        && !coadaptation.configurations.iter().any(|known| known.components.contains(&loss.component))
    {
        let text = format!("no configuration needs a component `{}` that could be lost", loss.component);
        return Err(Failure::usage(Message::error("M125", text)));
    }
    let mut added = match &arguments.published {
        Some(path) => published_rows(path)?,
        None => Vec::new(),
    };
    let mut comparisons = Vec::new();
    let progress = bar(arguments, common);
    for (pair, mission, coadaptation) in missions(arguments, &mission, coadaptation, &roles)? {
        comparisons.push((pair, one(arguments, &mission, &coadaptation, &roles)?));
        progress.set_position(comparisons.len() as u64);
    }
    progress.finish_and_clear();
    let mut rows: Vec<Row> =
        comparisons.iter().flat_map(|(pair, comparison)| rows(pair.as_ref(), comparison)).collect();
    rows.append(&mut added);
    if let Some(path) = &arguments.csv {
        output::write_file(path, &csv(&rows))?;
    }
    match common.format {
        Format::Json => {
            let all: Vec<Value> = comparisons.iter().map(|(pair, c)| as_json(pair.as_ref(), c)).collect();
            let more: Vec<Value> = rows.iter().filter(|row| row.kind == "+").map(row_json).collect();
            output::json_answer(
                &json!({ "format": "metaplan-compare/1", "comparisons": all, "published": more }),
            );
        }
        _ => output::answer(&as_text(&rows, &comparisons)),
    }
    Ok(Exit::Done)
}

fn bar(arguments: &Arguments, common: &Common) -> ProgressBar {
    let shown = !common.quiet && std::io::stderr().is_terminal();
    let target = if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    ProgressBar::with_draw_target(arguments.pairs.map(|pairs| pairs as u64), target)
}

type Pair = (String, String);

/// The mission itself, or the same mission between other places.
fn missions(
    arguments: &Arguments,
    mission: &Mission,
    coadaptation: Coadaptation,
    roles: &Roles,
) -> Result<Vec<(Option<Pair>, Mission, Coadaptation)>, Failure> {
    let Some(wanted) = arguments.pairs else { return Ok(vec![(None, mission.clone(), coadaptation)]) };
    let places = coadaptation.places.len();
    let all: Vec<(usize, usize)> = (0..places)
        .flat_map(|start| (0..places).filter(move |goal| *goal != start).map(move |goal| (start, goal)))
        .collect();
    let mut found = Vec::new();
    let wanted = wanted.clamp(1, all.len().max(1));
    for number in 0..wanted.min(all.len()) {
        let (start, goal) = all[number * all.len() / wanted];
        let (start_name, goal_name) = (&coadaptation.places[start], &coadaptation.places[goal]);
        let mut other = mission.clone();
        other.set(&roles.location, start_name).map_err(Failure::from)?;
        other.aim(&roles.location, goal_name);
        let moved = Coadaptation { start, goal, ..coadaptation.clone() };
        found.push((Some((start_name.clone(), goal_name.clone())), other, moved));
    }
    Ok(found)
}

fn one(
    arguments: &Arguments,
    mission: &Mission,
    coadaptation: &Coadaptation,
    roles: &Roles,
) -> Result<Comparison, Failure> {
    let mut risk = Risk::all(coadaptation);
    risk.battery &= !arguments.no_battery;
    let config = Config {
        risk,
        penalty: arguments.penalty,
        priority: arguments.priority as usize,
        states: arguments.state_limit,
    };
    let mut planner = |situation: &Situation| plan(mission, coadaptation, roles, risk, *situation);
    compare(coadaptation, &config, &mut planner).map_err(|error| match error {
        Unfinished::Process(error) => process_failure(error, &mission.name),
        Unfinished::Planner(messages) => messages.into(),
    })
}

/// The SAT planner's plan from a situation.
fn plan(
    mission: &Mission,
    coadaptation: &Coadaptation,
    roles: &Roles,
    risk: Risk,
    situation: Situation,
) -> Result<Planned, Vec<Message>> {
    let started = Instant::now();
    let one = |message| vec![message];
    let mut mission = mission.clone();
    mission.set(&roles.location, &coadaptation.places[situation.place]).map_err(one)?;
    let configuration = &coadaptation.configurations[situation.configuration].name;
    mission.set(&roles.configured, configuration).map_err(one)?;
    if let Some(battery) = coadaptation.battery.filter(|_| risk.battery) {
        let left = u64::from(situation.battery) * u64::from(battery.unit);
        mission.set(&roles.battery, &left.to_string()).map_err(one)?;
    }
    if let Some(loss) = coadaptation.loss.as_ref().filter(|_| situation.lost) {
        mission.fail(&loss.component).map_err(one)?;
    }
    let (problem, _) = mission.filled()?;
    let task = mission.ground(&problem, &[], &Limits::none())?;
    let solution = encodings::optimize(&task, &encodings::Config::default(), &mut |_| {});
    let actions = solution.plan.map(|plan| {
        let step = |step: &encodings::Step| action(coadaptation, &step.arguments);
        plan.steps.iter().filter_map(step).collect()
    });
    let statistics = &solution.statistics;
    Ok(Planned {
        actions,
        variables: statistics.variables as u64,
        clauses: statistics.clauses as u64,
        time: started.elapsed(),
    })
}

/// What a step does: between two places, or to the last design that it names.
fn action(mission: &Coadaptation, arguments: &[String]) -> Option<Action> {
    let same = |a: &str, b: &str| a.eq_ignore_ascii_case(b);
    let place = |name: &String| mission.places.iter().position(|known| same(known, name));
    let places: Vec<usize> = arguments.iter().filter_map(place).collect();
    if let [from, to] = places[..] {
        return mission.arcs.iter().position(|arc| (arc.from, arc.to) == (from, to)).map(Action::Move);
    }
    let design = arguments.last()?;
    mission.configurations.iter().position(|known| same(&known.name, design)).map(Action::Change)
}

fn rows(pair: Option<&Pair>, comparison: &Comparison) -> Vec<Row> {
    let row = |kind: &str, name: &str, values: Vec<Option<f64>>| Row {
        pair: pair.cloned(),
        kind: kind.to_owned(),
        name: name.to_owned(),
        values,
    };
    let mut rows: Vec<Row> = comparison
        .candidates
        .iter()
        .map(|candidate| {
            row(&candidate.kind.to_string(), &candidate.name, values(&candidate.measures).to_vec())
        })
        .collect();
    let mut bound = vec![None; MEASURES.len()];
    bound[4] = comparison.hindsight;
    rows.push(row("f", "hindsight bound on the time", bound));
    rows
}

fn published_rows(path: &std::path::Path) -> Result<Vec<Row>, Failure> {
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

fn as_text(rows: &[Row], comparisons: &[(Option<Pair>, Comparison)]) -> String {
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
        let k = &c.costs;
        let seconds = Duration::as_secs_f64;
        let _ = writeln!(
            text,
            "process: {} states, {} transitions, built in {:.3} s, solved in {:.3} s; \
             plans: {}, the first in {:.3} s, the others in {:.3} s, formula of {} variables and {} clauses",
            k.states,
            k.transitions,
            seconds(&k.build),
            seconds(&k.solve),
            k.plans,
            seconds(&k.first_plan),
            seconds(&k.more_plans),
            k.variables,
            k.clauses
        );
    }
    if let Some(peak) = peak_memory() {
        let _ = writeln!(text, "peak memory of all together: {peak} MB");
    }
    text
}

/// The greatest resident memory of this program in megabytes, where the system tells it.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse::<u64>().ok().map(|kilobytes| kilobytes / 1024)
}

fn csv(rows: &[Row]) -> String {
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

fn row_json(row: &Row) -> Value {
    let mut fields = Map::new();
    fields.insert("kind".to_owned(), json!(row.kind));
    fields.insert("name".to_owned(), json!(row.name));
    fields.extend(MEASURES.iter().zip(&row.values).map(|(name, value)| ((*name).to_owned(), json!(value))));
    Value::Object(fields)
}

fn as_json(pair: Option<&Pair>, c: &Comparison) -> Value {
    let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
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
        "costs": {
            "states": c.costs.states,
            "transitions": c.costs.transitions,
            "plans": c.costs.plans,
            "variables": c.costs.variables,
            "clauses": c.costs.clauses,
            "milliseconds": {
                "build": milliseconds(c.costs.build),
                "solve": milliseconds(c.costs.solve),
                "first_plan": milliseconds(c.costs.first_plan),
                "more_plans": milliseconds(c.costs.more_plans),
            },
            "peak_memory_mb": peak_memory(),
        },
    })
}
