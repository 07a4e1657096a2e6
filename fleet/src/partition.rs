//! The robots of one partition, by the worker that has its lease.
//!
//! Events are read in their order. Each robot takes one at a time; robots go on side by side. A decision is appended behind the robot's last
//! one, so that of two workers only one can decide an event. From time to time a robot is saved, and the partition's progress says from
//! where on events and decisions must be read again. After a crash between any two of these operations a new owner reads what was saved,
//! lets each robot go through the events since with the plans as they were decided, and goes on with the first event that nobody has decided.

use std::collections::{BTreeMap, VecDeque};
use std::future::Future;
use std::sync::{Arc, Mutex, PoisonError};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use futures::future::BoxFuture;
use futures::stream::{BoxStream, FuturesUnordered, StreamExt as _};
use tokio::sync::{Semaphore, watch};

use crate::missions::Missions;
use crate::robot::{Faulted, Refused, Robot};
use crate::store::{Bucket, Fault, Message, Store, Stored, Stream};
use crate::wire::{Address, Decided, Progress, Saved, partition_of};

/// How partitions are run.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// Loops that work at the same time.
    pub threads: usize,
    /// Robots that are kept ready; others are snapshots in memory, and made ready when they are needed.
    pub warm: usize,
    /// A robot is saved after so many decisions.
    pub save_every: usize,
    /// What is not saved holds up what may be forgotten for so long at most.
    pub save_within: Duration,
    /// So many events of a partition are read ahead.
    pub ahead: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self { threads: 2, warm: 4096, save_every: 64, save_within: Duration::from_secs(30), ahead: 1024 }
    }
}

/// What a worker's partitions share.
#[derive(Debug)]
pub struct Shared<S> {
    /// The log.
    pub store: S,
    /// The missions that are known.
    pub missions: Missions,
    /// The worker's name.
    pub worker: String,
    /// How partitions are run.
    pub settings: Settings,
    /// Counts, over all partitions.
    pub counts: Counts,
    threads: Semaphore,
}

/// What is counted; of what is there now, and of what has happened.
#[derive(Debug, Default)]
pub struct Counts {
    /// Robots, and those that are kept ready.
    pub robots: AtomicU64,
    /// Robots that are kept ready.
    pub warm: AtomicU64,
    /// Events that are read and not decided.
    pub waiting: AtomicU64,
    /// Partitions that are held.
    pub partitions: AtomicU64,
    /// Events decided.
    pub decided: AtomicU64,
    /// Events refused.
    pub refused: AtomicU64,
    /// Microseconds that loops have worked.
    pub busy: AtomicU64,
    /// Partition to the event up to which all are decided or refused.
    pub reached: Mutex<BTreeMap<u32, u64>>,
}

impl<S> Shared<S> {
    /// Nothing has happened yet.
    pub fn new(store: S, missions: Missions, worker: String, settings: Settings) -> Self {
        let threads = Semaphore::new(settings.threads.max(1));
        Self { store, missions, worker, settings, counts: Counts::default(), threads }
    }
}

/// What a partition is to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Go on.
    Go,
    /// Decide what was begun, save everything and end.
    Drain,
    /// End at once: somebody else has the lease.
    Abandon,
}

/// How a partition has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// As ordered.
    Ordered,
    /// Somebody else has written what only an owner writes.
    Fenced,
}

/// Runs a partition until it is ordered to end, or somebody else owns it.
pub async fn serve<S: Store>(shared: Arc<Shared<S>>, partition: u32, orders: watch::Receiver<Order>) -> End {
    let mut abandoned = orders.clone();
    let work = async {
        match Partition::recover(&shared, partition).await {
            Ok(own) => own.run(orders).await,
            Err(end) => end,
        }
    };
    let is_abandoned = async move {
        loop {
            if *abandoned.borrow_and_update() == Order::Abandon || abandoned.changed().await.is_err() {
                return;
            }
        }
    };
    tokio::select! {
        end = work => end,
        () = is_abandoned => End::Ordered,
    }
}

/// A robot, what waits for it, and what of it is not saved.
#[derive(Default)]
struct Slot {
    /// None while it is at work.
    robot: Option<Box<Robot>>,
    /// The event that it is at, and the last decision that was known when it began.
    at: Option<(u64, u64)>,
    waiting: VecDeque<Stored>,
    /// Its last decision.
    chain: u64,
    /// Decisions of former owners that it has not gone through.
    before: VecDeque<(u64, Decided)>,
    /// Events and decisions since it was saved.
    unsaved: VecDeque<(u64, u64)>,
    since: Option<Instant>,
    /// The revision of what was saved.
    revision: u64,
    is_saving: bool,
    /// Why it cannot go on, if it cannot.
    faulted: bool,
    used: u64,
}

/// What was done beside.
enum Done {
    /// An event was taken.
    Taken { robot: String, own: Box<Robot>, event: Stored, outcome: Outcome },
    /// A robot was saved, up to an event, as a revision.
    Kept { robot: String, event: u64, revision: Result<u64, Fault> },
    /// The progress was written.
    Progressed { progress: Progress, revision: Result<u64, Fault> },
}

enum Outcome {
    /// As the decision of that sequence says.
    Decided(u64),
    Refused(Refused),
    Faulted(String),
    Fenced,
}

struct Partition<S> {
    shared: Arc<Shared<S>>,
    number: u32,
    progress: Progress,
    revision: u64,
    slots: BTreeMap<String, Slot>,
    /// The last event that was read, and the last decision that is known.
    seen: (u64, u64),
    /// The revision of the last snapshot.
    snapshots: u64,
    jobs: FuturesUnordered<BoxFuture<'static, Done>>,
    /// Events that are read and not decided.
    waiting: usize,
    is_progressing: bool,
    clock: u64,
    recent: VecDeque<(u64, String)>,
}

/// So often it is looked whether something is to be saved.
const LOOK: Duration = Duration::from_millis(500);

impl<S: Store> Partition<S> {
    /// Takes over what former owners have left.
    async fn recover(shared: &Arc<Shared<S>>, number: u32) -> Result<Self, End> {
        let key = number.to_string();
        let store = &shared.store;
        let (progress, revision) = loop {
            let known = persist(|| store.get(Bucket::Progress, &key)).await.map_err(|_| End::Fenced)?;
            let (mut progress, revision) = match known {
                Some(entry) => (serde_json::from_slice(&entry.value).unwrap_or_default(), entry.revision),
                None => (Progress::default(), 0),
            };
            progress.epoch += 1;
            let value = bytes(&progress);
            match persist(|| store.put(Bucket::Progress, &key, &value, revision)).await {
                Ok(revision) => break (progress, revision),
                // It was written by somebody else, or by ourselves without our knowing.
                Err(_) => pause(1).await,
            }
        };
        let saved = persist(|| store.list(Bucket::Robots, Some(number), progress.snapshots));
        let saved = saved.await.map_err(|_| End::Fenced)?;
        let history = persist(|| store.history(Stream::Decisions, number, progress.decisions));
        let history = history.await.map_err(|_| End::Fenced)?;
        shared.counts.partitions.fetch_add(1, Ordering::Relaxed);
        let mut own = Self {
            shared: Arc::clone(shared),
            number,
            seen: (progress.events, progress.decisions),
            snapshots: progress.snapshots,
            progress,
            revision,
            slots: BTreeMap::new(),
            jobs: FuturesUnordered::new(),
            waiting: 0,
            is_progressing: false,
            clock: 0,
            recent: VecDeque::new(),
        };
        for entry in saved {
            own.snapshots = own.snapshots.max(entry.revision);
            own.take_saved(&entry.key, &entry.value, entry.revision);
        }
        for message in history {
            own.seen.1 = own.seen.1.max(message.sequence);
            let Some(address) = Address::parse(&message.subject) else { continue };
            let slot = own.slot(&address.robot);
            if slot.chain >= message.sequence {
                continue;
            }
            // Whatever stands there, the next decision stands behind it.
            slot.chain = message.sequence;
            match Decided::parse(&message.payload) {
                Some(decided) => slot.before.push_back((message.sequence, decided)),
                None => own.refuse(None, "not_a_decision"),
            }
        }
        Ok(own)
    }

    fn take_saved(&mut self, key: &str, value: &[u8], revision: u64) {
        let (Some(address), Ok(saved)) = (Address::parse(key), serde_json::from_slice::<Saved>(value)) else {
            self.refuse(None, "not_a_snapshot");
            return;
        };
        let restored = Robot::restore(&saved, &self.shared.missions);
        let slot = self.slot(&address.robot);
        (slot.chain, slot.revision) = (saved.decision, revision);
        match restored {
            Ok(robot) => slot.robot = Some(Box::new(robot)),
            Err(Faulted(why)) => {
                slot.robot = Some(Box::default());
                self.fault(&address.robot, saved.event + 1, saved.decision + 1, &why);
            }
        }
    }

    fn slot(&mut self, robot: &str) -> &mut Slot {
        if !self.slots.contains_key(robot) {
            self.shared.counts.robots.fetch_add(1, Ordering::Relaxed);
            let slot = Slot { robot: Some(Box::default()), ..Slot::default() };
            self.slots.insert(robot.to_owned(), slot);
        }
        self.slots.get_mut(robot).expect("it is there now")
    }

    async fn run(mut self, mut orders: watch::Receiver<Order>) -> End {
        let (mut backoff, mut reached) = (0, 0);
        let mut events: Option<BoxStream<'static, Result<Stored, Fault>>> = None;
        let mut look = tokio::time::interval(LOOK);
        look.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            if self.waiting == 0 && reached != self.seen.0 {
                reached = self.seen.0;
                let mut all = self.shared.counts.reached.lock().unwrap_or_else(PoisonError::into_inner);
                all.insert(self.number, reached);
            }
            let order = *orders.borrow_and_update();
            let is_draining = order == Order::Drain;
            if is_draining && self.jobs.is_empty() && !self.save(true) && !self.advance(true) {
                return End::Ordered;
            }
            if events.is_none() && !is_draining {
                match self.shared.store.follow(Stream::Events, self.number, self.seen.0).await {
                    Ok(stream) => events = Some(stream),
                    Err(_) => {
                        backoff += 1;
                        pause(backoff).await;
                    }
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
                message = next(&mut events), if may_read && events.is_some() => match message {
                    Some(Ok(event)) => {
                        backoff = 0;
                        self.read(event);
                    }
                    Some(Err(_)) | None => {
                        events = None;
                        backoff += 1;
                        pause(backoff).await;
                    }
                },
            }
        }
    }

    /// Takes the next event of the stream.
    fn read(&mut self, event: Stored) {
        if event.sequence <= self.seen.0 {
            return;
        }
        self.seen.0 = event.sequence;
        let Some(address) = Address::parse(&event.subject) else {
            self.refuse(None, "wrong_subject");
            return;
        };
        let forged = event.id.as_ref().is_some_and(|id| {
            id.split_once(':').is_none_or(|(robot, _)| robot != address.robot)
        });
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
            // Names that nobody can enrol take no memory.
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
        if slot.robot.as_ref().is_some_and(|own| event.sequence <= own.event) {
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

    /// Lets a robot take the next event that waits for it, if it is not at work.
    fn begin(&mut self, name: &str) {
        let known = self.seen.1;
        let Some(slot) = self.slots.get_mut(name) else { return };
        if slot.robot.is_none() || slot.faulted {
            return;
        }
        let Some(event) = slot.waiting.pop_front() else { return };
        let Some(robot) = slot.robot.take() else { return };
        slot.at = Some((event.sequence, known));
        while slot.before.front().is_some_and(|(_, decided)| decided.event < event.sequence) {
            slot.before.pop_front();
        }
        let before = slot.before.pop_front_if(|(_, decided)| decided.event == event.sequence);
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
                // Under load a robot is always at work: its turn to be saved is between two events.
                if self.slots.get(&name).is_some_and(|slot| slot.unsaved.len() >= self.shared.settings.save_every) {
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

    /// Begins to save robots whose turn it is, or all; whether there are such.
    fn save(&mut self, all: bool) -> bool {
        let within = self.shared.settings.save_within;
        let is_due = |slot: &Slot| all || slot.since.is_some_and(|since| since.elapsed() >= within);
        let due = self.slots.iter().filter(|(_, slot)| is_due(slot)).map(|(name, _)| name.clone());
        let due: Vec<String> = due.collect();
        // Each of them, not up to the first.
        due.iter().fold(false, |any, name| self.save_robot(name) || any)
    }

    /// Begins to save a robot, if that can be done and is worth it.
    fn save_robot(&mut self, name: &str) -> bool {
        let Some(slot) = self.slots.get_mut(name) else { return false };
        let (Some(robot), Some(last)) = (&slot.robot, slot.unsaved.back()) else { return false };
        if slot.is_saving || slot.faulted {
            return false;
        }
        let saved = robot.save(&self.shared.missions, last.1);
        slot.is_saving = true;
        let (shared, name, revision) = (Arc::clone(&self.shared), name.to_owned(), slot.revision);
        let key = Address { partition: self.number, robot: name.clone() }.to_string();
        self.jobs.push(Box::pin(async move {
            let revision = write(&shared.store, Bucket::Robots, &key, &bytes(&saved), revision).await;
            Done::Kept { robot: name, event: saved.event, revision }
        }));
        true
    }

    /// Begins to write how far the partition has come, if it has come further; whether it has.
    fn advance(&mut self, must: bool) -> bool {
        if self.is_progressing {
            return true;
        }
        let mut next = Progress {
            epoch: self.progress.epoch,
            events: self.seen.0,
            decisions: self.seen.1,
            snapshots: self.snapshots,
        };
        for slot in self.slots.values() {
            let waits = slot.waiting.front().map(|event| event.sequence);
            let first = slot.unsaved.front();
            let events = [waits, slot.at.map(|at| at.0), first.map(|first| first.0)];
            for event in events.into_iter().flatten() {
                next.events = next.events.min(event - 1);
            }
            let before = slot.before.front().map(|(decision, _)| decision - 1);
            for decision in [first.map(|first| first.1 - 1), slot.at.map(|at| at.1), before].into_iter().flatten() {
                next.decisions = next.decisions.min(decision);
            }
        }
        // What former owners have decided is needed until its events were read again.
        next.events = next.events.max(self.progress.events);
        next.decisions = next.decisions.max(self.progress.decisions);
        let worth = if must { 1 } else { 64 };
        if next.events < self.progress.events + worth && next.decisions < self.progress.decisions + worth {
            return false;
        }
        self.is_progressing = true;
        let (shared, key, revision) = (Arc::clone(&self.shared), self.number.to_string(), self.revision);
        self.jobs.push(Box::pin(async move {
            let revision = write(&shared.store, Bucket::Progress, &key, &bytes(&next), revision).await;
            Done::Progressed { progress: next, revision }
        }));
        true
    }

    /// Keeps no more robots ready than there is room for.
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

    /// Tells of an event that changes nothing.
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

    /// A robot cannot go on. Its events stay where they are, for a worker that can.
    fn fault(&mut self, robot: &str, event: u64, decision: u64, why: &str) {
        metrics::counter!("metaplan_fleet_faulted_total").increment(1);
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

/// What one event of one robot takes.
struct Task<S> {
    shared: Arc<Shared<S>>,
    name: String,
    epoch: u64,
    chain: u64,
    before: Option<(u64, Decided)>,
    /// A former owner has decided later events and not this one.
    was_refused: bool,
}

impl<S: Store> Task<S> {
    async fn run(self, robot: Box<Robot>, event: Stored) -> Done {
        let Ok(permit) = self.shared.threads.acquire().await else {
            return Done::Taken { robot: self.name, own: robot, event, outcome: Outcome::Fenced };
        };
        let shared = Arc::clone(&self.shared);
        let before = self.before.as_ref().map(|(_, decided)| decided.clone());
        let work = tokio::task::spawn_blocking(move || {
            let (mut robot, begun) = (robot, Instant::now());
            let decided = robot.decide(&event, &shared.missions, before.as_ref());
            let micros = u64::try_from(begun.elapsed().as_micros()).unwrap_or(u64::MAX);
            shared.counts.busy.fetch_add(micros, Ordering::Relaxed);
            metrics::histogram!("metaplan_fleet_decision_seconds").record(begun.elapsed());
            (robot, event, decided)
        });
        let (own, event, decided) = match work.await {
            Ok(done) => done,
            // A loop that panics takes its robot with it; whoever recovers the partition begins with what was saved.
            Err(_) => {
                let event = Stored { sequence: 0, subject: String::new(), id: None, time: 0, payload: Vec::new() };
                return Done::Taken { robot: self.name, own: Box::default(), event, outcome: Outcome::Fenced };
            }
        };
        drop(permit);
        let outcome = match decided {
            Err(Faulted(why)) => Outcome::Faulted(why),
            Ok(Err(refused)) => Outcome::Refused(refused),
            Ok(Ok(_)) if self.was_refused => {
                Outcome::Faulted(format!("event {} was refused by a former owner, and would not be now", event.sequence))
            }
            Ok(Ok(mut decided)) => match &self.before {
                Some((sequence, _)) => Outcome::Decided(*sequence),
                None => {
                    (decided.worker, decided.epoch) = (self.shared.worker.clone(), self.epoch);
                    self.publish(&event, &decided).await
                }
            },
        };
        Done::Taken { robot: self.name, own, event, outcome }
    }

    /// Appends a decision behind the last one.
    async fn publish(&self, event: &Stored, decided: &Decided) -> Outcome {
        let (store, payload) = (&self.shared.store, bytes(decided));
        let id = format!("{}:{}:{}:{}", self.name, event.sequence, self.epoch, self.shared.worker);
        let message = Message { subject: &event.subject, id: &id, after: Some(self.chain), payload: &payload };
        for attempt in 1.. {
            match store.append(Stream::Decisions, message).await {
                Ok(receipt) => {
                    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
                    let late = now.saturating_sub(Duration::from_micros(event.time));
                    metrics::histogram!("metaplan_fleet_latency_seconds").record(late);
                    return Outcome::Decided(receipt.sequence);
                }
                Err(Fault::Conflict) => match store.last(Stream::Decisions, &event.subject).await {
                    Ok(Some(last)) if last.id.as_deref() == Some(&id) => return Outcome::Decided(last.sequence),
                    Ok(last) if last.as_ref().map_or(0, |last| last.sequence) != self.chain => {
                        return Outcome::Fenced;
                    }
                    // What was sent before may still be on its way.
                    _ => {}
                },
                Err(Fault::TooLong(length)) => {
                    return Outcome::Faulted(format!("a decision of {length} bytes is longer than the server takes"));
                }
                Err(Fault::Unreachable(_)) => {}
            }
            metrics::counter!("metaplan_fleet_retries_total").increment(1);
            pause(attempt).await;
        }
        Outcome::Fenced
    }
}

/// The mission that a message asks for, if it asks for an enrolment.
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

async fn next(events: &mut Option<BoxStream<'static, Result<Stored, Fault>>>) -> Option<Result<Stored, Fault>> {
    match events {
        Some(events) => events.next().await,
        None => None,
    }
}

fn bytes(value: &impl serde::Serialize) -> Vec<u8> {
    serde_json::to_vec(value).unwrap_or_default()
}

/// Writes a value behind a revision, until it is there or somebody else has written another one.
async fn write<S: Store>(
    store: &S,
    bucket: Bucket,
    key: &str,
    value: &[u8],
    after: u64,
) -> Result<u64, Fault> {
    for attempt in 1.. {
        match store.put(bucket, key, value, after).await {
            Ok(revision) => return Ok(revision),
            Err(Fault::Unreachable(_)) => {}
            Err(fault) => match store.get(bucket, key).await {
                Ok(Some(entry)) if entry.value == value => return Ok(entry.revision),
                Ok(entry) if entry.as_ref().map_or(0, |entry| entry.revision) > after => return Err(fault),
                _ => {}
            },
        }
        pause(attempt).await;
    }
    Err(Fault::Conflict)
}

/// Asks until there is an answer.
async fn persist<T, F: Future<Output = Result<T, Fault>>>(ask: impl Fn() -> F) -> Result<T, Fault> {
    for attempt in 1.. {
        match ask().await {
            Err(Fault::Unreachable(_)) => pause(attempt).await,
            other => return other,
        }
    }
    Err(Fault::Conflict)
}

/// Waits before another attempt: up to 10 ms, and up to twice as long each time, 5 s at most; a random part of that, so that not all come
/// back at once.
pub(crate) async fn pause(attempt: u32) {
    let most = 5_000.min(10_u64 << attempt.min(10));
    tokio::time::sleep(Duration::from_millis(fastrand::u64(1..=most))).await;
}
