//! The robots of one partition, by the worker that has its lease.
//!
//! Events are read in their order. Each robot takes one at a time; robots go on side by side. A decision is appended behind the robot's last
//! one, so that of two workers only one can decide an event. From time to time a robot is saved, and the partition's progress says from
//! where on events and decisions must be read again. After a crash between any two of these operations a new owner reads what was saved,
//! lets each robot go through the events since with the plans as they were decided, and goes on with the first event that nobody has decided.

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

/// How partitions are run.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// Loops that work at the same time.
    pub threads: usize,
    /// Robots that are kept ready; others are snapshots in memory, and made ready when they are needed.
    pub warm: usize,
    /// A robot is saved, and its partition's progress written, after so many decisions.
    pub save_every: usize,
    /// What is not saved holds up what may be forgotten for so long at most.
    pub save_within: Duration,
    /// So often it is looked whether something is to be saved.
    pub look: Duration,
    /// So many events of a partition are read ahead.
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
