//! Records of a journal as lines of text, linked by a hash chain.
//!
//! A line is sixteen hexadecimal digits, a space and a JSON array that begins with the record's number. The digits are
//! the first 8 bytes of the SHA-256 hash of the previous line's digits and this line's array. So a changed, missing,
//! repeated or moved line before the end is detected. The chain detects damage; it does not protect against an attacker
//! with write access to the directory.

use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};

pub(super) const FORMAT: &str = "metaplan-journal/3";

const DIGITS: usize = 16;

/// A position between two records: the number of the next record, and the digits (hash) of the previous one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Link {
    pub(super) next: u64,
    pub(super) digits: String,
}

impl Link {
    pub(super) fn first() -> Self {
        Self { next: 0, digits: "0".repeat(DIGITS) }
    }

    pub(super) fn line(&self, kind: &str, fields: &[Value]) -> (String, Self) {
        let mut array = vec![json!(self.next), json!(kind)];
        array.extend_from_slice(fields);
        let text = Value::Array(array).to_string();
        let digits = digits(&self.digits, text.as_bytes());
        (format!("{digits} {text}\n"), Self { next: self.next + 1, digits })
    }

    /// Parses a line without its line break. Returns the record and the link after it. Returns `None` if the line is
    /// malformed, or if its number or digits do not continue the chain at this position.
    pub(super) fn read(&self, line: &[u8]) -> Option<(Record, Self)> {
        let (record, digits) = parse(line)?;
        let text = line.get(DIGITS + 1..)?;
        let fits = record.number == self.next && digits == self::digits(&self.digits, text);
        fits.then(|| (record, Self { next: self.next + 1, digits }))
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Record {
    pub(super) number: u64,
    pub(super) kind: String,
    pub(super) fields: Vec<Value>,
}

impl Record {
    pub(super) fn text(&self, index: usize) -> Option<&str> {
        self.fields.get(index).and_then(Value::as_str)
    }

    pub(super) fn count(&self, index: usize) -> Option<u64> {
        self.fields.get(index).and_then(Value::as_u64)
    }

    pub(super) fn list(&self, index: usize) -> Vec<Value> {
        self.fields.get(index).and_then(Value::as_array).cloned().unwrap_or_default()
    }
}

/// Returns the first line of a segment (file of records), and the link (position in the chain of records) after this
/// line. The line repeats the digits of the previous record, which is in the previous segment.
pub(super) fn header(after: &Link, digest: &str, segment: u64) -> (String, Link) {
    after.line("segment", &[json!(FORMAT), json!(digest), json!(segment), json!(after.digits)])
}

/// Returns the only line of a snapshot file. `after` is the position in the chain of records at which the snapshot was
/// taken.
pub(super) fn snapshot(after: &Link, digest: &str, segment: u64, data: &Value) -> String {
    after
        .line("snapshot", &[json!(FORMAT), json!(digest), json!(segment), json!(after.digits), data.clone()])
        .0
}

/// Parses the first line of a file: the header of a segment, or a snapshot. Both contain the digits of the previous
/// record. Returns the line's record, the link before it and the link after it. Returns `None` if the line is damaged
/// or is not of the given kind.
pub(super) fn opening(line: &[u8], kind: &str) -> Option<(Record, Link, Link)> {
    let (record, _) = parse(line)?;
    let before = Link { next: record.number, digits: record.text(3)?.to_owned() };
    let (record, after) = before.read(line)?;
    (record.kind == kind).then_some((record, before, after))
}

fn parse(line: &[u8]) -> Option<(Record, String)> {
    let (digits, text) = line.split_at_checked(DIGITS)?;
    let digits = std::str::from_utf8(digits).ok()?.to_owned();
    let Value::Array(fields) = serde_json::from_slice(text.strip_prefix(b" ")?).ok()? else { return None };
    let mut fields = fields.into_iter();
    let (number, kind) = (fields.next()?.as_u64()?, fields.next()?.as_str()?.to_owned());
    Some((Record { number, kind, fields: fields.collect() }, digits))
}

fn digits(before: &str, text: &[u8]) -> String {
    let hash = Sha256::new().chain_update(before).chain_update(text).finalize();
    let half = hash.iter().take(DIGITS / 2).fold(0_u64, |sum, byte| sum << 8 | u64::from(*byte));
    format!("{half:016x}")
}
