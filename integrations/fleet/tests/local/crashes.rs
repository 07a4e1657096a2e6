//! Tests with a crash of a worker between any two operations, and with two owners of one partition: no event is lost or
//! decided twice.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use delegate::delegate;
use metaplan_fleet::partition::Settings;
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::{Fault, Message, Receipt, Store, Stored, Stream, Subscription};
use metaplan_fleet::wire::Presence;
use tokio::sync::Notify;

use super::harness::{Client, ENROL, Fleet, Running, TICK, patient, shared, until};

/// A log that stops responding after a number of operations, as if the worker had crashed. The last
/// operation is executed without an acknowledgement if `carries_out` is set.
#[derive(Debug, Clone)]
struct Crashing {
    inner: Local,
    operations: Arc<AtomicU64>,
    carries_out: bool,
    /// `false` to omit the comparison of decisions with their required predecessors.
    fences: bool,
    /// Subject of a robot whose second decision is never acknowledged.
    stuck: &'static str,
    /// Number of attempts to discard events that still fail.
    failing: Arc<AtomicU64>,
    /// Sequence numbers up to which events were discarded.
    discarded: Arc<Mutex<Vec<u64>>>,
    over: Arc<Notify>,
}

impl Crashing {
    fn new(fleet: &Fleet, operations: u64) -> Self {
        let (inner, operations) = (fleet.store.clone(), Arc::new(operations.into()));
        let (failing, discarded, over) = (Arc::default(), Arc::default(), Arc::default());
        Self { inner, operations, carries_out: false, fences: true, stuck: "", failing, discarded, over }
    }

    /// Counts an operation, and executes it if the limit is not reached. Otherwise the returned
    /// future never completes.
    async fn through<T>(&self, operation: impl Future<Output = Result<T, Fault>>) -> Result<T, Fault> {
        match decrement(&self.operations) {
            Ok(2..) => return operation.await,
            Ok(_) if self.carries_out => drop(operation.await),
            _ => {}
        }
        self.over.notify_one();
        std::future::pending().await
    }
}

fn decrement(counter: &AtomicU64) -> Result<u64, u64> {
    counter.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |count| count.checked_sub(1))
}

impl Store for Crashing {
    delegate! {
        to self.inner {
            fn partitions(&self) -> u32;
            fn lease(&self) -> Duration;
            async fn end(&self, stream: Stream, partition: u32) -> Result<u64, Fault>;
            async fn announce(&self, worker: &str, status: Option<&Presence>) -> Result<(), Fault>;
            async fn workers(&self) -> Result<BTreeMap<String, Presence>, Fault>;
            async fn notice(&self, subject: &str, text: &str);
        }
    }

    async fn follow(&self, stream: Stream, partition: u32, after: u64) -> Result<Subscription, Fault> {
        self.through(self.inner.follow(stream, partition, after)).await
    }

    async fn append(&self, stream: Stream, mut message: Message<'_>) -> Result<Receipt, Fault> {
        if message.subject == self.stuck && message.after > Some(0) {
            std::future::pending::<()>().await;
        }
        if !self.fences {
            message.after = None;
        }
        self.through(self.inner.append(stream, message)).await
    }

    async fn discard(&self, subject: &str, last: u64) -> Result<(), Fault> {
        if decrement(&self.failing).is_ok() {
            return Err(Fault::Unreachable("no server".to_owned()));
        }
        self.discarded.lock().expect("no panic").push(last);
        self.through(self.inner.discard(subject, last)).await
    }

    async fn last(&self, stream: Stream, subject: &str) -> Result<Option<Stored>, Fault> {
        self.through(self.inner.last(stream, subject)).await
    }

    async fn next(&self, subject: &str, start: u64) -> Result<Option<Stored>, Fault> {
        self.through(self.inner.next(subject, start)).await
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_crash_between_any_two_operations_neither_loses_nor_repeats() {
    let robots = [
        Client::play("ugv-a", ("ugv", "kinect_at_wp2"), 3, 7),
        Client::play("uuv-b", ("uuv", "suave"), 3, 7),
    ];
    let count: usize = robots.iter().map(|robot| robot.events.len()).sum();
    let settings = Settings { discard_every: 2, ..patient() };
    let mut crashes = 0;
    for carries_out in [false, true] {
        for operations in 1.. {
            let (fleet, mut robots) = (Fleet::new(1), robots.clone());
            for robot in &mut robots {
                robot.send_all(&fleet).await;
            }
            let crashing = Crashing { carries_out, ..Crashing::new(&fleet, operations) };
            let over = Arc::clone(&crashing.over);
            let owner = Running::owner(shared(crashing, "first", settings));
            let crashed = tokio::select! {
                () = over.notified() => true,
                () = fleet.decided(count) => false,
            };
            drop(owner);
            crashes += u32::from(crashed);
            fleet.work("second", settings, count).await;
            for robot in &robots {
                robot.verify(&fleet).await;
            }
            if !crashed {
                break;
            }
        }
    }
    assert!(crashes > 20, "there were {crashes} crashes");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_owners_decide_each_event_once_but_twice_without_the_comparison() {
    // In one case with the comparison, both owners also compete for the first decision.
    for (seed, fences, is_late) in [
        (0, true, true),
        (1, true, true),
        (2, true, true),
        (3, true, true),
        (1, true, false),
        (1, false, false),
    ] {
        let fleet = Fleet::new(1);
        let mut robot = Client::play("r", ("ugv", "kinect_comes_and_goes"), seed, 30);
        let settings = Settings { discard_every: if fences { 3 } else { 64 }, ..patient() };
        let own = |name: &str| {
            Running::owner(shared(Crashing { fences, ..Crashing::new(&fleet, u64::MAX) }, name, settings))
        };
        let _zombie = own("zombie");
        if is_late {
            robot.send(&fleet, 10).await;
            fleet.decided(3 + seed as usize).await;
        }
        let _owner = own("owner");
        for number in robot.sequences.len()..robot.events.len() {
            robot.send(&fleet, number + 1).await;
            tokio::time::sleep(Duration::from_millis(fastrand::u64(0..20))).await;
        }
        let mut count = robot.events.len();
        fleet.decided(count).await;
        if fences {
            tokio::time::sleep(Duration::from_millis(300)).await;
            robot.verify(&fleet).await;
        }
        // An owner that starts late loads the first decisions of the other one, and repeats only later ones.
        while !fences && fleet.of("r").await.len() <= count {
            assert!(count < 10_000, "no event is decided twice");
            count += fleet.tell("r", &[TICK]).await.len();
            fleet.decided(count).await;
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_drain_does_not_wait_for_jobs_without_end_and_events_are_discarded_after_failed_attempts() {
    let robot = Client::play("r", ("ugv", "kinect_at_wp2"), 3, 7);
    let (drain, discard_within) = (Duration::from_millis(100), Duration::from_millis(10));
    let settings = Settings { drain, discard_within, ..patient() };
    for operations in 3..9 {
        let (fleet, mut robot) = (Fleet::new(1), robot.clone());
        robot.send_all(&fleet).await;
        let crashing = Crashing { carries_out: true, ..Crashing::new(&fleet, operations) };
        let over = Arc::clone(&crashing.over);
        let owner = Running::owner(shared(crashing, "first", settings));
        over.notified().await;
        owner.stop().await;
        let crashing = Crashing { failing: Arc::new(5.into()), ..Crashing::new(&fleet, u64::MAX) };
        let _owner = Running::owner(shared(crashing, "second", settings));
        fleet.settle().await;
        robot.verify(&fleet).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_search_gives_up_its_place_while_its_robot_waits_for_the_log() {
    let fleet = Fleet::new(1);
    let settings = Settings { threads: 1, patience: Duration::ZERO, ..patient() };
    let crashing = Crashing { stuck: "0.stuck", ..Crashing::new(&fleet, u64::MAX) };
    let _owner = Running::owner(shared(crashing, "first", settings));
    fleet.tell("stuck", &[ENROL, TICK]).await;
    fleet.decided(1).await;
    fleet.tell("r", &[ENROL]).await;
    let has_plan = async || fleet.of("r").await.iter().any(|decided| decided.planned);
    until("the place is not free", has_plan).await;
}

/// NATS servers before 2.12.10 would remove all events of the robot.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_request_discards_the_events_up_to_the_number_0() {
    let fleet = Fleet::new(1);
    let crashing = Crashing::new(&fleet, u64::MAX);
    let discarded = Arc::clone(&crashing.discarded);
    let settings = Settings { discard_every: 1, patience: Duration::ZERO, ..patient() };
    let _owner = Running::owner(shared(crashing, "first", settings));
    // The first event of the log is kept until its plan is found.
    fleet.tell("r", &[ENROL]).await;
    fleet.settle().await;
    let discarded = discarded.lock().expect("no panic");
    assert!(!discarded.is_empty() && !discarded.contains(&0), "{discarded:?}");
}
