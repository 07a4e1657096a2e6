//! Distributes the lines of a run to clients. Retains the last lines, and for each key (part of the loop's state, such
//! as `function f`) the line that defines its current state.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::live::keep::{design_key, keys};
use crate::mapek::DesignChange;

/// Maximum number of lines in the queue from the loop to the thread of [`listen`]. Further lines are dropped and
/// counted.
const MAX_QUEUED_LINES: usize = 4096;
const MAX_QUEUED_BYTES: usize = 16 << 20;

const MAX_LINES: usize = 2000;

/// Maximum total size of the retained lines in bytes. A single line may be longer.
const MAX_RETAINED_BYTES: usize = 4 << 20;

/// Maximum number of keys whose latest line is retained. Above it, the keys that changed longest ago are dropped.
const MAX_KEYS: usize = 10_000;

const MAX_BATCH: usize = 100;

#[derive(Debug, Default)]
pub(super) struct Hub {
    retained: Mutex<RetainedLines>,
    more: Condvar,
}

#[derive(Debug, Default)]
struct RetainedLines {
    lines: VecDeque<Arc<str>>,
    bytes: usize,
    first: u64,
    /// For each key, the latest line about it, and the number of this line.
    words: BTreeMap<String, (u64, Arc<str>)>,
    ended: bool,
}

#[derive(Debug, PartialEq, Eq)]
pub(super) enum News {
    Lines(Vec<Arc<str>>),
    Nothing,
    /// Lines that the client has not read were dropped.
    Missed,
    Ended,
}

impl Hub {
    /// Returns the latest line about each key (part of the loop's state, such as `function f`), if this line is no
    /// longer among the retained lines. The result is in the order of the lines' numbers. Also returns the number of
    /// the first retained line.
    pub(super) fn state(&self) -> (Vec<Arc<str>>, u64) {
        let state = self.lock();
        let mut visited = BTreeSet::new();
        let words =
            state.words.values().filter(|(number, _)| *number < state.first && visited.insert(*number));
        let mut words: Vec<_> = words.cloned().collect();
        words.sort_unstable_by_key(|(number, _)| *number);
        (words.into_iter().map(|(_, line)| line).collect(), state.first)
    }

    /// Returns the retained lines from number `from` on, at most [`MAX_BATCH`]. If there is no such line yet, waits up
    /// to `wait` for one or for the end of the run. If line `from` was dropped, returns [`News::Missed`].
    pub(super) fn news(&self, from: u64, wait: Duration) -> News {
        let is_waiting = |state: &mut RetainedLines| !state.ended && from == state.end();
        let state = self.more.wait_timeout_while(self.lock(), wait, is_waiting);
        let (state, _) = state.unwrap_or_else(PoisonError::into_inner);
        if from < state.first {
            return News::Missed;
        }
        let skipped = (from - state.first) as usize;
        let lines: Vec<_> = state.lines.iter().skip(skipped).take(MAX_BATCH).cloned().collect();
        match lines.is_empty() {
            false => News::Lines(lines),
            true if state.ended => News::Ended,
            true => News::Nothing,
        }
    }

    /// Adds a line, which is the latest one about these keys. Above the limits, drops the oldest lines, and the keys
    /// that changed longest ago.
    fn take(&self, line: Arc<str>, keys: Vec<String>) {
        let mut state = self.lock();
        let number = state.end();
        for key in keys {
            state.words.insert(key, (number, Arc::clone(&line)));
        }
        while state.words.len() > MAX_KEYS {
            let oldest =
                state.words.iter().min_by_key(|(_, (number, _))| *number).map(|(key, _)| key.clone());
            oldest.and_then(|key| state.words.remove(&key));
        }
        state.bytes += line.len();
        state.lines.push_back(line);
        // The newest line is always retained, even if it exceeds the limit alone.
        while state.lines.len() > 1 && (state.lines.len() > MAX_LINES || state.bytes > MAX_RETAINED_BYTES) {
            let removed = state.lines.pop_front();
            state.bytes -= removed.map_or(0, |line| line.len());
            state.first += 1;
        }
        drop(state);
        self.more.notify_all();
    }

    fn end(&self) {
        self.lock().ended = true;
        self.more.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, RetainedLines> {
        self.retained.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl RetainedLines {
    fn end(&self) -> u64 {
        self.first + self.lines.len() as u64
    }
}

/// Sends events and answers of the loop to a hub, through a queue. Only [`HubSender::end`] blocks.
/// Clones share the hub.
#[derive(Debug, Clone)]
pub(super) struct HubSender {
    queue: SyncSender<Option<(f64, Entry)>>,
    backlog: Arc<Backlog>,
    start: Instant,
}

#[derive(Debug, Default)]
struct Backlog {
    dropped: AtomicU64,
    bytes: AtomicUsize,
}

#[derive(Debug)]
enum Entry {
    Event(u64, String),
    Answer(String),
    Designs(Vec<DesignChange>),
    Planned { exists: bool, under_way: Option<u64> },
}

impl Entry {
    fn bytes(&self) -> usize {
        match self {
            Self::Event(_, text) | Self::Answer(text) => text.len(),
            Self::Designs(_) | Self::Planned { .. } => 0,
        }
    }
}

impl HubSender {
    pub(super) fn of(hub: Arc<Hub>) -> Self {
        let (queue, receiver) = sync_channel(MAX_QUEUED_LINES);
        let backlog = Arc::new(Backlog::default());
        let receiver_backlog = Arc::clone(&backlog);
        std::thread::spawn(move || listen(&hub, &receiver, &receiver_backlog));
        Self { queue, backlog, start: Instant::now() }
    }

    pub(super) fn send_event(&self, number: u64, text: &str) {
        self.enqueue(Entry::Event(number, text.to_owned()));
    }

    pub(super) fn send_answer(&self, answer: &str) {
        self.enqueue(Entry::Answer(answer.to_owned()));
    }

    pub(super) fn send_designs(&self, designs: Vec<DesignChange>) {
        self.enqueue(Entry::Designs(designs));
    }

    pub(super) fn send_plan(&self, exists: bool, under_way: Option<u64>) {
        self.enqueue(Entry::Planned { exists, under_way });
    }

    /// Reports the end of the run. Blocks while the queue is full.
    pub(super) fn end(&self) {
        let _ = self.queue.send(None);
    }

    fn enqueue(&self, entry: Entry) {
        let at = self.start.elapsed().as_secs_f64();
        let bytes = entry.bytes();
        let waiting = self.backlog.bytes.fetch_add(bytes, Ordering::Relaxed);
        // The loop must not wait until the queue is emptied, so lines beyond the limit are dropped.
        let is_taken = waiting.saturating_add(bytes) <= MAX_QUEUED_BYTES
            && !matches!(self.queue.try_send(Some((at, entry))), Err(TrySendError::Full(_)));
        if !is_taken {
            self.backlog.bytes.fetch_sub(bytes, Ordering::Relaxed);
            self.backlog.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }
}

fn listen(hub: &Hub, receiver: &Receiver<Option<(f64, Entry)>>, backlog: &Backlog) {
    while let Ok(Some((at, entry))) = receiver.recv() {
        // The page shows the number of dropped lines.
        let missing = backlog.dropped.swap(0, Ordering::Relaxed);
        backlog.bytes.fetch_sub(entry.bytes(), Ordering::Release);
        // Milliseconds are precise enough for a page.
        let at = (at * 1000.0).round() / 1000.0;
        if missing > 0 {
            hub.take(json!({"at": at, "left_out": missing}).to_string().into(), Vec::new());
        }
        match entry {
            Entry::Event(number, text) => {
                let line = json!({"at": at, "line": number, "heard": text});
                hub.take(line.to_string().into(), Vec::new());
            }
            Entry::Designs(designs) => {
                let keys = designs.iter().map(|design| design_key(&design.design)).collect();
                hub.take(json!({"at": at, "known": designs}).to_string().into(), keys);
            }
            Entry::Planned { exists, under_way } => {
                let line = json!({"at": at, "planned": {"exists": exists, "under_way": under_way}});
                hub.take(line.to_string().into(), vec!["planned".to_owned()]);
            }
            Entry::Answer(answer) => {
                // The answer is valid JSON, so it is embedded unchanged.
                let line = format!("{{\"at\":{},\"said\":{answer}}}", Value::from(at));
                hub.take(line.into(), keys(&answer));
            }
        }
    }
    hub.end();
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::Ordering;
    use std::time::Duration;

    use super::{Hub, HubSender, MAX_QUEUED_BYTES, News};

    #[test]
    fn the_queue_is_bounded_by_its_bytes() {
        let hub = Arc::new(Hub::default());
        let sender = HubSender::of(Arc::clone(&hub));
        let long = "x".repeat(1 << 20);
        // The lock blocks the receiving thread. Once no bytes wait, this thread has taken the first line and has read
        // the number of dropped lines.
        let guard = hub.lock();
        sender.send_event(0, "first");
        while sender.backlog.bytes.load(Ordering::Acquire) > 0 {
            std::thread::sleep(Duration::from_millis(1));
        }
        for number in 1..=100 {
            sender.send_event(number, &long);
        }
        assert!(sender.backlog.bytes.load(Ordering::Relaxed) <= MAX_QUEUED_BYTES);
        assert!(sender.backlog.dropped.load(Ordering::Relaxed) >= 83);
        drop(guard);
        while sender.backlog.bytes.load(Ordering::Relaxed) > 0 {
            std::thread::sleep(Duration::from_millis(1));
        }
        sender.send_event(101, "short");
        sender.end();
        let (mut next, mut short_lines) = (0, 0);
        loop {
            match hub.news(next, Duration::from_secs(1)) {
                News::Lines(lines) => {
                    next += lines.len() as u64;
                    short_lines += lines.iter().filter(|line| line.contains("short")).count();
                }
                News::Missed => next = hub.state().1,
                News::Nothing => {}
                News::Ended => break,
            }
        }
        assert_eq!(short_lines, 1, "lines after an overflow are delivered");
    }
}
