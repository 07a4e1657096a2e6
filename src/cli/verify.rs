//! `metaplan verify`.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use encodings::Limits;
use metaplan::certificate::{Claim, Report, conditions, verify};
use serde_json::json;

use crate::cli::{Common, Exit, Failure, Format, memory, output};

/// Grounding ends when the process takes more, in megabytes of 2^20 bytes: a certificate may come from anybody.
const MEMORY_LIMIT: u64 = 4096;

/// Arguments of `verify`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// What `metaplan plan --certificate` has written.
    directory: PathBuf,
    /// Write the argument as verification conditions in SMT-LIB 2, too: an SMT solver has to answer `unsat` to each.
    #[arg(long, value_name = "FILE")]
    smt: Option<PathBuf>,
}

fn limits() -> Limits {
    let limits = Limits::none();
    // Where the platform does not tell how much memory is taken, there is no limit on it.
    let _ = memory::watch(MEMORY_LIMIT, limits.interrupt());
    limits
}

/// Runs the command.
pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    if let Some(file) = &arguments.smt {
        output::write_file(file, &conditions(&arguments.directory, &limits)?)?;
    }
    let report = verify(&arguments.directory, &limits);
    match common.format {
        Format::Json => output::json_answer(&json!({
            "format": "metaplan-verification/1",
            "verified": report.verified(),
            "claim": report.claim,
            "parts": report.parts.iter().map(|part| json!({
                "part": part.part,
                "verified": part.result.is_ok(),
                "message": part.result.as_ref().unwrap_or_else(|reason| reason),
            })).collect::<Vec<_>>(),
        })),
        _ => output::answer(&text(&report)),
    }
    Ok(if report.verified() { Exit::Done } else { Exit::Invalid })
}

fn text(report: &Report) -> String {
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
