//! Robots of a partition, run by the worker that has its lease.
//!
//! Events are read in order. Each robot handles a single event at a time, and robots run
//! concurrently. A decision is appended after the robot's last one, so only one of two workers can
//! decide an event. Robots are saved periodically, and the progress of the partition tells from
//! where events and decisions must be read again. After a crash between any two of these
//! operations, a new owner reads the saved states, replays later events with the recorded plans,
//! and continues with the first undecided event.

mod asking;
mod keeping;
mod own;
mod slot;
mod taking_over;
mod task;

use std::collections::BTreeMap;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use tokio::sync::{Semaphore, watch};

use crate::missions::Missions;
use crate::store::Store;

pub(crate) use asking::pause;
use own::Partition;

/// Parameters of partitions.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// Number of loops that work at the same time.
    pub threads: usize,
    /// Number of robots loaded in memory. Others are kept as snapshots and loaded on demand.
    pub warm: usize,
    /// Number of decisions after which a robot is saved and the progress is written.
    pub save_every: usize,
    /// Maximum time that a robot stays unsaved, which limits the retained events.
    pub save_within: Duration,
    /// Interval between checks for robots to save.
    pub look: Duration,
    /// Number of events of a partition that are read in advance.
    pub ahead: usize,
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
        }
    }
}

/// Shared state of a worker's partitions.
#[derive(Debug)]
pub struct Shared<S> {
    /// The log.
    pub store: S,
    /// The missions of the worker.
    pub missions: Missions,
    /// Name of the worker.
    pub worker: String,
    /// Parameters of partitions.
    pub settings: Settings,
    /// Counters over all partitions.
    pub counts: Counts,
    threads: Semaphore,
}

/// Counters of current objects and of past events.
#[derive(Debug, Default)]
pub struct Counts {
    /// Number of robots.
    pub robots: AtomicU64,
    /// Number of robots loaded in memory.
    pub warm: AtomicU64,
    /// Number of events that are read but not decided.
    pub waiting: AtomicU64,
    /// Number of leased partitions.
    pub partitions: AtomicU64,
    /// Number of decided events.
    pub decided: AtomicU64,
    /// Number of refused events.
    pub refused: AtomicU64,
    /// Working time of loops in microseconds.
    pub busy: AtomicU64,
    /// Sequence by partition up to which all events are decided or refused.
    pub reached: Mutex<BTreeMap<u32, u64>>,
}

impl<S> Shared<S> {
    /// Creates the state with all counters at zero.
    pub fn new(store: S, missions: Missions, worker: String, settings: Settings) -> Self {
        let threads = Semaphore::new(settings.threads.max(1));
        Self { store, missions, worker, settings, counts: Counts::default(), threads }
    }
}

/// Order to a partition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Continue.
    Go,
    /// Finish running decisions, save everything and end.
    Drain,
    /// End immediately, because another worker has the lease.
    Abandon,
}

/// Reason why a partition has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// An order.
    Ordered,
    /// Another worker has written what only the owner writes.
    Fenced,
}

/// Runs a partition until it is ordered to end or is fenced.
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
