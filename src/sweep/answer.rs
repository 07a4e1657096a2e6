//! JSON answer of `metaplan sweep`. It is not in `answers`, because studies depend on missions,
//! which depend on `answers`.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value};

use super::results::{FORMAT, Line};
use super::table::Group;
use crate::message::Message;
use crate::simulate::Sample;

/// Progress of a shard or study; after merging, also means over repetitions.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SweepAnswer {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// Number of runs of the shard or study.
    runs: usize,
    /// Number of completed runs.
    done: usize,
    /// Number of completed runs without an answer.
    failed: usize,
    /// Number of completed runs that reached the time limit.
    timed_out: usize,
    /// Runs that are not complete; at most the first hundred.
    missing: Vec<usize>,
    /// Reason why a limit ended the command before all runs were complete (M130).
    messages: Vec<Message>,
    /// With `--merge`: groups of rows with equal texts and equal values of all varied keys except
    /// `repetitions`.
    groups: Vec<GroupPart>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct GroupPart {
    /// Keys and text values that are common to the rows of the group.
    common: Map<String, Value>,
    /// Number of rows.
    rows: usize,
    /// Statistics of each column of numbers or truth values, except varied keys and the exit
    /// status.
    means: Map<String, Value>,
}

#[derive(Debug, Clone, Serialize)]
struct MeanPart {
    count: usize,
    mean: f64,
    deviation: f64,
    half_width_95: f64,
}

impl GroupPart {
    fn of(group: &Group) -> Self {
        let mean = |(column, sample): &(String, Sample)| {
            let part = MeanPart {
                count: sample.count,
                mean: sample.mean,
                deviation: sample.deviation,
                half_width_95: sample.half_width,
            };
            (column.clone(), serde_json::to_value(part).unwrap_or_default())
        };
        Self {
            common: group.common.iter().cloned().collect(),
            rows: group.count,
            means: group.samples.iter().map(mean).collect(),
        }
    }
}

impl SweepAnswer {
    /// Creates the answer from the lines of completed runs, the numbers of all requested runs, and
    /// the groups of a merged table.
    pub fn new(lines: &[Line], requested: impl Iterator<Item = usize>, groups: &[Group]) -> Self {
        let done: std::collections::BTreeSet<usize> = lines.iter().map(|line| line.run).collect();
        let requested: Vec<usize> = requested.collect();
        let missing = requested.iter().filter(|run| !done.contains(run)).copied();
        Self {
            format: FORMAT,
            runs: requested.len(),
            done: lines.len(),
            failed: lines.iter().filter(|line| line.answer.is_null()).count(),
            timed_out: lines.iter().filter(|line| line.timed_out).count(),
            missing: missing.take(100).collect(),
            messages: Vec::new(),
            groups: groups.iter().map(GroupPart::of).collect(),
        }
    }

    /// Sets the reasons why the command ended before all runs were done.
    #[must_use]
    pub fn because(self, messages: Vec<Message>) -> Self {
        Self { messages, ..self }
    }

    /// Returns `true` if all requested runs are done, each with an answer.
    pub fn is_complete(&self) -> bool {
        self.done == self.runs && self.failed == 0
    }

    /// Formats the numbers of runs as a phrase, such as "3 of 4 runs done".
    pub fn sentence(&self) -> String {
        let done = format!("{} of {} runs done", self.done, self.runs);
        match (self.failed, self.timed_out) {
            (0, _) => done,
            (failed, 0) => format!("{done}, {failed} without an answer"),
            (failed, late) => format!("{done}, {failed} without an answer ({late} by the time limit)"),
        }
    }
}
