//! The command `metaplan lint`, which checks a mission for errors and warnings.

use std::path::PathBuf;

use crate::answers::LintAnswer;
use crate::lint::{in_order, lint};
use clap::Args;

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::limits::TimeLimit;
use crate::cli::output::{self, counted};
use crate::cli::progress::during;
use crate::cli::situation::Situation;

/// Arguments of `lint`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A mission's manifest, or a PDDL domain and a PDDL problem; `-` is standard input.
    #[arg(required = true, num_args = 1..=2, value_name = "MISSION | DOMAIN PROBLEM")]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    situation: Situation,
    #[command(flatten)]
    time: TimeLimit,
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let _guard = arguments.time.guard(common)?;
    let messages = match arguments.situation.setup(&arguments.inputs, common) {
        Ok(setup) => during("looking", common, || lint(&setup)),
        Err(failure) if failure.exit == Exit::Usage => return Err(failure),
        Err(failure) => in_order(failure.messages.into_vec()),
    };
    let answer = LintAnswer::new(&messages);
    let (errors, warnings) = answer.counts();
    if common.format == Format::Json {
        output::json_answer(&answer);
    } else {
        let colors = common.colors(&std::io::stdout());
        let texts: String = messages.iter().map(|message| output::shown(message, colors)).collect();
        output::document(&(texts + &summary(errors, warnings)));
    }
    if messages.iter().any(|message| message.code == "M110") {
        return Ok(Exit::Inconsistent);
    }
    Ok(match (errors, warnings) {
        (0, 0) => Exit::Done,
        (0, _) => Exit::NotProved,
        _ => Exit::BadInput,
    })
}

fn summary(errors: usize, warnings: usize) -> String {
    match (errors, warnings) {
        (0, 0) => "no problems found\n".to_owned(),
        _ => format!("{}, {}\n", counted(errors, "error"), counted(warnings, "warning")),
    }
}
