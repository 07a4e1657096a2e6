//! What `metaplan run` answers beside the answers of the loop, a line each; and the log of `metaplan simulate`.

use serde::Serialize;
use serde_json::Value;

use crate::journal::Recovery;
use crate::mapek::{Beliefs, FORMAT, Planning};
use crate::number::to_json;
use crate::simulate::Strategy;

/// The first line: the loop is ready, and where it goes on.
#[derive(Debug, Clone, Serialize)]
pub struct ReadyLine {
    answer: &'static str,
    format: &'static str,
    mission: String,
    #[serde(flatten)]
    recovered: Option<RecoveryPart>,
}

/// What a loop with a journal says of it.
#[derive(Debug, Clone, Serialize)]
struct RecoveryPart {
    resumed: bool,
    lines: u64,
    seq: Option<u64>,
    /// Ranges of numbers below `seq` that were not seen, with both ends.
    missing: Vec<[u64; 2]>,
    cut_bytes: u64,
    warnings: Vec<String>,
}

impl ReadyLine {
    /// A loop without a journal.
    pub fn new(mission: String) -> Self {
        Self { answer: "ready", format: FORMAT, mission, recovered: None }
    }

    /// The same with a journal that was opened.
    pub fn resume(&mut self, beliefs: &Beliefs, recovery: &Recovery) {
        self.recovered = Some(RecoveryPart {
            resumed: recovery.replayed.is_some(),
            lines: beliefs.lines(),
            seq: beliefs.sequence(),
            missing: beliefs.missing(),
            cut_bytes: recovery.cut,
            warnings: recovery.warnings.iter().map(|own| own.message.clone()).collect(),
        });
    }
}

/// A sign of life while a plan is looked for.
#[derive(Debug, Clone, Serialize)]
pub struct PlanningLine {
    answer: &'static str,
    seconds: u64,
    cost: Option<Value>,
    lower_bound: Option<Value>,
    line: u64,
}

impl PlanningLine {
    /// So many seconds after planning for a line of input has begun.
    pub fn new(planning: &Planning, seconds: u64, line: u64) -> Self {
        Self {
            answer: "planning",
            seconds,
            cost: planning.cost.as_ref().map(to_json),
            lower_bound: planning.lower_bound.as_ref().map(to_json),
            line,
        }
    }
}

/// An answer with the number of the line that it is about.
#[derive(Debug, Clone, Serialize)]
pub struct NumberedAnswer<'a, A> {
    #[serde(flatten)]
    answer: &'a A,
    line: u64,
}

impl<'a, A> NumberedAnswer<'a, A> {
    /// An answer to a line.
    pub fn new(answer: &'a A, line: u64) -> Self {
        Self { answer, line }
    }
}

/// That a line was handled.
#[derive(Debug, Clone, Serialize)]
pub struct HandledLine {
    answer: &'static str,
    line: u64,
    microseconds: u128,
}

impl HandledLine {
    /// So many microseconds after it was read.
    pub fn new(line: u64, microseconds: u128) -> Self {
        Self { answer: "handled", line, microseconds }
    }
}

/// An event or an answer in the log of a simulation.
#[derive(Debug, Clone, Serialize)]
pub struct LogLine {
    #[serde(flatten)]
    line: Value,
    strategy: &'static str,
}

impl LogLine {
    /// An object of the format, and who has decided.
    pub fn new(line: Value, strategy: Strategy) -> Self {
        Self { line, strategy: strategy.name() }
    }
}
