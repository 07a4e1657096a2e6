//! `metaplan verify`.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use metaplan::certificate::{Claim, Report, verify};
use serde_json::json;

use crate::cli::{Common, Exit, Failure, Format, output};

/// Arguments of `verify`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// What `metaplan plan --certificate` has written.
    directory: PathBuf,
}

/// Runs the command.
#[allow(clippy::unnecessary_wraps)]
pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let report = verify(&arguments.directory);
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
            Ok(said) => writeln!(text, "{:9} verified: {said}", part.part),
            Err(reason) => writeln!(text, "{:9} failed: {reason}", part.part),
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
