//! Reads the contents of a journal for a report, without loading its mission and without changing a
//! file.

use std::path::Path;

use serde_json::{Value, json};

use super::directory::{End, JournalFiles, Segment, broken, name};
use super::recover::usable;
use crate::message::Message;

/// Contents and faults of a journal.
#[derive(Debug)]
#[non_exhaustive]
pub struct JournalReport {
    /// Descriptions of the segments and snapshots, one line each.
    pub parts: Vec<String>,
    /// Faults: an error if the journal cannot be used, a warning otherwise.
    pub messages: Vec<Message>,
    /// All sound records of all segments, in order, without the headers of the segments.
    pub entries: Vec<Entry>,
}

/// A record of a journal.
#[derive(Debug)]
#[non_exhaustive]
pub struct Entry {
    /// Number of the record.
    pub record: u64,
    /// Number of the record's segment.
    pub segment: u64,
    /// Kind of the record: `event`, `reaction`, `decision` or `end`.
    pub kind: String,
    /// For an event, the time since the start of the mission, in microseconds.
    pub time: Option<u64>,
    /// The line of an event, or the answers of a reaction or decision; null for an `end` record.
    pub content: Value,
}

impl JournalReport {
    /// Reads the journal in a directory.
    ///
    /// # Errors
    /// The directory cannot be read, or does not contain a journal.
    pub fn read(directory: &Path) -> Result<Self, Message> {
        let contents =
            JournalFiles::read(directory).map_err(|error| broken(directory, &error.to_string()))?;
        if contents.segments.is_empty() && contents.snapshots.is_empty() {
            return Err(broken(directory, "there is none"));
        }
        let (mut parts, mut messages, mut entries) = (Vec::new(), Vec::new(), Vec::new());
        if let Err(message) = contents.require_complete(directory) {
            messages.push(message);
        } else if let Err(text) = usable(&contents, &mut messages) {
            messages.push(broken(directory, &text));
        }
        for (number, segment) in &contents.segments {
            match segment {
                Ok(segment) => {
                    parts.push(format!("{}: {}", contents.name(*number), describe(segment)));
                    entries.extend(segment.records.iter().map(|record| Entry {
                        record: record.number,
                        segment: *number,
                        kind: record.kind.clone(),
                        time: record.count(0).filter(|_| record.kind == "event"),
                        content: match record.kind.as_str() {
                            "event" => json!(record.text(1)),
                            "decision" | "reaction" => json!(record.list(0)),
                            _ => Value::Null,
                        },
                    }));
                }
                Err(text) => parts.push(format!("{}: {text}", contents.name(*number))),
            }
        }
        for (number, snapshot) in &contents.snapshots {
            let text = match snapshot {
                Ok(snapshot) => format!("the state before record {}", snapshot.before.next),
                Err(text) => text.clone(),
            };
            parts.push(format!("{}: {text}", name("snapshot", *number)));
        }
        Ok(Self { parts, messages, entries })
    }

    /// Returns `true` if the journal can be used, i.e. if no message is an error.
    pub fn is_sound(&self) -> bool {
        self.messages.iter().all(|message| message.severity == "warning")
    }
}

fn describe(segment: &Segment) -> String {
    let (first, next) = (segment.before.next, segment.after.next);
    let records = format!("records {first} to {}, {} bytes", next - 1, segment.sound);
    match segment.end {
        End::Whole => records,
        End::Unbroken => format!("{records}; the last line break is missing"),
        End::Incomplete(bytes) => {
            format!("{records}; then {bytes} bytes of a record that was not written completely")
        }
        End::Damaged(line) => format!("{records}; line {line} is damaged or out of order"),
    }
}
