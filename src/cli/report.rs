//! The command `metaplan report`, which writes a plan or a journal as an HTML page.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::certificate::{Verification, Verifier};
use crate::journal::JournalReport;
use crate::message::Message;
use crate::mission::Mission;
use crate::planner::Planner;
use crate::report::{Cost, Positions, changes, log_picture};
use crate::setup::Setup;
use crate::visible::visible;
use clap::Args;
use num_rational::BigRational;
use picture::{Checked, Plan, Report};
use planner::{Limits, Solution, Status};

use ::verify::Watch;

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::concurrent::Overlap;
use crate::cli::drawn::write_pictures;
use crate::cli::limits::Guard;
use crate::cli::output;
use crate::cli::plan::exit;
use crate::cli::progress::during;
use crate::cli::situation::Situation;
use crate::cli::values::seconds;

/// Time limit of the verification of a certificate without `--time-limit`, as the default of `verify`.
const VERIFICATION_TIME: Duration = Duration::from_secs(600);

/// Arguments of `report`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A mission's manifest, or a PDDL domain and a PDDL problem; `-` is standard input.
    #[arg(required_unless_present = "journal", num_args = 1..=2, value_name = "MISSION | DOMAIN PROBLEM")]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    situation: Situation,
    /// Stop after this many seconds with the best plan so far.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    time_limit: Option<Duration>,
    /// Stop with the best plan so far if the program uses more than this many megabytes of memory.
    #[arg(long, value_name = "MB", value_parser = clap::value_parser!(u64).range(1..), allow_negative_numbers = true)]
    memory_limit: Option<u64>,
    /// Include the verification of a certificate that `metaplan plan --certificate` has written.
    #[arg(long, value_name = "DIR", conflicts_with = "concurrent")]
    certificate: Option<PathBuf>,
    #[command(flatten)]
    overlap: Overlap,
    /// Report a run of the loop from its journal instead of a plan: events, inferences, plans and effects.
    #[arg(
        long,
        value_name = "DIR",
        conflicts_with_all = [
            "inputs", "certificate", "scenario", "set", "fail", "concurrent", "knowledge", "rules", "names", "catalog",
            "directory", "ignore_missing_imports",
        ]
    )]
    journal: Option<PathBuf>,
    /// Also write each picture as an SVG file to a directory; created if it does not exist.
    #[arg(long, value_name = "DIR")]
    svg: Option<PathBuf>,
    /// Write the page to a file.
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    if common.format != Format::Text {
        let text = "`report` writes HTML; the same data come as JSON from `plan --format json`";
        return Err(Failure::usage(Message::error("M107", text)));
    }
    let started = Instant::now();
    let guard = Guard::new(arguments.time_limit, arguments.memory_limit, common)?;
    arguments.svg.as_deref().map_or(Ok(()), output::require_directory)?;
    if let Some(directory) = &arguments.journal {
        return during("reading", common, || JournalReport::read(directory))
            .map_err(Failure::from)
            .and_then(|report| journal(arguments, directory, &report));
    }
    let (setup, before) = arguments.situation.setups(&arguments.inputs, common)?;
    let positions = setup.positions()?;
    output::warnings(common, setup.mission.warnings());
    let limits = guard.plan();
    let separation = arguments.overlap.separation();
    // Of two plans, the first gets half of the time.
    let first = if before.is_some() { limits.half() } else { limits.clone() };
    let answer = during("planning", common, || Answer::of(&setup.mission, &positions, separation, &first))?;
    let before = match &before {
        Some(before) => {
            let work = || Answer::of(&before.mission, &positions, separation, &limits);
            Some((before, during("planning", common, work)?))
        }
        None => None,
    };
    let (exit, verdict) = (exit(answer.solution.status), format!("{}\n", answer.solution.verdict()));
    let page = Page {
        report: page(arguments, &setup, before, answer),
        svg: arguments.svg.clone(),
        output: arguments.output.clone(),
        verdict,
        exit,
    };
    let Some(directory) = arguments.certificate.as_deref() else { return page.write(None) };
    if limits.reached() {
        return page.write(Some((directory, unchecked())));
    }
    let late = (page.clone(), directory.to_owned(), common.clone());
    let time = arguments.time_limit.map(|limit| limit.saturating_sub(started.elapsed()));
    let watch = Watch::start(time.unwrap_or(VERIFICATION_TIME), move |_| {
        let (page, directory, common) = late;
        let written = page.write(Some((&directory, unchecked())));
        let exit = written.unwrap_or_else(|failure| {
            output::failure(&common, &failure.messages);
            failure.exit
        });
        std::process::exit(exit as i32)
    });
    let verifier =
        Verifier::new(directory).mission(&setup.mission).stop(|| watch.reached() || limits.reached());
    let verification = watch.end(during("verifying", common, || verifier.verify()));
    page.write(Some((directory, checked(&verification, limits.reached()))))
}

/// A page that is complete except for the verification of a certificate.
#[derive(Clone)]
struct Page {
    report: Report,
    svg: Option<PathBuf>,
    output: Option<PathBuf>,
    /// Verdict on the plan, a line for standard error.
    verdict: String,
    /// Exit status unless a certificate is rejected.
    exit: Exit,
}

impl Page {
    /// Writes the page and its pictures, with the verification of a certificate if there is one. Returns the exit
    /// status.
    fn write(mut self, certificate: Option<(&Path, Checked)>) -> Result<Exit, Failure> {
        let rejected = certificate.as_ref().filter(|(_, checked)| !checked.verified);
        let note = rejected
            .map(|(directory, checked)| format!("{}: {}\n", directory.display(), checked.verdict))
            .unwrap_or_default();
        let is_invalid = rejected.is_some_and(|(_, checked)| !checked.stopped);
        self.report.checked = certificate.map(|(_, checked)| checked);
        if let Some(directory) = &self.svg {
            write_pictures(directory, &self.report.pictures())?;
        }
        write(self.output.as_ref(), &self.report.html(), &self.verdict)?;
        output::note(&note);
        Ok(if is_invalid { Exit::Invalid } else { self.exit })
    }
}

fn journal(arguments: &Arguments, directory: &Path, report: &JournalReport) -> Result<Exit, Failure> {
    let log = log_picture(&directory.display().to_string(), report);
    if let Some(directory) = &arguments.svg {
        write_pictures(directory, &[("log.svg".to_owned(), log.svg())])?;
    }
    write(arguments.output.as_ref(), &log.html(), &format!("{}\n", log.verdict))?;
    Ok(if report.is_sound() { Exit::Done } else { Exit::BadInput })
}

fn write(file: Option<&PathBuf>, page: &str, said: &str) -> Result<(), Failure> {
    let page = &*visible(page);
    match output::file_named(file) {
        Some(file) => {
            output::write_file(file, page)?;
            output::note(said);
        }
        None => output::document(page),
    }
    Ok(())
}

struct Answer {
    solution: Solution,
    plan: Plan,
}

impl Answer {
    /// Plans a mission. Actions may overlap if `separation` is given, the minimum time between
    /// interfering starts and ends of actions.
    fn of(
        mission: &Mission,
        positions: &Positions,
        separation: Option<&BigRational>,
        limits: &Limits,
    ) -> Result<Self, Failure> {
        let planner = Planner::new(mission)?.limits(limits.clone()).concurrent(separation.cloned());
        let planned = planner.plan().map_err(|messages| Failure::planning(messages, limits))?;
        let plan = planned.picture(positions);
        Ok(Self { solution: planned.solution, plan })
    }

    fn cost(&self) -> Cost {
        match (&self.solution.plan, self.solution.status) {
            (Some(plan), _) => Cost::Of(plan.cost.to_string()),
            (None, Status::Unsolvable) => Cost::NoPlan,
            (None, _) => Cost::NotFound,
        }
    }
}

fn page(arguments: &Arguments, setup: &Setup, before: Option<(&Setup, Answer)>, answer: Answer) -> Report {
    let name = match (setup.mission.name.as_str(), arguments.inputs.last()) {
        ("", Some(problem)) => problem.display().to_string(),
        (name, _) => name.to_owned(),
    };
    let compared = before.as_ref().map(|(old, was)| {
        changes((&old.mission, &was.plan), (&setup.mission, &answer.plan), &[was.cost(), answer.cost()])
    });
    Report {
        name,
        description: setup.description.clone(),
        situation: arguments.situation.words(),
        before: before.map(|(_, answer)| answer.plan),
        plan: answer.plan,
        changes: compared.unwrap_or_default(),
        checked: None,
    }
}

/// Converts the result of a verification. `is_interrupted` states whether a limit may have ended it early.
fn checked(report: &Verification, is_interrupted: bool) -> Checked {
    let parts = report.parts.iter().map(|part| {
        let (Ok(said) | Err(said)) = &part.result;
        (part.part.to_owned(), part.result.is_ok(), said.clone())
    });
    let parts = parts.collect();
    if !report.verified() && (is_interrupted || report.parts.iter().any(|part| part.part == "limits")) {
        return Checked { parts, ..unchecked() };
    }
    let text = report.to_string();
    let verdict = text.lines().last().unwrap_or_default().to_owned();
    Checked { verified: report.verified(), stopped: false, verdict, parts }
}

/// Result of a verification that a limit has ended.
fn unchecked() -> Checked {
    let verdict = "not checked: interrupted, or a limit on time or memory was reached".to_owned();
    Checked { verified: false, stopped: true, verdict, parts: Vec::new() }
}
