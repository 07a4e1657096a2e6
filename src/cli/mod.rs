//! Arguments to calls of the library, answers to standard output, everything else to standard error.

mod alternatives;
mod check;
mod compare;
mod compare_so_far;
mod compare_table;
mod concurrent;
mod confirm;
mod convert;
mod explain;
mod export;
mod import;
mod journal;
mod limits;
mod memory;
mod objectives;
mod output;
mod plan;
mod plan_answer;
mod plan_exact;
mod plan_json;
mod plan_stages;
mod plan_text;
mod plan_verdict;
mod reason;
mod reason_ask;
mod run;
mod simulate;
mod validate;
mod verify;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand, ValueEnum};
use metaplan::knowledge::{COADAPTATION, Knowledge, Sources};
use metaplan::message::{Message, did_you_mean};
use metaplan::mission::{Bindings, Mission, source};
use ontology::ReadOptions;

/// Exit statuses; the README lists them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Exit {
    Done = 0,
    NotProved = 1,
    Usage = 2,
    BadInput = 3,
    Unsolvable = 10,
    UnsolvableWithinHorizon = 11,
    NothingFound = 12,
    Inconsistent = 20,
    Invalid = 30,
    Fault = 70,
}

/// Why a command has no answer.
struct Failure {
    exit: Exit,
    messages: Vec<Message>,
}

impl Failure {
    fn usage(message: Message) -> Self {
        Self { exit: Exit::Usage, messages: vec![message] }
    }
}

impl From<Vec<Message>> for Failure {
    fn from(messages: Vec<Message>) -> Self {
        Self { exit: Exit::BadInput, messages }
    }
}

impl From<Message> for Failure {
    fn from(message: Message) -> Self {
        vec![message].into()
    }
}

/// Adapts a robot's task plan and its software architecture together, and proves that the result is optimal.
#[derive(Debug, Parser)]
#[command(name = "metaplan", version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Clone, Args)]
struct Common {
    /// How the answer is written.
    #[arg(long, global = true, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// No warnings and no progress on standard error.
    #[arg(long, short, global = true)]
    quiet: bool,
    /// Statistics besides the answer.
    #[arg(long, short, global = true)]
    verbose: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// For people.
    Text,
    /// For programs; versioned, see the README.
    Json,
    /// `reason` only: the inferred assertions, sorted.
    Ntriples,
    /// `reason` only: the inferred assertions by subject.
    Turtle,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// A jointly optimal task plan and configuration.
    Plan(plan::Arguments),
    /// What follows from knowledge bases and rules: assertions, availability, objectives in error.
    Reason(reason::Arguments),
    /// A knowledge base with its imports as one document in another syntax.
    Convert(convert::Arguments),
    /// Model checking of a PRISM-language model: a value with bounds, and its policy.
    Check(check::Arguments),
    /// Metaplan and probabilistic model checking side by side, on one co-adaptation mission.
    Compare(compare::Arguments),
    /// A mission from the files of another tool.
    Import(import::Arguments),
    /// Why a design is available or not, why it is chosen or not, and what would change the answer.
    Explain(explain::Arguments),
    /// A mission for other planners, with what the knowledge base has contributed.
    Export(export::Arguments),
    /// The adaptation loop: events in, adaptations out, one JSON object a line.
    Run(run::Arguments),
    /// What is in the journal of a loop, and whether it can be used; nothing is changed.
    Journal(journal::Arguments),
    /// The loop against a simulated robot, beside other ways of control.
    Simulate(simulate::Arguments),
    /// Whether a plan is executable, reaches the goal, and what it costs; independent of the planner.
    Validate(validate::Arguments),
    /// Checks a certificate without trusting the planner.
    Verify(verify::Arguments),
}

/// A mission, or a domain and a problem, and the situation to plan for.
#[derive(Debug, Args)]
struct Situation {
    /// A knowledge base for DOMAIN and PROBLEM (OWL; repeatable).
    #[arg(long = "kb", value_name = "FILE")]
    knowledge: Vec<PathBuf>,
    /// Rules for that knowledge base: a file, `coadaptation` or `tomasys` (repeatable; default `coadaptation`).
    #[arg(long = "rules", value_name = "FILE")]
    rules: Vec<String>,
    #[command(flatten)]
    imports: Imports,
    /// A scenario of the mission's manifest.
    #[arg(long, value_name = "NAME")]
    scenario: Option<String>,
    /// A measured attribute, a numeric fluent or a fact: `ambient_light=0.9`, `battery=30`, `robot_at=wp2` (repeatable).
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    set: Vec<(String, String)>,
    /// A component that has failed (repeatable).
    #[arg(long, value_name = "COMPONENT")]
    fail: Vec<String>,
}

/// Where imports are looked for; never the network.
#[derive(Debug, Args)]
struct Imports {
    /// An OASIS XML catalog that says where imports lie (repeatable).
    #[arg(long, value_name = "FILE")]
    catalog: Vec<PathBuf>,
    /// A directory to look for imports in, with those below it (repeatable).
    #[arg(long, value_name = "DIR", value_parser = existing_directory)]
    directory: Vec<PathBuf>,
    /// Goes on with a warning where an import is found nowhere.
    #[arg(long)]
    #[allow(clippy::struct_field_names)]
    ignore_missing_imports: bool,
}

impl Imports {
    fn options(&self) -> ReadOptions {
        ReadOptions {
            catalogs: self.catalog.clone(),
            directories: self.directory.clone(),
            allow_missing_imports: self.ignore_missing_imports,
            ..ReadOptions::default()
        }
    }
}

fn existing_directory(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if path.is_dir() { Ok(path) } else { Err(format!("there is no directory `{text}`")) }
}

fn setting(text: &str) -> Result<(String, String), String> {
    let (name, value) =
        text.split_once('=').ok_or_else(|| format!("`{text}` is not of the form NAME=VALUE"))?;
    Ok((name.trim().to_owned(), value.trim().to_owned()))
}

impl Situation {
    /// A situation of a mission that has a manifest.
    fn of_mission(scenario: Option<String>, set: Vec<(String, String)>, fail: Vec<String>) -> Self {
        let imports = Imports { catalog: Vec::new(), directory: Vec::new(), ignore_missing_imports: false };
        Self { knowledge: Vec::new(), rules: Vec::new(), imports, scenario, set, fail }
    }

    /// The mission in this situation, from one input (a manifest) or two (domain and problem).
    fn mission(&self, inputs: &[PathBuf]) -> Result<Mission, Failure> {
        let mut mission = match inputs {
            [manifest] => {
                let imports = &self.imports;
                let none = self.knowledge.is_empty() && self.rules.is_empty();
                let here = imports.catalog.is_empty() && imports.directory.is_empty();
                if !(none && here && !imports.ignore_missing_imports) {
                    let text = "`--kb`, `--rules` and where imports lie go with DOMAIN and PROBLEM; \
                                a mission's manifest names its own";
                    return Err(Failure::usage(Message::error("M107", text)));
                }
                let (mut mission, manifest) = Mission::read(manifest)?;
                if let Some(name) = &self.scenario {
                    let scenario = manifest.scenarios.get(name).ok_or_else(|| {
                        let known: Vec<_> = manifest.scenarios.keys().map(String::as_str).collect();
                        let text = format!(
                            "the mission has no scenario `{name}`; it has: {}{}",
                            known.join(", "),
                            did_you_mean(name, known.iter().copied())
                        );
                        Failure::usage(Message::error("M108", text))
                    })?;
                    mission.apply(scenario).map_err(|message| {
                        let text = format!("scenario `{name}`: {}", message.message);
                        Message::at(&message.code, manifest.file(), None, text)
                    })?;
                }
                mission
            }
            [domain, problem] => {
                if self.scenario.is_some() {
                    let text = "`--scenario` goes with a mission's manifest";
                    return Err(Failure::usage(Message::error("M107", text)));
                }
                if self.knowledge.is_empty() && !self.rules.is_empty() {
                    return Err(Failure::usage(Message::error("M107", "`--rules` goes with `--kb`")));
                }
                let knowledge = (!self.knowledge.is_empty()).then(|| {
                    let rules = if self.rules.is_empty() {
                        vec![COADAPTATION.to_owned()]
                    } else {
                        self.rules.clone()
                    };
                    Knowledge::read(&Sources {
                        documents: self.knowledge.clone(),
                        rules,
                        options: self.imports.options(),
                        ..Sources::default()
                    })
                });
                Mission::new("", knowledge, Bindings::default(), source(domain), source(problem))?
            }
            _ => {
                let text = "give a mission's manifest, or a domain and a problem";
                return Err(Failure::usage(Message::error("M107", text)));
            }
        };
        for component in &self.fail {
            mission.fail(component).map_err(Failure::usage)?;
        }
        for (name, value) in &self.set {
            mission.set(name, value).map_err(Failure::usage)?;
        }
        consistent(mission.knowledge())?;
        mission.note_doubts();
        Ok(mission)
    }
}

/// Nothing is planned on knowledge that contradicts itself.
fn consistent(knowledge: Option<&Knowledge>) -> Result<(), Failure> {
    let contradictions = knowledge.map(Knowledge::contradictions).unwrap_or_default();
    if contradictions.is_empty() {
        return Ok(());
    }
    let messages = contradictions.iter().map(|c| {
        Message::error(
            "M110",
            format!("the knowledge is inconsistent: {}: {}", c.violated, c.facts.join(", ")),
        )
    });
    Err(Failure { exit: Exit::Inconsistent, messages: messages.collect() })
}

/// Runs the program.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    // The default hook would print a stack trace at users; what matters is printed below.
    std::panic::set_hook(Box::new(|_| {}));
    let outcome = std::panic::catch_unwind(|| run(&cli));
    let exit = match outcome {
        Ok(Ok(_)) if output::answer_lost() => Exit::BadInput,
        Ok(Ok(exit)) => exit,
        Ok(Err(failure)) => {
            output::failure(&cli.common, &failure.messages);
            failure.exit
        }
        Err(panic) => {
            let reason = panic
                .downcast_ref::<String>()
                .cloned()
                .or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()))
                .unwrap_or_default();
            let text = format!("this is a fault of metaplan, not of your input; please report it: {reason}");
            output::failure(&cli.common, &[Message::error("M170", text)]);
            Exit::Fault
        }
    };
    ExitCode::from(exit as u8)
}

fn run(cli: &Cli) -> Result<Exit, Failure> {
    let triples = matches!(cli.common.format, Format::Ntriples | Format::Turtle);
    if triples && !matches!(cli.command, Command::Reason(_)) {
        let text = "`--format ntriples` and `--format turtle` go with `reason`";
        return Err(Failure::usage(Message::error("M107", text)));
    }
    match &cli.command {
        Command::Plan(arguments) => plan::run(arguments, &cli.common),
        Command::Reason(arguments) => reason::run(arguments, &cli.common),
        Command::Convert(arguments) => convert::run(arguments, &cli.common),
        Command::Check(arguments) => check::run(arguments, &cli.common),
        Command::Compare(arguments) => compare::run(arguments, &cli.common),
        Command::Import(arguments) => import::run(arguments, &cli.common),
        Command::Explain(arguments) => explain::run(arguments, &cli.common),
        Command::Export(arguments) => export::run(arguments, &cli.common),
        Command::Run(arguments) => run::run(arguments, &cli.common),
        Command::Journal(arguments) => journal::run(arguments, &cli.common),
        Command::Simulate(arguments) => simulate::run(arguments, &cli.common),
        Command::Validate(arguments) => validate::run(arguments, &cli.common),
        Command::Verify(arguments) => verify::run(arguments, &cli.common),
    }
}
