//! The journal: every observation and every decision of a loop on disk before anything is done about it.
//!
//! A directory holds a segment `journal-N` and, but for the first, the snapshot `snapshot-N` that it begins from. A line is a
//! checksum (CRC-32, eight hexadecimal digits), a space, and a JSON array. An observation is written before it is handled,
//! and the decision before any of its answers leaves the program \[1\]. On opening, the loop is brought back by the
//! snapshot and by handling the observations of the segment again, with the plans as they were made then; what it
//! answers must be what is written, or else the journal is refused.
//!
//! A crash may leave the last line incomplete. It is cut off and reported. A damaged line with sound ones behind it is
//! no trace of a crash, and the journal is refused.
//!
//! One process at a time has the journal: it holds a lock on the file `lock`, which the operating system releases when the
//! process ends, however it ends.
//!
//! - \[1\] C. Mohan et al.: ARIES, a transaction recovery method, ACM TODS 17, 1992.

use std::fs::{File, OpenOptions};
use std::io::{self, Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use fs4::{FileExt, TryLockError};
use serde_json::{Value, json};

use crate::mapek::{Answer, Decision, Loop, Observation, Snapshot};
use crate::message::Message;

const FORMAT: &str = "metaplan-journal/1";

/// When the operating system is made to write to the disk itself. A program that is killed loses nothing either way;
/// a machine that loses power may lose what was not yet written.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Sync {
    /// After every observation, before its answers leave the program.
    Always,
    /// Before effects leave the program.
    #[default]
    Effects,
    /// When the operating system sees fit.
    Never,
}

/// How a journal is kept.
#[derive(Debug, Clone, Copy)]
pub struct Policy {
    /// When the disk is written to.
    pub sync: Sync,
    /// After so many observations a snapshot is made, and a new segment begun.
    pub snapshot_every: u64,
}

impl Default for Policy {
    fn default() -> Self {
        Self { sync: Sync::default(), snapshot_every: 1000 }
    }
}

/// What opening a journal has come to.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Recovery {
    /// How many observations were handled again; none for a new journal.
    pub replayed: Option<u64>,
    /// How many bytes of an incomplete line were cut off.
    pub cut: u64,
    /// Answers that have not left the program, or may not have: those to an observation without a decision, then
    /// effects that were not acknowledged.
    pub answers: Vec<Answer>,
}

/// An open journal.
#[derive(Debug)]
pub struct Journal {
    directory: PathBuf,
    policy: Policy,
    segment: u64,
    file: File,
    /// Locked for as long as it is open.
    _lock: File,
    /// Observations since the snapshot.
    observations: u64,
}

impl Journal {
    /// Opens the journal in a directory, which is made if there is none, for a loop that has not begun. The loop is
    /// then as it was when the journal was last written, or has just begun.
    ///
    /// # Errors
    /// The directory cannot be used, or another process uses it; or the journal is damaged or belongs to another
    /// mission.
    pub fn open(directory: &Path, policy: Policy, control: &mut Loop) -> Result<(Self, Recovery), Message> {
        let failed = |error: &io::Error| broken(directory, &error.to_string());
        std::fs::create_dir_all(directory).map_err(|error| failed(&error))?;
        let lock = lock(directory)?;
        let digest = control.digest();
        let segment = latest_snapshot(directory).map_err(|error| failed(&error))?;
        let mut recovery = Recovery::default();
        if segment > 0 {
            let (records, _) = read(&path(directory, "snapshot", segment))?;
            let [snapshot] = records.as_slice() else {
                return Err(broken(&path(directory, "snapshot", segment), "it has not one line"));
            };
            check_mission(directory, snapshot, &digest)?;
            control.restore(&Snapshot(snapshot.get(3).cloned().unwrap_or_default()))?;
            recovery.replayed = Some(0);
        }
        let name = path(directory, "journal", segment);
        let (records, cut) = if name.exists() { read(&name)? } else { (Vec::new(), Cut::default()) };
        recovery.cut = cut.bytes;
        let file =
            OpenOptions::new().create(true).append(true).open(&name).map_err(|error| failed(&error))?;
        file.set_len(cut.keep).map_err(|error| failed(&error))?;
        let directory = directory.to_owned();
        let mut journal = Self { directory, policy, segment, file, _lock: lock, observations: 0 };
        journal.replay(&records, &digest, control, &mut recovery)?;
        journal.file.sync_data().map_err(|error| broken(&journal.directory, &error.to_string()))?;
        Ok((journal, recovery))
    }

    /// Brings a loop to where the records end, and completes them.
    fn replay(
        &mut self,
        records: &[Value],
        digest: &str,
        control: &mut Loop,
        recovery: &mut Recovery,
    ) -> Result<(), Message> {
        let directory = self.directory.clone();
        let failed = |error: io::Error| broken(&directory, &error.to_string());
        let mut records = records.iter().peekable();
        match records.next() {
            Some(header) => {
                check_mission(&self.directory, header, digest)?;
                recovery.replayed = Some(0);
            }
            None => self.append(&json!(["mission", FORMAT, digest])).map_err(failed)?,
        }
        // What a loop does first stands in the first segment only.
        if self.segment == 0 {
            let plans = next_decision(&mut records);
            let answers = control.start_again(plans.as_ref().map_or(&[][..], |decision| &decision.plans));
            self.settle(plans, control, answers, recovery)?;
        }
        let mut is_complete = recovery.answers.is_empty();
        while let Some(record) = records.next() {
            let (Some("event"), Some(now), Some(line)) = (
                record.get(0).and_then(Value::as_str),
                record.get(1).and_then(Value::as_u64),
                record.get(2).and_then(Value::as_str),
            ) else {
                return Err(broken(&self.directory, "a record is not where it belongs"));
            };
            if !is_complete {
                return Err(broken(&self.directory, "an observation follows one without a decision"));
            }
            let decision = next_decision(&mut records);
            is_complete = decision.is_some();
            let plans = decision.as_ref().map_or(&[][..], |decision| &decision.plans);
            let answers = control.handle_again(&Observation::parse(line), Duration::from_micros(now), plans);
            self.settle(decision, control, answers, recovery)?;
            self.observations += 1;
            recovery.replayed = recovery.replayed.map(|count| count + 1);
        }
        let fresh = recovery.answers.iter().filter_map(Answer::effect).map(|effect| effect.number);
        let fresh: Vec<u64> = fresh.collect();
        let again = control.repeat().into_iter();
        let is_fresh = |answer: &Answer| answer.effect().is_some_and(|effect| fresh.contains(&effect.number));
        recovery.answers.extend(again.filter(|answer| !is_fresh(answer)));
        Ok(())
    }

    /// Compares answers with those that were written, or writes them.
    fn settle(
        &mut self,
        written: Option<Decision>,
        control: &mut Loop,
        answers: Vec<Answer>,
        recovery: &mut Recovery,
    ) -> Result<(), Message> {
        let made = control.decision(&answers);
        match written {
            Some(written) if written.answers == made.answers => Ok(()),
            Some(_) => {
                let text = "the mission now leads to other decisions than those that were written";
                Err(broken(&self.directory, text))
            }
            None => {
                recovery.answers = answers;
                self.decide(&made).map_err(|error| broken(&self.directory, &error.to_string()))
            }
        }
    }

    /// Writes an observation, lets the loop handle it, and writes what it has decided; the answers may leave the program
    /// then.
    ///
    /// # Errors
    /// The journal cannot be written; the answers must not leave the program.
    pub fn handle(&mut self, control: &mut Loop, line: &str, now: Duration) -> io::Result<Vec<Answer>> {
        let micros = u64::try_from(now.as_micros()).unwrap_or(u64::MAX);
        self.append(&json!(["event", micros, line]))?;
        let answers = control.handle(&Observation::parse(line), Duration::from_micros(micros));
        let decision = control.decision(&answers);
        self.decide(&decision)?;
        let must = match self.policy.sync {
            Sync::Always => true,
            Sync::Effects => answers.iter().any(|answer| answer.effect().is_some()),
            Sync::Never => false,
        };
        if must {
            self.file.sync_data()?;
        }
        self.observations += 1;
        if self.observations >= self.policy.snapshot_every {
            self.checkpoint(control)?;
        }
        Ok(answers)
    }

    fn decide(&mut self, decision: &Decision) -> io::Result<()> {
        self.append(&json!(["decision", decision.answers, decision.plans]))
    }

    fn append(&mut self, record: &Value) -> io::Result<()> {
        self.file.write_all(line(record).as_bytes())
    }

    /// Writes a snapshot and begins a new segment; the segment before the last is removed.
    fn checkpoint(&mut self, control: &Loop) -> io::Result<()> {
        let next = self.segment + 1;
        let digest = control.digest();
        let snapshot = line(&json!(["mission", FORMAT, digest, control.snapshot().0]));
        let mut file = tempfile::NamedTempFile::new_in(&self.directory)?;
        file.write_all(snapshot.as_bytes())?;
        file.as_file().sync_all()?;
        // All that the snapshot replaces is on the disk before it.
        self.file.sync_data()?;
        file.persist(path(&self.directory, "snapshot", next)).map_err(|error| error.error)?;
        self.file =
            OpenOptions::new().create(true).append(true).open(path(&self.directory, "journal", next))?;
        self.file.set_len(0)?;
        self.segment = next;
        self.observations = 0;
        self.append(&json!(["mission", FORMAT, digest]))?;
        File::open(&self.directory)?.sync_all()?;
        for kind in ["snapshot", "journal"] {
            if let Some(old) = next.checked_sub(2) {
                // It may not be there; nothing rests on it.
                let _ = std::fs::remove_file(path(&self.directory, kind, old));
            }
        }
        Ok(())
    }
}

/// So often a lock is tried again: a process that was killed may not be gone yet.
const PATIENCE: u32 = 10;
/// The time from one try to the next.
const PAUSE: Duration = Duration::from_millis(20);

/// Takes the journal for this process, and leaves its number there for the message that others get.
fn lock(directory: &Path) -> Result<File, Message> {
    let name = directory.join("lock");
    let failed = |error: &io::Error| broken(&name, &error.to_string());
    let mut options = OpenOptions::new();
    let file = options.create(true).truncate(false).read(true).write(true).open(&name);
    let mut file = file.map_err(|error| failed(&error))?;
    let mut answer = FileExt::try_lock(&file);
    for _ in 0..PATIENCE {
        if !matches!(answer, Err(TryLockError::WouldBlock)) {
            break;
        }
        std::thread::sleep(PAUSE);
        answer = FileExt::try_lock(&file);
    }
    match answer {
        Ok(()) => {
            let note = file.set_len(0).and_then(|()| file.rewind());
            note.and_then(|()| write!(file, "{}", std::process::id())).map_err(|error| failed(&error))?;
            Ok(file)
        }
        Err(TryLockError::WouldBlock) => {
            let mut owner = String::new();
            // Where a locked file cannot be read the message does without.
            let _ = file.read_to_string(&mut owner);
            let owner = owner.parse::<u32>().map_or_else(|_| String::new(), |id| format!(" (number {id})"));
            let text = format!(
                "another process{owner} uses the journal in {}; end it first, or take another directory",
                directory.display()
            );
            Err(Message::error("M322", text))
        }
        Err(TryLockError::Error(error)) => Err(failed(&error)),
    }
}

fn path(directory: &Path, kind: &str, segment: u64) -> PathBuf {
    directory.join(format!("{kind}-{segment:06}"))
}

fn line(record: &Value) -> String {
    let text = record.to_string();
    format!("{:08x} {text}\n", crc32fast::hash(text.as_bytes()))
}

fn broken(place: &Path, text: &str) -> Message {
    Message::at("M321", &place.display().to_string(), None, format!("the journal cannot be used: {text}"))
}

fn check_mission(directory: &Path, header: &Value, digest: &str) -> Result<(), Message> {
    let part = |index: usize| header.get(index).and_then(Value::as_str).unwrap_or_default();
    if part(1) != FORMAT {
        return Err(broken(directory, &format!("its format is `{}`, not `{FORMAT}`", part(1))));
    }
    if part(2) != digest {
        return Err(broken(directory, "it belongs to another mission, or the mission's files have changed"));
    }
    Ok(())
}

/// The number of the last snapshot, 0 without any. Snapshots are whole or not there.
fn latest_snapshot(directory: &Path) -> io::Result<u64> {
    let mut latest = 0;
    for entry in std::fs::read_dir(directory)? {
        let name = entry?.file_name();
        let number =
            name.to_str().and_then(|name| name.strip_prefix("snapshot-")).and_then(|n| n.parse().ok());
        latest = latest.max(number.unwrap_or(0));
    }
    Ok(latest)
}

/// Takes the next record if it is a decision.
fn next_decision<'a>(records: &mut std::iter::Peekable<impl Iterator<Item = &'a Value>>) -> Option<Decision> {
    let is_decision = |record: &&Value| record.get(0).and_then(Value::as_str) == Some("decision");
    let record = records.next_if(is_decision)?;
    let list = |index: usize| record.get(index).and_then(Value::as_array).cloned().unwrap_or_default();
    Some(Decision { answers: list(1), plans: list(2) })
}

/// What a crash has left at the end of a file.
#[derive(Debug, Default)]
struct Cut {
    /// So many bytes are sound.
    keep: u64,
    /// So many are not.
    bytes: u64,
}

/// The sound records of a file.
fn read(file: &Path) -> Result<(Vec<Value>, Cut), Message> {
    let bytes = std::fs::read(file).map_err(|error| broken(file, &error.to_string()))?;
    let mut records = Vec::new();
    let mut keep = 0;
    let mut damaged = None;
    for (number, text) in bytes.split_inclusive(|&byte| byte == b'\n').enumerate() {
        match record(text) {
            Some(_) if damaged.is_some() => {
                let text = format!("line {} is damaged, and sound lines follow", damaged.unwrap_or(0) + 1);
                return Err(broken(file, &text));
            }
            Some(record) => {
                records.push(record);
                keep += text.len() as u64;
            }
            None => damaged = damaged.or(Some(number)),
        }
    }
    Ok((records, Cut { keep, bytes: bytes.len() as u64 - keep }))
}

fn record(line: &[u8]) -> Option<Value> {
    let text = std::str::from_utf8(line).ok()?.strip_suffix('\n')?;
    let (checksum, text) = text.split_at_checked(8)?;
    let text = text.strip_prefix(' ')?;
    let expected = u32::from_str_radix(checksum, 16).ok()?;
    (crc32fast::hash(text.as_bytes()) == expected).then(|| serde_json::from_str(text).ok()).flatten()
}
