//! Shared parts of all commands: exit status, failures, and common options.

use std::io::IsTerminal;
use std::path::PathBuf;

use crate::message::{Errors, Message};
use clap::{Args, ColorChoice, ValueEnum};
use planner::Limits;
use probabilistic::{Diagnostic, Error};

/// Exit statuses; `docs/reference/statuses.md` lists them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Exit {
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

pub(super) struct Failure {
    pub(super) exit: Exit,
    pub(super) messages: Errors,
}

impl Failure {
    pub(super) fn usage(message: Message) -> Self {
        Self { exit: Exit::Usage, messages: message.into() }
    }

    pub(super) fn planning(messages: Errors, limits: &Limits) -> Self {
        let is = |code: &str| messages.iter().any(|message| message.code == code);
        let exit = if is("M170") {
            Exit::Fault
        } else if is("M110") {
            Exit::Inconsistent
        } else if limits.reached() {
            Exit::NothingFound
        } else {
            Exit::BadInput
        };
        Self { exit, messages }
    }
}

impl From<Errors> for Failure {
    fn from(messages: Errors) -> Self {
        Self { exit: Exit::BadInput, messages }
    }
}

impl From<Vec<Message>> for Failure {
    fn from(messages: Vec<Message>) -> Self {
        Errors::from(messages).into()
    }
}

impl From<Message> for Failure {
    fn from(message: Message) -> Self {
        Errors::from(message).into()
    }
}

/// Options that all commands have.
#[derive(Debug, Clone, Args)]
pub(super) struct Common {
    /// Output format of the answer.
    #[arg(long, global = true, value_enum, default_value_t = Format::Text)]
    pub(super) format: Format,
    /// Suppress warnings and progress on standard error.
    #[arg(long, short, global = true)]
    pub(super) quiet: bool,
    /// Print statistics in addition to the answer.
    #[arg(long, short, global = true)]
    pub(super) verbose: bool,
    /// Write a trace of the running time for `chrome://tracing` or Perfetto.
    #[arg(long, global = true, value_name = "FILE")]
    pub(super) trace: Option<PathBuf>,
    /// Use colours in messages: on a terminal unless `NO_COLOR` is set, always, or never.
    #[arg(long, global = true, value_enum, default_value_t = ColorChoice::Auto, value_name = "WHEN")]
    pub(super) color: ColorChoice,
}

impl Common {
    pub(super) fn colors(&self, stream: &impl IsTerminal) -> bool {
        let is_set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
        let is_dumb = std::env::var_os("TERM").is_some_and(|terminal| terminal == "dumb");
        match self.color {
            ColorChoice::Always => true,
            ColorChoice::Never => false,
            ColorChoice::Auto => stream.is_terminal() && !is_set("NO_COLOR") && !is_dumb,
        }
    }
}

/// Format of answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Format {
    /// Text for people.
    Text,
    /// JSON for programs, in versioned formats; see the book.
    Json,
    /// `reason` only: inferred assertions, sorted.
    Ntriples,
    /// `reason` only: inferred assertions, grouped by subject.
    Turtle,
}

/// Converts an error about a model and a property to a failure. Both are pairs of file name and
/// text, which messages quote.
pub(super) fn process_failure(error: Error, model: (&str, &str), property: (&str, &str)) -> Failure {
    match error {
        Error::Model(problems) => in_file(&problems, model),
        Error::Property(problems) => in_file(&problems, property),
        Error::Constant(text) => Failure::usage(Message::error("Q504", text)),
        Error::StateLimit { .. } | Error::Interrupted { .. } => Failure {
            exit: Exit::NothingFound,
            messages: vec![Message::at("Q505", model.0, None, error.to_string())].into(),
        },
        other => Message::at("Q506", model.0, None, other.to_string()).into(),
    }
}

pub(super) fn in_file(problems: &[Diagnostic], (file, text): (&str, &str)) -> Failure {
    let message = |problem: &Diagnostic| {
        let place = Some((problem.place.line, problem.place.column));
        Message::at(problem.code, file, place, problem.message.clone()).with_source(text)
    };
    problems.iter().map(message).collect::<Vec<_>>().into()
}
