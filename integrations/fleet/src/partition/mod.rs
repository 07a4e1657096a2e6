//! A partition, i.e. a fixed group of robots, run by one worker.
//!
//! Events are read in order. Each robot handles one event at a time, and robots run concurrently. A robot that cannot
//! keep up, or is suspended, does not delay the others: its events stay in the log, and are read again one by one.
//!
//! A search for a plan does not delay the reaction to events. If the search takes longer than [`Settings::patience`],
//! the reaction is published without a plan. Each further event is handled in the meantime. If it changes the planning
//! problem, the search starts again. A further decision contains the plan.
//!
//! The state of a robot is part of its last decision. A decision is appended only if the robot's last decision has the
//! expected sequence number, so only one of two workers can decide an event. A new owner of a partition reads the events
//! that are still in the log, loads the last decision of their robots, and continues with the first undecided event.
//! Events that are decided or refused are discarded from time to time.

mod own;
mod runner;
mod threads;

use std::collections::BTreeMap;
use std::future::Future;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::watch;

use crate::health::Health;
use crate::missions::Missions;
use crate::store::{Fault, Store};

use own::Partition;
use threads::Threads;

/// Parameters with which a worker runs its partitions.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// Number of places for searches, for each class of durations (up to 25 ms, up to 400 ms, longer); in the last
    /// class one less, but at least one. A search that exceeds the duration of its class gives up its place and
    /// continues, so more searches can run. The same number limits loops that work without a search.
    pub threads: usize,
    /// Time for which a decision waits for a plan. If the search takes longer, the reaction to the event is published
    /// without it, and further events are handled in the meantime. Zero: no decision about an event contains a plan
    /// that had to be searched for.
    pub patience: Duration,
    /// Maximum number of robots in memory. Others are loaded from their last decision when they have events, and removed
    /// afterwards. Robots that are handling events may exceed this number. A robot is also removed ten minutes after its
    /// last event or plan.
    pub warm: usize,
    /// Number of handled events after which the events of a robot are discarded.
    pub discard_every: usize,
    /// Time after which a handled event is discarded.
    pub discard_within: Duration,
    /// Maximum time that a partition waits for running loops when it is given back. The next owner decides the
    /// events of loops that run longer.
    pub drain: Duration,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            threads: 2,
            patience: Duration::from_millis(25),
            warm: 4096,
            discard_every: 64,
            discard_within: Duration::from_secs(30),
            drain: Duration::from_secs(5),
        }
    }
}

/// State that all partitions of a worker share.
#[derive(Debug)]
pub struct Shared<S> {
    /// The log of the fleet.
    pub store: S,
    /// The missions of the worker.
    pub missions: Missions,
    /// Name of the worker.
    pub worker: String,
    /// Parameters of the partitions.
    pub settings: Settings,
    /// Counters over all partitions of the worker.
    pub counts: Counts,
    /// Health of the worker, which probes can share.
    pub health: Arc<Health>,
    threads: Threads,
}

/// Counters of a worker: current numbers of robots and events, and totals since the start.
#[derive(Debug, Default)]
pub struct Counts {
    /// Number of robots in memory.
    pub robots: Arc<AtomicU64>,
    /// Number of events that are read but neither decided nor refused, without those of suspended robots.
    pub waiting: Arc<AtomicU64>,
    /// Number of events that were decided.
    pub decided: AtomicU64,
    /// Number of refused events and suspensions of robots.
    pub refused: AtomicU64,
    /// Total working time of loops in microseconds.
    pub busy: AtomicU64,
    /// Number of robots whose last decision lacks a plan, without suspended robots.
    pub planning: Arc<AtomicU64>,
    /// For each partition: sequence number of the last event that was read.
    pub seen: Mutex<BTreeMap<u32, u64>>,
}

impl<S> Shared<S> {
    /// Creates the shared state of a worker, with all counters at zero.
    pub fn new(store: S, missions: Missions, worker: String, settings: Settings) -> Self {
        let threads = Threads::new(settings.threads.max(1));
        let (counts, health) = (Counts::default(), Arc::default());
        Self { store, missions, worker, settings, counts, health, threads }
    }

    /// Returns the shared state with this health, which the worker updates.
    #[must_use]
    pub fn with_health(self, health: Arc<Health>) -> Self {
        Self { health, ..self }
    }
}

impl<S: Store> Shared<S> {
    /// Counts a refused event or a suspended robot. Publishes the notice, which is a subject with a text, to the clients
    /// of the robot.
    fn refuse(self: &Arc<Self>, reason: &'static str, notice: Option<(&str, String)>) {
        self.counts.refused.fetch_add(1, Ordering::Relaxed);
        metrics::counter!("metaplan_fleet_refused_total", "reason" => reason).increment(1);
        if let Some((subject, text)) = notice {
            let (shared, subject) = (Arc::clone(self), subject.to_owned());
            tokio::spawn(async move { shared.store.notice(&subject, &text).await });
        }
    }

    fn has_too_many_robots(&self) -> bool {
        self.counts.robots.load(Ordering::Relaxed) > self.settings.warm as u64
    }

    fn timed<T>(&self, work: impl FnOnce() -> T) -> T {
        let begun = Instant::now();
        let result = work();
        let micros = u64::try_from(begun.elapsed().as_micros()).unwrap_or(u64::MAX);
        self.counts.busy.fetch_add(micros, Ordering::Relaxed);
        result
    }
}

/// Runs a partition until `drain` becomes true, its sender is dropped, or work on the partition panics. If `drain`
/// becomes true, finishes running decisions and discards handled events.
pub async fn serve<S: Store>(shared: Arc<Shared<S>>, partition: u32, drain: watch::Receiver<bool>) {
    let mut dropped = drain.clone();
    tokio::select! {
        () = Partition::new(shared, partition, drain).run() => {}
        () = async { while dropped.changed().await.is_ok() {} } => {}
    }
}

/// Repeats an operation until it succeeds. After a permanent failure of the log, waits until the task is aborted.
pub(crate) async fn persist<T, F: Future<Output = Result<T, Fault>>>(operation: impl Fn() -> F) -> T {
    match repeat(operation).await {
        Ok(value) => value,
        Err(_) => std::future::pending().await,
    }
}

/// Repeats an operation with growing pauses while the log is unreachable.
///
/// # Errors
/// As for the operation, except [`Fault::Unreachable`].
pub async fn repeat<T, F: Future<Output = Result<T, Fault>>>(operation: impl Fn() -> F) -> Result<T, Fault> {
    let mut attempt = 1;
    loop {
        match operation().await {
            Err(Fault::Unreachable(why)) => {
                warn(attempt, &why);
                pause(attempt).await;
            }
            outcome => return outcome,
        }
        attempt += 1;
    }
}

/// Number of failed attempts without a warning.
const SILENT_ATTEMPTS: u32 = 4;

/// Minimum time between two warnings of the process.
const WARNING_INTERVAL: Duration = Duration::from_secs(10);

/// Logs why an operation is repeated. The operations of all robots fail together, so most warnings are suppressed.
pub(crate) fn warn(attempt: u32, why: &str) {
    static LAST: Mutex<Option<Instant>> = Mutex::new(None);
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    if attempt > SILENT_ATTEMPTS && last.is_none_or(|last| last.elapsed() >= WARNING_INTERVAL) {
        *last = Some(Instant::now());
        tracing::warn!("the log does not respond, and the request is repeated: {why}");
    }
}

/// Waits for a random time before another attempt. The upper limit is 10 ms · 2^attempt, and at most 5 s.
/// Random pauses prevent synchronised retries.
pub(crate) async fn pause(attempt: u32) {
    let limit = 5_000.min(10_u64 << attempt.min(10));
    tokio::time::sleep(Duration::from_millis(fastrand::u64(1..=limit))).await;
}
