//! A recording in a thread of its own: who says something does not wait for the disk.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::recording::write::{Form, Recording};

/// So long a message waits at most before it is in the file.
pub const INTERVAL: Duration = Duration::from_secs(1);

/// So many messages may wait for the disk; who has more to say waits, too.
const WAITING: usize = 1024;

/// A recording that is written by a thread of its own; copies write to the same file.
#[derive(Debug, Clone)]
pub struct Recorder {
    entries: SyncSender<Entry>,
    thread: Arc<Mutex<Option<JoinHandle<io::Result<()>>>>>,
    /// The time of the system's clock, in nanoseconds, at a moment.
    begun: (u64, Instant),
}

#[derive(Debug)]
enum Entry {
    Event { time: u64, line: u64, now: Duration, text: String },
    Answer { time: u64, text: String },
    End,
}

impl Recorder {
    /// Begins a file, which must not be there yet: nothing that was recorded is overwritten.
    ///
    /// # Errors
    /// It is there, or cannot be written.
    pub fn create(path: &Path, mission: &str, form: Form) -> io::Result<Self> {
        let file = OpenOptions::new().write(true).create_new(true).open(path)?;
        let recording = Recording::begin(file, mission, form)?;
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let begun = (u64::try_from(since.as_nanos()).unwrap_or(u64::MAX), Instant::now());
        let (entries, received) = sync_channel(WAITING);
        let thread = std::thread::spawn(move || write(recording, &received));
        Ok(Self { entries, thread: Arc::new(Mutex::new(Some(thread))), begun })
    }

    /// Takes a line that the loop is about to handle, with its number and the time since the start of the mission.
    pub fn event(&self, line: u64, now: Duration, text: &str) {
        self.send(Entry::Event { time: self.time(), line, now, text: text.to_owned() });
    }

    /// Takes an answer, which is an object of the format as JSON.
    pub fn answer(&self, text: &str) {
        self.send(Entry::Answer { time: self.time(), text: text.to_owned() });
    }

    /// Whether something could not be written, so that nothing is recorded any more; [`Recorder::finish`] says why.
    pub fn has_failed(&self) -> bool {
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner);
        thread.as_ref().is_some_and(JoinHandle::is_finished)
    }

    /// Ends the file with its index. What is said afterwards is not recorded.
    ///
    /// # Errors
    /// Something could not be written, now or before.
    pub fn finish(&self) -> io::Result<()> {
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        self.send(Entry::End);
        match thread.map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(written)) => written,
            Some(Err(_)) => Err(io::Error::other("the thread that writes it has ended")),
        }
    }

    /// Nobody receives any more after an error, which [`Recorder::finish`] tells.
    fn send(&self, entry: Entry) {
        let _ = self.entries.send(entry);
    }

    fn time(&self) -> u64 {
        let (time, moment) = self.begun;
        time.saturating_add(u64::try_from(moment.elapsed().as_nanos()).unwrap_or(u64::MAX))
    }
}

/// Writes what comes until the end is said, or until nobody can say any more.
fn write(mut recording: Recording<File>, entries: &Receiver<Entry>) -> io::Result<()> {
    // When what was written last has to be in the file.
    let mut due: Option<Instant> = None;
    loop {
        let entry = match due {
            None => entries.recv().map_err(|_| RecvTimeoutError::Disconnected),
            Some(due) => entries.recv_timeout(due.saturating_duration_since(Instant::now())),
        };
        match entry {
            Ok(Entry::Event { time, line, now, text }) => recording.event(time, line, now, &text)?,
            Ok(Entry::Answer { time, text }) => recording.answer(time, &text)?,
            Ok(Entry::End) | Err(RecvTimeoutError::Disconnected) => return recording.finish(),
            Err(RecvTimeoutError::Timeout) => {}
        }
        let now = Instant::now();
        if now >= *due.get_or_insert(now + INTERVAL) {
            recording.flush()?;
            due = None;
        }
    }
}
