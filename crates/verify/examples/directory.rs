//! Verifies certificates, and prints the result of each part.
//!
//! `cargo run -p metaplan-verify --example directory -- CERTIFICATE…`
#![expect(clippy::print_stdout, reason = "an example prints")]

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use metaplan_verify::{Claim, Verifier};

fn main() -> ExitCode {
    let directories: Vec<PathBuf> =
        std::env::args().skip(1).filter(|word| !word.starts_with('-')).map(PathBuf::from).collect();
    let mut are_verified = true;
    for directory in &directories {
        let verification = Verifier::new(directory).time_limit(Duration::from_secs(600)).verify();
        let claim = match &verification.claim {
            Some(Claim::Optimal { metric }) => format!("optimal with metric {metric}"),
            Some(Claim::Unsolvable) => "no plan".to_owned(),
            Some(Claim::Front(front)) => format!("a front of {} points", front.points.len()),
            None => "nothing".to_owned(),
        };
        println!("{}: claims {claim}", directory.display());
        for part in &verification.parts {
            match &part.result {
                Ok(summary) => println!("  {}: {summary}", part.part),
                Err(reason) => println!("  {}: FAILS: {reason}", part.part),
            }
        }
        are_verified &= verification.verified();
    }
    println!("{}", if are_verified { "all verified" } else { "not all verified" });
    ExitCode::from(u8::from(!are_verified))
}
