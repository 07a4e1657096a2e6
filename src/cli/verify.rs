//! The command `metaplan verify`, which checks a certificate.

use std::path::PathBuf;
use std::time::Duration;

use crate::certificate::{Verification, Verifier};
use clap::Args;

use ::verify::{Watch, json};

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::output;
use crate::cli::progress::during;
use crate::cli::situation::Situation;
use crate::cli::values::{seconds, setting};

/// Arguments of `verify`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The directory written by `metaplan plan --certificate`.
    directory: PathBuf,
    /// Also write the argument as verification conditions in SMT-LIB 2. An SMT solver has to answer `unsat` to each.
    #[arg(long, value_name = "FILE")]
    smt: Option<PathBuf>,
    /// Fail if the verification takes more than this many seconds.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true, default_value = "600")]
    time_limit: Duration,
    /// Also check that the certificate is about the mission with this manifest.
    #[arg(long, value_name = "MISSION")]
    mission: Option<PathBuf>,
    /// Apply a scenario of the mission's manifest.
    #[arg(long, value_name = "NAME", requires = "mission")]
    scenario: Option<String>,
    /// Set a value, as with `plan --set` (repeatable).
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting, requires = "mission")]
    set: Vec<(String, String)>,
    /// Mark a component as failed (repeatable).
    #[arg(long, value_name = "COMPONENT", requires = "mission")]
    fail: Vec<String>,
}

/// Runs `metaplan verify` and returns the exit status of the program.
pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let format = common.format;
    let watch =
        Watch::start(arguments.time_limit, move |report| std::process::exit(show(report, format) as i32));
    let verifier = Verifier::new(&arguments.directory).stop(|| watch.reached());
    if let Some(file) = &arguments.smt {
        output::write_file(file, &verifier.conditions()?)?;
    }
    let mission = match &arguments.mission {
        Some(manifest) => {
            let situation = Situation::of_mission(
                arguments.scenario.clone(),
                arguments.set.clone(),
                arguments.fail.clone(),
            );
            Some(situation.mission(std::slice::from_ref(manifest), common)?)
        }
        None => None,
    };
    let report = during("verifying", common, || verifier.mission(mission.as_ref()).verify());
    Ok(show(&watch.end(report), format))
}

fn show(report: &Verification, format: Format) -> Exit {
    output::document(&match format {
        Format::Json => json(report),
        _ => report.to_string(),
    });
    if report.verified() { Exit::Done } else { Exit::Invalid }
}
