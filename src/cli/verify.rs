//! The command `metaplan verify`, which checks a certificate.

use std::path::PathBuf;
use std::time::Duration;

use crate::answers::{VerifyAnswer, theorem_line};
use crate::certificate::{ProvedChecker, Theorem, Verification, Verifier};
use clap::Args;

use ::verify::Watch;

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::output;
use crate::cli::progress::during;
use crate::cli::situation::Situation;
use crate::cli::values::{seconds, setting};
use crate::visible::{pretty, visible_json};

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
    /// Also run the checker that is extracted from a Coq proof, and name the parts that the theorem covers. Its programs `metaplan-proved-prepare`, `metaplan-proved-check`, `metaplan-proved-front`, `metaplan-proved-knowledge` and `metaplan-proved-mission` are found in FOLDER, or in the folder of this program and in PATH.
    #[arg(long, value_name = "FOLDER", num_args = 0..=1, require_equals = true)]
    #[expect(clippy::option_option, reason = "the option may have no value")]
    proved: Option<Option<PathBuf>>,
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let format = common.format;
    let checker = match &arguments.proved {
        Some(folder) => Some(ProvedChecker::find(folder.as_deref())?),
        None => None,
    };
    let watch = Watch::start(arguments.time_limit, move |report| {
        std::process::exit(show(report, None, format) as i32)
    });
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
    let verifier = verifier.mission(mission.as_ref());
    let mut report = during("verifying", common, || verifier.verify());
    let theorem = match checker {
        Some(checker) => Some(during("running the proved checker", common, || {
            checker.compare(&arguments.directory, &mut report, &|| watch.reached())
        })?),
        None => None,
    };
    let report = watch.end(report);
    let theorem = theorem.map(|theorem| theorem.of_verified(&report));
    Ok(show(&report, theorem.as_ref(), format))
}

fn show(report: &Verification, theorem: Option<&Theorem>, format: Format) -> Exit {
    output::document(&match format {
        Format::Json => visible_json(&pretty(&VerifyAnswer::new(report, theorem))).into_owned(),
        _ => report.to_string() + &theorem.map(theorem_line).unwrap_or_default(),
    });
    match theorem {
        _ if !report.verified() => Exit::Invalid,
        Some(Theorem::None(_)) => Exit::NotProved,
        _ => Exit::Done,
    }
}
