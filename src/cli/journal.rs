//! The command `metaplan journal`, which shows or checks the journal of an adaptation loop.

use std::fmt::Write as _;
use std::path::PathBuf;

use crate::answers::JournalAnswer;
use crate::journal::{Entry, Journal, JournalReport};
use crate::mapek::Loop;
use crate::setup::Setup;
use clap::{Args, Subcommand};
use serde_json::Value;

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::limits::TimeLimit;
use crate::cli::output;
use crate::cli::progress::during;

/// Arguments of `journal`.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: Operation,
    #[command(flatten)]
    time: TimeLimit,
}

#[derive(Debug, Subcommand)]
enum Operation {
    /// Check whether the journal can be used, and report its defects.
    Check {
        /// The journal's directory.
        #[arg(value_name = "DIR")]
        directory: PathBuf,
        /// The mission's manifest. The journal is resumed without changes on disk.
        #[arg(long, value_name = "MISSION")]
        mission: Option<PathBuf>,
    },
    /// Show all intact records, such as events and decisions.
    Show {
        /// The journal's directory.
        #[arg(value_name = "DIR")]
        directory: PathBuf,
    },
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let _guard = arguments.time.guard(common)?;
    let (Operation::Check { directory, .. } | Operation::Show { directory }) = &arguments.what;
    let mut report = during("reading", common, || JournalReport::read(directory))?;
    if let Operation::Check { mission: Some(mission), .. } = &arguments.what
        && report.is_sound()
    {
        let Setup { mission, settings, .. } = Setup::read(mission)?;
        let mut control = Loop::new(mission, settings)?;
        if let Err(message) = during("resuming", common, || Journal::rehearse(directory, &mut control)) {
            report.messages.push(message);
        }
    }
    let shows = matches!(arguments.what, Operation::Show { .. });
    if common.format == Format::Json {
        output::json_answer(&JournalAnswer::new(&report, shows));
    } else {
        let lines = if shows { report.entries.iter().map(line).collect() } else { report.parts.clone() };
        let mut text = lines.into_iter().fold(String::new(), |text, line| text + &line + "\n");
        if !shows {
            text +=
                if report.is_sound() { "the journal can be used\n" } else { "the journal cannot be used\n" };
        }
        output::answer(&text);
        output::warnings(common, &report.messages);
    }
    Ok(if report.is_sound() { Exit::Done } else { Exit::BadInput })
}

fn line(entry: &Entry) -> String {
    let mut text = format!("{:>7}  {:<8}", entry.record, entry.kind);
    if let Some(time) = entry.time {
        let _ = write!(text, "  {:.3} s", time as f64 / 1e6);
    }
    let content = match &entry.content {
        // An empty line is the event of a timer.
        Value::String(line) if line.is_empty() => "time has passed".to_owned(),
        Value::String(line) => line.clone(),
        Value::Array(answers) if answers.is_empty() => "nothing".to_owned(),
        Value::Array(answers) => {
            let kinds: Vec<&str> = answers.iter().filter_map(|answer| answer["answer"].as_str()).collect();
            kinds.join(", ")
        }
        _ => return text,
    };
    text + "  " + &content
}
