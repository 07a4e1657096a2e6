//! Restores a loop from a journal: selects the usable segments, replays their records, and repairs the ends of segments
//! after a crash.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{self, Seek as _, Write as _};
use std::path::Path;
use std::time::Duration;

use super::directory::{End, JournalFiles, OLD_FORMAT, Segment, broken, closing, open_private, path};
use super::record::{Link, Record};
use super::recovery::Recovery;
use crate::mapek::{Observation, Recoverable};
use crate::message::Message;

#[derive(Debug)]
pub(super) enum Unfinished {
    /// The loop has a pending deliberation: it has reacted to an observation, or has just been
    /// created.
    Agenda,
    /// An observation without a recorded reaction or decision: its line, and its time since the start of the mission in
    /// microseconds.
    Observation(String, u64),
}

/// Returns the number of the first segment to replay, and the segments from this number on. Replay starts as late as
/// possible: at the newest sound snapshot that only sound segments follow; without one, at the beginning of the
/// journal. Faults in files that are not needed are added to `warnings`.
///
/// # Errors
/// Neither a snapshot nor the beginning of the journal can be used: descriptions of all faults, or only that the
/// format is old.
pub(super) fn usable<'a>(
    contents: &'a JournalFiles,
    warnings: &mut Vec<Message>,
) -> Result<(u64, Vec<&'a Segment>), String> {
    let mut problems = Vec::new();
    // Only the numbers of existing files count: a foreign file with a huge number must not cost time and memory.
    let numbers: BTreeSet<u64> = contents.segments.keys().chain(contents.snapshots.keys()).copied().collect();
    let first = numbers.first().copied().unwrap_or(0);
    for &from in numbers.iter().rev() {
        let start = if from == 0 { Ok(()) } else { contents.start(from).map(|_| ()) };
        match start.and_then(|()| contents.chain(from)) {
            Ok(segments) => {
                // Older segments and snapshots are not needed, so their damage is only a warning.
                let older = numbers.range(..from).copied().filter(|&number| number > 0);
                problems.extend(older.filter_map(|number| contents.start(number).err()));
                problems.extend(contents.chain(first).err());
                problems.sort();
                problems.dedup();
                let warning = |text: &String| {
                    Message::warning("M323", format!("the journal: {text}; recovery did not need this file"))
                };
                warnings.extend(problems.iter().map(warning));
                return Ok((from, segments));
            }
            Err(text) => problems.push(text),
        }
    }
    problems.sort();
    problems.dedup();
    // A journal of an older version is not damaged, and needs another remedy.
    if let Some(old) = problems.iter().find(|text| text.ends_with(OLD_FORMAT)) {
        return Err(format!("{old}; nothing was changed"));
    }
    let way_out = "nothing was changed; `metaplan journal show` lists the intact records; restore the damaged files \
                   from a backup, or use another directory";
    Err(format!("{}; {way_out}", problems.join(", ")))
}

pub(super) struct Replay<'a, C> {
    pub(super) directory: &'a Path,
    pub(super) control: &'a mut C,
    pub(super) recovery: &'a mut Recovery,
    pub(super) observations: u64,
    pub(super) unfinished: Option<Unfinished>,
}

impl<C: Recoverable> Replay<'_, C> {
    pub(super) fn segment(&mut self, segment: &Segment) -> Result<(), Message> {
        self.observations = 0;
        // The `end` record only links segments.
        let mut records = segment.records.iter().filter(|record| record.kind != "end").peekable();
        while let Some(record) = records.next() {
            let wrong = || broken(self.directory, &format!("record {} is out of order", record.number));
            // Only the last observation of a journal may lack its answers.
            if self
                .unfinished
                .take()
                .is_some_and(|unfinished| matches!(unfinished, Unfinished::Observation(..)))
            {
                return Err(wrong());
            }
            match record.kind.as_str() {
                // The decision on an earlier reaction, or the first decision.
                "decision" if self.control.has_agenda() => {
                    let answers = self.control.deliberate_again(&record.list(1));
                    self.compare(record, &answers)?;
                }
                "event" => {
                    let (Some(now), Some(line)) = (record.count(0), record.text(1)) else {
                        return Err(wrong());
                    };
                    let next = records.next_if(|next| ["decision", "reaction"].contains(&next.kind.as_str()));
                    self.event(line, now, next)?;
                }
                _ => return Err(wrong()),
            }
        }
        let is_begun = matches!(self.unfinished, Some(Unfinished::Observation(..)));
        if self.control.has_agenda() && !is_begun {
            self.unfinished = Some(Unfinished::Agenda);
        }
        Ok(())
    }

    /// Replays an observation. Compares the answers with those of `next`, the reaction or decision
    /// that follows it; without `next`, the observation is unfinished.
    fn event(&mut self, line: &str, now: u64, next: Option<&Record>) -> Result<(), Message> {
        self.recovery.replayed = self.recovery.replayed.map(|count| count + 1);
        let Some(next) = next else {
            self.unfinished = Some(Unfinished::Observation(line.to_owned(), now));
            return Ok(());
        };
        let (observation, now) = (Observation::recorded(line), Duration::from_micros(now));
        let answers = match next.kind.as_str() {
            // A reaction is replayed without planning; a decision is replayed with the recorded
            // plans.
            "reaction" => self.control.react(&observation, now),
            _ => self.control.handle_again(&observation, now, &next.list(1)),
        };
        self.observations += 1;
        self.compare(next, &answers)
    }

    fn compare(&mut self, written: &Record, answers: &[C::Answer]) -> Result<(), Message> {
        if self.control.decision(answers).agrees(&written.list(0)) {
            return Ok(());
        }
        let text = format!("replay gives a different decision than record {}", written.number);
        Err(broken(self.directory, &text))
    }
}

/// Repairs the ends of segments after a crash: removes an incomplete record, and adds a missing line break or `end`
/// record. Opens the last segment for appending. Returns its file and the link at its end.
pub(super) fn settle(
    directory: &Path,
    segments: &[&Segment],
    recovery: &mut Recovery,
) -> io::Result<(File, Link)> {
    for (position, segment) in segments.iter().enumerate() {
        let is_last = position + 1 == segments.len();
        if !is_last && segment.end == End::Whole && segment.is_closed() {
            continue;
        }
        let name = path(directory, "journal", segment.number);
        let mut file = open_private(&name, OpenOptions::new().read(true).write(true))?;
        // The incomplete record is kept in a separate file before it is cut off.
        if let End::Incomplete(bytes) = segment.end {
            recovery.cut += bytes;
            keep_cut(&name, segment.sound)?;
        }
        file.set_len(segment.sound)?;
        file.seek(io::SeekFrom::End(0))?;
        if segment.end == End::Unbroken {
            file.write_all(b"\n")?;
        }
        // A crash may have prevented the record that links to the next segment.
        if !is_last && !segment.is_closed() {
            file.write_all(closing(&segment.after, segment.number).0.as_bytes())?;
        }
        file.sync_data()?;
        if is_last {
            return Ok((file, segment.after.clone()));
        }
    }
    Err(io::Error::other("it has no segments"))
}

/// Copies the incomplete record at the end of a file, i.e. all bytes from `sound` on, to a new file
/// `NAME.cutN`.
fn keep_cut(name: &Path, sound: u64) -> io::Result<()> {
    let bytes = std::fs::read(name)?;
    let remaining = bytes.get(sound as usize..).unwrap_or_default();
    let mut number = 0;
    loop {
        let mut beside = name.as_os_str().to_owned();
        beside.push(format!(".cut{number}"));
        match open_private(Path::new(&beside), OpenOptions::new().create_new(true).write(true)) {
            // A file with this number may remain from an earlier crash.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => number += 1,
            other => return other.and_then(|mut file| file.write_all(remaining)),
        }
    }
}
