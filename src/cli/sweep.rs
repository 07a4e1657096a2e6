//! The command `metaplan sweep`, which executes the runs of a parameter study or merges their results.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::message::{Errors, Message, did_you_mean};
use crate::sweep::{Group, Line, Results, Shard, Study, SweepAnswer, Table, perform, read_lines};
use clap::Args;
use clap::error::ErrorKind;

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::limits::Guard;
use crate::cli::output;
use crate::cli::progress::Progress;
use crate::cli::simulate;
use crate::cli::values::seconds;

/// Arguments of `sweep`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The study: a TOML file with the command and the varied parameters.
    #[arg(value_name = "STUDY")]
    study: PathBuf,
    /// Directory for the results of the runs.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// Execute only every N-th run, starting with the I-th, to distribute a study over N processes or machines.
    #[arg(long, value_name = "I/N", default_value_t)]
    shard: Shard,
    /// Stop after this many seconds with the runs so far. `--resume` continues.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    time_limit: Option<Duration>,
    /// Continue an interrupted shard.
    #[arg(long)]
    resume: bool,
    /// Merge the results of all shards without running anything.
    #[arg(long, conflicts_with_all = ["shard", "resume", "time_limit"])]
    merge: bool,
    /// With `--merge`: write all rows as CSV.
    #[arg(long, value_name = "FILE", requires = "merge")]
    csv: Option<PathBuf>,
    /// With `--merge`: include times and other figures that vary between runs.
    #[arg(long, requires = "merge")]
    measured: bool,
}

/// Parser of a command line. Returns the arguments if the command is `simulate`, and `None` for other commands.
pub type Read<'a> = dyn Fn(Vec<String>) -> Result<Option<simulate::Arguments>, clap::Error> + 'a;

pub fn run(arguments: &Arguments, common: &Common, read: &Read<'_>) -> Result<Exit, Failure> {
    output::require_directory(&arguments.output)?;
    let guard = Guard::new(arguments.time_limit, None, common)?;
    let study = Study::read(&arguments.study)?;
    if arguments.merge {
        return merge(arguments, &study, common);
    }
    check(&study, common, read)?;
    sweep(arguments, &study, guard, common)
}

fn sweep(arguments: &Arguments, study: &Study, guard: Guard, common: &Common) -> Result<Exit, Failure> {
    let program = std::env::current_exe().map_err(|error| {
        Message::error("M152", format!("the path of the running program cannot be determined: {error}"))
    })?;
    let mut results = Results::open(&arguments.output, study, arguments.shard, arguments.resume)?;
    let limits = guard.plan();
    let progress = Progress::new("sweeping", common);
    let total = study.runs(arguments.shard).count();
    let mut messages = Vec::new();
    for run in study.runs(arguments.shard) {
        if !results.done.contains_key(&run.number) {
            let line = if limits.reached() { None } else { perform(&program, study, &run, &limits)? };
            let Some(line) = line else {
                let text = format!(
                    "the time limit or an interruption stopped the study after {} of {total} runs; continue \
                     with `--resume`",
                    results.done.len()
                );
                messages.push(Message::error("M130", text));
                break;
            };
            results.add(line)?;
        }
        progress.set_message(format!("{} of {total} runs", results.done.len()));
    }
    progress.finish();
    let lines: Vec<Line> = results.done.values().cloned().collect();
    let numbers = study.runs(arguments.shard).map(|run| run.number);
    let exit = say(&SweepAnswer::new(&lines, numbers, &[]).because(messages.clone()), &[], common);
    if common.format != Format::Json {
        output::warnings(common, &messages);
    }
    Ok(exit)
}

/// Checks the commands of a sample of a study's runs (see [`Study::samples`]): their options, and
/// the scenarios that they simulate. Scenarios of a study that generates files are not checked.
fn check(study: &Study, common: &Common, read: &Read<'_>) -> Result<(), Failure> {
    let (mut mistakes, mut simulated): (Vec<Message>, BTreeSet<String>) = (Vec::new(), BTreeSet::new());
    for (path, run) in study.samples() {
        let words = study.words(&run, Path::new("{dir}"));
        let simulation = match read(words) {
            Ok(simulation) => simulation,
            // A file that is generated for the run does not exist yet.
            Err(error) if study.generates() && error.kind() == ErrorKind::ValueValidation => continue,
            Err(error) => {
                // A mistake in an option that all runs have occurs in each sampled run, but is reported once.
                let text = refusal(&error);
                if mistakes.iter().all(|mistake: &Message| !mistake.message.starts_with(&text)) {
                    mistakes.push(study.mistake(&path, &text));
                }
                continue;
            }
        };
        if let Some(arguments) = simulation
            && !study.generates()
            && simulated.insert(simulate::subject(&arguments))
        {
            let wrong = simulate::check(&arguments, &study.directory, common).err();
            mistakes.extend(wrong.into_iter().flat_map(|failure| failure.messages));
        }
    }
    Ok(Errors::unless_empty(mistakes)?)
}

fn refusal(error: &clap::Error) -> String {
    let text = error.to_string();
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let lines: Vec<&str> =
        lines.take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more")).collect();
    lines.join("; ").trim_start_matches("error: ").replace("; tip: ", "; ")
}

fn merge(arguments: &Arguments, study: &Study, common: &Common) -> Result<Exit, Failure> {
    let lines = read_lines(&arguments.output, study)?;
    let answers = || lines.iter().map(|line| &line.answer).filter(|answer| !answer.is_null());
    if let Some(answer) = answers().next()
        && answers().all(|answer| answer.pointer(study.rows()).is_none())
    {
        let keys = answer.as_object().into_iter().flatten().map(|(key, _)| format!("/{key}"));
        let keys: Vec<String> = keys.collect();
        let suggestion = did_you_mean(study.rows(), keys.iter().map(String::as_str));
        let text = format!(
            "no answer has a value at `{}`{suggestion}; there are: {}",
            study.rows(),
            keys.join(", ")
        );
        return Err(study.mistake(&["rows".into()], &text).into());
    }
    let table = Table::new(&lines, study.rows(), arguments.measured);
    if let Some(file) = &arguments.csv {
        output::write_file(file, &table.to_csv())?;
    }
    let repetitions = study.keys().into_iter().filter(|(_, repeats)| *repeats).map(|(key, _)| key);
    let groups = table.groups(&repetitions.collect::<Vec<_>>());
    Ok(say(&SweepAnswer::new(&lines, 0..study.len(), &groups), &groups, common))
}

fn say(answer: &SweepAnswer, groups: &[Group], common: &Common) -> Exit {
    if common.format == Format::Json {
        output::json_answer(answer);
    } else {
        output::answer(&(answer.sentence() + "\n" + &text(groups)));
    }
    if answer.is_complete() { Exit::Done } else { Exit::NotProved }
}

fn text(groups: &[Group]) -> String {
    if groups.is_empty() {
        return String::new();
    }
    let rows = groups.iter().flat_map(|group| {
        let text_of =
            |value: &serde_json::Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let common: Vec<String> =
            group.common.iter().map(|(column, value)| format!("{column}={}", text_of(value))).collect();
        let common = common.join(" ");
        group.samples.iter().map(move |(column, sample)| {
            let mean = if sample.count < 2 {
                format!("{:.4}", sample.mean)
            } else {
                format!("{:.4} ± {:.4}", sample.mean, sample.half_width)
            };
            vec![common.clone(), column.clone(), sample.count.to_string(), mean]
        })
    });
    format!("\n{}", output::table(&["runs with", "column", "n", "mean, 95 % confidence"], rows))
}
