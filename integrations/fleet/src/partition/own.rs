//! Execution of a partition: reads events, refuses invalid ones, runs the loops of robots, unloads
//! robots that were not used recently, and starts checkpoints.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::time::Instant;

use futures::future::BoxFuture;
use futures::stream::{BoxStream, FuturesUnordered, StreamExt as _};
use tokio::sync::watch;

use super::asking::pause;
use super::slot::{Done, Outcome, Slot};
use super::task::Task;
use super::{End, Order, Shared};
use crate::robot::Refused;
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
    pub(super) jobs: FuturesUnordered<BoxFuture<'static, Done>>,
    pub(super) waiting: usize,
    pub(super) is_progressing: bool,
    pub(super) clock: u64,
    pub(super) recent: VecDeque<(u64, String)>,
}

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
        let mut look = tokio::time::interval(self.shared.settings.look);
        look.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            if self.waiting == 0 && reached != self.seen.0 {
                reached = self.seen.0;
                let mut positions = self.shared.counts.reached.lock().unwrap_or_else(PoisonError::into_inner);
                positions.insert(self.number, reached);
            }
            let order = *orders.borrow_and_update();
            let is_draining = order == Order::Drain;
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
            let may_read = self.waiting < self.shared.settings.ahead && !is_draining;
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
                }
                message = next(&mut events), if may_read && events.is_some() => {
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
    /// read before, events that the robot's snapshot contains, and events of stopped robots.
    fn read(&mut self, event: Stored) {
        if event.sequence <= self.seen.0 {
            return;
        }
        self.seen.0 = event.sequence;
        let Some(address) = Address::parse(&event.subject) else {
            self.refuse(None, "wrong_subject");
            return;
        };
        let forged = event
            .id
            .as_ref()
            .is_some_and(|id| id.split_once(':').is_none_or(|(robot, _)| robot != address.robot));
        let refused = if partition_of(&address.robot, self.shared.store.partitions()) != self.number {
            Some(Refused::Misplaced)
        } else if forged {
            Some(Refused::Forged)
        } else {
            None
        };
        if let Some(refused) = refused {
            self.say(&event, refused);
            return;
        }
        let has_slot = self.slots.contains_key(&address.robot);
        if !has_slot {
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
        let slot = self.slot(&address.robot);
        if slot.robot.as_ref().is_some_and(|robot| event.sequence <= robot.event) {
            return;
        }
        if slot.faulted {
            return;
        }
        slot.waiting.push_back(event);
        self.waiting += 1;
        self.shared.counts.waiting.fetch_add(1, Ordering::Relaxed);
        self.begin(&address.robot);
    }

    /// Starts to handle the next queued event of a robot, if the robot is idle.
    fn begin(&mut self, name: &str) {
        let last_decision = self.seen.1;
        let Some(slot) = self.slots.get_mut(name) else { return };
        if slot.robot.is_none() || slot.faulted {
            return;
        }
        let Some(event) = slot.waiting.pop_front() else { return };
        let Some(robot) = slot.robot.take() else { return };
        while slot.before.front().is_some_and(|(_, decided)| decided.event < event.sequence) {
            slot.before.pop_front();
        }
        let is_next = slot.before.front().is_some_and(|(_, decided)| decided.event == event.sequence);
        let before = if is_next { slot.before.pop_front() } else { None };
        // The position of a replayed decision must not be passed by the progress until the decision
        // is listed as unsaved.
        let last_decision =
            before.as_ref().map_or(last_decision, |(decision, _)| last_decision.min(decision - 1));
        slot.at = Some((event.sequence, last_decision));
        let task = Task {
            shared: Arc::clone(&self.shared),
            name: name.to_owned(),
            epoch: self.progress.epoch,
            chain: slot.chain,
            was_refused: before.is_none() && !slot.before.is_empty(),
            before,
        };
        self.jobs.push(Box::pin(task.run(robot, event)));
    }

    fn done(&mut self, done: Done, is_draining: bool) -> Result<(), End> {
        match done {
            Done::Taken { robot: name, own, event, outcome } => {
                self.waiting -= 1;
                self.shared.counts.waiting.fetch_sub(1, Ordering::Relaxed);
                self.clock += 1;
                let clock = self.clock;
                let warm = own.is_warm();
                let Some(slot) = self.slots.get_mut(&name) else { return Ok(()) };
                slot.robot = Some(own);
                slot.at = None;
                match (slot.used > 0, warm) {
                    (false, true) => drop(self.shared.counts.warm.fetch_add(1, Ordering::Relaxed)),
                    (true, false) => drop(self.shared.counts.warm.fetch_sub(1, Ordering::Relaxed)),
                    _ => {}
                }
                slot.used = if warm { clock } else { 0 };
                match outcome {
                    Outcome::Decided(decision) => {
                        slot.chain = slot.chain.max(decision);
                        slot.unsaved.push_back((event.sequence, decision));
                        slot.since.get_or_insert_with(Instant::now);
                        self.seen.1 = self.seen.1.max(decision);
                        self.shared.counts.decided.fetch_add(1, Ordering::Relaxed);
                    }
                    Outcome::Refused(refused) => self.say(&event, refused),
                    Outcome::Faulted(why) => {
                        let decision = slot.chain + 1;
                        self.fault(&name, event.sequence, decision, &why);
                    }
                    Outcome::Fenced => return Err(End::Fenced),
                }
                if warm {
                    self.recent.push_back((clock, name.clone()));
                    self.cool();
                }
                // A busy robot is never idle between events, so it is saved between two events
                // here.
                if self
                    .slots
                    .get(&name)
                    .is_some_and(|slot| slot.unsaved.len() >= self.shared.settings.save_every)
                {
                    self.save_robot(&name);
                }
                if !is_draining {
                    self.begin(&name);
                }
            }
            Done::Kept { robot, event, revision } => {
                let revision = revision.map_err(|_| End::Fenced)?;
                self.snapshots = self.snapshots.max(revision);
                metrics::counter!("metaplan_fleet_snapshots_total").increment(1);
                if let Some(slot) = self.slots.get_mut(&robot) {
                    slot.is_saving = false;
                    slot.revision = revision;
                    while slot.unsaved.front().is_some_and(|(first, _)| *first <= event) {
                        slot.unsaved.pop_front();
                    }
                    slot.since = (!slot.unsaved.is_empty()).then(Instant::now);
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

    /// Unloads the least recently used idle robots of this partition until the number of loaded robots
    /// of the worker is within the limit, or until the partition has no further idle robot.
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

    /// Marks a robot as faulted, so that it handles no events, and publishes the reason `why`. `event`
    /// and `decision` are the sequence numbers of the event that failed and of the decision that would
    /// have followed it. The progress stays before them. So the events of the robot are read again by
    /// the next owner of the partition.
    pub(super) fn fault(&mut self, robot: &str, event: u64, decision: u64, why: &str) {
        metrics::counter!("metaplan_fleet_faulted_total").increment(1);
        tracing::error!(partition = self.number, robot, "does not go on: {why}");
        let subject = Address { partition: self.number, robot: robot.to_owned() }.to_string();
        let slot = self.slot(robot);
        slot.faulted = true;
        if slot.unsaved.is_empty() {
            slot.unsaved.push_back((event, decision));
        }
        let dropped = slot.waiting.len();
        slot.waiting.clear();
        self.waiting -= dropped;
        self.shared.counts.waiting.fetch_sub(dropped as u64, Ordering::Relaxed);
        let text = format!("the robot does not go on: {why}");
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
