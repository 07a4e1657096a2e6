//! Execution of a partition: reads events, refuses those with a wrong address, runs the loops of robots, unloads robots
//! that were not used recently, and discards handled events.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use futures::future::BoxFuture;
use futures::stream::{BoxStream, FuturesUnordered, StreamExt as _};
use tokio::sync::watch;

use super::task::{Loaded, Outcome, Task};
use super::{Order, Shared, pause, persist};
use crate::robot::{Refused, is_retirement};
use crate::store::{Fault, Store, Stored, Stream};
use crate::wire::{Address, partition_of};

pub(super) struct Partition<S> {
    shared: Arc<Shared<S>>,
    number: u32,
    slots: BTreeMap<String, Slot>,
    /// Sequence number of the last event that was read.
    seen: u64,
    jobs: FuturesUnordered<BoxFuture<'static, Done>>,
    /// Number of events that are read but not handled.
    waiting: usize,
    /// Number of robots with events that have to be read again.
    behind: usize,
    /// Names of robots with the number of the use that is described in [`Slot::used`], in the order of these numbers.
    recent: VecDeque<(u64, String)>,
    clock: u64,
}

/// A robot in memory, with its queue.
#[derive(Default)]
#[expect(clippy::struct_excessive_bools, reason = "they are independent of each other")]
struct Slot {
    /// State of the robot. `None` while an event is being handled, and if the state is not loaded.
    loaded: Option<Loaded>,
    is_busy: bool,
    /// `true` if the robot is included in the number of loaded robots.
    is_counted: bool,
    waiting: VecDeque<Stored>,
    /// Sequence numbers of the first and the last event that are not in the queue and have to be read again, because
    /// the queue was full.
    omitted: Option<(u64, u64)>,
    is_refilling: bool,
    /// `true` if the robot cannot continue. Its events stay in the log, except that one can retire the robot.
    is_suspended: bool,
    /// Sequence number of the last event that was decided or refused.
    handled: u64,
    /// Number of handled events since the last time that events of the robot were discarded, and the time of the
    /// first of them.
    obsolete: usize,
    since: Option<Instant>,
    is_discarding: bool,
    /// Number of events that the partition had handled when the robot was last used.
    used: u64,
    /// Estimated duration of the robot's next search, if it has searched before.
    search: Option<Duration>,
}

impl Slot {
    fn is_idle(&self) -> bool {
        let is_working = self.is_busy || self.is_refilling || self.is_discarding || self.is_suspended;
        !is_working && self.waiting.is_empty() && self.omitted.is_none()
    }
}

enum Done {
    /// An event was handled.
    Handled { task: Task, event: Stored, outcome: Outcome },
    /// Omitted events of a robot were read again: the first `MAX_PAGE`, or all up to `last`.
    Refilled { robot: String, events: Vec<Stored>, last: u64 },
    /// Handled events of a robot were discarded, or could not be discarded.
    Discarded { robot: String },
}

/// Maximum number of undecided events that each robot has in memory before it is refilled.
const MAX_QUEUE: usize = 16;

const MAX_PAGE: usize = 64;

impl<S: Store> Partition<S> {
    pub(super) fn new(shared: Arc<Shared<S>>, number: u32) -> Self {
        shared.counts.partitions.fetch_add(1, Ordering::Relaxed);
        Self {
            shared,
            number,
            slots: BTreeMap::new(),
            seen: 0,
            jobs: FuturesUnordered::new(),
            waiting: 0,
            behind: 0,
            recent: VecDeque::new(),
            clock: 0,
        }
    }

    pub(super) async fn run(mut self, mut orders: watch::Receiver<Order>) {
        let (mut backoff, mut reached) = (0, 0);
        let mut events: Option<BoxStream<'static, Result<Stored, Fault>>> = None;
        let mut drained: Option<Instant> = None;
        let mut look = tokio::time::interval(self.shared.settings.look);
        look.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            if self.waiting == 0 && self.behind == 0 && reached != self.seen {
                reached = self.seen;
                let mut positions = self.shared.counts.reached.lock().unwrap_or_else(PoisonError::into_inner);
                positions.insert(self.number, reached);
            }
            let is_draining = *orders.borrow_and_update() == Order::Drain;
            if is_draining {
                let since = drained.get_or_insert_with(Instant::now);
                let is_late = since.elapsed() >= self.shared.settings.drain;
                if is_late || self.jobs.is_empty() && !self.discard_all(true) {
                    return;
                }
            }
            if events.is_none() && !is_draining {
                if let Ok(stream) = self.shared.store.follow(Stream::Events, self.number, self.seen).await {
                    events = Some(stream);
                } else {
                    backoff += 1;
                    pause(backoff).await;
                }
            }
            tokio::select! {
                biased;
                done = self.jobs.next(), if !self.jobs.is_empty() => {
                    if let Some(done) = done {
                        self.done(done, is_draining);
                    }
                }
                _ = orders.changed() => {}
                _ = look.tick() => drop(self.discard_all(false)),
                message = next(&mut events), if !is_draining && events.is_some() => {
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
    }

    /// Queues the next event of the stream for its robot, or refuses it because of its address. Omits the event, to
    /// be read again, if the queue of the robot is full or if earlier events of the robot were omitted.
    fn read(&mut self, event: Stored) {
        if event.sequence <= self.seen {
            return;
        }
        self.seen = event.sequence;
        let Some(address) = Address::parse(&event.subject) else {
            self.refuse(None, "wrong_subject");
            self.discard(&event.subject, &event.subject, event.sequence);
            return;
        };
        if partition_of(&address.robot, self.shared.store.partitions()) != self.number {
            self.say(&event, Refused::Misplaced);
            self.discard(&event.subject, &event.subject, event.sequence);
            return;
        }
        let slot = self.slots.entry(address.robot.clone()).or_default();
        if let Some((_, last)) = &mut slot.omitted {
            *last = event.sequence;
        } else if slot.waiting.len() >= MAX_QUEUE {
            slot.omitted = Some((event.sequence, event.sequence));
            self.behind += 1;
        } else {
            slot.waiting.push_back(event);
            self.count_waiting(1);
            self.begin(&address.robot);
        }
    }

    fn count_waiting(&mut self, change: isize) {
        self.waiting = self.waiting.wrapping_add_signed(change);
        self.shared.counts.waiting.fetch_add(change.cast_unsigned() as u64, Ordering::Relaxed);
    }

    /// Starts to handle the next queued event of a robot, if the robot is idle. Drops events of a suspended robot
    /// except its retirement. Starts to read more events of the robot if the queue lacks some.
    fn begin(&mut self, name: &str) {
        loop {
            self.refill(name);
            let Some(slot) = self.slots.get_mut(name).filter(|slot| !slot.is_busy) else { return };
            let Some(event) = slot.waiting.pop_front() else { return };
            if slot.is_suspended && !is_retirement(&event.payload) {
                self.count_waiting(-1);
                continue;
            }
            slot.is_busy = true;
            let task = Task { name: name.to_owned(), loaded: slot.loaded.take(), estimate: slot.search };
            let shared = Arc::clone(&self.shared);
            self.jobs.push(Box::pin(async move {
                let (task, outcome) = task.run(&shared, &event).await;
                Done::Handled { task, event, outcome }
            }));
            return;
        }
    }

    /// Starts to read events of a robot that were omitted, if its queue is almost empty.
    fn refill(&mut self, name: &str) {
        let Some(slot) = self.slots.get_mut(name) else { return };
        let is_needed = !slot.is_refilling && slot.waiting.len() < MAX_QUEUE / 2;
        let Some((first, last)) = slot.omitted.filter(|_| is_needed) else { return };
        slot.is_refilling = true;
        let (shared, robot) = (Arc::clone(&self.shared), name.to_owned());
        let subject = self.subject(name);
        self.jobs.push(Box::pin(async move {
            let events = persist(|| shared.store.events(&subject, first - 1, MAX_PAGE)).await;
            // If the page is not full, there are no other events up to `last`: they were discarded.
            let last = if events.len() < MAX_PAGE { last } else { 0 };
            Done::Refilled { robot, events, last }
        }));
    }

    fn refilled(&mut self, name: &str, mut events: Vec<Stored>, last: u64) {
        let Some(slot) = self.slots.get_mut(name) else { return };
        // Later events are still to come from the stream.
        events.retain(|event| event.sequence <= self.seen);
        let read = events.last().map_or(0, |event| event.sequence).max(last);
        let count = events.len();
        slot.waiting.extend(events);
        slot.is_refilling = false;
        slot.omitted =
            slot.omitted.filter(|(_, last)| *last > read).map(|(first, last)| (first.max(read + 1), last));
        self.behind -= usize::from(slot.omitted.is_none());
        self.count_waiting(count.cast_signed());
    }

    fn done(&mut self, done: Done, is_draining: bool) {
        let robot = match done {
            Done::Handled { task, event, outcome } => {
                let robot = task.name.clone();
                self.handled(&robot, task, &event, outcome);
                robot
            }
            Done::Refilled { robot, events, last } => {
                self.refilled(&robot, events, last);
                robot
            }
            Done::Discarded { robot } => {
                if let Some(slot) = self.slots.get_mut(&robot) {
                    slot.is_discarding = false;
                }
                robot
            }
        };
        if !is_draining {
            self.begin(&robot);
        }
        // A robot that is not enrolled, or not loaded, needs no memory after its events are discarded.
        if let Some(slot) = self.slots.get(&robot).filter(|slot| slot.is_idle()) {
            let is_unknown = slot.loaded.as_ref().is_some_and(|loaded| loaded.robot.mission.is_none());
            if slot.obsolete == 0 && (is_unknown || slot.loaded.is_none()) {
                self.count_loaded(&robot, false);
                self.slots.remove(&robot);
            } else if is_unknown {
                self.discard_of(&robot);
            }
        }
    }

    /// Updates the number of loaded robots of the worker.
    fn count_loaded(&mut self, name: &str, is_loaded: bool) {
        let Some(slot) = self.slots.get_mut(name).filter(|slot| slot.is_counted != is_loaded) else { return };
        slot.is_counted = is_loaded;
        let change = if is_loaded { 1 } else { u64::MAX };
        self.shared.counts.robots.fetch_add(change, Ordering::Relaxed);
    }

    fn handled(&mut self, name: &str, task: Task, event: &Stored, outcome: Outcome) {
        self.count_waiting(-1);
        self.clock += 1;
        self.count_loaded(name, task.loaded.is_some());
        let Some(slot) = self.slots.get_mut(name) else { return };
        (slot.is_busy, slot.loaded, slot.search, slot.used) = (false, task.loaded, task.estimate, self.clock);
        match outcome {
            // If the robot was suspended, this decision has retired it.
            Outcome::Decided => slot.is_suspended = false,
            Outcome::Faulted(_) => slot.is_suspended = true,
            Outcome::Known | Outcome::Refused(_) => {}
        }
        if !matches!(outcome, Outcome::Faulted(_)) {
            slot.handled = event.sequence;
            slot.obsolete += 1;
            slot.since.get_or_insert_with(Instant::now);
        }
        let is_due = slot.obsolete >= self.shared.settings.discard_every;
        match outcome {
            Outcome::Known => {}
            Outcome::Decided => drop(self.shared.counts.decided.fetch_add(1, Ordering::Relaxed)),
            Outcome::Refused(refused) => self.say(event, refused),
            Outcome::Faulted(why) => {
                metrics::counter!("metaplan_fleet_faulted_total").increment(1);
                tracing::error!(partition = self.number, robot = name, "robot suspended: {why}");
                self.refuse(Some((self.subject(name), format!("the robot is suspended: {why}"))), "faulted");
            }
        }
        if is_due {
            self.discard_of(name);
        }
        self.recent.push_back((self.clock, name.to_owned()));
        self.unload();
    }

    /// Unloads idle robots, the least recently used ones first, while the worker has more loaded robots than its
    /// limit.
    fn unload(&mut self) {
        while self.shared.counts.robots.load(Ordering::Relaxed) > self.shared.settings.warm as u64 {
            let Some((used, name)) = self.recent.pop_front() else { return };
            let Some(slot) = self.slots.get_mut(&name).filter(|slot| slot.used == used && slot.is_idle())
            else {
                continue;
            };
            slot.loaded = None;
            let is_obsolete = slot.obsolete == 0;
            self.count_loaded(&name, false);
            if is_obsolete {
                self.slots.remove(&name);
            }
        }
        // Entries of robots that were used again are obsolete.
        if self.recent.len() > 2 * self.slots.len() + MAX_QUEUE {
            let slots = &self.slots;
            self.recent.retain(|(used, name)| slots.get(name).is_some_and(|slot| slot.used == *used));
        }
    }

    /// Starts to discard the handled events of all robots that are due: those with an event that was handled
    /// [`Settings::discard_within`](super::Settings::discard_within) ago, or, with `all`, all others, too. Returns
    /// `true` if a job was started.
    fn discard_all(&mut self, all: bool) -> bool {
        let within = self.shared.settings.discard_within;
        let is_due = |slot: &Slot| slot.since.is_some_and(|since| all || since.elapsed() >= within);
        let due = self.slots.iter().filter(|(_, slot)| is_due(slot)).map(|(name, _)| name.clone());
        let due: Vec<String> = due.collect();
        due.iter().filter(|name| self.discard_of(name)).count() > 0
    }

    fn discard_of(&mut self, name: &str) -> bool {
        let subject = self.subject(name);
        let Some(slot) = self.slots.get_mut(name).filter(|slot| !slot.is_discarding) else { return false };
        (slot.obsolete, slot.since, slot.is_discarding) = (0, None, true);
        let last = slot.handled;
        self.discard(name, &subject, last);
        true
    }

    /// Starts to discard events. If that fails, the next owner of the partition discards them.
    fn discard(&self, robot: &str, subject: &str, last: u64) {
        let (shared, robot, subject) = (Arc::clone(&self.shared), robot.to_owned(), subject.to_owned());
        self.jobs.push(Box::pin(async move {
            let _ = shared.store.discard(&subject, last).await;
            Done::Discarded { robot }
        }));
    }

    fn subject(&self, robot: &str) -> String {
        Address { partition: self.number, robot: robot.to_owned() }.to_string()
    }

    /// Counts a refused event, and publishes the reason as a notice to the clients of the robot.
    fn say(&self, event: &Stored, refused: Refused) {
        self.refuse(Some((event.subject.clone(), refused.sentence().to_owned())), refused.name());
    }

    fn refuse(&self, notice: Option<(String, String)>, reason: &'static str) {
        self.shared.counts.refused.fetch_add(1, Ordering::Relaxed);
        metrics::counter!("metaplan_fleet_refused_total", "reason" => reason).increment(1);
        if let Some((subject, text)) = notice {
            let shared = Arc::clone(&self.shared);
            tokio::spawn(async move { shared.store.notice(&subject, &text).await });
        }
    }
}

impl<S> Drop for Partition<S> {
    fn drop(&mut self) {
        let counts = &self.shared.counts;
        let loaded = self.slots.values().filter(|slot| slot.is_counted).count();
        counts.robots.fetch_sub(loaded as u64, Ordering::Relaxed);
        counts.waiting.fetch_sub(self.waiting as u64, Ordering::Relaxed);
        counts.partitions.fetch_sub(1, Ordering::Relaxed);
    }
}

async fn next(
    events: &mut Option<BoxStream<'static, Result<Stored, Fault>>>,
) -> Option<Result<Stored, Fault>> {
    match events {
        Some(events) => events.next().await,
        None => None,
    }
}
