//! `metaplan verify`.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use encodings::Limits;
use metaplan::answers::VerificationAnswer;
use metaplan::certificate::{Claim, Verification, VerifiedPart, conditions, verify};

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::memory;
use crate::cli::output;
use crate::cli::situation::Situation;
use crate::cli::values::{seconds, setting};

/// The process may take so much, in megabytes of 2^20 bytes: a certificate may come from anybody.
const MEMORY_LIMIT: u64 = 4096;
/// So long after a limit has been reached the verification is given up from outside.
const GRACE: Duration = Duration::from_secs(2);
const LATE: &str = "it takes longer than `--time-limit` allows";
const INTERVAL: Duration = Duration::from_millis(50);

/// Arguments of `verify`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// What `metaplan plan --certificate` has written.
    directory: PathBuf,
    /// Write the argument as verification conditions in SMT-LIB 2, too: an SMT solver has to answer `unsat` to each.
    #[arg(long, value_name = "FILE")]
    smt: Option<PathBuf>,
    /// The verification fails if it takes more seconds.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true, default_value = "600")]
    time_limit: Duration,
    /// Whether the certificate is about this mission, too: its manifest.
    #[arg(long, value_name = "MISSION")]
    mission: Option<PathBuf>,
    /// The mission in this situation: a scenario of its manifest.
    #[arg(long, value_name = "NAME", requires = "mission")]
    scenario: Option<String>,
    /// As with `plan` (repeatable).
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting, requires = "mission")]
    set: Vec<(String, String)>,
    /// As with `plan` (repeatable).
    #[arg(long, value_name = "COMPONENT", requires = "mission")]
    fail: Vec<String>,
}

/// Runs the command.
pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let started = Instant::now();
    let limits = Limits::none().with_time(arguments.time_limit);
    let answered = Arc::new(AtomicBool::new(false));
    give_up_late(limits.clone(), Arc::clone(&answered), common.format);
    // Where the platform does not tell how much memory is taken, there is no limit on it.
    let _ = memory::watch(MEMORY_LIMIT, limits.interrupt());
    if let Some(file) = &arguments.smt {
        output::write_file(file, &conditions(&arguments.directory, &limits)?)?;
    }
    let mission = match &arguments.mission {
        Some(manifest) => {
            let situation = Situation::of_mission(
                arguments.scenario.clone(),
                arguments.set.clone(),
                arguments.fail.clone(),
            );
            Some(situation.mission(std::slice::from_ref(manifest))?)
        }
        None => None,
    };
    let mut report = verify(&arguments.directory, mission.as_ref(), &limits);
    if started.elapsed() > arguments.time_limit {
        report.parts.push(VerifiedPart { part: "limits", result: Err(LATE.to_owned()) });
    }
    while answered.swap(true, Ordering::Relaxed) {
        std::thread::park();
    }
    Ok(show(&report, common.format))
}

/// Not all that is done looks at the limits, so that a thread of its own ends the program.
fn give_up_late(limits: Limits, answered: Arc<AtomicBool>, format: Format) {
    std::thread::spawn(move || {
        while !limits.reached() {
            std::thread::sleep(INTERVAL);
        }
        std::thread::sleep(GRACE);
        if !answered.swap(true, Ordering::Relaxed) {
            let reason = format!("{LATE}, or more than {MEMORY_LIMIT} MB");
            let report = Verification {
                claim: None,
                parts: vec![VerifiedPart { part: "limits", result: Err(reason) }],
            };
            std::process::exit(show(&report, format) as i32);
        }
    });
}

fn show(report: &Verification, format: Format) -> Exit {
    match format {
        Format::Json => output::json_answer(&VerificationAnswer::new(report)),
        _ => output::answer(&text(report)),
    }
    if report.verified() { Exit::Done } else { Exit::Invalid }
}

fn text(report: &Verification) -> String {
    let mut text = String::new();
    for part in &report.parts {
        let _ = match &part.result {
            Ok(said) => writeln!(text, "{:11} verified: {said}", part.part),
            Err(reason) => writeln!(text, "{:11} failed: {reason}", part.part),
        };
    }
    let claim = match &report.claim {
        Some(Claim::Optimal { metric }) => format!("the plan is optimal, metric {metric}"),
        Some(Claim::Unsolvable) => "there is no plan".to_owned(),
        None => "nothing is claimed".to_owned(),
    };
    let verdict = if report.verified() { "verified" } else { "NOT verified" };
    let _ = writeln!(text, "{verdict}: {claim}");
    text
}
