//! `metaplan-verify DIR`: verifies a certificate.

use std::io::{ErrorKind, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::{Parser, ValueEnum};
use metaplan_verify::{Verification, Verifier, Watch, json, seconds};
use mission::file;
use mission::message::{ErrorAnswer, Errors, Message};
use mission::visible::{pretty, visible, visible_json};

/// Exit status if the certificate is verified. All exit statuses are equal to those of `metaplan verify`.
const VERIFIED: u8 = 0;
const BAD_INPUT: u8 = 3;
const INVALID: u8 = 30;
const FAULT: u8 = 70;

/// Verify a certificate of optimality, or of the absence of plans, without trusting the planner.
#[derive(Debug, Clone, Parser)]
#[command(name = "metaplan-verify", version, about, max_term_width = 100)]
struct Arguments {
    /// The directory written by `metaplan plan --certificate`.
    directory: PathBuf,
    /// Output format of the answer.
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Also write the argument as verification conditions in SMT-LIB 2. An SMT solver has to answer `unsat` to each.
    #[arg(long, value_name = "FILE")]
    smt: Option<PathBuf>,
    /// Fail if the verification takes more than this many seconds.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true, default_value = "600")]
    time_limit: Duration,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Text for people.
    Text,
    /// JSON for programs.
    Json,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    // The default panic hook would also print the message, in any format. It is printed below instead, in the
    // selected format.
    std::panic::set_hook(Box::new(|_| {}));
    let outcome = std::panic::catch_unwind(|| run(&arguments));
    ExitCode::from(match outcome {
        Ok(Ok(report)) => show(&report, arguments.format),
        Ok(Err(messages)) => {
            fail(&messages, arguments.format);
            BAD_INPUT
        }
        Err(panic) => {
            fail(&[Message::of_panic(&*panic)], arguments.format);
            FAULT
        }
    })
}

/// Verifies the certificate. With `--smt`, the verification conditions are written first.
fn run(arguments: &Arguments) -> Result<Verification, Errors> {
    let Arguments { directory, format, smt, time_limit } = arguments.clone();
    let watch = Watch::start(time_limit, move |report| std::process::exit(show(report, format).into()));
    let verifier = Verifier::new(&directory).stop(|| watch.reached());
    if let Some(file) = &smt {
        file::write(file, &verifier.conditions()?)?;
    }
    Ok(watch.end(verifier.verify()))
}

fn show(report: &Verification, format: Format) -> u8 {
    let written = document(&match format {
        Format::Text => report.to_string(),
        Format::Json => json(report),
    });
    match (written, report.verified()) {
        (false, _) => BAD_INPUT,
        (true, true) => VERIFIED,
        (true, false) => INVALID,
    }
}

fn fail(messages: &[Message], format: Format) {
    match format {
        Format::Text => {
            for message in messages {
                let _ = std::io::stderr().write_all(visible(message.text()).as_bytes());
            }
        }
        Format::Json => {
            document(&visible_json(&pretty(&ErrorAnswer::new(messages))));
        }
    }
}

/// Writes a text to standard output. Returns `false` and prints an error on failure. A closed pipe
/// does not count as a failure.
fn document(text: &str) -> bool {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            let message = Message::error("M109", format!("the answer cannot be written: {error}"));
            let _ = std::io::stderr().write_all(message.text().as_bytes());
            false
        }
        _ => true,
    }
}
