//! The command `metaplan validate`, which checks a plan by executing it step by step.

use std::fmt::Write as _;
use std::path::PathBuf;

use crate::answers::VerdictAnswer;
use crate::file::source;
use crate::message::Message;
use crate::mission::{Mission, read_plan};
use clap::Args;
use num_rational::BigRational;
use pddl::validate::{Options, Verdict, validate};

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::limits::TimeLimit;
use crate::cli::output;
use crate::cli::progress::during;
use crate::cli::situation::Situation;
use crate::cli::values::time;

/// Arguments of `validate`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A mission's manifest, or a PDDL domain and a PDDL problem, followed by the plan: lines `(action
    /// arguments)` or `start: (action arguments) [duration]`, or the JSON of `metaplan plan`; `-` is
    /// standard input.
    #[arg(required = true, num_args = 1..=3, value_name = "MISSION PLAN | DOMAIN PROBLEM PLAN")]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    situation: Situation,
    /// Allow actions to overlap as in PDDL 2.1. By default they are executed one after another.
    #[arg(long)]
    concurrent: bool,
    /// Tolerance of times, and minimum time between interfering starts and ends of actions.
    #[arg(long, value_name = "TIME", default_value = "0.001", value_parser = time)]
    tolerance: BigRational,
    #[command(flatten)]
    time: TimeLimit,
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let (plan, mission) = match arguments.inputs.split_last() {
        Some((plan, mission)) if !mission.is_empty() => (plan, mission),
        _ => {
            return Err(Failure::usage(Message::error(
                "M107",
                "give a mission, or a domain and a problem, and a plan",
            )));
        }
    };
    let _guard = arguments.time.guard(common)?;
    let mission = arguments.situation.mission(mission, common)?;
    let (problem, warnings) = mission.filled()?;
    output::warnings(common, mission.warnings().chain(&warnings));
    let plan = read_plan(&source(plan)?, &mission)?;
    let options =
        Options::default().with_concurrent(arguments.concurrent).with_tolerance(arguments.tolerance.clone());
    let verdict = during("validating", common, || validate(mission.domain(), &problem, &plan, &options));
    match common.format {
        Format::Json => output::json_answer(&VerdictAnswer::new(&verdict)),
        _ => output::answer(&text(&mission, &verdict)),
    }
    Ok(if verdict.valid { Exit::Done } else { Exit::Invalid })
}

fn text(mission: &Mission, verdict: &Verdict) -> String {
    let mut text = String::new();
    match &verdict.violation {
        None => {
            let _ = write!(text, "valid");
            if let Some(metric) = &verdict.metric {
                let _ = write!(text, ", metric {}", output::decimal(metric));
            }
            let _ = writeln!(text, ", total time {}", output::decimal(&verdict.total_time));
        }
        Some(violation) => {
            let _ = write!(text, "invalid: ");
            if let (Some(step), Some(action)) = (violation.step, &violation.action) {
                let _ = write!(text, "step {step}, {action}: ");
            }
            let _ = writeln!(text, "{}", violation.message);
            for unmet in &violation.unmet {
                let _ = writeln!(text, "    {}", mission.spoken(&unmet.condition));
                for (name, value) in &unmet.values {
                    let value = value.as_ref().map_or("undefined".to_owned(), output::decimal);
                    let _ = writeln!(text, "        {name} = {value}");
                }
            }
        }
    }
    text
}
