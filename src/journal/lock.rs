//! Lock file of a journal: only one process at a time can have the journal open for writing. The file also stores the
//! number of records, by which missing records are detected.

use std::fs::{File, OpenOptions};
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::Path;
use std::time::Duration;

use fs4::{FileExt, TryLockError};

use super::directory::{broken, open_private};
use crate::message::Message;

/// Number of further attempts to lock after a failed one; a killed process may still hold the lock for a short time.
const LOCK_RETRIES: u32 = 10;
const RETRY_INTERVAL: Duration = Duration::from_millis(20);
const OWNER_CHARACTERS: usize = 10;
const COUNT_CHARACTERS: usize = 20;

#[derive(Debug)]
pub(super) struct Lock {
    file: File,
    /// Number of records of the journal that the file stated when it was locked; 0 if unknown.
    pub(super) records: u64,
}

impl Lock {
    /// Locks the journal, and stores the ID of this process in the lock file for the messages of other processes.
    /// Returns M322 if another process holds the lock.
    pub(super) fn take(directory: &Path) -> Result<Self, Message> {
        let name = directory.join("lock");
        let failed = |error: &io::Error| broken(&name, &error.to_string());
        let mut options = OpenOptions::new();
        let file = open_private(&name, options.create(true).truncate(false).read(true).write(true));
        let mut file = file.map_err(|error| failed(&error))?;
        let mut answer = FileExt::try_lock(&file);
        for _ in 0..LOCK_RETRIES {
            if !matches!(answer, Err(TryLockError::WouldBlock)) {
                break;
            }
            std::thread::sleep(RETRY_INTERVAL);
            answer = FileExt::try_lock(&file);
        }
        let mut note = String::new();
        // If the file cannot be read, the owner and the number of records are unknown.
        let _ = (&mut file).take(64).read_to_string(&mut note);
        let mut lines = note.lines().map(str::trim);
        let (owner, records) = (lines.next().unwrap_or_default(), lines.next().unwrap_or_default());
        match answer {
            Ok(()) => {
                let mut lock = Self { file, records: records.parse().unwrap_or(0) };
                lock.store_count(lock.records).map_err(|error| failed(&error))?;
                Ok(lock)
            }
            Err(TryLockError::WouldBlock) => {
                let owner =
                    owner.parse::<u32>().map_or_else(|_| String::new(), |id| format!(" (number {id})"));
                let text = format!(
                    "another process{owner} uses the journal in {}; stop that process, or use another directory",
                    directory.display()
                );
                Err(Message::error("M322", text))
            }
            Err(TryLockError::Error(error)) => Err(failed(&error)),
        }
    }

    pub(super) fn store_count(&mut self, records: u64) -> io::Result<()> {
        let owner = std::process::id();
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(format!("{owner:>OWNER_CHARACTERS$}\n{records:>COUNT_CHARACTERS$}\n").as_bytes())
    }
}
