//! Execution of a partition: reads events, refuses invalid ones, runs the loops of robots, unloads
//! robots that were not used recently, and starts checkpoints.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use futures::future::BoxFuture;
use futures::stream::{BoxStream, FuturesUnordered, StreamExt as _};
use tokio::sync::watch;

use super::asking::{pause, persist};
use super::slot::{Done, Outcome, Slot};
use super::task::Task;
use super::{End, Order, Shared};
use crate::robot::{Refused, Robot, is_retirement};
use crate::store::{Fault, Store, Stored, Stream};
use crate::wire::{Address, Progress, partition_of};

pub(super) struct Partition<S> {
    pub(super) shared: Arc<Shared<S>>,
    pub(super) number: u32,
    pub(super) progress: Progress,
    pub(super) revision: u64,
    pub(super) slots: BTreeMap<String, Slot>,
    /// Sequence numbers of the last event that was read, and of the last known decision, both over all
    /// robots of the partition.
    pub(super) seen: (u64, u64),
    /// Greatest known revision of the snapshots of the partition's robots.
    pub(super) snapshots: u64,
    /// Sequence number of the last decision at the time of the recovery.
    pub(super) recovered: u64,
    /// Number of robots with events that have to be read again.
    pub(super) behind: usize,
    pub(super) jobs: FuturesUnordered<BoxFuture<'static, Done>>,
    pub(super) waiting: usize,
    pub(super) is_progressing: bool,
    pub(super) clock: u64,
    pub(super) recent: VecDeque<(u64, String)>,
}

/// Number of undecided events that each robot can have in memory, regardless of other robots.
const FEW: usize = 16;

const MAX_PAGE: usize = 64;

impl<S: Store> Partition<S> {
    pub(super) fn slot(&mut self, robot: &str) -> &mut Slot {
        if !self.slots.contains_key(robot) {
            self.shared.counts.robots.fetch_add(1, Ordering::Relaxed);
            let slot = Slot { robot: Some(Box::default()), ..Slot::default() };
            self.slots.insert(robot.to_owned(), slot);
        }
        self.slots.get_mut(robot).expect("it is there now")
    }

    pub(super) async fn run(mut self, mut orders: watch::Receiver<Order>) -> End {
        let (mut backoff, mut reached) = (0, 0);
        let mut events: Option<BoxStream<'static, Result<Stored, Fault>>> = None;
        let mut drained: Option<Instant> = None;
        let mut look = tokio::time::interval(self.shared.settings.look);
        look.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        let behind = self.slots.iter().filter(|(_, slot)| slot.behind.is_some());
        for robot in behind.map(|(name, _)| name.clone()).collect::<Vec<_>>() {
            self.begin(&robot);
        }
        loop {
            if self.waiting == 0 && self.behind == 0 && reached != self.seen.0 {
                reached = self.seen.0;
                let mut positions = self.shared.counts.reached.lock().unwrap_or_else(PoisonError::into_inner);
                positions.insert(self.number, reached);
            }
            let order = *orders.borrow_and_update();
            let is_draining = order == Order::Drain;
            if is_draining {
                let drained = drained.get_or_insert_with(|| {
                    self.save(true);
                    Instant::now()
                });
                if drained.elapsed() >= self.shared.settings.drain {
                    return End::Ordered;
                }
            }
            if is_draining && self.jobs.is_empty() && !self.save(true) && !self.advance(true) {
                return End::Ordered;
            }
            if events.is_none() && !is_draining {
                if let Ok(stream) = self.shared.store.follow(Stream::Events, self.number, self.seen.0).await {
                    events = Some(stream);
                } else {
                    backoff += 1;
                    pause(backoff).await;
                }
            }
            tokio::select! {
                biased;
                done = self.jobs.next(), if !self.jobs.is_empty() => {
                    if let Some(done) = done && let Err(end) = self.done(done, is_draining) {
                        return end;
                    }
                }
                _ = orders.changed() => {}
                _ = look.tick() => {
                    self.save(false);
                    self.advance(false);
                    self.forget();
                }
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

    /// Queues the next event of the stream for its robot, or refuses it. Ignores events that were
    /// read before, events that the robot's snapshot contains, and events of suspended robots
    /// except their retirement. Omits the event, to be read again, if too many events are queued or
    /// if earlier ones of the robot were omitted.
    fn read(&mut self, event: Stored) {
        if event.sequence <= self.seen.0 {
            return;
        }
        self.seen.0 = event.sequence;
        let Some(address) = self.address(&event) else { return };
        if !self.slots.contains_key(&address.robot) {
            // Events of unknown robots are refused here unless they enrol the robot with a known
            // mission, so that they create no state.
            let refused = match enrolment(&event.payload) {
                Some(mission) if self.shared.missions.get(&mission).is_some() => None,
                Some(_) => Some(Refused::Mission),
                None => Some(Refused::Unknown),
            };
            if let Some(refused) = refused {
                self.say(&event, refused);
                return;
            }
        }
        let is_full = self.waiting >= self.shared.settings.ahead / 2;
        let slot = self.slot(&address.robot);
        if slot.behind.is_some() {
            slot.omitted = event.sequence;
        } else if is_full && slot.waiting.len() >= FEW {
            slot.behind = Some(event.sequence);
            slot.omitted = event.sequence;
            self.behind += 1;
        } else {
            self.queue(&address.robot, event);
            self.begin(&address.robot);
        }
    }

    /// Parses the address of an event. Refuses the event and returns `None` if the address or its
    /// partition is wrong, or if the message id is not one of the robot.
    fn address(&self, event: &Stored) -> Option<Address> {
        let Some(address) = Address::parse(&event.subject) else {
            self.refuse(None, "wrong_subject");
            return None;
        };
        let forged = event
            .id
            .as_ref()
            .is_some_and(|id| id.split_once(':').is_none_or(|(robot, _)| robot != address.robot));
        let refused = if partition_of(&address.robot, self.shared.store.partitions()) != self.number {
            Refused::Misplaced
        } else if forged {
            Refused::Forged
        } else {
            return Some(address);
        };
        self.say(event, refused);
        None
    }

    fn queue(&mut self, robot: &str, event: Stored) {
        let slot = self.slot(robot);
        if slot.robot.as_ref().is_some_and(|robot| event.sequence <= robot.event) {
            return;
        }
        slot.waiting.push_back(event);
        self.waiting += 1;
        self.shared.counts.waiting.fetch_add(1, Ordering::Relaxed);
    }

    fn dequeue(&mut self, name: &str) -> Option<Stored> {
        let event = self.slots.get_mut(name)?.waiting.pop_front()?;
        self.waiting -= 1;
        self.shared.counts.waiting.fetch_sub(1, Ordering::Relaxed);
        Some(event)
    }

    /// Starts to handle the next queued event of a robot, if the robot is idle. Drops events of a
    /// suspended robot except its retirement, and refuses events that a former owner has skipped.
    /// Starts to read more events of the robot if the queue lacks some.
    fn begin(&mut self, name: &str) {
        let last_decision = self.seen.1;
        loop {
            self.refill(name);
            if self.slots.get(name).is_none_or(|slot| slot.robot.is_none()) {
                return;
            }
            let Some(event) = self.dequeue(name) else { return };
            let Some(slot) = self.slots.get_mut(name) else { return };
            let is_suspended = slot.suspended.is_some();
            if is_suspended && !is_retirement(&event.payload) {
                continue;
            }
            while slot.before.front().is_some_and(|(_, decided)| decided.event < event.sequence) {
                slot.before.pop_front();
            }
            let next =
                slot.before.front().map(|(_, decided)| (decided.event == event.sequence, decided.skips));
            if next == Some((false, true)) {
                self.say(&event, Refused::Skipped);
                continue;
            }
            let before = if next.is_some_and(|next| next.0) { slot.before.pop_front() } else { None };
            let Some(robot) = slot.robot.take() else { return };
            // The progress must not pass the end of a suspension before a snapshot contains it.
            slot.is_apart &= !is_suspended;
            // The position of a replayed decision must not be passed by the progress until the decision
            // is listed as unsaved.
            let last_decision =
                before.as_ref().map_or(last_decision, |(decision, _)| last_decision.min(decision - 1));
            slot.at = Some((event.sequence, last_decision));
            let task = Task {
                shared: Arc::clone(&self.shared),
                name: name.to_owned(),
                partition: self.number,
                epoch: self.progress.epoch,
                chain: slot.chain,
                recovered: self.recovered,
                was_refused: before.is_none() && !slot.before.is_empty(),
                before,
                is_suspended,
                estimate: slot.search,
            };
            self.waiting += 1;
            self.shared.counts.waiting.fetch_add(1, Ordering::Relaxed);
            self.jobs.push(Box::pin(task.run(robot, event)));
            return;
        }
    }

    /// Starts to read events of a robot that were omitted, if its queue is almost empty.
    fn refill(&mut self, name: &str) {
        let Some(slot) = self.slots.get_mut(name) else { return };
        let Some(first) = slot.behind.filter(|_| !slot.is_refilling && slot.waiting.len() < FEW / 2) else {
            return;
        };
        slot.is_refilling = true;
        slot.omitted = 0;
        let (shared, name) = (Arc::clone(&self.shared), name.to_owned());
        let subject = Address { partition: self.number, robot: name.clone() }.to_string();
        self.jobs.push(Box::pin(async move {
            let read = || shared.store.of_subject(Stream::Events, &subject, first - 1, MAX_PAGE);
            let events = persist(read).await;
            Done::Refilled { robot: name, events }
        }));
    }

    fn refilled(&mut self, name: &str, events: Vec<Stored>) {
        let is_page_full = events.len() == MAX_PAGE;
        let mut last = 0;
        for event in events {
            // Later events are still to come from the stream.
            if event.sequence <= self.seen.0 {
                last = event.sequence;
                if self.address(&event).is_some() {
                    self.queue(name, event);
                }
            }
        }
        let Some(slot) = self.slots.get_mut(name) else { return };
        slot.is_refilling = false;
        let is_complete = !is_page_full && slot.omitted <= last;
        slot.behind = slot.behind.filter(|_| !is_complete).map(|first| first.max(last + 1));
        self.behind -= usize::from(is_complete);
    }

    fn done(&mut self, done: Done, is_draining: bool) -> Result<(), End> {
        match done {
            Done::Taken { robot: name, own, event, outcome, search } => {
                self.taken(&name, own, &event, outcome, search)?;
                // A busy robot is never idle between events, so it is saved between two events
                // here.
                let limit = self.shared.settings.save_every;
                if self.slots.get(&name).is_some_and(|slot| slot.unsaved.len() >= limit) {
                    self.save_robot(&name);
                }
                if !is_draining {
                    self.begin(&name);
                }
            }
            Done::Kept { robot, event, behind, revision } => {
                let revision = revision.map_err(|_| End::Fenced)?;
                self.snapshots = self.snapshots.max(revision);
                metrics::counter!("metaplan_fleet_snapshots_total").increment(1);
                if let Some(slot) = self.slots.get_mut(&robot) {
                    slot.is_saving = false;
                    slot.is_apart = behind;
                    slot.revision = revision;
                    while slot.unsaved.front().is_some_and(|(first, _)| *first <= event) {
                        slot.unsaved.pop_front();
                    }
                    slot.since = (!slot.unsaved.is_empty()).then(Instant::now);
                }
            }
            Done::Removed { robot, outcome } => {
                outcome.map_err(|_| End::Fenced)?;
                if let Some(slot) = self.slots.get_mut(&robot) {
                    (slot.is_saving, slot.revision) = (false, 0);
                }
                self.forget();
            }
            Done::Refilled { robot, events } => {
                self.refilled(&robot, events.map_err(|_| End::Fenced)?);
                if !is_draining {
                    self.begin(&robot);
                }
            }
            Done::Progressed { progress, revision } => {
                self.is_progressing = false;
                self.revision = revision.map_err(|_| End::Fenced)?;
                self.progress = progress;
            }
        }
        Ok(())
    }

    fn taken(
        &mut self,
        name: &str,
        own: Box<Robot>,
        event: &Stored,
        outcome: Outcome,
        search: Option<Duration>,
    ) -> Result<(), End> {
        self.waiting -= 1;
        self.shared.counts.waiting.fetch_sub(1, Ordering::Relaxed);
        self.clock += 1;
        let clock = self.clock;
        let warm = own.is_warm();
        let Some(slot) = self.slots.get_mut(name) else { return Ok(()) };
        slot.robot = Some(own);
        slot.search = search;
        let at = slot.at.take();
        match (slot.used > 0, warm) {
            (false, true) => drop(self.shared.counts.warm.fetch_add(1, Ordering::Relaxed)),
            (true, false) => drop(self.shared.counts.warm.fetch_sub(1, Ordering::Relaxed)),
            _ => {}
        }
        slot.used = if warm { clock } else { 0 };
        match outcome {
            Outcome::Decided(decision) => {
                if slot.suspended.take().is_some() {
                    // The robot is retired: its former state is not needed.
                    slot.unsaved.clear();
                }
                slot.chain = Some(slot.chain.unwrap_or_default().max(decision));
                slot.unsaved.push_back((event.sequence, decision));
                slot.since.get_or_insert_with(Instant::now);
                self.seen.1 = self.seen.1.max(decision);
                self.shared.counts.decided.fetch_add(1, Ordering::Relaxed);
            }
            Outcome::Refused(refused) => self.say(event, refused),
            Outcome::Faulted(why) => {
                // The next owner replays the decision of a former owner about this event, and all later ones.
                let last_decision = at.map_or(self.recovered, |(_, last_decision)| last_decision);
                self.fault(name, event.sequence, last_decision + 1, &why);
            }
            Outcome::Fenced => return Err(End::Fenced),
        }
        if warm {
            self.recent.push_back((clock, name.to_owned()));
            self.cool();
        }
        Ok(())
    }

    /// Unloads idle robots of this partition, the least recently used ones first, while the worker
    /// has more loaded robots than its limit.
    fn cool(&mut self) {
        let counts = &self.shared.counts;
        while counts.warm.load(Ordering::Relaxed) > self.shared.settings.warm as u64 {
            let Some((used, name)) = self.recent.pop_front() else { return };
            let Some(slot) = self.slots.get_mut(&name).filter(|slot| slot.used == used) else { continue };
            let Some(robot) = &mut slot.robot else { continue };
            robot.cool();
            slot.used = 0;
            counts.warm.fetch_sub(1, Ordering::Relaxed);
        }
    }

    /// Counts a refused event, and publishes the reason as a notice to the clients of the robot.
    fn say(&self, event: &Stored, refused: Refused) {
        self.refuse(Some((event.subject.clone(), refused.sentence().to_owned())), refused.name());
    }

    pub(super) fn refuse(&self, notice: Option<(String, String)>, reason: &'static str) {
        self.shared.counts.refused.fetch_add(1, Ordering::Relaxed);
        metrics::counter!("metaplan_fleet_refused_total", "reason" => reason).increment(1);
        if let Some((subject, text)) = notice {
            let shared = Arc::clone(&self.shared);
            tokio::spawn(async move { shared.store.notice(&subject, &text).await });
        }
    }

    /// Suspends a robot, so that it handles no event until one retires it, and publishes the reason `why`.
    /// `event` and `decision` are the sequence numbers of the event that failed and of the decision that
    /// would have followed it. The events of the robot are read again by the next owner of the partition.
    pub(super) fn fault(&mut self, robot: &str, event: u64, decision: u64, why: &str) {
        metrics::counter!("metaplan_fleet_faulted_total").increment(1);
        tracing::error!(partition = self.number, robot, "robot suspended: {why}");
        let subject = Address { partition: self.number, robot: robot.to_owned() }.to_string();
        let slot = self.slot(robot);
        slot.suspended = Some(slot.unsaved.front().copied().unwrap_or((event, decision)));
        slot.unsaved.clear();
        let text = format!("the robot is suspended: {why}");
        self.refuse(Some((subject, text)), "faulted");
    }
}

impl<S> Drop for Partition<S> {
    fn drop(&mut self) {
        let counts = &self.shared.counts;
        let warm = self.slots.values().filter(|slot| slot.used > 0).count();
        counts.warm.fetch_sub(warm as u64, Ordering::Relaxed);
        counts.robots.fetch_sub(self.slots.len() as u64, Ordering::Relaxed);
        counts.waiting.fetch_sub(self.waiting as u64, Ordering::Relaxed);
        counts.partitions.fetch_sub(1, Ordering::Relaxed);
    }
}

fn enrolment(payload: &[u8]) -> Option<String> {
    #[derive(serde::Deserialize)]
    struct Head {
        event: String,
        #[serde(default)]
        mission: String,
    }
    let head: Head = serde_json::from_slice(payload).ok()?;
    (head.event == "enrol").then_some(head.mission)
}

async fn next(
    events: &mut Option<BoxStream<'static, Result<Stored, Fault>>>,
) -> Option<Result<Stored, Fault>> {
    match events {
        Some(events) => events.next().await,
        None => None,
    }
}
