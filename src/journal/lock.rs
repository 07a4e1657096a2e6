//! One process at a time has a journal; and how many records it had, so that missing ones are noticed.

use std::fs::{File, OpenOptions};
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::Path;
use std::time::Duration;

use fs4::{FileExt, TryLockError};

use super::directory::{broken, open_private};
use crate::message::Message;

/// So often a lock is tried again: a process that was killed may not be gone yet.
const PATIENCE: u32 = 10;
/// The time from one try to the next.
const PAUSE: Duration = Duration::from_millis(20);
/// Characters of the number of the process, which stands in the first line of the file.
const OWNER: usize = 10;
/// Characters of the number of records, which stands in the second.
const COUNT: usize = 20;

/// A journal that no other process has, for as long as this is kept.
#[derive(Debug)]
pub(super) struct Lock {
    file: File,
    /// How many records the journal had when it was last written to, if that is known.
    pub(super) records: u64,
}

impl Lock {
    /// Takes a journal for this process, and leaves its number there for the message that others get.
    ///
    /// # Errors
    /// M322 where another process has it.
    pub(super) fn take(directory: &Path) -> Result<Self, Message> {
        let name = directory.join("lock");
        let failed = |error: &io::Error| broken(&name, &error.to_string());
        let mut options = OpenOptions::new();
        let file = open_private(&name, options.create(true).truncate(false).read(true).write(true));
        let mut file = file.map_err(|error| failed(&error))?;
        let mut answer = FileExt::try_lock(&file);
        for _ in 0..PATIENCE {
            if !matches!(answer, Err(TryLockError::WouldBlock)) {
                break;
            }
            std::thread::sleep(PAUSE);
            answer = FileExt::try_lock(&file);
        }
        let mut note = String::new();
        // Where a locked file cannot be read the message does without.
        let _ = (&mut file).take(64).read_to_string(&mut note);
        let mut lines = note.lines().map(str::trim);
        let (owner, records) = (lines.next().unwrap_or_default(), lines.next().unwrap_or_default());
        match answer {
            Ok(()) => {
                let mut lock = Self { file, records: records.parse().unwrap_or(0) };
                lock.note(lock.records).map_err(|error| failed(&error))?;
                Ok(lock)
            }
            Err(TryLockError::WouldBlock) => {
                let owner =
                    owner.parse::<u32>().map_or_else(|_| String::new(), |id| format!(" (number {id})"));
                let text = format!(
                    "another process{owner} uses the journal in {}; end it first, or take another directory",
                    directory.display()
                );
                Err(Message::error("M322", text))
            }
            Err(TryLockError::Error(error)) => Err(failed(&error)),
        }
    }

    /// Notes how many records there are.
    pub(super) fn note(&mut self, records: u64) -> io::Result<()> {
        let owner = std::process::id();
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(format!("{owner:>OWNER$}\n{records:>COUNT$}\n").as_bytes())
    }
}
