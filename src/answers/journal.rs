//! JSON answer of `metaplan journal`.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use crate::journal::{Entry, JournalReport};
use crate::message::Message;

const FORMAT: &str = "metaplan-journal-report/1";

/// What is in a journal, and what is wrong with it.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct JournalAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// Whether it can be used.
    sound: bool,
    /// A sentence for each file.
    parts: &'a [String],
    /// What is wrong with it.
    messages: &'a [Message],
    /// With `show`: what is in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    records: Option<Vec<RecordPart<'a>>>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct RecordPart<'a> {
    /// Its number, from 1.
    record: u64,
    /// The number of the file that it is in.
    segment: u64,
    /// `event`, `decision` or `end`.
    kind: &'a str,
    /// Of an event: its time since the start of the mission.
    #[serde(skip_serializing_if = "Option::is_none")]
    microseconds: Option<u64>,
    /// Of a decision.
    #[serde(skip_serializing_if = "Option::is_none")]
    answers: Option<&'a Value>,
    /// Of an event.
    #[serde(skip_serializing_if = "Option::is_none")]
    line: Option<&'a Value>,
}

impl<'a> JournalAnswer<'a> {
    /// Answer with the report, and with the records if `shows`.
    pub fn new(report: &'a JournalReport, shows: bool) -> Self {
        Self {
            format: FORMAT,
            sound: report.is_sound(),
            parts: &report.parts,
            messages: &report.messages,
            records: shows.then(|| report.entries.iter().map(RecordPart::of).collect()),
        }
    }
}

impl<'a> RecordPart<'a> {
    fn of(entry: &'a Entry) -> Self {
        let content = Some(&entry.content).filter(|content| !content.is_null());
        let is_decision = entry.kind == "decision";
        Self {
            record: entry.record,
            segment: entry.segment,
            kind: &entry.kind,
            microseconds: entry.time,
            answers: content.filter(|_| is_decision),
            line: content.filter(|_| !is_decision),
        }
    }
}
