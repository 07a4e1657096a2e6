//! The command `metaplan compare`, which compares Metaplan with probabilistic model checking on a mission.

use std::path::PathBuf;
use std::time::Duration;

use crate::answers::Pair;
use crate::comparison::{
    Candidate, Coadaptation, Compared, Comparison, Config, Costs, Listener, NoResult, Risk, Roles, Tasked,
};
use crate::message::{Message, did_you_mean};
use crate::mission::Mission;
use crate::setup::Setup;
use clap::{Args, ValueEnum};

use crate::cli::common::{Common, Exit, Failure, process_failure};
use crate::cli::compare_so_far::{Begun, Shared};
use crate::cli::compare_table::{memory_since, published_rows};
use crate::cli::drawn::Pages;
use crate::cli::output;
use crate::cli::progress::Progress;
use crate::cli::situation::Situation;
use crate::cli::values::seconds;

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A mission's manifest, or a PDDL domain and a PDDL problem.
    #[arg(required = true, num_args = 1..=2, value_name = "MISSION | DOMAIN PROBLEM")]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    situation: Situation,
    /// Component that can be lost on the way, with the probability of its loss at each move.
    #[arg(long, value_name = "COMPONENT=RATE", value_parser = loss)]
    loss: Option<(String, f64)>,
    /// Penalty time of a mission that does not reach its goal. Default: ten times the time of the plan, at least
    /// 10; 10000 if there is no plan.
    #[arg(long, value_name = "TIME", value_parser = penalty)]
    penalty: Option<f64>,
    /// First priority of the published procedure.
    #[arg(long, value_enum, default_value_t = Priority::Time)]
    priority: Priority,
    /// Battery units per level of the process. Default: the value in the manifest, or 1.
    #[arg(long, value_name = "UNITS", value_parser = clap::value_parser!(u32).range(1..))]
    battery_unit: Option<u32>,
    /// Omit the battery from the process, but not from the plan.
    #[arg(long)]
    no_battery: bool,
    /// Stop if there are more than this many states.
    #[arg(long, value_name = "N", default_value_t = 20_000_000)]
    state_limit: usize,
    /// Stop after this many seconds with the comparisons so far.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    time_limit: Option<Duration>,
    /// Compare for this many pairs of start and goal, evenly selected from all pairs, instead of the mission's
    /// pair.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pairs: Option<u32>,
    /// Compare for another pair of start and goal than the mission's.
    #[arg(long, value_name = "START,GOAL", value_parser = pair, conflicts_with = "pairs")]
    pair: Option<Pair>,
    /// Also write the table as CSV.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    pages: Pages,
    /// Add rows to the table from a JSON file: a list of objects with `name` and any measures of the table.
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

fn pair(text: &str) -> Result<Pair, String> {
    let parts = text.split_once(',').filter(|(start, goal)| start != goal);
    let parts = parts.ok_or_else(|| format!("`{text}` is not of the form START,GOAL with two places"))?;
    Ok((parts.0.to_owned(), parts.1.to_owned()))
}

fn penalty(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| *value >= 0.0 && value.is_finite());
    value.ok_or_else(|| format!("`{text}` is not a time that is at least 0"))
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let so_far = Shared::new();
    so_far.show_after(arguments.time_limit, common);
    let Setup { mission, mut roles, .. } = arguments.situation.setup(&arguments.inputs, common)?;
    if let Some((component, rate)) = &arguments.loss {
        roles.loss_component = Some(component.clone());
        roles.loss_rate = *rate;
    }
    if let Some(unit) = arguments.battery_unit {
        roles.battery_unit = unit;
    }
    let (problem, warnings) = mission.filled()?;
    output::warnings(common, mission.warnings().chain(&warnings));
    let spelt_out = Coadaptation::is_spelt_out(&problem, &roles);
    let tasked = if spelt_out { None } else { Some(Tasked::new(&mission, &problem, &roles)?) };
    let coadaptation = match &tasked {
        Some(tasked) => tasked.coadaptation.clone(),
        None => Coadaptation::new(&mission, &problem, &roles)?,
    };
    if tasked.is_some() && (arguments.pairs.is_some() || arguments.pair.is_some()) {
        let text = "`--pairs` and `--pair` are for missions whose problem spells out places (see the book: Compare with PRISM)";
        return Err(Failure::usage(Message::error("M129", text)));
    }
    coadaptation.check_loss().map_err(Failure::usage)?;
    let added = match &arguments.published {
        Some(path) => published_rows(path)?,
        None => Vec::new(),
    };
    let missions = missions(arguments, &mission, coadaptation, &roles)?;
    so_far.change(|results| {
        (results.of, results.added, results.csv) = (Some(missions.len()), added, arguments.csv.clone());
        (results.mission, results.pages) = (mission.name.clone(), arguments.pages.clone());
    });
    let progress = Progress::new("comparing", common);
    let total = missions.len();
    for (number, (pair, mission, coadaptation)) in missions.into_iter().enumerate() {
        let mut report = |candidates: &[Candidate], costs: &Costs| {
            let (pair, candidates, costs) = (pair.clone(), candidates.to_vec(), costs.clone());
            so_far.change(|results| results.begun = Some(Begun { pair, candidates, costs }));
        };
        let (mission, coadaptation, tasked) = (&mission, &coadaptation, tasked.as_ref());
        let compared = Compared { mission, roles: &roles, coadaptation, tasked };
        let comparison = one(arguments, &compared, &mut report)?;
        so_far.change(|results| {
            results.begun = None;
            results.done.push((pair, comparison));
        });
        progress.set_message(format!("{} of {total} missions", number + 1));
    }
    progress.finish();
    so_far.end(common)
}

/// Returns the missions to compare: the mission itself, or variants with other starts and goals.
/// Each has the data from which its Markov decision process is built. The pair has the names of
/// start and goal of a variant; it is `None` for the mission itself.
fn missions(
    arguments: &Arguments,
    mission: &Mission,
    coadaptation: Coadaptation,
    roles: &Roles,
) -> Result<Vec<(Option<Pair>, Mission, Coadaptation)>, Failure> {
    let places = coadaptation.places.len();
    let between = |start: usize, goal: usize| -> Result<_, Failure> {
        let (start_name, goal_name) = (&coadaptation.places[start], &coadaptation.places[goal]);
        let mut variant = mission.clone();
        variant.set(&roles.location, start_name).map_err(Failure::from)?;
        variant.aim(&roles.location, goal_name);
        let moved = Coadaptation { start, goal, ..coadaptation.clone() };
        Ok((Some((start_name.clone(), goal_name.clone())), variant, moved))
    };
    if let Some((start, goal)) = &arguments.pair {
        let place = |name: &String| {
            let position = coadaptation.places.iter().position(|place| place.eq_ignore_ascii_case(name));
            position.ok_or_else(|| {
                let suggestion = did_you_mean(name, coadaptation.places.iter().map(String::as_str));
                Failure::usage(Message::error("M129", format!("there is no place `{name}`{suggestion}")))
            })
        };
        return Ok(vec![between(place(start)?, place(goal)?)?]);
    }
    let Some(count) = arguments.pairs else { return Ok(vec![(None, mission.clone(), coadaptation)]) };
    let pairs: Vec<(usize, usize)> = (0..places)
        .flat_map(|start| (0..places).filter(move |goal| *goal != start).map(move |goal| (start, goal)))
        .collect();
    let mut chosen = Vec::new();
    let count = pairs.len().min(count as usize);
    for number in 0..count {
        let (start, goal) = pairs[number * pairs.len() / count];
        chosen.push(between(start, goal)?);
    }
    Ok(chosen)
}

fn one(
    arguments: &Arguments,
    compared: &Compared<'_>,
    report: &mut Listener<'_>,
) -> Result<Comparison, Failure> {
    let mut risk = Risk::all(compared.coadaptation);
    risk.battery &= !arguments.no_battery;
    let config = Config {
        risk,
        penalty: arguments.penalty,
        priority: match arguments.priority {
            Priority::Time => crate::comparison::Priority::Time,
            Priority::Energy => crate::comparison::Priority::Energy,
            Priority::Safety => crate::comparison::Priority::Safety,
        },
        states: arguments.state_limit,
        memory: &memory_since,
    };
    let file = arguments.inputs.first().map(|input| input.display().to_string()).unwrap_or_default();
    compared.compare(&config, report).map_err(|error| match error {
        NoResult::Process(error) => process_failure(error, (&file, ""), ("property", "")),
        NoResult::Planner(messages) => messages.into(),
    })
}
