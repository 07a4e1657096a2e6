//! Execution of a partition: reads events, refuses those with a wrong address, runs the loops of robots, unloads robots
//! that were not used recently, and discards handled events.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use futures::future::BoxFuture;
use futures::stream::{BoxStream, FuturesUnordered, StreamExt as _};
use metaplan::mapek::{ParallelSearch, Thoughts};
use tokio::sync::watch;

use super::task::{Loaded, Outcome, PANICKED, Planning, Task};
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
    /// Number of robots whose last decision lacks a plan.
    pending: usize,
    /// Names of robots with the number of the use that is described in [`Slot::used`], in the order of these numbers.
    recent: VecDeque<(u64, String)>,
    /// Number of finished tasks: handled events, and starts and conclusions of planning.
    clock: u64,
}

/// A robot in memory, with its queue.
#[derive(Default)]
#[expect(clippy::struct_excessive_bools, reason = "they are independent of each other")]
struct Slot {
    /// State of the robot. `None` while the robot is busy, and if the state is not loaded.
    loaded: Option<Loaded>,
    /// `true` while an event is being handled, or planning is started or concluded.
    is_busy: bool,
    /// `true` if the last decision lacks a plan. Then the last event is not discarded, so that a new owner of the
    /// partition searches for the plan.
    is_pending: bool,
    /// `true` if the robot was suspended while a plan was pending. Then the last event is not discarded, either.
    is_kept: bool,
    /// The search for a plan that continues after the decision.
    search: ParallelSearch,
    /// Plans that were found.
    thoughts: Option<Thoughts>,
    /// `true` if the robot is included in the number of loaded robots.
    is_counted: bool,
    waiting: VecDeque<Stored>,
    /// Sequence numbers of the events after those in `waiting`. They are read again when it is their turn.
    later: VecDeque<u64>,
    /// `true` if the robot cannot continue. Its events stay in the log, and only a retirement is handled.
    is_suspended: bool,
    /// Sequence number of the last event that was decided or refused.
    handled: u64,
    /// Number of handled events since the last time that events of the robot were discarded, and the time of the
    /// first of them.
    obsolete: usize,
    since: Option<Instant>,
    is_discarding: bool,
    /// Value of [`Partition::clock`] when the robot was last used.
    used: u64,
    /// Estimated duration of the robot's next search, if it has searched before.
    estimate: Option<Duration>,
}

impl Slot {
    fn is_idle(&self) -> bool {
        let is_working = self.is_busy || self.is_discarding || self.is_suspended;
        let is_planning = self.is_pending || self.search.is_running() || self.thoughts.is_some();
        !is_working && !is_planning && self.waiting.is_empty() && self.later.is_empty()
    }
}

enum Done {
    /// An event was handled, or, without a sequence number, planning was started or concluded.
    Handled { task: Task, sequence: Option<u64>, outcome: Outcome, planning: Option<Planning> },
    /// A search has ended. There are no plans if it has panicked, or if its thread could not be started.
    Planned { robot: String, result: Option<(Thoughts, Duration)> },
    /// Handled events of a robot were discarded, or could not be discarded.
    Discarded { robot: String, is_done: bool },
}

/// Maximum number of undecided events that each robot has in memory. Only the sequence numbers of further ones are.
const MAX_QUEUE: usize = 16;

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
            pending: 0,
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
            if self.waiting == 0 && self.pending == 0 && reached != self.seen {
                reached = self.seen;
                let mut positions = self.shared.counts.reached.lock().unwrap_or_else(PoisonError::into_inner);
                positions.insert(self.number, reached);
            }
            let is_draining = *orders.borrow_and_update() == Order::Drain;
            if is_draining {
                let since = drained.get_or_insert_with(Instant::now);
                // The next owner plans.
                self.slots.values_mut().for_each(|slot| slot.search.interrupt());
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

    /// Queues the next event of the stream for its robot, or refuses it because of its address.
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
            self.say(event.subject.clone(), Refused::Misplaced);
            self.discard(&event.subject, &event.subject, event.sequence);
            return;
        }
        let slot = self.slots.entry(address.robot.clone()).or_default();
        if slot.waiting.len() < MAX_QUEUE && slot.later.is_empty() {
            slot.waiting.push_back(event);
        } else {
            slot.later.push_back(event.sequence);
        }
        self.count_waiting(1);
        self.begin(&address.robot);
    }

    fn count_waiting(&mut self, change: isize) {
        self.waiting = self.waiting.wrapping_add_signed(change);
        self.shared.counts.waiting.fetch_add(change.cast_unsigned() as u64, Ordering::Relaxed);
    }

    /// Starts the next work of a robot, if the robot is idle: concludes planning, handles the next queued event, or starts
    /// to plan.
    fn begin(&mut self, name: &str) {
        let subject = self.subject(name);
        let Some(slot) = self.slots.get_mut(name).filter(|slot| !slot.is_busy) else { return };
        let thoughts = slot.thoughts.take();
        let (mut event, mut sequence) = (None, None);
        if thoughts.is_none() {
            event = slot.waiting.pop_front();
            sequence = event.as_ref().map(|event| event.sequence).or_else(|| slot.later.pop_front());
            if sequence.is_none() && (!slot.is_pending || slot.search.is_running()) {
                return;
            }
        }
        slot.is_busy = true;
        let (is_late, may_search) = (slot.search.accepts_late_plans(), !slot.search.is_running());
        let loaded = slot.loaded.take();
        let (name, estimate) = (name.to_owned(), slot.estimate);
        let mut task = Task { name, subject, loaded, is_restored: false, estimate };
        let (shared, is_suspended) = (Arc::clone(&self.shared), slot.is_suspended);
        self.jobs.push(Box::pin(async move {
            let (outcome, planning) = match (thoughts, sequence) {
                (Some(thoughts), _) => (task.conclude(&shared, thoughts, is_late).await, None),
                (None, None) => task.start_planning(&shared).await,
                (None, Some(sequence)) => {
                    let is_known = task.loaded.as_ref().is_some_and(|loaded| sequence <= loaded.robot.event);
                    let event = match event {
                        None if !is_known => persist(|| shared.store.event(sequence)).await,
                        event => event,
                    };
                    match event {
                        // A suspended robot can only be retired.
                        Some(event) if is_suspended && !is_retirement(&event.payload) => {
                            (Outcome::Suspended, None)
                        }
                        Some(event) => task.run(&shared, &event, may_search).await,
                        // It is decided, and perhaps discarded.
                        None => (Outcome::Known, None),
                    }
                }
            };
            Done::Handled { task, sequence, outcome, planning }
        }));
    }

    fn done(&mut self, done: Done, is_draining: bool) {
        let robot = match done {
            Done::Handled { task, sequence, outcome, planning } => {
                let robot = task.name.clone();
                self.handled(&robot, task, sequence, outcome);
                self.follow_search(&robot, planning);
                robot
            }
            Done::Planned { robot, result } => {
                self.planned(&robot, result);
                robot
            }
            Done::Discarded { robot, is_done } => {
                if let Some(slot) = self.slots.get_mut(&robot) {
                    slot.is_discarding = false;
                    if !is_done {
                        // Another attempt follows.
                        slot.obsolete += 1;
                        slot.since.get_or_insert_with(Instant::now);
                    }
                }
                robot
            }
        };
        if !is_draining {
            self.begin(&robot);
        }
        // A robot that is not enrolled, or not loaded, needs no memory after its events are discarded.
        if let Some(slot) = self.slots.get(&robot).filter(|slot| slot.is_idle()) {
            let is_unknown = slot.loaded.as_ref().is_some_and(|loaded| loaded.robot.mission().is_none());
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

    fn handled(&mut self, name: &str, task: Task, sequence: Option<u64>, outcome: Outcome) {
        self.count_waiting(-isize::from(sequence.is_some()));
        self.clock += 1;
        self.count_loaded(name, task.loaded.is_some());
        let Some(slot) = self.slots.get_mut(name) else { return };
        (slot.is_busy, slot.estimate, slot.used) = (false, task.estimate, self.clock);
        let is_decided = matches!(outcome, Outcome::Decided);
        // If the robot was suspended, this decision has retired it.
        slot.is_suspended &= !is_decided;
        slot.is_kept &= !is_decided;
        let robot = task.loaded.as_ref().map(|loaded| &loaded.robot);
        let is_pending = robot.map_or(slot.is_pending, |robot| robot.is_pending());
        let plan = robot.filter(|_| is_decided).map(|robot| robot.event);
        if task.is_restored {
            // Plans for the problems of the former loop cannot be distinguished from those for the problems of this one.
            slot.thoughts = None;
            slot.search.update(None);
        } else if let Some(robot) = robot {
            slot.search.update(is_pending.then(|| robot.question()));
        }
        slot.loaded = task.loaded;
        // The events of a suspended robot stay in the log, also those before a refused retirement.
        let is_stuck = slot.is_suspended || matches!(outcome, Outcome::Faulted(_) | Outcome::Suspended);
        let event = sequence.filter(|_| !is_stuck);
        if let Some(last) = event.or(plan) {
            slot.handled = slot.handled.max(last);
            slot.obsolete += 1;
            slot.since.get_or_insert_with(Instant::now);
        }
        let is_due = slot.obsolete >= self.shared.settings.discard_every;
        self.set_pending(name, is_pending);
        match outcome {
            Outcome::Known | Outcome::Suspended | Outcome::Outdated => {}
            Outcome::Decided => {
                self.shared.counts.decided.fetch_add(u64::from(sequence.is_some()), Ordering::Relaxed);
            }
            Outcome::Refused(refused) => self.say(self.subject(name), refused),
            Outcome::Faulted(why) => self.suspend(name, &why),
        }
        if is_due {
            self.discard_of(name);
        }
        self.recent.push_back((self.clock, name.to_owned()));
        self.unload();
    }

    fn set_pending(&mut self, name: &str, is_pending: bool) {
        let Some(slot) = self.slots.get_mut(name) else { return };
        self.pending = self.pending + usize::from(is_pending) - usize::from(slot.is_pending);
        slot.is_pending = is_pending;
        if !is_pending {
            slot.search.reset();
        }
    }

    fn suspend(&mut self, name: &str, why: &str) {
        let Some(slot) = self.slots.get_mut(name) else { return };
        slot.is_kept |= slot.is_pending;
        self.set_pending(name, false);
        let Some(slot) = self.slots.get_mut(name) else { return };
        slot.is_suspended = true;
        metrics::counter!("metaplan_fleet_faulted_total").increment(1);
        tracing::error!(partition = self.number, robot = name, "robot suspended: {why}");
        self.refuse(Some((self.subject(name), format!("the robot is suspended: {why}"))), "faulted");
    }

    /// Waits for a search for a plan of a robot while other work continues.
    fn follow_search(&mut self, name: &str, planning: Option<Planning>) {
        let Some(slot) = self.slots.get_mut(name) else { return };
        let Some(Planning { search, result }) = planning else { return };
        slot.search.begin(search);
        let robot = name.to_owned();
        self.jobs.push(Box::pin(async move { Done::Planned { robot, result: result.await } }));
    }

    fn planned(&mut self, name: &str, result: Option<(Thoughts, Duration)>) {
        let Some(slot) = self.slots.get_mut(name) else { return };
        let is_cancelled = slot.search.end();
        match result {
            None => self.suspend(name, PANICKED),
            Some(_) if is_cancelled => {}
            Some((thoughts, estimate)) => {
                (slot.estimate, slot.thoughts) = (Some(estimate), Some(thoughts));
            }
        }
    }

    /// Unloads idle robots of this partition, the least recently used ones first, while the worker has more loaded
    /// robots than its limit.
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
        let last = slot.handled - u64::from(slot.is_pending || slot.is_kept);
        self.discard(name, &subject, last);
        true
    }

    /// Starts to discard events.
    fn discard(&self, robot: &str, subject: &str, last: u64) {
        let (shared, robot, subject) = (Arc::clone(&self.shared), robot.to_owned(), subject.to_owned());
        self.jobs.push(Box::pin(async move {
            let is_done = shared.store.discard(&subject, last).await.is_ok();
            Done::Discarded { robot, is_done }
        }));
    }

    fn subject(&self, robot: &str) -> String {
        Address { partition: self.number, robot: robot.to_owned() }.to_string()
    }

    /// Counts a refused event, and publishes the reason as a notice to the clients of the robot.
    fn say(&self, subject: String, refused: Refused) {
        self.refuse(Some((subject, refused.to_string())), refused.name());
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::missions::Missions;
    use crate::partition::Settings;
    use crate::robot::{Begun, Robot};
    use crate::store::local::Local;

    #[test]
    fn a_search_for_the_former_loop_of_a_robot_that_is_loaded_again_is_cancelled() {
        let folder = tempfile::tempdir().expect("a directory");
        let store = Local::open(folder.path(), 1, 8, Duration::from_secs(1))
            .unwrap_or_else(|message| panic!("{message}"));
        let missions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../missions");
        let missions = Missions::read(&missions).unwrap_or_else(|errors| panic!("{errors}"));
        let thinker = missions.get("uuv").expect("it exists").control.thinker();
        let payload = br#"{"event": "enrol", "mission": "uuv"}"#.to_vec();
        let event = Stored { sequence: 1, subject: "0.r".to_owned(), id: None, time: 0, payload };
        let mut robot = Robot::default();
        let Ok(Begun::Search(search)) = robot.begin(&event, &missions) else {
            panic!("a search is necessary")
        };
        let decided = robot.finish(search, None);
        let shared = Arc::new(Shared::new(store, missions, "w".to_owned(), Settings::default()));
        for is_restored in [false, true] {
            let mut partition = Partition::new(Arc::clone(&shared), 0);
            partition.slots.entry("r".to_owned()).or_default().search.begin(thinker.handle());
            // The numbers of both problems are 0.
            let robot = Box::new(Robot::restore(decided.clone()));
            let (name, subject) = ("r".to_owned(), "0.r".to_owned());
            let loaded = Some(Loaded { robot, chain: 1 });
            let task = Task { name, subject, loaded, is_restored, estimate: None };
            partition.handled("r", task, None, Outcome::Known);
            let slot = partition.slots.get_mut("r").expect("it is in memory");
            assert_eq!(slot.search.end(), is_restored);
        }
    }
}
