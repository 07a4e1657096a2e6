//! A directory to the segments and snapshots in it, with all that is wrong with them.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::record::{FORMAT, Link, Record, opening};
use crate::message::Message;

/// A segment, as far as it is sound.
#[derive(Debug)]
pub(super) struct Segment {
    pub(super) number: u64,
    pub(super) digest: String,
    /// What it comes after, and what comes after it.
    pub(super) before: Link,
    pub(super) after: Link,
    /// Without the header.
    pub(super) records: Vec<Record>,
    /// How many bytes are whole records.
    pub(super) sound: u64,
    pub(super) end: End,
}

/// How a segment ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum End {
    /// With a whole record.
    Whole,
    /// With a whole record whose line break is missing, or is another character.
    Unbroken,
    /// With so many bytes of a record that was not written completely.
    Incomplete(u64),
    /// Something is wrong with this line, from 1.
    Damaged(usize),
}

impl Segment {
    /// Whether it says that another one follows.
    pub(super) fn is_closed(&self) -> bool {
        self.records.last().is_some_and(|record| record.kind == "end")
    }
}

/// A snapshot.
#[derive(Debug)]
pub(super) struct SnapshotFile {
    /// After what it was made; the segment with its number begins there.
    pub(super) before: Link,
    pub(super) data: Value,
}

/// What is in a directory.
#[derive(Debug, Default)]
pub(super) struct JournalFiles {
    /// Segments by number, or what is wrong with them as a whole.
    pub(super) segments: BTreeMap<u64, Result<Segment, String>>,
    pub(super) snapshots: BTreeMap<u64, Result<SnapshotFile, String>>,
}

impl JournalFiles {
    /// Reads a directory.
    ///
    /// # Errors
    /// It cannot be listed.
    pub(super) fn read(directory: &Path) -> io::Result<Self> {
        let mut contents = Self::default();
        for entry in std::fs::read_dir(directory)? {
            let name = entry?.file_name();
            let Some((kind, number)) = name.to_str().and_then(|name| name.split_once('-')) else { continue };
            let Ok(number) = number.parse::<u64>() else { continue };
            let bytes = || read_private(&directory.join(&name)).map_err(|error| error.to_string());
            match kind {
                "journal" => {
                    contents.segments.insert(number, bytes().and_then(|bytes| segment(&bytes, number)));
                }
                "snapshot" => {
                    contents.snapshots.insert(number, bytes().and_then(|bytes| snapshot(&bytes, number)));
                }
                _ => {}
            }
        }
        Ok(contents)
    }

    /// A sound snapshot with which the segment of its number begins.
    pub(super) fn start(&self, number: u64) -> Result<&SnapshotFile, String> {
        let name = name("snapshot", number);
        let missing = || Err(format!("{name} is missing"));
        let found = self.snapshots.get(&number).map_or_else(missing, |found| match found {
            Ok(snapshot) => Ok(snapshot),
            Err(text) => Err(format!("{name} {text}")),
        })?;
        match self.segments.get(&number) {
            Some(Ok(segment)) if segment.before != found.before => {
                Err(format!("{name} is not of the same journal as {}", self::name("journal", number)))
            }
            _ => Ok(found),
        }
    }

    /// The segments from a number on, which follow each other without a gap, or the first thing that is wrong.
    pub(super) fn chain(&self, from: u64) -> Result<Vec<&Segment>, String> {
        let last = self.segments.keys().chain(self.snapshots.keys()).max().copied().unwrap_or(from);
        let mut chain: Vec<&Segment> = Vec::new();
        for number in from..=last.max(from) {
            let name = name("journal", number);
            let segment = match self.segments.get(&number) {
                None => return Err(format!("{name} is missing")),
                Some(Err(text)) => return Err(format!("{name} {text}")),
                Some(Ok(segment)) => segment,
            };
            if let End::Damaged(line) = segment.end {
                return Err(format!("line {line} of {name} is damaged, or does not belong there"));
            }
            if let Some(before) = chain.last()
                && !follows(before, segment)
            {
                return Err(format!("{name} does not follow {}", self::name("journal", number - 1)));
            }
            chain.push(segment);
        }
        match chain.last() {
            Some(last) if last.is_closed() => Err(format!("{} is missing", name("journal", last.number + 1))),
            _ => Ok(chain),
        }
    }
}

/// Whether a segment begins where another one ends, or would end if a crash had not come before its last record.
pub(super) fn follows(before: &Segment, after: &Segment) -> bool {
    if before.is_closed() {
        return before.end == End::Whole && before.after == after.before;
    }
    after.records.is_empty() && closing(&before.after, before.number).1 == after.before
}

/// The last line of a segment that another one follows, and the place after it.
pub(super) fn closing(at: &Link, segment: u64) -> (String, Link) {
    at.line("end", &[Value::from(segment + 1)])
}

fn segment(bytes: &[u8], number: u64) -> Result<Segment, String> {
    let mut lines = bytes.split_inclusive(|&byte| byte == b'\n');
    let first = lines.next().and_then(|line| line.strip_suffix(b"\n")).unwrap_or_default();
    let Some((header, before, after)) = opening(first, "segment") else { return Err(no_journal(first)) };
    check_opening(&header, number)?;
    let mut segment = Segment {
        number,
        digest: header.text(1).unwrap_or_default().to_owned(),
        before,
        after,
        records: Vec::new(),
        sound: first.len() as u64 + 1,
        end: End::Whole,
    };
    for (index, line) in lines.enumerate() {
        let whole = line.strip_suffix(b"\n");
        let mut read = segment.after.read(whole.unwrap_or(line));
        if read.is_none() && whole.is_none() {
            // The line break is another character.
            read = line.split_last().and_then(|(_, rest)| segment.after.read(rest));
        }
        match (read, whole) {
            (Some((record, after)), _) => {
                let length = if whole.is_some() { line.len() } else { after_length(line, &segment.after) };
                segment.end = if whole.is_some() { End::Whole } else { End::Unbroken };
                segment.sound += length as u64;
                segment.records.push(record);
                segment.after = after;
            }
            (None, None) => segment.end = End::Incomplete(line.len() as u64),
            (None, Some(_)) => {
                segment.end = End::Damaged(index + 2);
                break;
            }
        }
    }
    Ok(segment)
}

/// How much of a line without a line break is its record.
fn after_length(line: &[u8], at: &Link) -> usize {
    if at.read(line).is_some() { line.len() } else { line.len() - 1 }
}

fn snapshot(bytes: &[u8], number: u64) -> Result<SnapshotFile, String> {
    let line = bytes.strip_suffix(b"\n").filter(|line| !line.contains(&b'\n')).unwrap_or_default();
    let (record, before, _) = opening(line, "snapshot").ok_or("is damaged")?;
    check_opening(&record, number)?;
    Ok(SnapshotFile { before, data: record.fields.get(4).cloned().unwrap_or_default() })
}

fn check_opening(record: &Record, number: u64) -> Result<(), String> {
    match (record.text(0), record.count(2)) {
        (Some(FORMAT), Some(own)) if own == number => Ok(()),
        (Some(FORMAT), own) => Err(format!("has the number {} in it", own.unwrap_or_default())),
        (Some("metaplan-journal/2"), _) => Err(OLD_FORMAT.to_owned()),
        (format, _) => Err(format!("has the format `{}`, not `{FORMAT}`", format.unwrap_or_default())),
    }
}

/// What is to be said of a segment that an older version has written.
pub(super) const OLD_FORMAT: &str = "is of the format `metaplan-journal/2` or older, which this version does not read; let the version that \
                                     wrote it bring its mission to an end, or begin the mission anew with a journal in another \
                                     directory";

/// Why a file whose first line is not a header is none of ours.
fn no_journal(first: &[u8]) -> String {
    let text = String::from_utf8_lossy(first);
    let old = text.contains("metaplan-journal/1");
    let damaged = text.contains("metaplan-journal/");
    match (old, damaged) {
        (true, _) => OLD_FORMAT.to_owned(),
        (false, true) => "is damaged in its first line".to_owned(),
        (false, false) => "is not a journal; it was left as it is".to_owned(),
    }
}

pub(super) fn name(kind: &str, number: u64) -> String {
    format!("{kind}-{number:06}")
}

pub(super) fn path(directory: &Path, kind: &str, number: u64) -> PathBuf {
    directory.join(name(kind, number))
}

pub(super) fn broken(place: &Path, text: &str) -> Message {
    Message::at("M321", &place.display().to_string(), None, format!("the journal cannot be used: {text}"))
}

/// Reads a file that must be a file: a pipe would never end, and a link leads elsewhere.
fn read_private(path: &Path) -> io::Result<Vec<u8>> {
    require_file(path)?;
    std::fs::read(path)
}

/// # Errors
/// There is something with that name that is not a file.
pub(super) fn require_file(path: &Path) -> io::Result<()> {
    match std::fs::symlink_metadata(path) {
        Ok(found) if !found.is_file() => Err(io::Error::other("is not a regular file")),
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Opens a file for its user alone; it is made if there is none.
pub(super) fn open_private(path: &Path, options: &mut OpenOptions) -> io::Result<File> {
    require_file(path)?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::{OpenOptionsExt as _, PermissionsExt as _};
        let file = options.mode(0o600).open(path)?;
        file.set_permissions(std::fs::Permissions::from_mode(0o600))?;
        Ok(file)
    }
    #[cfg(not(unix))]
    options.open(path)
}

/// Makes a directory for its user alone, if there is none.
pub(super) fn make_directory(path: &Path) -> io::Result<()> {
    let mut builder = std::fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(path)
}
