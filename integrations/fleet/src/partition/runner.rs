//! A robot in memory: handles its events one after the other, each on the robot's state after its last decision, and
//! searches for plans in the meantime. A decision is appended if the robot's last decision is still the expected one.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use metaplan::mapek::{ParallelSearch, SearchHandle, Thinker, Thoughts};
use tokio::sync::watch;
use tokio::task::JoinSet;

use super::own::Inbox;
use super::{Shared, pause, persist, warn};
use crate::missions::Missions;
use crate::robot::{Begun, Refused, Robot, Undecided, is_retirement};
use crate::store::{Fault, Message, Store, Stored, Stream};
use crate::wire::{Address, Decided};

/// Time without an event or a plan after which a robot is removed from memory.
const MAX_IDLE: Duration = Duration::from_secs(600);

/// Reason for a suspension: work on the robot has panicked.
const PANICKED: &str = "its loop has panicked";

pub(super) struct Count(Arc<AtomicU64>);

impl Count {
    pub(super) fn new(counter: &Arc<AtomicU64>) -> Self {
        counter.fetch_add(1, Ordering::Relaxed);
        Self(Arc::clone(counter))
    }
}

impl Drop for Count {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// State of a robot after its last decision, which has the sequence number `chain`; 0 without a decision.
struct Loaded {
    robot: Box<Robot>,
    chain: u64,
    /// Counts the loaded robots of the worker.
    _count: Count,
}

enum Outcome {
    Decided,
    /// Nothing was decided: the event had been decided before, or there was no event.
    Known,
    Undecided(Undecided),
    /// Another decision is the last one, or the plans of a search cannot be used.
    Outdated,
}

impl From<Undecided> for Outcome {
    fn from(undecided: Undecided) -> Self {
        Self::Undecided(undecided)
    }
}

fn panicked() -> Outcome {
    Outcome::Undecided(Undecided::Faulted(PANICKED.to_owned()))
}

/// The plans of a search and the new estimate of the duration of a search. `None` if the search has panicked.
type Plans = Option<(Thoughts, Duration)>;

/// A search for a plan that continues after the decision.
struct Planning {
    search: SearchHandle,
    plans: JoinSet<Plans>,
}

pub(super) struct Runner<S> {
    shared: Arc<Shared<S>>,
    pub(super) address: Address,
    subject: String,
    pub(super) inbox: Arc<Inbox>,
    loaded: Option<Loaded>,
    /// Exists if the last decision lacks a plan. Then the last event is not discarded, so that a new owner of the
    /// partition searches for the plan.
    pending: Option<Count>,
    /// `true` if the robot was suspended while a plan was pending. Then the last event is not discarded, either.
    is_kept: bool,
    /// `true` if the robot cannot continue. Its events stay in the log, and only a retirement is handled.
    is_suspended: bool,
    /// The search that continues after the decision, and its plans.
    search: ParallelSearch,
    plans: JoinSet<Plans>,
    /// Estimated duration of the robot's next search, if it has searched before.
    estimate: Option<Duration>,
    /// Sequence number of the last event that was decided or refused.
    handled: u64,
    /// Number of handled events since the last time that events of the robot were discarded, and the time of the
    /// first of them.
    obsolete: usize,
    since: Option<Instant>,
    /// Time of the last event or plan.
    used: Instant,
}

impl<S: Store> Runner<S> {
    pub(super) fn new(shared: Arc<Shared<S>>, address: Address, inbox: Arc<Inbox>) -> Self {
        Self {
            shared,
            subject: address.to_string(),
            address,
            inbox,
            loaded: None,
            pending: None,
            is_kept: false,
            is_suspended: false,
            search: ParallelSearch::default(),
            plans: JoinSet::new(),
            estimate: None,
            handled: 0,
            obsolete: 0,
            since: None,
            used: Instant::now(),
        }
    }

    /// Handles events and searches for plans until nothing of the robot has to be kept in memory, or `drain` becomes
    /// true. Discards handled events when they are due.
    pub(super) async fn run(mut self: Box<Self>, mut drain: watch::Receiver<bool>) -> Box<Self> {
        while !self.is_obsolete() {
            if self.pending.is_some() && self.plans.is_empty() && self.inbox.is_empty() {
                let outcome = self.start_planning().await;
                self.register(None, outcome);
                continue;
            }
            let discard_at = self.since.map(|since| since + self.shared.settings.discard_within);
            let unload_at = self.unload_at();
            let decided = self.loaded.as_ref().map_or(0, |loaded| loaded.robot.event);
            let Self { inbox, plans, shared, subject, .. } = &mut *self;
            tokio::select! {
                biased;
                () = drained(&mut drain) => break,
                Some(plans) = join(plans) => self.conclude(plans).await,
                () = until(discard_at) => {}
                event = inbox.next(&shared.store, subject, decided) => if let Some(event) = event {
                    self.handle(event).await;
                },
                () = until(unload_at) => self.loaded = None,
            }
            let is_unknown = self.loaded.as_ref().is_some_and(|loaded| loaded.robot.mission().is_none());
            let is_due =
                self.since.is_some_and(|since| since.elapsed() >= self.shared.settings.discard_within);
            let is_idle = self.is_idle();
            if is_due
                || self.obsolete >= self.shared.settings.discard_every
                || is_idle && is_unknown && self.obsolete > 0
            {
                self.discard().await;
            }
            // The last decision contains the state.
            if is_idle && (is_unknown || self.shared.has_too_many_robots()) {
                self.loaded = None;
            }
        }
        if *drain.borrow() {
            // The next owner plans.
            self.search.interrupt();
            self.plans = JoinSet::new();
            if self.obsolete > 0 {
                self.discard().await;
            }
        }
        self
    }

    fn is_idle(&self) -> bool {
        self.inbox.is_empty() && self.pending.is_none() && self.plans.is_empty()
    }

    /// Returns the time at which the robot is removed from memory. A robot with a missing plan stays, because plans for a
    /// loop that was removed cannot be used.
    fn unload_at(&self) -> Option<Instant> {
        self.loaded.as_ref().filter(|_| self.is_idle()).map(|_| self.used + MAX_IDLE)
    }

    /// Returns `true` if nothing has to be kept in memory.
    fn is_obsolete(&self) -> bool {
        self.is_idle() && self.loaded.is_none() && self.obsolete == 0 && !self.is_suspended
    }

    async fn handle(&mut self, event: Stored) {
        // A suspended robot can only be retired.
        if !self.is_suspended || is_retirement(&event.payload) {
            let outcome = self.decide(&event).await;
            self.register(Some(event.sequence), outcome);
        }
        self.used = Instant::now();
        self.inbox.finish();
    }

    /// Handles an event until it is decided by this worker or another one, refused, or the robot cannot continue.
    async fn decide(&mut self, event: &Stored) -> Outcome {
        let mut is_cached = self.loaded.is_some();
        // Loaded also for an event that is refused: afterwards, `register` checks if a plan is pending.
        self.load().await;
        let id = event.id.as_ref();
        if id.is_some_and(|id| id.split_once(':').is_none_or(|(robot, _)| robot != self.address.robot)) {
            return Undecided::from(Refused::ForgedId).into();
        }
        for attempt in 1.. {
            if event.sequence <= self.load().await.robot.event {
                return Outcome::Known;
            }
            let begun = Instant::now();
            let decision = self.decision(event).await;
            metrics::histogram!("metaplan_fleet_decision_seconds").record(begun.elapsed());
            let (outcome, planning) = match decision {
                Ok((decided, planning)) => {
                    if decided.migrated {
                        // A search for the former version of the mission has no use.
                        self.search.update(None);
                    }
                    (self.publish(decided, Some(event.time)).await, planning)
                }
                Err(outcome) => (outcome, None),
            };
            // The log compares the chain only with decisions. A refusal by an outdated state would discard the event.
            let is_refused = matches!(outcome, Outcome::Undecided(Undecided::Refused(_)));
            if is_refused && is_cached && !self.is_last().await {
                self.loaded = None;
            } else if !matches!(outcome, Outcome::Outdated) {
                self.follow(planning);
                return outcome;
            }
            // Another worker has decided, or an unacknowledged attempt has succeeded. The robot is loaded again to find
            // out.
            is_cached = false;
            pause(attempt).await;
        }
        Outcome::Known
    }

    /// Returns `true` if the robot's last decision is the loaded one.
    async fn is_last(&mut self) -> bool {
        let last = persist(|| self.shared.store.last(Stream::Decisions, &self.subject)).await;
        last.map_or(0, |last| last.sequence) == self.load().await.chain
    }

    /// Returns the decision about an event, and the search that continues if the decision lacks a plan.
    async fn decision(&mut self, event: &Stored) -> Result<(Decided, Option<Planning>), Outcome> {
        let (event, may_search) = (event.clone(), self.plans.is_empty());
        let begin = move |robot: &mut Robot, missions: &Missions| {
            let begun = robot.begin(&event, missions);
            let thinker = match &begun {
                Ok(Begun::Search(_)) if may_search => robot.thinker(missions).ok().flatten(),
                _ => None,
            };
            (begun, thinker)
        };
        let (begun, thinker) = self.with_robot(begin).await?;
        let search = match begun? {
            Begun::Decided(decided) => return Ok((decided, None)),
            Begun::Search(search) => search,
        };
        let mut planning = thinker.map(|thinker| self.planning(thinker));
        let mut thoughts = None;
        let patience = self.shared.settings.patience;
        if let Some(Planning { plans, .. }) = &mut planning
            // `timeout` with zero would accept the result of a search that ends within its first millisecond.
            && !patience.is_zero()
            && let Ok(Some(plans)) = tokio::time::timeout(patience, join(plans)).await
        {
            let (result, estimate) = plans.ok_or_else(panicked)?;
            (thoughts, self.estimate, planning) = (Some(result), Some(estimate), None);
        }
        let finish = move |robot: &mut Robot, _: &Missions| robot.finish(search, thoughts);
        Ok((self.with_robot(finish).await?, planning))
    }

    /// Starts a search if the last decision lacks a plan.
    async fn start_planning(&mut self) -> Outcome {
        match self.with_robot(Robot::thinker).await {
            Ok(Ok(thinker)) => {
                let planning = thinker.map(|thinker| self.planning(thinker));
                self.follow(planning);
                Outcome::Known
            }
            Ok(Err(undecided)) => undecided.into(),
            Err(outcome) => outcome,
        }
    }

    fn planning(&self, thinker: Thinker) -> Planning {
        let (shared, estimate) = (Arc::clone(&self.shared), self.estimate);
        let mission = self.loaded.as_ref().and_then(|loaded| loaded.robot.mission());
        let mission = mission.unwrap_or_default().to_owned();
        let search = thinker.handle();
        let plans = async move {
            let timing = Arc::clone(&shared);
            let think = move || timing.timed(|| thinker.think());
            shared.threads.search(&mission, estimate, think).await
        };
        // A task of its own, because a search holds a place, which it has to give up also while its robot waits for the log.
        Planning { search, plans: [plans].into_iter().collect() }
    }

    fn follow(&mut self, planning: Option<Planning>) {
        if let Some(Planning { search, plans }) = planning {
            self.search.begin(search);
            self.plans = plans;
        }
    }

    /// Publishes the plans of the search in a decision that completes the decisions without a plan.
    async fn conclude(&mut self, plans: Plans) {
        self.used = Instant::now();
        let is_cancelled = self.search.end();
        let Some((thoughts, estimate)) = plans else { return self.suspend(PANICKED) };
        if is_cancelled || self.loaded.is_none() {
            return;
        }
        self.estimate = Some(estimate);
        let is_late = self.search.accepts_late_plans();
        let conclude = move |robot: &mut Robot, _: &Missions| robot.plan(thoughts, is_late);
        let outcome = match self.with_robot(conclude).await {
            Ok(Some(decided)) => self.publish(decided, None).await,
            Ok(None) => Outcome::Outdated,
            Err(outcome) => outcome,
        };
        self.register(None, outcome);
    }

    /// Returns the robot, which is loaded from its last decision if necessary.
    async fn load(&mut self) -> &mut Loaded {
        let loaded = if let Some(loaded) = self.loaded.take() {
            loaded
        } else {
            // The problems of a loaded loop are numbered from 0 again. Plans for the former loop could have the same
            // number.
            self.search.update(None);
            let last = persist(|| self.shared.store.last(Stream::Decisions, &self.subject)).await;
            let chain = last.as_ref().map_or(0, |last| last.sequence);
            let robot = last.map_or_else(Robot::default, |last| {
                Decided::parse(&last.payload).map_or_else(Robot::unreadable, Robot::restore)
            });
            Loaded { robot: Box::new(robot), chain, _count: Count::new(&self.shared.counts.robots) }
        };
        self.loaded.insert(loaded)
    }

    /// Runs work without a search on the robot, on a thread for such work.
    async fn with_robot<T: Send + 'static>(
        &mut self,
        work: impl FnOnce(&mut Robot, &Missions) -> T + Send + 'static,
    ) -> Result<T, Outcome> {
        self.load().await;
        let (loaded, shared) = (self.loaded.take(), Arc::clone(&self.shared));
        let work = move || {
            let mut loaded = loaded?;
            let result = shared.timed(|| work(&mut loaded.robot, &shared.missions));
            Some((loaded, result))
        };
        let done = self.shared.threads.quick(work).await.flatten();
        let (loaded, result) = done.ok_or_else(panicked)?;
        self.loaded = Some(loaded);
        Ok(result)
    }

    /// Appends a decision if the robot's last decision has the sequence number of the loaded one. Retries until the
    /// result is known, which is [`Outcome::Outdated`] if another decision is the last one. `time` is that of the event
    /// in microseconds since 1970, if the decision is about an event.
    async fn publish(&mut self, mut decided: Decided, time: Option<u64>) -> Outcome {
        let Some(Loaded { chain, .. }) = &mut self.loaded else { return Outcome::Outdated };
        decided.worker.clone_from(&self.shared.worker);
        let payload = serde_json::to_vec(&decided).unwrap_or_default();
        // Without an id, so that the server compares the chain also for a repeated attempt.
        let message = Message { subject: &self.subject, id: "", after: Some(*chain), payload: &payload };
        let mut attempt = 1;
        let outcome = loop {
            match self.shared.store.append(Stream::Decisions, message).await {
                Ok(receipt) => {
                    if let Some(time) = time {
                        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
                        let late = now.saturating_sub(Duration::from_micros(time));
                        metrics::histogram!("metaplan_fleet_latency_seconds").record(late);
                    }
                    *chain = receipt.sequence;
                    return Outcome::Decided;
                }
                Err(Fault::TooLong(length)) => {
                    let why = format!("a decision of {length} bytes is longer than the server accepts");
                    break Undecided::Faulted(why).into();
                }
                Err(Fault::Conflict) => {
                    metrics::counter!("metaplan_fleet_fenced_total").increment(1);
                    break Outcome::Outdated;
                }
                Err(Fault::Unreachable(why) | Fault::Failed(why)) => warn(attempt, &why),
            }
            metrics::counter!("metaplan_fleet_retries_total").increment(1);
            pause(attempt).await;
            attempt += 1;
        };
        self.loaded = None;
        outcome
    }

    /// Registers the outcome of an event, or, without a sequence number, of the start or the end of planning.
    fn register(&mut self, sequence: Option<u64>, outcome: Outcome) {
        let is_decided = matches!(outcome, Outcome::Decided);
        // If the robot was suspended, this decision has retired it.
        self.is_suspended &= !is_decided;
        self.is_kept &= !is_decided;
        let was_pending = self.pending.is_some();
        let mut last = None;
        if let Some(Loaded { robot, .. }) = &self.loaded {
            let planning = &self.shared.counts.planning;
            self.pending =
                robot.is_pending().then(|| self.pending.take().unwrap_or_else(|| Count::new(planning)));
            self.search.update(self.pending.as_ref().map(|_| robot.question()));
            // The plan may be in a decision of another worker, or in an unacknowledged one. Its event was kept until now.
            let is_planned = was_pending && self.pending.is_none();
            last = (is_decided || is_planned).then_some(robot.event);
        }
        if self.pending.is_none() {
            self.search.reset();
        }
        // The events of a suspended robot stay in the log, also those before a refused retirement.
        let is_stuck = self.is_suspended || matches!(outcome, Outcome::Undecided(Undecided::Faulted(_)));
        if let Some(last) = sequence.filter(|_| !is_stuck).or(last) {
            // Another worker may have decided later events, which are then left out, but have to be discarded.
            let decided = self.loaded.as_ref().map_or(0, |loaded| loaded.robot.event);
            self.handled = self.handled.max(last).max(decided);
            self.obsolete += 1;
            self.since.get_or_insert_with(Instant::now);
        }
        match outcome {
            Outcome::Known | Outcome::Outdated => {}
            Outcome::Decided => {
                self.shared.counts.decided.fetch_add(u64::from(sequence.is_some()), Ordering::Relaxed);
            }
            Outcome::Undecided(Undecided::Refused(refused)) => {
                self.shared.refuse(refused.into(), Some((&self.subject, refused.to_string())));
            }
            Outcome::Undecided(Undecided::Faulted(why)) => self.suspend(&why),
        }
    }

    fn suspend(&mut self, why: &str) {
        self.loaded = None;
        self.is_kept |= self.pending.take().is_some();
        self.is_suspended = true;
        self.search.reset();
        metrics::counter!("metaplan_fleet_faulted_total").increment(1);
        let Address { partition, robot } = &self.address;
        tracing::error!(partition, robot, "robot suspended: {why}");
        let notice = format!("the robot is suspended: {why}");
        self.shared.refuse("faulted", Some((&self.subject, notice)));
    }

    async fn discard(&mut self) {
        (self.obsolete, self.since) = (0, None);
        let last = self.handled - u64::from(self.pending.is_some() || self.is_kept);
        if last == 0 {
            return;
        }
        if self.shared.store.discard(&self.subject, last).await.is_err() {
            // Another attempt follows.
            (self.obsolete, self.since) = (1, Some(Instant::now()));
        }
    }
}

/// Waits for the plans of a search. Returns `None` without a search.
async fn join(plans: &mut JoinSet<Plans>) -> Option<Plans> {
    Some(plans.join_next().await?.ok().flatten())
}

/// Waits until a time. Never completes without one.
async fn until(time: Option<Instant>) {
    match time {
        Some(time) => tokio::time::sleep_until(time.into()).await,
        None => std::future::pending().await,
    }
}

async fn drained(drain: &mut watch::Receiver<bool>) {
    if drain.wait_for(|is_draining| *is_draining).await.is_err() {
        // The runner is dropped together with the sender.
        std::future::pending::<()>().await;
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::partition::Settings;
    use crate::store::local::Local;

    fn log(folder: &Path) -> Local {
        Local::open(folder, 1, 8, Duration::from_secs(1)).unwrap_or_else(|message| panic!("{message}"))
    }

    fn missions() -> Missions {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../missions");
        Missions::read(&folder).unwrap_or_else(|errors| panic!("{errors}"))
    }

    fn runner(store: Local, missions: Missions, settings: Settings) -> Runner<Local> {
        let shared = Arc::new(Shared::new(store, missions, "w".to_owned(), settings));
        let inbox = Arc::new(Inbox::new(&shared.counts.waiting));
        Runner::new(shared, Address { partition: 0, robot: "r".to_owned() }, inbox)
    }

    #[tokio::test]
    async fn events_are_discarded_while_a_search_runs() {
        let folder = tempfile::tempdir().expect("a directory");
        let store = log(folder.path());
        let message = Message { subject: "0.r", id: "", after: None, payload: br#"{"event": "tick"}"# };
        store.append(Stream::Events, message).await.expect("it is the first one");
        let settings = Settings { discard_within: Duration::from_millis(10), ..Settings::default() };
        let mut runner = runner(store.clone(), missions(), settings);
        runner.plans.spawn(std::future::pending());
        runner.inbox.push(store.next("0.r", 0).await.expect("it can be read").expect("it exists"));
        let (_drain, drain) = watch::channel(false);
        let run = tokio::spawn(Box::new(runner).run(drain));
        while store.end(Stream::Events, 0).await.expect("it can be read") > 0 {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        assert!(!run.is_finished());
        run.abort();
    }

    #[tokio::test]
    async fn a_robot_stays_in_memory_while_its_search_runs() {
        let folder = tempfile::tempdir().expect("a directory");
        let mut runner = runner(log(folder.path()), missions(), Settings::default());
        assert_eq!(runner.unload_at(), None);
        runner.load().await;
        assert_eq!(runner.unload_at(), Some(runner.used + MAX_IDLE));
        runner.plans.spawn(std::future::pending());
        assert_eq!(runner.unload_at(), None);
    }

    #[tokio::test]
    async fn events_that_another_worker_has_decided_are_discarded() {
        let folder = tempfile::tempdir().expect("a directory");
        let mut runner = runner(log(folder.path()), missions(), Settings::default());
        runner.load().await.robot.event = 5;
        runner.register(Some(1), Outcome::Known);
        assert_eq!(runner.handled, 5);
    }

    #[tokio::test]
    async fn a_search_for_the_former_loop_of_a_robot_that_is_loaded_again_is_cancelled() {
        let folder = tempfile::tempdir().expect("a directory");
        let (store, missions) = (log(folder.path()), missions());
        let thinker = missions.get("uuv").expect("it exists").control.thinker();
        let mut runner = runner(store, missions.clone(), Settings::default());
        enrol(&mut runner, "uuv", &missions).await;
        for is_unloaded in [false, true] {
            runner.search.begin(thinker.handle());
            if is_unloaded {
                runner.loaded = None;
            }
            runner.load().await;
            // The numbers of both problems are 0.
            runner.register(None, Outcome::Known);
            assert_eq!(runner.search.end(), is_unloaded);
        }
    }

    /// Appends the enrolment of the robot in memory and its decision without a plan.
    async fn enrol(runner: &mut Runner<Local>, mission: &str, missions: &Missions) {
        let payload = format!(r#"{{"event": "enrol", "mission": "{mission}"}}"#).into_bytes();
        let event = Stored { sequence: 1, subject: "0.r".to_owned(), id: None, time: 0, payload };
        let mut robot = Robot::default();
        let Ok(Begun::Search(search)) = robot.begin(&event, missions) else {
            panic!("a search is necessary")
        };
        let payload = serde_json::to_vec(&robot.finish(search, None)).expect("plain data");
        let message = Message { subject: "0.r", id: "", after: Some(0), payload: &payload };
        let store = &runner.shared.store;
        store.append(Stream::Decisions, message).await.expect("it is the first one");
        runner.load().await;
    }

    fn later(payload: &str) -> Stored {
        Stored { sequence: 9, subject: "0.r".to_owned(), id: None, time: 0, payload: payload.into() }
    }

    #[tokio::test]
    async fn a_search_for_the_former_version_of_a_mission_is_cancelled() {
        let folder = tempfile::tempdir().expect("a directory");
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let text = std::fs::read_to_string(root.join("missions/ugv.toml")).expect("it can be read");
        let text = text.replace("\"../", &format!("\"{}/", root.display()));
        let versions =
            [text.clone(), text.replacen("[knowledge]", "[adaptation]\nsettle = 1\n\n[knowledge]", 1)];
        let directories = ["old", "new"].map(|name| folder.path().join(name));
        for (directory, text) in directories.iter().zip(versions) {
            std::fs::create_dir(directory).expect("it can be made");
            std::fs::write(directory.join("ugv.toml"), text).expect("it can be written");
        }
        let read = |path| Missions::read(path).unwrap_or_else(|errors| panic!("{errors}"));
        let (former, missions) = (read(&directories[0]), read(&directories[1]));
        let missions = missions.with_former(&directories[0]).unwrap_or_else(|errors| panic!("{errors}"));
        let thinker = former.get("ugv").expect("it exists").control.thinker();
        let mut runner = runner(log(folder.path()), missions, Settings::default());
        enrol(&mut runner, "ugv", &former).await;
        for (event, is_cancelled) in [(r#"{"event": "tick"}"#, false), (r#"{"event": "migrate"}"#, true)] {
            runner.search.begin(thinker.handle());
            runner.plans.spawn(std::future::pending());
            let event = Stored { sequence: 9 + u64::from(is_cancelled), ..later(event) };
            runner.handle(event).await;
            assert!(runner.pending.is_some());
            assert_eq!(runner.search.end(), is_cancelled);
        }
    }

    #[tokio::test]
    async fn an_event_is_refused_only_by_the_state_after_the_last_decision() {
        let folder = tempfile::tempdir().expect("a directory");
        let missions = missions();
        let mut runner = runner(log(folder.path()), missions.clone(), Settings::default());
        enrol(&mut runner, "ugv", &missions).await;
        // Another owner retires the robot.
        let retired = Decided { event: 8, retired: true, ..Decided::default() };
        let payload = serde_json::to_vec(&retired).expect("plain data");
        let message = Message { subject: "0.r", id: "", after: None, payload: &payload };
        runner.shared.store.append(Stream::Decisions, message).await.expect("it can be written");
        let enrolment = later(r#"{"event": "enrol", "mission": "uuv"}"#);
        assert!(matches!(runner.decide(&enrolment).await, Outcome::Decided));
        let again = Stored { sequence: 10, ..enrolment };
        let outcome = runner.decide(&again).await;
        let refused = Undecided::Refused(Refused::EnrolledAlready);
        assert!(matches!(outcome, Outcome::Undecided(reason) if reason == refused));
    }

    #[tokio::test]
    async fn an_event_whose_plan_is_in_a_decision_of_another_worker_is_discarded() {
        let folder = tempfile::tempdir().expect("a directory");
        let missions = missions();
        let mut runner = runner(log(folder.path()), missions.clone(), Settings::default());
        enrol(&mut runner, "ugv", &missions).await;
        runner.register(Some(1), Outcome::Known);
        runner.discard().await;
        assert!(runner.pending.is_some() && runner.obsolete == 0);
        let enrolment = Stored { sequence: 1, ..later(r#"{"event": "enrol", "mission": "ugv"}"#) };
        let planned = Robot::default().decide(&enrolment, &missions).expect("it is not refused");
        let payload = serde_json::to_vec(&planned).expect("plain data");
        let message = Message { subject: "0.r", id: "", after: None, payload: &payload };
        runner.shared.store.append(Stream::Decisions, message).await.expect("it can be written");
        // The plan of this worker is rejected.
        runner.loaded = None;
        let outcome = runner.start_planning().await;
        runner.register(None, outcome);
        assert!(runner.pending.is_none() && runner.obsolete == 1);
    }
}
