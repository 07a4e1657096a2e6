//! The command line: parses arguments and calls the library. Answers go to standard output or to the files that
//! options name, messages and progress to standard error.

mod alternatives;
mod check;
mod check_series;
mod check_text;
mod common;
mod compare;
mod compare_so_far;
mod compare_table;
mod completions;
mod concurrent;
mod configure;
mod convert;
mod drawn;
mod examples;
mod explain;
mod export;
mod import;
mod init;
mod journal;
mod limits;
mod lint;
mod objectives;
mod output;
mod plan;
mod plan_answer;
mod plan_text;
mod progress;
mod reason;
mod reason_ask;
mod report;
mod run;
mod run_keeper;
mod run_lines;
mod run_outlet;
mod run_session;
mod schema;
mod simulate;
mod situation;
mod sweep;
mod trace;
mod validate;
mod values;
mod verify;

use std::process::ExitCode;

use crate::message::Message;
use clap::{ColorChoice, CommandFactory as _, FromArgMatches as _, Parser, Subcommand, ValueEnum as _};

use common::{Common, Exit, Failure, Format};
use trace::Trace;

/// Adapts a robot's task plan and its software architecture together, and proves that the result is optimal.
#[derive(Debug, Parser)]
#[command(name = "metaplan", version, about)]
struct Cli {
    #[command(subcommand)]
    command: Subcommands,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Subcommand)]
enum Subcommands {
    /// Create a directory with a small mission to start from.
    #[command(after_long_help = examples::INIT)]
    Init(init::Arguments),
    /// Plan a mission: optimal actions and the configuration for each of them.
    #[command(after_long_help = examples::PLAN)]
    Plan(plan::Arguments),
    /// Check a mission for errors and warnings without planning: knowledge base, rules, PDDL and manifest.
    #[command(after_long_help = examples::LINT)]
    Lint(lint::Arguments),
    /// Query the conclusions of knowledge bases and rules: assertions, availability, objectives in error.
    #[command(after_long_help = examples::REASON)]
    Reason(reason::Arguments),
    /// Convert a knowledge base with its imports to one document in another syntax.
    #[command(after_long_help = examples::CONVERT)]
    Convert(convert::Arguments),
    /// Check a property of a PRISM model: its value with bounds, and an optimal policy.
    Check(check::Arguments),
    /// Compare Metaplan with probabilistic model checking on a co-adaptation mission.
    #[command(after_long_help = examples::COMPARE)]
    Compare(compare::Arguments),
    /// Choose a design for each function that needs one, without a task plan, similarly to MROS.
    #[command(after_long_help = examples::CONFIGURE)]
    Configure(configure::Arguments),
    /// Import a mission from the files of another tool.
    Import(import::Arguments),
    /// Explain why a design is available or chosen, which changes lead to another plan, or a message code.
    #[command(after_long_help = examples::EXPLAIN)]
    Explain(explain::Arguments),
    /// Export a mission for other planners and model checkers, with the facts from the knowledge base.
    #[command(after_long_help = examples::EXPORT)]
    Export(export::Arguments),
    /// Write a plan or a journal as an HTML page: timeline, map, search, reasons for designs, effects of
    /// changes.
    #[command(after_long_help = examples::REPORT)]
    Report(report::Arguments),
    /// Run the adaptation loop: events in, adaptations out, one JSON object per line.
    #[command(after_long_help = examples::RUN)]
    Run(run::Arguments),
    /// Show and check the journal of a loop without changing it.
    #[command(after_long_help = examples::JOURNAL)]
    Journal(journal::Arguments),
    /// Simulate a robot under the loop and under other controllers.
    #[command(after_long_help = examples::SIMULATE)]
    Simulate(simulate::Arguments),
    /// Run a command with each combination of parameters, in shards, and write a table of the results.
    #[command(after_long_help = examples::SWEEP)]
    Sweep(sweep::Arguments),
    /// Validate a plan independently of the planner: executable, reaches the goal, cost.
    #[command(after_long_help = examples::VALIDATE)]
    Validate(validate::Arguments),
    /// Verify a certificate without trusting the planner.
    #[command(after_long_help = examples::VERIFY)]
    Verify(verify::Arguments),
    /// Print the JSON Schema of an input or output format.
    Schema(schema::Arguments),
    /// Print a script that completes commands and options in a shell.
    Completions(completions::Arguments),
    /// Write manual pages, one for each command.
    Man(completions::ManArguments),
}

/// Width of help texts if the width of the terminal is unknown.
const HELP_COLUMNS: usize = 80;

/// Maximum width of help texts; longer lines are hard to read.
const MAX_HELP_COLUMNS: usize = 100;

/// Parses the command line, runs the command, and reports failures and panics.
pub fn main() -> ExitCode {
    #[cfg(unix)]
    limits::handle_signals_of_process_1();
    let cli = parse();
    // The default hook would print a message for developers; a short message for users is printed below.
    std::panic::set_hook(Box::new(|_| {}));
    let outcome = std::panic::catch_unwind(|| traced(&cli));
    let exit = match outcome {
        Ok(Ok(_)) if output::answer_lost() => Exit::BadInput,
        Ok(Ok(exit)) => exit,
        Ok(Err(failure)) => {
            output::failure(&cli.common, &failure.messages);
            failure.exit
        }
        Err(panic) => {
            output::failure(&cli.common, &[Message::of_panic(&*panic)]);
            Exit::Fault
        }
    };
    ExitCode::from(exit as u8)
}

/// Runs the command, and writes a trace if requested. A trace file that cannot be created prevents the command. A trace
/// that cannot be completed is an error only if the command succeeds.
fn traced(cli: &Cli) -> Result<Exit, Failure> {
    let trace = cli.common.trace.as_deref().map(Trace::begin).transpose()?;
    let outcome = run(cli);
    match (trace.map_or(Ok(()), Trace::end), outcome) {
        (Err(message), Ok(_)) => Err(message.into()),
        (_, outcome) => outcome,
    }
}

/// Parses the command line. `--color` also applies to messages about faulty arguments, even if these arguments
/// precede the option.
fn parse() -> Cli {
    let words: Vec<String> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    let beside = words.iter().zip(words.iter().skip(1)).filter(|(word, _)| *word == "--color");
    let beside = beside.map(|(_, value)| value.as_str());
    let joined = words.iter().filter_map(|word| word.strip_prefix("--color="));
    let color = beside.chain(joined).last().and_then(|value| ColorChoice::from_str(value, false).ok());
    let columns = output::columns().map_or(HELP_COLUMNS, usize::from).min(MAX_HELP_COLUMNS);
    let matches = Cli::command().color(color.unwrap_or_default()).term_width(columns).get_matches();
    Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
}

fn read(words: Vec<String>) -> Result<Option<simulate::Arguments>, clap::Error> {
    let cli = Cli::try_parse_from(std::iter::once("metaplan".to_owned()).chain(words))?;
    Ok(match cli.command {
        Subcommands::Simulate(arguments) => Some(arguments),
        _ => None,
    })
}

fn run(cli: &Cli) -> Result<Exit, Failure> {
    let triples = matches!(cli.common.format, Format::Ntriples | Format::Turtle);
    if triples && !matches!(cli.command, Subcommands::Reason(_)) {
        let text = "`--format ntriples` and `--format turtle` are formats of `reason`";
        return Err(Failure::usage(Message::error("M107", text)));
    }
    match &cli.command {
        Subcommands::Init(arguments) => init::run(arguments, &cli.common),
        Subcommands::Plan(arguments) => plan::run(arguments, &cli.common),
        Subcommands::Lint(arguments) => lint::run(arguments, &cli.common),
        Subcommands::Reason(arguments) => reason::run(arguments, &cli.common),
        Subcommands::Convert(arguments) => convert::run(arguments, &cli.common),
        Subcommands::Check(arguments) => check::run(arguments, &cli.common),
        Subcommands::Compare(arguments) => compare::run(arguments, &cli.common),
        Subcommands::Configure(arguments) => configure::run(arguments, &cli.common),
        Subcommands::Import(arguments) => import::run(arguments, &cli.common),
        Subcommands::Explain(arguments) => explain::run(arguments, &cli.common),
        Subcommands::Export(arguments) => export::run(arguments, &cli.common),
        Subcommands::Report(arguments) => report::run(arguments, &cli.common),
        Subcommands::Run(arguments) => run::run(arguments, &cli.common),
        Subcommands::Journal(arguments) => journal::run(arguments, &cli.common),
        Subcommands::Simulate(arguments) => simulate::run(arguments, &cli.common),
        Subcommands::Sweep(arguments) => sweep::run(arguments, &cli.common, &read),
        Subcommands::Validate(arguments) => validate::run(arguments, &cli.common),
        Subcommands::Verify(arguments) => verify::run(arguments, &cli.common),
        Subcommands::Schema(arguments) => schema::run(arguments),
        Subcommands::Completions(arguments) => Ok(completions::run(arguments, Cli::command())),
        Subcommands::Man(arguments) => completions::man(arguments, Cli::command()),
    }
}
