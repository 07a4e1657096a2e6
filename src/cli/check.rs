//! `metaplan check`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use metaplan::answers::CheckAnswer;
use metaplan::file::source;
use metaplan::message::Message;
use probabilistic::check::{Answer, Exactness, Options, Outcome, PolicyTable, Report, check};
use probabilistic::explore::Bounds;
use probabilistic::prism::Settings;
use probabilistic::{prism, property};

use crate::cli::common::{Common, Exit, Failure, Format, in_file, process_failure};
use crate::cli::output;
use crate::cli::progress::Progress;
use crate::cli::values::setting;

/// Arguments of `check`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A model in the PRISM language.
    #[arg(value_name = "MODEL")]
    model: PathBuf,
    /// What is asked: `Pmax=? [ F "goal" ]`, `R{"time"}min=? [ F "goal" ]`, `multi(…, …)`.
    #[arg(value_name = "PROPERTY")]
    property: String,
    /// The value of a constant (repeatable, or separated by commas).
    #[arg(long = "const", value_name = "NAME=VALUE", value_delimiter = ',', value_parser = setting)]
    constants: Vec<(String, String)>,
    /// Write the best policy to a file.
    #[arg(long, value_name = "FILE")]
    policy: Option<PathBuf>,
    /// Evaluate the policy of a file in place of the best one.
    #[arg(long, value_name = "FILE", conflicts_with = "policy")]
    evaluate: Option<PathBuf>,
    /// The reward that a policy keeps small where the property leaves a choice; the number of steps by default.
    #[arg(long, value_name = "REWARD")]
    secondary: Option<String>,
    /// Stop beyond so many states.
    #[arg(long, value_name = "N", default_value_t = 20_000_000)]
    state_limit: usize,
    /// Solve in rational numbers, however large the model is.
    #[arg(long, conflicts_with = "inexact")]
    exact: bool,
    /// Solve in doubles with certified bounds, however small the model is.
    #[arg(long)]
    inexact: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let file = source(&arguments.model)?;
    let model_text = (file.name(), file.text());
    let model = prism::parse(file.text()).map_err(|problems| in_file(&problems, model_text))?;
    let failed = |error| process_failure(error, model_text, &arguments.property);
    let property = property::parse(&arguments.property).map_err(failed)?;
    let progress = Progress::new("checking", common);
    let told = |states: usize| {
        progress.set_message(format!("{states} states"));
        true
    };
    let options = Options {
        settings: arguments.constants.iter().cloned().collect::<Settings>(),
        bounds: Bounds { states: arguments.state_limit, progress: &told },
        exactness: match (arguments.exact, arguments.inexact) {
            (true, _) => Exactness::Always,
            (_, true) => Exactness::Never,
            _ => Exactness::Auto,
        },
        secondary: arguments.secondary.clone(),
        policy: arguments.policy.is_some(),
        evaluate: arguments.evaluate.as_deref().map(read_policy).transpose()?,
    };
    let report = check(&model, &property, &options);
    progress.finish();
    let report = report.map_err(failed)?;
    if let Some(path) = &arguments.policy {
        let Some(policy) = &report.policy else {
            let text = "this property has no policy to write; ask for one value with `F`, `G` or `U`";
            return Err(Failure::usage(Message::error("M107", text)));
        };
        output::write_file(path, &output::pretty(&policy.to_json()))?;
    }
    match common.format {
        Format::Json => output::json_answer(&CheckAnswer::new(&arguments.property, &report)),
        _ => output::answer(&as_text(&report, common.verbose)),
    }
    Ok(match &report.outcome {
        Outcome::Undecided(_) => Exit::NotProved,
        _ => Exit::Done,
    })
}

fn read_policy(path: &Path) -> Result<PolicyTable, Failure> {
    let file = source(path)?;
    PolicyTable::from_json(file.text())
        .map_err(|error| process_failure(error, (file.name(), file.text()), ""))
}

fn as_text(report: &Report, verbose: bool) -> String {
    let mut text = match &report.outcome {
        Outcome::Value(answer) => format!("{}\n", shown(answer)),
        Outcome::Truth(holds, answer) => {
            let value = answer.as_ref().map(|answer| format!(" ({})", shown(answer))).unwrap_or_default();
            format!("{holds}{value}\n")
        }
        Outcome::Undecided(answer) => format!("not decided: {}\n", shown(answer)),
        Outcome::Front(vertices) => {
            let rows = vertices.iter().map(|pair| pair.iter().map(shown).collect());
            output::table(&["first", "second"], rows)
        }
        Outcome::Constrained { randomised, deterministic, proved } => {
            let note = if *proved { "" } else { " (perhaps not the least)" };
            format!("randomised: {}\ndeterministic: {}{note}\n", shown(randomised), shown(deterministic))
        }
    };
    if verbose {
        let Report { states, choices, transitions, deadlocks, build, solve, .. } = report;
        let _ = writeln!(
            text,
            "{states} states, {choices} choices, {transitions} transitions, {deadlocks} deadlocks; \
             built in {:.3} s, solved in {:.3} s",
            build.as_secs_f64(),
            solve.as_secs_f64()
        );
    }
    text
}

/// A value for people: exactly, or with its bounds.
pub fn shown(answer: &Answer) -> String {
    match answer {
        Answer::Infinite => "infinite".to_owned(),
        Answer::Undefined => "undefined: no policy does this".to_owned(),
        Answer::Finite(quantity) => match &quantity.exact {
            Some(exact) if exact.is_integer() => exact.to_string(),
            Some(exact) if exact.denom().bits() + exact.numer().bits() <= 128 => {
                format!("{} ({exact})", quantity.value)
            }
            Some(_) => format!("{} (exact, rounded)", quantity.value),
            None if quantity.lower >= quantity.upper => quantity.value.to_string(),
            None => format!("{} (between {} and {})", quantity.value, quantity.lower, quantity.upper),
        },
    }
}
