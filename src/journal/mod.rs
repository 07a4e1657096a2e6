//! Write-ahead journal: each observation of a loop, and each decision on it, is written before the answers of the
//! decision leave the program. [`Sync`] defines when the written data is flushed to the disk.
//!
//! A directory contains segments `journal-N` and snapshots `snapshot-N`. Each segment except segment 0 begins at the
//! snapshot with its number. The last two segments and snapshots are kept. Records are numbered and chained by hashes,
//! see `record`. Writing before acting follows \[1\]. Opening restores the loop from the newest sound snapshot that
//! only sound segments follow, or from the beginning. It then replays the later observations with the recorded plans.
//! The answers must equal the recorded ones, except for explanations; otherwise the journal is rejected.
//!
//! A crash may leave the last record incomplete. This record is cut off, kept in a separate file, and reported. A
//! complete record is never cut off. A missing line break or `end` record at the end of a segment is added. Any other
//! fault in a needed segment is an error, and a fault in a file that is not needed is a warning.
//!
//! A checkpoint creates the new segment first, then writes the `end` record of the old segment, then the snapshot. So a
//! missing segment is detected, and a crash during a checkpoint is not mistaken for a missing segment.
//!
//! Only one process at a time can open a journal for writing. It holds a lock on the file `lock`, which the operating
//! system releases when the process ends. The file also stores the number of records, by which missing records are
//! detected.
//!
//! If a write fails, the loop stops, and no further answer leaves the program. With [`Unrecorded::Continue`], the
//! segment is renamed instead, so that the journal cannot be resumed, and the loop continues without it.
//!
//! - \[1\] C. Mohan et al.: ARIES, a transaction recovery method, ACM TODS 17, 1992.

mod directory;
mod lock;
mod record;
mod recover;
mod recovery;
mod report;

use std::fs::File;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::{Value, json};

use crate::mapek::{Answer, Decision, Observation, Recoverable, Snapshot, Unrecorded};
use crate::message::Message;
pub use recovery::Recovery;

use directory::{INCOMPLETE, JournalFiles, Segment, broken, closing, name, path};
use lock::Lock;
use record::{Link, header};
use recover::{Replay, Unfinished, settle, usable};

pub use report::{Entry, JournalReport};

/// Policy for flushing the journal to the disk before answers leave the program. If the program is killed, no policy
/// loses data; if the machine loses power, data that was not flushed may be lost. The journal is also flushed when it
/// is opened and at each snapshot.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Sync {
    /// Flushes before any answers leave the program.
    Always,
    /// Flushes before answers that contain an effect leave the program.
    #[default]
    Effects,
    /// Does not flush before answers; the operating system decides when data reaches the disk.
    Never,
}

/// Settings for writing a journal.
#[derive(Debug, Clone, Copy)]
pub struct Policy {
    /// Policy for flushing writes to the disk.
    pub sync: Sync,
    /// Number of observations after which a snapshot is written and a new segment begins, as soon as no deliberation is
    /// pending.
    pub snapshot_every: u64,
}

impl Default for Policy {
    fn default() -> Self {
        Self { sync: Sync::default(), snapshot_every: 1000 }
    }
}

/// A journal that is open for writing, at its end.
#[derive(Debug)]
pub struct Journal {
    directory: PathBuf,
    policy: Policy,
    segment: u64,
    file: File,
    link: Link,
    lock: Lock,
    /// Number of observations in the current segment, i.e. since its snapshot.
    observations: u64,
    /// Work that the previous process began and did not finish, until [`Journal::begin`] or [`Journal::begin_reacting`]
    /// handles it.
    unfinished: Option<Unfinished>,
    digest: String,
    unrecorded: Unrecorded,
    /// `true` if a write failed and the loop continued without the journal. Nothing more is written then.
    is_incomplete: bool,
    notice: Option<String>,
}

impl Journal {
    /// Opens the journal in a directory and restores `control`, a loop that has not begun, to its
    /// state after the last recorded reaction or decision. Creates the directory and the journal if they do not
    /// exist. [`Journal::begin`] or [`Journal::begin_reacting`] has to be called next.
    ///
    /// # Errors
    /// The directory cannot be used, or another process uses it. The journal is damaged, belongs to another
    /// mission, or the mission leads to other decisions. An earlier write failed, and the loop continued
    /// without the journal.
    ///
    /// These errors leave segments and snapshots unchanged, unless they occur during a repair. What a crash
    /// leaves behind (an incomplete last record, missing last records) is not an error: it is repaired, or
    /// reported in [`Recovery`].
    pub fn open<C: Recoverable>(
        directory: &Path,
        policy: Policy,
        control: &mut C,
    ) -> Result<(Self, Recovery), Message> {
        let failed = |error: io::Error| broken(directory, &error.to_string());
        directory::make_directory(directory).map_err(failed)?;
        let lock = Lock::take(directory)?;
        let contents = JournalFiles::read(directory).map_err(failed)?;
        let (digest, unrecorded) = (control.digest(), control.unrecorded());
        let mut recovery = Recovery::default();
        let directory = directory.to_owned();
        let failed = |error: io::Error| broken(&directory, &error.to_string());
        let (segment, (file, link), observations, unfinished) = if contents.segments.is_empty()
            && contents.snapshots.is_empty()
        {
            // The lock file proves that the journal had records before.
            if lock.records > 0 {
                return Err(broken(&directory, &format!("{} is missing", name("journal", 0))));
            }
            let created = create_segment(&directory, &Link::first(), &digest, 0).map_err(failed)?;
            (0, created, 0, Some(Unfinished::Agenda))
        } else {
            let Resumed { from, segments, observations, unfinished, missing_snapshots } =
                resume(&directory, &contents, control, &mut recovery)?;
            let (file, link) = settle(&directory, &segments, &mut recovery).map_err(failed)?;
            for (number, line) in missing_snapshots {
                write_snapshot(&directory, number, &line).map_err(failed)?;
            }
            // A machine that lost power may have lost records that were not flushed.
            if lock.records > link.next {
                let text = format!(
                    "the last {} records of the journal are missing; send the events after this `seq` again",
                    lock.records - link.next
                );
                recovery.warnings.push(Message::warning("M323", text));
            }
            let segment = segments.last().map_or(from, |last| last.number);
            (segment, (file, link), observations, unfinished)
        };
        let journal = Self {
            directory,
            policy,
            segment,
            file,
            link,
            lock,
            observations,
            unfinished,
            digest,
            unrecorded,
            is_incomplete: false,
            notice: None,
        };
        Ok((journal, recovery))
    }

    /// Restores a loop that has not begun, as [`Journal::open`] does, but without changing files
    /// and without a lock.
    ///
    /// # Errors
    /// The journal cannot be read or resumed, for example because it is damaged or belongs to another mission.
    pub fn rehearse<C: Recoverable>(directory: &Path, control: &mut C) -> Result<Recovery, Message> {
        let contents =
            JournalFiles::read(directory).map_err(|error| broken(directory, &error.to_string()))?;
        let mut recovery = Recovery::default();
        resume(directory, &contents, control, &mut recovery)?;
        Ok(recovery)
    }

    /// Completes the work that the previous process left unfinished, or makes the first decision in a new journal. Both
    /// may require planning. Returns the answers to the unfinished work, then the effects that still await an
    /// acknowledgement: it is unknown whether the previous process has output them.
    ///
    /// # Errors
    /// The journal cannot be written; the answers must not leave the program.
    pub fn begin<C: Recoverable>(&mut self, control: &mut C) -> io::Result<Vec<C::Answer>> {
        let mut answers = Vec::new();
        if let Some(unfinished) = self.unfinished.take() {
            answers = match unfinished {
                Unfinished::Agenda => control.deliberate(),
                Unfinished::Observation(line, now) => {
                    self.observations += 1;
                    let observation = Observation::recorded(&line);
                    let mut answers = control.react(&observation, Duration::from_micros(now));
                    answers.extend(control.deliberate());
                    answers
                }
            };
            let decision = control.decision(&answers);
            self.write(|journal| journal.decide(&decision))?;
        }
        self.again(control, answers)
    }

    /// Starts the loop as [`Journal::begin`] does, but without planning: the loop only reacts to an
    /// unfinished observation, and its deliberation remains pending.
    ///
    /// # Errors
    /// The journal cannot be written; the answers must not leave the program.
    pub fn begin_reacting<C: Recoverable>(&mut self, control: &mut C) -> io::Result<Vec<C::Answer>> {
        let mut answers = Vec::new();
        if let Some(Unfinished::Observation(line, now)) = self.unfinished.take() {
            self.observations += 1;
            answers = control.react(&Observation::recorded(&line), Duration::from_micros(now));
            self.reacted(control, &mut answers)?;
        }
        self.again(control, answers)
    }

    /// Flushes the journal. Returns `answers`, followed by all earlier effects that still await an acknowledgement,
    /// which have to be output again. If a write has failed and the loop continues, a message about this comes first.
    fn again<C: Recoverable>(
        &mut self,
        control: &C,
        mut answers: Vec<C::Answer>,
    ) -> io::Result<Vec<C::Answer>> {
        self.write(|journal| {
            journal.file.sync_data()?;
            journal.lock.store_count(journal.link.next)
        })?;
        // Effects of the new answers must not be repeated.
        let fresh: Vec<u64> = answers.iter().filter_map(C::effect).collect();
        let again = control.repeat().into_iter();
        let is_fresh = |answer: &C::Answer| C::effect(answer).is_some_and(|effect| fresh.contains(&effect));
        answers.extend(again.filter(|answer| !is_fresh(answer)));
        self.give_notice::<C>(&mut answers);
        Ok(answers)
    }

    /// Writes an observation, passes it to the loop, and writes the decision. The returned answers may leave the
    /// program. A snapshot is written if one is due.
    ///
    /// # Errors
    /// The journal cannot be written; the answers must not leave the program.
    pub fn handle<C: Recoverable>(
        &mut self,
        control: &mut C,
        line: &str,
        now: Duration,
    ) -> io::Result<Vec<C::Answer>> {
        let mut answers = self.observe(control, line, now)?;
        answers.extend(control.deliberate());
        self.decided(control, &mut answers)?;
        Ok(answers)
    }

    /// Writes an observation, and passes it to the loop, which reacts without planning. The
    /// returned answers may leave the program only after [`Journal::reacted`], or together with the
    /// answers of the deliberation after [`Journal::decided`].
    ///
    /// # Errors
    /// The journal cannot be written; the answers must not leave the program.
    pub fn observe<C: Recoverable>(
        &mut self,
        control: &mut C,
        line: &str,
        now: Duration,
    ) -> io::Result<Vec<C::Answer>> {
        let micros = u64::try_from(now.as_micros()).unwrap_or(u64::MAX);
        self.write(|journal| journal.append("event", &[json!(micros), json!(line)]))?;
        self.observations += 1;
        let mut answers = control.react(&Observation::recorded(line), Duration::from_micros(micros));
        self.give_notice::<C>(&mut answers);
        Ok(answers)
    }

    /// Writes the answers that [`Journal::observe`] returned as a reaction. If a write fails and the loop continues
    /// without the journal, adds an answer about this.
    ///
    /// # Errors
    /// The journal cannot be written; the answers must not leave the program.
    pub fn reacted<C: Recoverable>(
        &mut self,
        control: &mut C,
        answers: &mut Vec<C::Answer>,
    ) -> io::Result<()> {
        let decision = control.decision(answers);
        self.write(|journal| {
            journal.append("reaction", &[json!(decision.answers)])?;
            journal.keep::<C>(answers)
        })?;
        self.give_notice::<C>(answers);
        Ok(())
    }

    /// Writes `answers` as a decision: the answers of a deliberation, preceded by those of [`Journal::observe`] if they
    /// were not written. Writes a snapshot if one is due. If a write fails and the loop continues without the journal,
    /// adds an answer about this.
    ///
    /// # Errors
    /// The journal cannot be written; the answers must not leave the program.
    pub fn decided<C: Recoverable>(
        &mut self,
        control: &mut C,
        answers: &mut Vec<C::Answer>,
    ) -> io::Result<()> {
        let decision = control.decision(answers);
        self.write(|journal| {
            journal.decide(&decision)?;
            journal.keep::<C>(answers)?;
            // Snapshots are written only between deliberations.
            if journal.observations >= journal.policy.snapshot_every && !control.has_agenda() {
                journal.checkpoint(control)?;
            }
            Ok(())
        })?;
        self.give_notice::<C>(answers);
        Ok(())
    }

    /// Performs a write, or nothing if the journal is already incomplete. If the write fails and
    /// the loop may continue, marks the journal as incomplete and returns `Ok`.
    fn write(&mut self, write: impl FnOnce(&mut Self) -> io::Result<()>) -> io::Result<()> {
        if self.is_incomplete {
            return Ok(());
        }
        let Err(error) = write(self) else { return Ok(()) };
        if self.unrecorded == Unrecorded::Stop {
            return Err(error);
        }
        // Without the mark, a resumed loop would use the numbers of effects twice.
        self.mark_incomplete().map_err(|fault| {
            let text = format!("{error}; and it cannot be marked as incomplete: {fault}");
            io::Error::new(error.kind(), text)
        })?;
        self.is_incomplete = true;
        self.notice = Some(format!(
            "the journal cannot be written: {error}; the run continues without it, and the journal cannot be resumed"
        ));
        Ok(())
    }

    fn mark_incomplete(&self) -> io::Result<()> {
        let from = path(&self.directory, "journal", self.segment);
        std::fs::rename(from, path(&self.directory, INCOMPLETE, self.segment))?;
        sync_directory(&self.directory)
    }

    fn give_notice<C: Recoverable>(&mut self, answers: &mut Vec<C::Answer>) {
        if let Some(message) = self.notice.take() {
            answers.insert(0, Answer::Unrecorded { message }.into());
        }
    }

    /// Flushes the file as far as the policy requires before these answers leave the program, and stores the number of
    /// records in the lock file.
    fn keep<C: Recoverable>(&mut self, answers: &[C::Answer]) -> io::Result<()> {
        // `Effects` is sufficient, because only effects change the world.
        let must = match self.policy.sync {
            Sync::Always => true,
            Sync::Effects => answers.iter().any(|answer| C::effect(answer).is_some()),
            Sync::Never => false,
        };
        if must {
            self.file.sync_data()?;
        }
        self.lock.store_count(self.link.next)
    }

    fn decide(&mut self, decision: &Decision) -> io::Result<()> {
        self.append("decision", &[json!(decision.answers), json!(decision.plans)])
    }

    fn append(&mut self, kind: &str, fields: &[Value]) -> io::Result<()> {
        let (line, link) = self.link.line(kind, fields);
        self.file.write_all(line.as_bytes())?;
        self.link = link;
        Ok(())
    }

    /// Creates the next segment, writes the `end` record of the current one, and writes a snapshot, in this order.
    /// Removes segments and snapshots with smaller numbers than the segment that ends here.
    fn checkpoint<C: Recoverable>(&mut self, control: &mut C) -> io::Result<()> {
        let next = self.segment + 1;
        let (end, at) = closing(&self.link, self.segment);
        // A power loss must not leave the next segment without the records that precede it.
        self.file.sync_data()?;
        let (file, link) = create_segment(&self.directory, &at, &self.digest, next)?;
        self.file.write_all(end.as_bytes())?;
        self.file.sync_data()?;
        (self.file, self.link, self.segment, self.observations) = (file, link, next, 0);
        self.lock.store_count(self.link.next)?;
        let line = record::snapshot(&at, &self.digest, next, &control.checkpoint().0);
        write_snapshot(&self.directory, next, &line)?;
        for entry in std::fs::read_dir(&self.directory)? {
            let name = entry?.file_name();
            let part = name.to_str().and_then(|name| name.split_once('-'));
            let is_old = part.is_some_and(|(kind, number)| {
                ["journal", "snapshot"].contains(&kind) && number.parse().is_ok_and(|n: u64| n < next - 1)
            });
            if is_old {
                // A failure is harmless, because no later segment depends on the file.
                let _ = std::fs::remove_file(self.directory.join(&name));
            }
        }
        Ok(())
    }
}

struct Resumed<'c> {
    /// Number of the snapshot from which the loop was restored, or 0 without a snapshot.
    from: u64,
    segments: Vec<&'c Segment>,
    observations: u64,
    unfinished: Option<Unfinished>,
    missing_snapshots: Vec<(u64, String)>,
}

/// Restores a loop from the newest usable snapshot, or from the beginning without one, and replays the later
/// observations. Changes no files.
fn resume<'c, C: Recoverable>(
    directory: &Path,
    contents: &'c JournalFiles,
    control: &mut C,
    recovery: &mut Recovery,
) -> Result<Resumed<'c>, Message> {
    contents.require_complete(directory)?;
    let digest = control.digest();
    let (from, segments) =
        usable(contents, &mut recovery.warnings).map_err(|text| broken(directory, &text))?;
    // Other files or settings would lead to other decisions during the replay.
    if segments.iter().any(|segment| segment.digest != digest) {
        let text = "it belongs to another mission, or the mission's files or settings have changed";
        return Err(broken(directory, text));
    }
    if from > 0 {
        let snapshot = contents.start(from).map_err(|text| broken(directory, &text))?;
        control.restore(&Snapshot(snapshot.data.clone()))?;
    }
    recovery.replayed = Some(0);
    let mut replay = Replay { directory, control, recovery, observations: 0, unfinished: None };
    let mut missing_snapshots = Vec::new();
    for segment in &segments {
        if segment.number > from {
            let snapshot = replay.control.checkpoint();
            // A crash between the creation of a segment and its snapshot leaves the snapshot missing.
            if contents.start(segment.number).is_err() {
                let line = record::snapshot(&segment.before, &digest, segment.number, &snapshot.0);
                missing_snapshots.push((segment.number, line));
            }
        }
        replay.segment(segment)?;
    }
    let Replay { observations, unfinished, .. } = replay;
    Ok(Resumed { from, segments, observations, unfinished, missing_snapshots })
}

/// Atomically creates a segment file that contains only its header. Returns the file and the link (position in the
/// chain of records) after the header.
fn create_segment(directory: &Path, after: &Link, digest: &str, number: u64) -> io::Result<(File, Link)> {
    let (line, link) = header(after, digest, number);
    let mut file = tempfile::NamedTempFile::new_in(directory)?;
    file.write_all(line.as_bytes())?;
    file.as_file().sync_all()?;
    let file = file.persist(path(directory, "journal", number)).map_err(|error| error.error)?;
    sync_directory(directory)?;
    Ok((file, link))
}

/// Writes a snapshot atomically. An existing file of this name is unusable, and is kept as `snapshot-N.damaged`.
fn write_snapshot(directory: &Path, number: u64, line: &str) -> io::Result<()> {
    let name = path(directory, "snapshot", number);
    let mut file = tempfile::NamedTempFile::new_in(directory)?;
    file.write_all(line.as_bytes())?;
    file.as_file().sync_all()?;
    // A damaged snapshot may help to find the cause of the damage.
    if name.exists() {
        let mut beside = name.clone().into_os_string();
        beside.push(".damaged");
        std::fs::rename(&name, beside)?;
    }
    file.persist(name).map_err(|error| error.error)?;
    sync_directory(directory)
}

#[cfg(unix)]
fn sync_directory(directory: &Path) -> io::Result<()> {
    File::open(directory)?.sync_all()
}

/// Does nothing: where directories cannot be opened, the durability of files depends on the system.
#[cfg(not(unix))]
fn sync_directory(_: &Path) -> io::Result<()> {
    Ok(())
}
