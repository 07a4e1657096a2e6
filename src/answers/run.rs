//! JSON lines of `metaplan run` in addition to the answers of the loop, and the log of `metaplan
//! simulate`.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use crate::journal::Recovery;
use crate::mapek::{Beliefs, FORMAT, Planning};
use crate::number::to_json;
use crate::simulate::Strategy;

/// First output line of a loop: name of its mission, and state of its journal if there is one.
#[derive(Debug, Clone, Serialize)]
pub struct ReadyLine {
    answer: &'static str,
    format: &'static str,
    mission: String,
    #[serde(flatten)]
    recovered: Option<RecoveryPart>,
}

/// State of the journal of a loop.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub(super) struct RecoveryPart {
    /// Whether the loop was restored from the journal.
    resumed: bool,
    /// Number of input lines that the journal has recorded.
    lines: u64,
    /// Greatest sequence number of an accepted line, or null if no such line had a number.
    seq: Option<u64>,
    /// Ranges of skipped numbers below `seq`, with both ends.
    missing: Vec<[u64; 2]>,
    /// Number of bytes of an incomplete record that were cut off.
    cut_bytes: u64,
    /// Warnings about files that were not needed, and about missing last records.
    warnings: Vec<String>,
}

impl RecoveryPart {
    pub(super) fn new(lines: u64, seq: Option<u64>, missing: Vec<[u64; 2]>, recovery: &Recovery) -> Self {
        Self {
            resumed: recovery.replayed.is_some(),
            lines,
            seq,
            missing,
            cut_bytes: recovery.cut,
            warnings: recovery.warnings.iter().map(|warning| warning.message.clone()).collect(),
        }
    }
}

impl ReadyLine {
    /// The first output line of a loop without a journal.
    pub fn new(mission: String) -> Self {
        Self { answer: "ready", format: FORMAT, mission, recovered: None }
    }

    /// Adds the state of the journal from which the loop was started.
    pub fn resume(&mut self, beliefs: &Beliefs, recovery: &Recovery) {
        let (lines, seq, missing) = (beliefs.lines(), beliefs.sequence(), beliefs.missing());
        self.recovered = Some(RecoveryPart::new(lines, seq, missing, recovery));
    }
}

/// Output line that is repeated during planning, with the cost of the incumbent and the current lower bound.
#[derive(Debug, Clone, Serialize)]
pub struct PlanningLine {
    answer: &'static str,
    seconds: u64,
    cost: Option<Value>,
    lower_bound: Option<Value>,
    line: u64,
}

impl PlanningLine {
    /// Creates the line. `seconds` is the duration of planning until now, `line` the number of the last
    /// input line that the loop received.
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

/// An answer, with the number of the last input line that the loop received before it gave the answer.
#[derive(Debug, Clone, Serialize)]
pub struct NumberedAnswer<'a, A> {
    #[serde(flatten)]
    answer: &'a A,
    line: u64,
}

impl<'a, A> NumberedAnswer<'a, A> {
    /// Creates the answer; `line` is the number of the last input line that the loop received.
    pub fn new(answer: &'a A, line: u64) -> Self {
        Self { answer, line }
    }
}

/// Acknowledgement of an input line, with the time that handling the line took.
#[derive(Debug, Clone, Serialize)]
pub struct HandledLine {
    answer: &'static str,
    line: u64,
    microseconds: u128,
}

impl HandledLine {
    /// Creates the acknowledgement of the input line with the number `line`; handling it took
    /// `microseconds`.
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
    /// Adds the name of the deciding strategy to a JSON object, which is an event or an answer.
    pub fn new(line: Value, strategy: Strategy) -> Self {
        Self { line, strategy: strategy.name() }
    }
}
