//! A partition, i.e. a fixed group of robots, run by the worker that leases it.
//!
//! Events are read in order. Each robot handles one event at a time, and robots run concurrently. A robot that cannot
//! keep up, or is suspended, does not delay the others: its events stay in the log, and are read again separately. A
//! decision is appended only if the robot's last decision has the expected sequence number. So only one of two workers
//! can decide an event.
//!
//! Robots are saved periodically; the stored progress of the partition gives the positions from which events and
//! decisions must be read again. A crash is possible between any two of these operations. A new owner reads the
//! snapshots, replays later events with the recorded plans, and continues with the first undecided event.

mod asking;
mod keeping;
mod own;
mod slot;
mod taking_over;
mod task;
mod threads;

use std::collections::BTreeMap;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use tokio::sync::watch;

use crate::health::Health;
use crate::missions::Missions;
use crate::store::Store;

pub(crate) use asking::pause;
use own::Partition;
use threads::Threads;

/// Parameters with which a worker runs its partitions.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// Maximum number of loops that search for plans at the same time, for each class of durations
    /// (up to 25 ms, up to 400 ms, longer). The same number limits further searches on extra
    /// threads, and loops that work without a search.
    pub threads: usize,
    /// Maximum number of idle robots loaded in memory. Others are kept as compressed snapshots and
    /// loaded on demand. Robots that are handling events may exceed this number.
    pub warm: usize,
    /// Number of decisions after which a robot is saved, and number of events or decisions after
    /// which the progress is written.
    pub save_every: usize,
    /// Time after which a robot with an unsaved decision is saved. It limits the number of events
    /// that a new owner has to replay.
    pub save_within: Duration,
    /// Time between two checks whether robots have to be saved.
    pub look: Duration,
    /// If half of this number of undecided events of a partition is in memory, a robot with 16 or
    /// more of them gets no more. Its later events are read again once the earlier ones are
    /// decided.
    pub ahead: usize,
    /// Maximum time that a partition waits for running loops when it is given back. Their events are decided by
    /// the next owner.
    pub drain: Duration,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            threads: 2,
            warm: 4096,
            save_every: 64,
            save_within: Duration::from_secs(30),
            look: Duration::from_millis(500),
            ahead: 1024,
            drain: Duration::from_secs(5),
        }
    }
}

/// State that all partitions of a worker share.
#[derive(Debug)]
pub struct Shared<S> {
    /// The log with streams and buckets.
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
    /// Number of robots in the worker's partitions.
    pub robots: AtomicU64,
    /// Number of robots loaded in memory.
    pub warm: AtomicU64,
    /// Number of events that are read but not decided.
    pub waiting: AtomicU64,
    /// Number of leased partitions that are running.
    pub partitions: AtomicU64,
    /// Number of events that were decided or replayed.
    pub decided: AtomicU64,
    /// Number of refused events, stopped robots and unreadable stored messages.
    pub refused: AtomicU64,
    /// Total working time of loops in microseconds.
    pub busy: AtomicU64,
    /// For each partition: sequence number up to which all events are decided or refused.
    pub reached: Mutex<BTreeMap<u32, u64>>,
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

/// Order of the worker to a running partition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Continue to handle events.
    Go,
    /// Finish running decisions, save everything and end.
    Drain,
    /// End immediately without saving, because the lease is lost: another worker has it, or it could
    /// not be renewed in time.
    Abandon,
}

/// Reason why the execution of a partition has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The worker has ordered the end.
    Ordered,
    /// The partition has to be recovered again: another worker has written data that only the owner
    /// writes, or the loop of a robot has panicked.
    Fenced,
}

/// Recovers and runs a partition until it is ordered to end, or until it has to be recovered again
/// ([`End::Fenced`]). [`Order::Abandon`] or a dropped sender of `orders` ends it immediately,
/// [`Order::Drain`] after everything is saved.
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
