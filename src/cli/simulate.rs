//! `metaplan simulate`.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use metaplan::answers::{LogLine, SimulateAnswer, accomplished_cost, beside_joint, runs_of, sample};
use metaplan::mapek::{Answer, Observation, Settings};
use metaplan::message::Message;
use metaplan::mission::Mission;
use metaplan::report::simulation_sheet;
use metaplan::setup::Setup;
use metaplan::simulate::{Run, SUAVE_COLUMNS, Sample, Simulation, Strategy, simulate};
use serde_json::Value;

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::drawn::Pages;
use crate::cli::output;
use crate::cli::progress::Progress;
use crate::cli::situation::consistent;

/// Arguments of `simulate`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A mission's manifest.
    #[arg(value_name = "MISSION")]
    mission: PathBuf,
    /// A scenario of the manifest that says what a simulated robot meets.
    #[arg(long, value_name = "NAME")]
    scenario: String,
    /// Who decides (repeatable; all without it).
    #[arg(long, value_enum)]
    strategy: Vec<Who>,
    /// So many missions for each strategy, with seeds that count up.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    runs: u32,
    /// The first seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Write what was observed and answered in the first mission of each strategy, one JSON object a line.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// Write one line for each mission, with the columns of SUAVE among others.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    pages: Pages,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Who {
    /// The adaptation loop.
    Joint,
    /// A new joint plan when an action has failed.
    Failure,
    /// For each function by itself the best design.
    Greedy,
    /// Any available design.
    Random,
    /// The first plan to its end.
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

/// Runs the command.
pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let Setup { mut mission, settings: control, scenarios, .. } = Setup::read(&arguments.mission)?;
    let known = || {
        let simulated = scenarios.iter().filter(|(_, scenario)| scenario.simulation.is_some());
        simulated.map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ")
    };
    let scenario = scenarios.get(&arguments.scenario);
    let Some((scenario, settings)) =
        scenario.and_then(|scenario| Some((scenario, scenario.simulation.as_ref()?)))
    else {
        let name = &arguments.scenario;
        let (known, why) = (
            known(),
            if scenario.is_some() {
                "its scenario has no `simulation` section"
            } else {
                "there is none of that name"
            },
        );
        let known = if known.is_empty() {
            "no scenario of this mission can".to_owned()
        } else {
            format!("these can: {known}")
        };
        let text = format!("`{name}` cannot be simulated: {why}; {known}");
        return Err(Failure::usage(Message::error("M108", text)));
    };
    scenario.apply(&mut mission)?;
    output::warnings(common, mission.warnings());
    consistent(mission.knowledge())?;
    let strategies: Vec<Strategy> = if arguments.strategy.is_empty() {
        Strategy::ALL.to_vec()
    } else {
        arguments.strategy.iter().map(|who| who.strategy()).collect()
    };
    let mut log = String::new();
    let runs = play(&mission, &control, settings, &strategies, arguments, common, &mut log)?;
    if let Some(file) = &arguments.log {
        output::write_file(file, &log)?;
    }
    if let Some(file) = &arguments.csv {
        output::write_file(file, &csv(&runs))?;
    }
    if arguments.pages.are_wanted() {
        arguments.pages.write(&simulation_sheet(&mission.name, &arguments.scenario, &strategies, &runs))?;
    }
    match common.format {
        Format::Json => {
            output::json_answer(&SimulateAnswer::new(&mission.name, &arguments.scenario, &strategies, &runs));
        }
        _ => output::answer(&text(&strategies, &runs)),
    }
    Ok(Exit::Done)
}

fn play(
    mission: &Mission,
    control: &Settings,
    settings: &Simulation,
    strategies: &[Strategy],
    arguments: &Arguments,
    common: &Common,
    log: &mut String,
) -> Result<Vec<Run>, Failure> {
    let total = strategies.len() as u64 * u64::from(arguments.runs);
    let progress = Progress::new("simulating", common);
    let mut runs = Vec::new();
    for &strategy in strategies {
        for seed in (arguments.seed..).take(arguments.runs as usize) {
            let is_first = seed == arguments.seed && arguments.log.is_some();
            let mut note = |observation: &Observation, answers: &[Answer]| {
                if is_first {
                    write_log(log, strategy, observation, answers);
                }
            };
            runs.push(simulate(mission, control, settings, strategy, seed, &mut note)?);
            progress.set_message(format!("{} of {total} missions", runs.len()));
        }
    }
    progress.finish();
    Ok(runs)
}

fn write_log(log: &mut String, strategy: Strategy, observation: &Observation, answers: &[Answer]) {
    let mut line = |object: Value| *log += &output::line(&LogLine::new(object, strategy));
    line(observation.to_json());
    for answer in answers {
        line(answer.to_json());
    }
}

fn text(strategies: &[Strategy], runs: &[Run]) -> String {
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
    let header = [
        "strategy",
        "accomplished",
        "cost, if accomplished",
        "reaction",
        "failed actions",
        "reconfigurations",
        "configurations",
        "better / worse than joint",
    ];
    output::table(&header, rows)
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
