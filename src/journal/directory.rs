//! Reads the segments and snapshots in a journal's directory. For each faulty file, the first fault is described. Also
//! opens files that only their user can access.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::record::{FORMAT, Link, Record, opening};
use crate::message::Message;

/// Replaces `journal` at the beginning of the name of the last segment's file if a write has failed
/// and the loop has continued without the journal. Both words have the same length, so that renaming
/// needs no disk space.
pub(super) const INCOMPLETE: &str = "partial";

#[derive(Debug)]
pub(super) struct Segment {
    pub(super) number: u64,
    pub(super) digest: String,
    pub(super) before: Link,
    pub(super) after: Link,
    pub(super) records: Vec<Record>,
    /// Number of bytes at the beginning of the file that contain the header and `records`.
    pub(super) sound: u64,
    pub(super) end: End,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum End {
    /// The last line, a record or the header, is complete and has its line break.
    Whole,
    /// The segment ends with a complete record whose line break is missing or damaged.
    Unbroken,
    /// The segment ends with this number of bytes of an incomplete record.
    Incomplete(u64),
    /// The line with this number, from 1, is damaged. The lines after it are not read.
    Damaged(usize),
}

impl Segment {
    pub(super) fn is_closed(&self) -> bool {
        self.records.last().is_some_and(|record| record.kind == "end")
    }
}

#[derive(Debug)]
pub(super) struct SnapshotFile {
    /// Link (position in the chain of records) at which the snapshot was taken. The segment with the same number begins
    /// at this link.
    pub(super) before: Link,
    pub(super) data: Value,
}

#[derive(Debug, Default)]
pub(super) struct JournalFiles {
    pub(super) segments: BTreeMap<u64, Result<Segment, String>>,
    pub(super) snapshots: BTreeMap<u64, Result<SnapshotFile, String>>,
    /// Number of the segment whose last write failed, if the loop continued after the failure.
    pub(super) incomplete: Option<u64>,
}

impl JournalFiles {
    pub(super) fn read(directory: &Path) -> io::Result<Self> {
        let mut contents = Self::default();
        for entry in std::fs::read_dir(directory)? {
            let name = entry?.file_name();
            let Some((kind, number)) = name.to_str().and_then(|name| name.split_once('-')) else { continue };
            let Ok(number) = number.parse::<u64>() else { continue };
            let bytes = || read_private(&directory.join(&name)).map_err(|error| error.to_string());
            match kind {
                "journal" | INCOMPLETE => {
                    contents.incomplete = Some(number).filter(|_| kind == INCOMPLETE).or(contents.incomplete);
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

    pub(super) fn name(&self, number: u64) -> String {
        name(if self.incomplete == Some(number) { INCOMPLETE } else { "journal" }, number)
    }

    /// Returns the error M324 if a segment is marked as incomplete: then the loop has continued after a failed write.
    pub(super) fn require_complete(&self, directory: &Path) -> Result<(), Message> {
        let Some(number) = self.incomplete else { return Ok(()) };
        let text = format!(
            "the journal cannot be resumed: it could not be written after {}, and the loop continued without it, so \
             the numbers of later effects would be assigned again",
            self.name(number)
        );
        let help = "free disk space, and start a journal in another directory; `metaplan journal show` lists the \
                    records";
        Err(Message::at("M324", &directory.display().to_string(), None, text).with_help(help))
    }

    pub(super) fn start(&self, number: u64) -> Result<&SnapshotFile, String> {
        let name = name("snapshot", number);
        let missing = || Err(format!("{name} is missing"));
        let snapshot = self.snapshots.get(&number).map_or_else(missing, |entry| match entry {
            Ok(snapshot) => Ok(snapshot),
            Err(text) => Err(format!("{name} {text}")),
        })?;
        match self.segments.get(&number) {
            Some(Ok(segment)) if segment.before != snapshot.before => {
                Err(format!("{name} belongs to another journal than {}", self::name("journal", number)))
            }
            _ => Ok(snapshot),
        }
    }

    /// Returns the segments from the given number to the last one, or a description of the first
    /// fault. Each segment has to continue the record chain of its predecessor, and the last one must not end with an
    /// `end` record. A sound snapshot requires the segment with its number.
    pub(super) fn chain(&self, from: u64) -> Result<Vec<&Segment>, String> {
        // A checkpoint writes its snapshot after the `end` record that refers to the new segment. So without this
        // record, a faulty snapshot after the last segment, such as a foreign file, proves no missing segment.
        let sound = self.snapshots.iter().filter(|(_, snapshot)| snapshot.is_ok()).map(|(number, _)| number);
        let last = self.segments.keys().chain(sound).max().copied().unwrap_or(from);
        let mut chain: Vec<&Segment> = Vec::new();
        for number in from..=last.max(from) {
            let name = name("journal", number);
            let segment = match self.segments.get(&number) {
                None => return Err(format!("{name} is missing")),
                Some(Err(text)) => return Err(format!("{name} {text}")),
                Some(Ok(segment)) => segment,
            };
            if let End::Damaged(line) = segment.end {
                return Err(format!("line {line} of {name} is damaged or out of order"));
            }
            if let Some(before) = chain.last()
                && !follows(before, segment)
            {
                // A power loss during a checkpoint can leave the new segment without the last records of the old one.
                // The next checkpoint replaces the new segment.
                let is_begun = !segment.records.is_empty() || self.snapshots.contains_key(&number);
                if number == last && !is_begun && !before.is_closed() {
                    break;
                }
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

/// Returns `true` if `after` begins at the link (position in the chain of records) where `before` ends. If `before` has
/// no `end` record, because a crash has prevented it, this record is assumed, and `after` must have no records yet.
pub(super) fn follows(before: &Segment, after: &Segment) -> bool {
    if before.is_closed() {
        return matches!(before.end, End::Whole | End::Unbroken) && before.after == after.before;
    }
    after.records.is_empty() && closing(&before.after, before.number).1 == after.before
}

/// Creates the line of the `end` record, which closes a segment and names the next one. Also
/// returns the link after this line.
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
            // Perhaps only the line break is damaged. Then the line without its last byte is a valid record.
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

/// Returns the length in bytes of the record in a last line without a line break. The line may have another character
/// in place of the line break.
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
        (Some(FORMAT), Some(stated)) if stated == number => Ok(()),
        (Some(FORMAT), stated) => Err(format!(
            "has the number {} in its header, which differs from its name",
            stated.unwrap_or_default()
        )),
        (Some("metaplan-journal/2"), _) => Err(OLD_FORMAT.to_owned()),
        (format, _) => Err(format!("has the format `{}`, not `{FORMAT}`", format.unwrap_or_default())),
    }
}

pub(super) const OLD_FORMAT: &str = "is of the format `metaplan-journal/2` or older, which this version does not \
                                     read; finish the mission with the version that wrote it, or restart the mission \
                                     with a journal in another directory";

fn no_journal(first: &[u8]) -> String {
    let text = String::from_utf8_lossy(first);
    let old = text.contains("metaplan-journal/1");
    let damaged = text.contains("metaplan-journal/");
    match (old, damaged) {
        (true, _) => OLD_FORMAT.to_owned(),
        (false, true) => "is damaged in its first line".to_owned(),
        (false, false) => "is not a journal and was not changed".to_owned(),
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

/// Reads a regular file. Rejects pipes and symbolic links, since a pipe may never end, and a link may lead outside the
/// directory.
fn read_private(path: &Path) -> io::Result<Vec<u8>> {
    require_file(path)?;
    std::fs::read(path)
}

/// Checks that a path is a regular file or does not exist. A symbolic link is not a regular file.
pub(super) fn require_file(path: &Path) -> io::Result<()> {
    match std::fs::symlink_metadata(path) {
        Ok(found) if !found.is_file() => Err(io::Error::other("is not a regular file")),
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Opens a regular file as specified by `options`, which may create it. On Unix, only its user can access it
/// afterwards.
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

/// Creates a directory and its missing parents. On Unix, only their user can access the created ones.
pub(super) fn make_directory(path: &Path) -> io::Result<()> {
    let mut builder = std::fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(path)
}
