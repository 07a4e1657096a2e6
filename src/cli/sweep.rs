//! `metaplan sweep`.

use std::path::PathBuf;

use clap::Args;
use metaplan::message::Message;
use metaplan::sweep::{Group, Line, Results, Shard, Study, SweepAnswer, Table, perform, read_lines};

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::output;
use crate::cli::progress::Progress;

/// Arguments of `sweep`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The study: what is run, and what is varied (TOML).
    #[arg(value_name = "STUDY")]
    study: PathBuf,
    /// The directory of the lines that runs leave.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// Only every N-th run, from the I-th on: for N processes, on any number of machines.
    #[arg(long, value_name = "I/N", default_value_t)]
    shard: Shard,
    /// Go on where the shard was when it ended.
    #[arg(long)]
    resume: bool,
    /// Run nothing: put the lines of all shards together.
    #[arg(long, conflicts_with_all = ["shard", "resume"])]
    merge: bool,
    /// With `--merge`: write all rows as CSV.
    #[arg(long, value_name = "FILE", requires = "merge")]
    csv: Option<PathBuf>,
    /// With `--merge`: with times and other figures that differ from run to run.
    #[arg(long, requires = "merge")]
    measured: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    output::require_directory(&arguments.output)?;
    let study = Study::read(&arguments.study)?;
    if arguments.merge { merge(arguments, &study, common) } else { sweep(arguments, &study, common) }
}

fn sweep(arguments: &Arguments, study: &Study, common: &Common) -> Result<Exit, Failure> {
    let program = std::env::current_exe()
        .map_err(|error| Message::error("M152", format!("the program's own file is unknown: {error}")))?;
    let mut results = Results::open(&arguments.output, study, arguments.shard, arguments.resume)?;
    let progress = Progress::new("sweeping", common);
    let total = study.runs(arguments.shard).count();
    for run in study.runs(arguments.shard) {
        if !results.done.contains_key(&run.number) {
            results.add(perform(&program, study, &run)?)?;
        }
        progress.set_message(format!("{} of {total} runs", results.done.len()));
    }
    progress.finish();
    let lines: Vec<Line> = results.done.values().cloned().collect();
    let wanted = study.runs(arguments.shard).map(|run| run.number);
    Ok(say(&SweepAnswer::new(&lines, wanted, &[]), &[], common))
}

fn merge(arguments: &Arguments, study: &Study, common: &Common) -> Result<Exit, Failure> {
    let lines = read_lines(&arguments.output, study)?;
    let table = Table::new(&lines, study.rows(), arguments.measured);
    if let Some(file) = &arguments.csv {
        output::write_file(file, &table.to_csv())?;
    }
    let repetitions = study.keys().into_iter().filter(|(_, repeats)| *repeats).map(|(key, _)| key);
    let groups = table.groups(&repetitions.collect::<Vec<_>>());
    Ok(say(&SweepAnswer::new(&lines, 0..study.len(), &groups), &groups, common))
}

/// Writes the answer; the status says whether all runs are there.
fn say(answer: &SweepAnswer, groups: &[Group], common: &Common) -> Exit {
    if common.format == Format::Json {
        output::json_answer(answer);
    } else {
        output::answer(&(answer.sentence() + "\n" + &text(groups)));
    }
    if answer.is_complete() { Exit::Done } else { Exit::NotProved }
}

/// One line for each mean.
fn text(groups: &[Group]) -> String {
    if groups.is_empty() {
        return String::new();
    }
    let rows = groups.iter().flat_map(|group| {
        let shown =
            |value: &serde_json::Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let common: Vec<String> =
            group.common.iter().map(|(column, value)| format!("{column}={}", shown(value))).collect();
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
