//! Writes a recording on a separate thread, so that the loop waits for the disk only while the queue is full.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::recording::write::{Form, Recording};

/// Maximum time between a message and its flush to the file.
pub const INTERVAL: Duration = Duration::from_secs(1);

/// Capacity of the queue between loop and writer thread, in entries. Senders block while the queue
/// is full.
const QUEUE_CAPACITY: usize = 1024;

/// A recording that a separate thread writes. Clones share the file.
#[derive(Debug, Clone)]
pub struct Recorder {
    entries: SyncSender<Entry>,
    thread: Arc<Mutex<Option<JoinHandle<io::Result<()>>>>>,
    /// Start of the recording as nanoseconds of the system's clock, and as a moment of the
    /// monotonic clock.
    begun: (u64, Instant),
}

#[derive(Debug)]
enum Entry {
    Event { time: u64, line: u64, now: Duration, text: String },
    Answer { time: u64, text: String },
    End,
}

impl Recorder {
    /// Creates the file of a recording. The file must not exist, so that no recording is
    /// overwritten.
    ///
    /// # Errors
    /// The file exists, or cannot be written.
    pub fn create(path: &Path, mission: &str, form: Form) -> io::Result<Self> {
        let file = OpenOptions::new().write(true).create_new(true).open(path)?;
        let recording = Recording::begin(file, mission, form)?;
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let begun = (u64::try_from(since.as_nanos()).unwrap_or(u64::MAX), Instant::now());
        let (entries, received) = sync_channel(QUEUE_CAPACITY);
        let thread = std::thread::spawn(move || write(recording, &received));
        Ok(Self { entries, thread: Arc::new(Mutex::new(Some(thread))), begun })
    }

    /// Records an input line before the loop handles it. `line` is the number of the line, `now` the time since the
    /// start of the mission. Blocks while the queue to the writer thread is full.
    pub fn event(&self, line: u64, now: Duration, text: &str) {
        self.send(Entry::Event { time: self.time(), line, now, text: text.to_owned() });
    }

    /// Records an answer of the loop, given as the text of a JSON object. Blocks while the queue to the writer thread
    /// is full.
    pub fn answer(&self, text: &str) {
        self.send(Entry::Answer { time: self.time(), text: text.to_owned() });
    }

    /// Returns `true` if the writer thread has ended early, usually after an error. [`Recorder::finish`] returns the
    /// error.
    pub fn has_failed(&self) -> bool {
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner);
        thread.as_ref().is_some_and(JoinHandle::is_finished)
    }

    /// Ends the file with its index. Messages that are sent later are not recorded.
    ///
    /// # Errors
    /// Writing has failed, now or before.
    pub fn finish(&self) -> io::Result<()> {
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        self.send(Entry::End);
        match thread.map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(written)) => written,
            Some(Err(_)) => Err(io::Error::other("the thread that writes it has ended")),
        }
    }

    /// Sends an entry to the writer thread. If this thread has ended, e.g. after an error, the entry is lost.
    fn send(&self, entry: Entry) {
        let _ = self.entries.send(entry);
    }

    fn time(&self) -> u64 {
        let (time, moment) = self.begun;
        time.saturating_add(u64::try_from(moment.elapsed().as_nanos()).unwrap_or(u64::MAX))
    }
}

/// Writes entries to the recording until it ends. Flushes at most [`INTERVAL`] after an entry.
fn write(mut recording: Recording<File>, entries: &Receiver<Entry>) -> io::Result<()> {
    // Time at which the entries that are not flushed have to be flushed.
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
