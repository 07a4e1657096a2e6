//! JSON answer of `metaplan journal`.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use crate::journal::{Entry, JournalReport};
use crate::message::Message;

const FORMAT: &str = "metaplan-journal-report/1";

/// Content and defects of a journal.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct JournalAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// Whether the journal can be used.
    sound: bool,
    /// One sentence per file.
    parts: &'a [String],
    /// Defects of the journal.
    messages: &'a [Message],
    /// With `show`: records of the journal.
    #[serde(skip_serializing_if = "Option::is_none")]
    records: Option<Vec<RecordPart<'a>>>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct RecordPart<'a> {
    /// Number of the record, from 1.
    record: u64,
    /// Number of the file with the record.
    segment: u64,
    /// `event`, `reaction`, `decision` or `end`.
    kind: &'a str,
    /// For an event: time since the start of the mission.
    #[serde(skip_serializing_if = "Option::is_none")]
    microseconds: Option<u64>,
    /// For a reaction or a decision: its answers.
    #[serde(skip_serializing_if = "Option::is_none")]
    answers: Option<&'a Value>,
    /// For an event: its line.
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
        let has_answers = ["reaction", "decision"].contains(&entry.kind.as_str());
        Self {
            record: entry.record,
            segment: entry.segment,
            kind: &entry.kind,
            microseconds: entry.time,
            answers: content.filter(|_| has_answers),
            line: content.filter(|_| !has_answers),
        }
    }
}
