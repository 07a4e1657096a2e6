//! What is known of a run, for those who look at it: the last lines, and the last word on each thing.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::live::keep::{design_key, keys};
use crate::mapek::DesignChange;

/// So many lines, with so many bytes together, may wait to be taken; what comes then is left out.
const WAITING: usize = 4096;
const WAITING_BYTES: usize = 16 << 20;

/// So many lines are kept.
const LINES: usize = 2000;

/// So many bytes of lines are kept, unless a single line has more.
const BYTES: usize = 4 << 20;

/// On so many things the last word is kept; beyond, the oldest words are forgotten.
const WORDS: usize = 10_000;

/// So many lines are handed out at once.
const BATCH: usize = 100;

/// What is known, and who waits for more.
#[derive(Debug, Default)]
pub(super) struct Hub {
    known: Mutex<Known>,
    more: Condvar,
}

#[derive(Debug, Default)]
struct Known {
    lines: VecDeque<Arc<str>>,
    bytes: usize,
    /// The number of the first of these lines.
    first: u64,
    /// The last word on each thing, with its number.
    words: BTreeMap<String, (u64, Arc<str>)>,
    ended: bool,
}

/// What there is for somebody who has read up to a line.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum News {
    /// The next lines.
    Lines(Vec<Arc<str>>),
    /// Nothing for now.
    Nothing,
    /// Lines that were not read are gone.
    Missed,
    /// There will be no more.
    Ended,
}

impl Hub {
    /// The state of things, as lines in their order, and the number of the line that follows.
    pub(super) fn state(&self) -> (Vec<Arc<str>>, u64) {
        let known = self.lock();
        let mut seen = BTreeSet::new();
        let words = known.words.values().filter(|(number, _)| *number < known.first && seen.insert(*number));
        let mut words: Vec<_> = words.cloned().collect();
        words.sort_unstable_by_key(|(number, _)| *number);
        (words.into_iter().map(|(_, line)| line).collect(), known.first)
    }

    /// What follows from a line on; waits for a while if there is nothing yet.
    pub(super) fn news(&self, from: u64, wait: Duration) -> News {
        let is_waiting = |known: &mut Known| !known.ended && from == known.end();
        let known = self.more.wait_timeout_while(self.lock(), wait, is_waiting);
        let (known, _) = known.unwrap_or_else(PoisonError::into_inner);
        if from < known.first {
            return News::Missed;
        }
        let skipped = (from - known.first) as usize;
        let lines: Vec<_> = known.lines.iter().skip(skipped).take(BATCH).cloned().collect();
        match lines.is_empty() {
            false => News::Lines(lines),
            true if known.ended => News::Ended,
            true => News::Nothing,
        }
    }

    /// Takes a line, with what it is the last word on.
    fn take(&self, line: Arc<str>, keys: Vec<String>) {
        let mut known = self.lock();
        let number = known.end();
        for key in keys {
            known.words.insert(key, (number, Arc::clone(&line)));
        }
        while known.words.len() > WORDS {
            let oldest =
                known.words.iter().min_by_key(|(_, (number, _))| *number).map(|(key, _)| key.clone());
            oldest.and_then(|key| known.words.remove(&key));
        }
        known.bytes += line.len();
        known.lines.push_back(line);
        while known.lines.len() > 1 && (known.lines.len() > LINES || known.bytes > BYTES) {
            let gone = known.lines.pop_front();
            known.bytes -= gone.map_or(0, |line| line.len());
            known.first += 1;
        }
        drop(known);
        self.more.notify_all();
    }

    fn end(&self) {
        self.lock().ended = true;
        self.more.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Known {
    /// The number of the line that follows.
    fn end(&self) -> u64 {
        self.first + self.lines.len() as u64
    }
}

/// The loop's end of a hub: nothing here ever waits. Copies lead to the same hub.
#[derive(Debug, Clone)]
pub(super) struct Mouth {
    said: SyncSender<Option<(f64, Said)>>,
    behind: Arc<Behind>,
    begun: Instant,
}

/// What was said and is not taken yet.
#[derive(Debug, Default)]
struct Behind {
    left_out: AtomicU64,
    bytes: AtomicUsize,
}

#[derive(Debug)]
enum Said {
    Heard(u64, String),
    Answer(String),
    Known(Vec<DesignChange>),
    Planned { exists: bool, under_way: Option<u64> },
}

impl Said {
    /// So much of it is text.
    fn bytes(&self) -> usize {
        match self {
            Self::Heard(_, text) | Self::Answer(text) => text.len(),
            Self::Known(_) | Self::Planned { .. } => 0,
        }
    }
}

impl Mouth {
    /// A way to speak to a hub, and a thread that listens.
    pub(super) fn of(hub: Arc<Hub>) -> Self {
        let (said, received) = sync_channel(WAITING);
        let behind = Arc::new(Behind::default());
        let counted = Arc::clone(&behind);
        std::thread::spawn(move || listen(&hub, &received, &counted));
        Self { said, behind, begun: Instant::now() }
    }

    /// A line that the loop has heard, with its number.
    pub(super) fn heard(&self, number: u64, text: &str) {
        self.say(Said::Heard(number, text.to_owned()));
    }

    /// An answer, which is an object of the format as JSON.
    pub(super) fn answer(&self, answer: &str) {
        self.say(Said::Answer(answer.to_owned()));
    }

    /// How designs are.
    pub(super) fn known(&self, designs: Vec<DesignChange>) {
        self.say(Said::Known(designs));
    }

    /// Publishes whether a plan exists now, and the number of the action under way.
    pub(super) fn planned(&self, exists: bool, under_way: Option<u64>) {
        self.say(Said::Planned { exists, under_way });
    }

    /// That there will be no more. This waits until what was said before is known.
    pub(super) fn end(&self) {
        let _ = self.said.send(None);
    }

    fn say(&self, said: Said) {
        let at = self.begun.elapsed().as_secs_f64();
        let bytes = said.bytes();
        let waiting = self.behind.bytes.fetch_add(bytes, Ordering::Relaxed);
        let is_taken = waiting.saturating_add(bytes) <= WAITING_BYTES
            && !matches!(self.said.try_send(Some((at, said))), Err(TrySendError::Full(_)));
        if !is_taken {
            self.behind.bytes.fetch_sub(bytes, Ordering::Relaxed);
            self.behind.left_out.fetch_add(1, Ordering::Relaxed);
        }
    }
}

fn listen(hub: &Hub, received: &Receiver<Option<(f64, Said)>>, behind: &Behind) {
    while let Ok(Some((at, said))) = received.recv() {
        behind.bytes.fetch_sub(said.bytes(), Ordering::Relaxed);
        let at = (at * 1000.0).round() / 1000.0;
        let missing = behind.left_out.swap(0, Ordering::Relaxed);
        if missing > 0 {
            hub.take(json!({"at": at, "left_out": missing}).to_string().into(), Vec::new());
        }
        match said {
            Said::Heard(number, text) => {
                let line = json!({"at": at, "line": number, "heard": text});
                hub.take(line.to_string().into(), Vec::new());
            }
            Said::Known(designs) => {
                let keys = designs.iter().map(|own| design_key(&own.design)).collect();
                hub.take(json!({"at": at, "known": designs}).to_string().into(), keys);
            }
            Said::Planned { exists, under_way } => {
                let line = json!({"at": at, "planned": {"exists": exists, "under_way": under_way}});
                hub.take(line.to_string().into(), vec!["planned".to_owned()]);
            }
            Said::Answer(answer) => {
                // An answer is JSON already.
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

    use super::{Hub, Mouth, News, WAITING_BYTES};

    #[test]
    fn what_waits_is_bounded_by_its_bytes() {
        let hub = Arc::new(Hub::default());
        let mouth = Mouth::of(Arc::clone(&hub));
        let long = "x".repeat(1 << 20);
        // Nothing is taken meanwhile.
        let known = hub.lock();
        for number in 0..100 {
            mouth.heard(number, &long);
        }
        assert!(mouth.behind.bytes.load(Ordering::Relaxed) <= WAITING_BYTES);
        assert!(mouth.behind.left_out.load(Ordering::Relaxed) >= 83);
        drop(known);
        while mouth.behind.bytes.load(Ordering::Relaxed) > 0 {
            std::thread::sleep(Duration::from_millis(1));
        }
        mouth.heard(100, "short");
        mouth.end();
        let (mut next, mut seen) = (0, 0);
        loop {
            match hub.news(next, Duration::from_secs(1)) {
                News::Lines(lines) => {
                    next += lines.len() as u64;
                    seen += lines.iter().filter(|line| line.contains("short")).count();
                }
                News::Missed => next = hub.state().1,
                News::Nothing => {}
                News::Ended => break,
            }
        }
        assert_eq!(seen, 1, "what comes then is there");
    }
}
