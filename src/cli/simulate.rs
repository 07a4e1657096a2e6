//! The command `metaplan simulate`, which simulates missions with different strategies.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::answers::{LogLine, SimulateAnswer, accomplished_cost, beside_joint, runs_of, sample};
use crate::mapek::{Answer, Observation};
use crate::message::Message;
use crate::mission::TimeUnit;
use crate::report::simulation_sheet;
use crate::setup::Setup;
use crate::simulate::{Ending, Experiment, Run, SUAVE_COLUMNS, Sample, Strategy};
use clap::{Args, ValueEnum};
use planner::Limits;
use serde_json::Value;

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::drawn::Pages;
use crate::cli::limits::Guard;
use crate::cli::output;
use crate::cli::progress::{Progress, during};
use crate::cli::situation::{consistent, scenario_failure};
use crate::cli::values::seconds;

/// Arguments of `simulate`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A mission's manifest.
    #[arg(value_name = "MISSION")]
    mission: PathBuf,
    /// A scenario of the manifest with a section `simulation`.
    #[arg(long, value_name = "NAME")]
    scenario: String,
    /// Strategy to simulate (repeatable). Default: all.
    #[arg(long, value_enum)]
    strategy: Vec<Who>,
    /// Number of missions per strategy, with consecutive seeds.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    runs: u32,
    /// The first seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Stop after this many seconds with the missions simulated so far.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    time_limit: Option<Duration>,
    /// Write the observations and answers of the first mission of each strategy, one JSON object per line.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// Write one line per mission, including the columns of SUAVE.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    pages: Pages,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Who {
    /// The adaptation loop.
    Joint,
    /// A new joint plan after an action has failed.
    Failure,
    /// For each function separately, the cheapest design with which the action is executable.
    Greedy,
    /// For each function, a random design with which the action is executable.
    Random,
    /// The first plan, without adaptation.
    None,
}

impl Who {
    fn strategy(self) -> Strategy {
        match self {
            Self::Joint => Strategy::Joint,
            Self::Failure => Strategy::Failure,
            Self::Greedy => Strategy::Greedy,
            Self::Random => Strategy::Random,
            Self::None => Strategy::None,
        }
    }
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let guard = Guard::new(arguments.time_limit, None, common)?;
    let mut experiment = experiment(&arguments.mission, &arguments.scenario, common)?;
    experiment.note_doubts();
    output::warnings(common, experiment.mission().warnings());
    consistent(experiment.mission().knowledge())?;
    let mut strategies: Vec<Strategy> = Vec::new();
    for strategy in arguments.strategy.iter().map(|who| who.strategy()) {
        // The missions of a repeated strategy would be counted twice.
        if !strategies.contains(&strategy) {
            strategies.push(strategy);
        }
    }
    if strategies.is_empty() {
        strategies = Strategy::ALL.to_vec();
    }
    let limits = guard.plan();
    let played = play(&experiment, &strategies, arguments, &limits, common)?;
    let runs = &played.runs;
    if let Some(file) = &arguments.log {
        output::write_file(file, &played.log)?;
    }
    if let Some(file) = &arguments.csv {
        output::write_file(file, &csv(runs))?;
    }
    let mission = &experiment.mission().name;
    if arguments.pages.are_wanted() {
        arguments.pages.write(&simulation_sheet(mission, &arguments.scenario, &strategies, runs))?;
    }
    let total = strategies.len() * arguments.runs as usize;
    let incomplete = (runs.len() < total).then(|| {
        let text = format!(
            "the time limit or an interruption stopped the simulation; the results are incomplete: {} of \
             {total} missions",
            runs.len()
        );
        Message::error("M130", text)
    });
    if common.format == Format::Json {
        let answer = SimulateAnswer::new(mission, &arguments.scenario, &strategies, runs);
        let answer = answer.timed(experiment.time_unit()).of(total, incomplete.clone().into_iter().collect());
        output::json_answer(&answer);
    } else {
        output::answer(&text(&strategies, runs, experiment.time_unit()));
        if let Some(message) = &incomplete {
            output::failure(common, std::slice::from_ref(message));
        }
    }
    Ok(if incomplete.is_some() { Exit::NothingFound } else { Exit::Done })
}

fn experiment(mission: &Path, scenario: &str, common: &Common) -> Result<Experiment, Failure> {
    let read = || Setup::read(mission)?.experiment(scenario);
    during("reading", common, read).map_err(scenario_failure)
}

pub fn subject(arguments: &Arguments) -> String {
    format!("{} {}", arguments.mission.display(), arguments.scenario)
}

/// Returns all mistakes in the mission's files or in the scenario. Paths are relative to
/// `directory`.
pub fn check(arguments: &Arguments, directory: &Path, common: &Common) -> Result<(), Failure> {
    experiment(&directory.join(&arguments.mission), &arguments.scenario, common).map(drop)
}

struct SimulationResults {
    runs: Vec<Run>,
    log: String,
}

/// Simulates missions until a limit is reached. Each seed is simulated with all strategies before
/// the next seed, so that partial results are comparable.
fn play(
    experiment: &Experiment,
    strategies: &[Strategy],
    arguments: &Arguments,
    limits: &Limits,
    common: &Common,
) -> Result<SimulationResults, Failure> {
    let total = strategies.len() as u64 * u64::from(arguments.runs);
    let progress = Progress::new("simulating", common);
    let (mut runs, mut logs) = (Vec::new(), vec![String::new(); strategies.len()]);
    'all: for number in 0..u64::from(arguments.runs) {
        let seed = arguments.seed.wrapping_add(number);
        let is_first = seed == arguments.seed && arguments.log.is_some();
        for (index, &strategy) in strategies.iter().enumerate() {
            let mut note = |observation: &Observation, answers: &[Answer]| {
                if is_first {
                    write_log(&mut logs[index], strategy, observation, answers);
                }
            };
            let Some(run) = experiment.run(strategy, seed, limits, &mut note)? else { break 'all };
            runs.push((index, run));
            progress.set_message(format!("{} of {total} missions", runs.len()));
        }
    }
    progress.finish();
    runs.sort_by_key(|(index, run)| (*index, run.seed));
    Ok(SimulationResults { runs: runs.into_iter().map(|(_, run)| run).collect(), log: logs.concat() })
}

fn write_log(log: &mut String, strategy: Strategy, observation: &Observation, answers: &[Answer]) {
    let mut line = |object: Value| *log += &output::line(&LogLine::new(object, strategy));
    line(observation.to_json());
    for answer in answers {
        line(answer.to_json());
    }
}

fn text(strategies: &[Strategy], runs: &[Run], unit: TimeUnit) -> String {
    let show = |sample: Option<Sample>| {
        sample.map_or_else(
            || "none".to_owned(),
            |s| {
                if s.count < 2 {
                    format!("{:.2}", s.mean)
                } else {
                    format!("{:.2} ± {:.2} (sd {:.2})", s.mean, s.half_width, s.deviation)
                }
            },
        )
    };
    let rows = strategies.iter().map(|&strategy| {
        let mine = runs_of(runs, strategy);
        let (count, done) = (mine.clone().count(), mine.filter(|run| run.accomplished).count());
        let beside = beside_joint(runs, strategy).filter(|_| strategy != Strategy::Joint);
        vec![
            strategy.name().to_owned(),
            format!("{done} of {count}"),
            show(sample(runs, strategy, accomplished_cost)),
            show(sample(runs, strategy, Run::mean_reaction)),
            show(sample(runs, strategy, |run| Some(run.failed as f64))),
            show(sample(runs, strategy, |run| Some(run.reconfigurations as f64))),
            show(sample(runs, strategy, |run| Some(run.distinct as f64))),
            beside.map_or_else(String::new, |(better, worse)| format!("{better} / {worse}")),
        ]
    });
    let reaction = format!("reaction ({unit})");
    let header = [
        "strategy",
        "accomplished",
        "cost, if accomplished",
        &reaction,
        "failed actions",
        "reconfigurations",
        "configurations",
        "better / worse than joint",
    ];
    output::table(&header, rows) + &failures_text(strategies, runs)
}

fn failures_text(strategies: &[Strategy], runs: &[Run]) -> String {
    let mut text = String::new();
    for &strategy in strategies {
        let count = |ending: Ending| runs_of(runs, strategy).filter(|run| run.ending == ending).count();
        let reasons = [Ending::Time, Ending::Lost, Ending::GaveUp].map(|ending| (count(ending), ending));
        let reasons: Vec<String> = reasons
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, ending)| format!("{count} {ending}"))
            .collect();
        let (all, done) = (runs_of(runs, strategy).count(), count(Ending::Goal));
        if !reasons.is_empty() {
            let done = if done == 0 { "none".to_owned() } else { done.to_string() };
            let _ =
                writeln!(text, "{}: {done} of {all} accomplished; {}", strategy.name(), reasons.join(", "));
        }
    }
    if text.is_empty() { text } else { format!("\n{text}") }
}

fn csv(runs: &[Run]) -> String {
    let mut text = String::from(
        "strategy,seed,accomplished,cost,time,plans,failed,cancelled,reconfigurations,configurations,",
    );
    text += &SUAVE_COLUMNS.join(",");
    text.push('\n');
    for run in runs {
        let _ = writeln!(
            text,
            "{},{},{},{:.3},{:.3},{},{},{},{},{},{}",
            run.strategy.name(),
            run.seed,
            run.accomplished,
            run.cost,
            run.time,
            run.plans,
            run.failed,
            run.cancelled,
            run.reconfigurations,
            run.distinct,
            run.suave().join(",")
        );
    }
    text
}
