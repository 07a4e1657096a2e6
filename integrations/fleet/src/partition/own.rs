//! Execution of a partition: reads events, refuses those with a wrong address, and passes the others to their robots.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use futures::StreamExt as _;
use tokio::sync::{Notify, watch};
use tokio::task::JoinSet;

use super::runner::Runner;
use super::{Shared, pause, persist};
use crate::robot::Refused;
use crate::store::{Fault, Store, Stored, Stream, Subscription};
use crate::wire::{Address, partition_of};

/// Maximum number of waiting events of each robot whose contents are in memory.
const MAX_QUEUE: usize = 16;

pub(super) struct Partition<S> {
    shared: Arc<Shared<S>>,
    number: u32,
    /// `true` if the partition is given back.
    drain: watch::Receiver<bool>,
    /// Events of the robots that are in memory, by the name of the robot.
    inboxes: BTreeMap<String, Arc<Inbox>>,
    /// Sequence number of the last event that was read.
    seen: u64,
    /// Robots in memory, and discards of refused events.
    running: JoinSet<Option<Box<Runner<S>>>>,
}

impl<S: Store> Partition<S> {
    pub(super) fn new(shared: Arc<Shared<S>>, number: u32, drain: watch::Receiver<bool>) -> Self {
        Self { shared, number, drain, inboxes: BTreeMap::new(), seen: 0, running: JoinSet::new() }
    }

    pub(super) async fn run(mut self) {
        let mut backoff = 0;
        let mut events: Option<Subscription> = None;
        let mut drain = self.drain.clone();
        while !*drain.borrow_and_update() {
            if events.is_none() {
                events = self.shared.store.follow(Stream::Events, self.number, self.seen).await.ok();
            }
            tokio::select! {
                biased;
                Some(done) = self.running.join_next() => {
                    let Ok(runner) = done else {
                        // The worker starts the partition again, which reads its events again.
                        self.positions().remove(&self.number);
                        return;
                    };
                    self.end(runner);
                }
                _ = drain.changed() => {}
                message = next(&mut events) => {
                    if let Some(Ok(event)) = message {
                        backoff = 0;
                        self.read(event);
                    } else {
                        events = None;
                        backoff += 1;
                        pause(backoff).await;
                    }
                }
            }
        }
        let end = async { while self.running.join_next().await.is_some() {} };
        // Tasks that run longer are aborted.
        let _ = tokio::time::timeout(self.shared.settings.drain, end).await;
    }

    /// Passes the next event of the stream to its robot, or refuses it because of its address.
    fn read(&mut self, event: Stored) {
        if event.sequence <= self.seen {
            return;
        }
        self.seen = event.sequence;
        match Address::parse(&event.subject) {
            None => self.refuse("wrong_subject", None, event),
            Some(address) if partition_of(&address.robot, self.shared.store.partitions()) != self.number => {
                let refused = Refused::WrongPartition;
                self.refuse(refused.into(), Some((&event.subject.clone(), refused.to_string())), event);
            }
            Some(address) => {
                if let Some(inbox) = self.inboxes.get(&address.robot) {
                    inbox.push(event);
                } else {
                    let inbox = Arc::new(Inbox::new(&self.shared.counts.waiting));
                    inbox.push(event);
                    self.inboxes.insert(address.robot.clone(), Arc::clone(&inbox));
                    self.start(Box::new(Runner::new(Arc::clone(&self.shared), address, inbox)));
                }
            }
        }
        self.positions().insert(self.number, self.seen);
    }

    fn positions(&self) -> MutexGuard<'_, BTreeMap<u32, u64>> {
        self.shared.counts.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn refuse(&mut self, reason: &'static str, notice: Option<(&str, String)>, event: Stored) {
        self.shared.refuse(reason, notice);
        let shared = Arc::clone(&self.shared);
        self.running.spawn(async move {
            // The next owner of the partition refuses an event again that is not discarded.
            let _ = shared.store.discard(&event.subject, event.sequence).await;
            None
        });
    }

    /// Removes a robot of which nothing has to be kept in memory, unless it has got an event in the meantime.
    fn end(&mut self, runner: Option<Box<Runner<S>>>) {
        let Some(runner) = runner else { return };
        if runner.inbox.is_empty() {
            self.inboxes.remove(&runner.address.robot);
        } else {
            self.start(runner);
        }
    }

    fn start(&mut self, runner: Box<Runner<S>>) {
        let run = runner.run(self.drain.clone());
        self.running.spawn(async { Some(run.await) });
    }
}

async fn next(events: &mut Option<Subscription>) -> Option<Result<Stored, Fault>> {
    events.as_mut()?.next().await
}

/// Events of a robot that its partition has read. The first [`MAX_QUEUE`] of them are in memory. Later ones stay in the
/// log, and are read again when it is their turn, so that the memory of a slow robot is bounded.
pub(super) struct Inbox {
    queue: Mutex<Queue>,
    arrival: Notify,
    /// Number of waiting events of all robots of the worker.
    waiting: Arc<AtomicU64>,
}

#[derive(Default)]
struct Queue {
    events: VecDeque<Stored>,
    /// Sequence number of the last event that the robot has taken.
    taken: u64,
    /// Sequence number of the last event that the partition has read.
    last: u64,
    /// Number of events that are not handled.
    waiting: u64,
}

impl Inbox {
    pub(super) fn new(waiting: &Arc<AtomicU64>) -> Self {
        Self { queue: Mutex::default(), arrival: Notify::new(), waiting: Arc::clone(waiting) }
    }

    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn is_empty(&self) -> bool {
        let queue = self.queue();
        queue.taken == queue.last
    }

    pub(super) fn push(&self, event: Stored) {
        let mut queue = self.queue();
        queue.waiting += 1;
        self.waiting.fetch_add(1, Ordering::Relaxed);
        // After an event that stays in the log, all others stay there until the robot has taken it.
        let end = queue.events.back().map_or(queue.taken, |event| event.sequence);
        let is_in_order = end == queue.last;
        queue.last = event.sequence;
        if is_in_order && queue.events.len() < MAX_QUEUE {
            queue.events.push_back(event);
        }
        self.arrival.notify_one();
    }

    /// Waits for the next event of the robot, which is read from the log if it is not in memory. Events up to the sequence
    /// number `decided` may be left out. Returns `None` if the events that the partition has read are no longer in the
    /// log. The robot then has to check whether a plan is missing, instead of waiting for a further event.
    pub(super) async fn next<S: Store>(&self, store: &S, subject: &str, decided: u64) -> Option<Stored> {
        loop {
            let (event, taken, last) = {
                let mut queue = self.queue();
                let event = queue.events.pop_front();
                queue.taken = event.as_ref().map_or(queue.taken, |event| event.sequence);
                (event, queue.taken, queue.last)
            };
            if event.is_some() {
                return event;
            }
            if taken == last {
                self.arrival.notified().await;
                continue;
            }
            let start = taken.max(decided) + 1;
            let event = persist(|| store.next(subject, start)).await;
            // Another worker or an operator may have discarded the events.
            let event = event.filter(|event| event.sequence <= last);
            self.queue().taken = event.as_ref().map_or(last, |event| event.sequence);
            if event.is_none() {
                self.finish();
            }
            return event;
        }
    }

    /// Counts the event that was taken last as handled.
    pub(super) fn finish(&self) {
        let mut queue = self.queue();
        // Events that were not taken are not counted one by one.
        let count = if queue.taken == queue.last { queue.waiting } else { queue.waiting.min(1) };
        queue.waiting -= count;
        self.waiting.fetch_sub(count, Ordering::Relaxed);
    }
}

impl Drop for Inbox {
    fn drop(&mut self) {
        self.waiting.fetch_sub(self.queue().waiting, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::store::local::Local;

    fn event(sequence: u64) -> Stored {
        Stored { sequence, subject: "0.r".to_owned(), id: None, time: 0, payload: Vec::new() }
    }

    #[test]
    fn the_memory_of_waiting_events_is_bounded() {
        let inbox = Inbox::new(&Arc::default());
        for sequence in 1..=100_000 {
            inbox.push(event(sequence));
        }
        let queue = inbox.queue();
        assert_eq!((queue.events.len(), queue.waiting, queue.last), (MAX_QUEUE, 100_000, 100_000));
        assert!(queue.events.capacity() <= 2 * MAX_QUEUE);
    }

    #[tokio::test]
    async fn a_robot_does_not_wait_for_events_that_are_no_longer_in_the_log() {
        let folder = tempfile::tempdir().expect("a directory");
        let store = Local::open(folder.path(), 1, 8, Duration::from_secs(1))
            .unwrap_or_else(|message| panic!("{message}"));
        let waiting = Arc::<AtomicU64>::default();
        let inbox = Inbox::new(&waiting);
        for sequence in 1..=20 {
            inbox.push(event(sequence));
        }
        for sequence in 1..=16 {
            assert_eq!(inbox.next(&store, "0.r", 0).await, Some(event(sequence)));
            inbox.finish();
        }
        assert_eq!(waiting.load(Ordering::Relaxed), 4);
        assert_eq!(inbox.next(&store, "0.r", 0).await, None);
        assert!(inbox.is_empty());
        assert_eq!(waiting.load(Ordering::Relaxed), 0);
    }
}
