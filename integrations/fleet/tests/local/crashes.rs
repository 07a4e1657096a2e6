//! Tests with a crash of a worker between any two operations, with two owners of one partition, and
//! with owners that are stopped at any time: no event is lost or decided twice.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use futures::stream::BoxStream;
use metaplan_fleet::partition::{Order, Settings, serve};
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::{Fault, Message, Receipt, Store, Stored, Stream};
use metaplan_fleet::wire::Presence;
use tokio::sync::{Notify, watch};

use super::{assert_same, decided, decisions, open, scripts, settle, shared, tell, work};

/// A log that stops responding after a number of operations, as if the worker had crashed. The last
/// operation is executed without an acknowledgement if `carries_out` is set.
#[derive(Debug, Clone)]
struct Crashing {
    inner: Local,
    left: Arc<AtomicU64>,
    carries_out: bool,
    /// `false` to omit the comparison of decisions with their required predecessors.
    fences: bool,
    /// Number of attempts to discard events that still fail.
    failing: Arc<AtomicU64>,
    over: Arc<Notify>,
}

impl Crashing {
    fn never(inner: Local, fences: bool) -> Self {
        let left = Arc::new(AtomicU64::new(u64::MAX));
        Self { inner, left, carries_out: false, fences, failing: Arc::default(), over: Arc::default() }
    }

    /// Counts an operation, and executes it if the limit is not reached. Otherwise the returned
    /// future never completes.
    async fn through<T>(&self, operation: impl Future<Output = Result<T, Fault>>) -> Result<T, Fault> {
        let left = self.left.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |left| left.checked_sub(1));
        match left {
            Ok(2..) => operation.await,
            Ok(_) if self.carries_out => {
                let _ = operation.await;
                self.crash().await
            }
            _ => self.crash().await,
        }
    }

    async fn crash<T>(&self) -> Result<T, Fault> {
        self.over.notify_one();
        std::future::pending().await
    }
}

impl Store for Crashing {
    fn partitions(&self) -> u32 {
        self.inner.partitions()
    }

    fn lease(&self) -> Duration {
        self.inner.lease()
    }

    async fn follow(
        &self,
        stream: Stream,
        partition: u32,
        after: u64,
    ) -> Result<BoxStream<'static, Result<Stored, Fault>>, Fault> {
        self.through(self.inner.follow(stream, partition, after)).await
    }

    async fn end(&self, stream: Stream, partition: u32) -> Result<u64, Fault> {
        self.inner.end(stream, partition).await
    }

    async fn append(&self, stream: Stream, mut message: Message<'_>) -> Result<Receipt, Fault> {
        if !self.fences {
            message.after = None;
        }
        self.through(self.inner.append(stream, message)).await
    }

    async fn discard(&self, subject: &str, last: u64) -> Result<(), Fault> {
        let failing =
            self.failing.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |left| left.checked_sub(1));
        if failing.is_ok() {
            return Err(Fault::Unreachable("no server".to_owned()));
        }
        self.through(self.inner.discard(subject, last)).await
    }

    async fn last(&self, stream: Stream, subject: &str) -> Result<Option<Stored>, Fault> {
        self.through(self.inner.last(stream, subject)).await
    }

    async fn event(&self, sequence: u64) -> Result<Option<Stored>, Fault> {
        self.inner.event(sequence).await
    }

    async fn announce(&self, worker: &str, status: Option<&Presence>) -> Result<(), Fault> {
        self.inner.announce(worker, status).await
    }

    async fn workers(&self) -> Result<BTreeMap<String, Presence>, Fault> {
        self.inner.workers().await
    }

    async fn notice(&self, subject: &str, text: &str) {
        self.inner.notice(subject, text).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_crash_between_any_two_operations_neither_loses_nor_repeats() {
    let scripts: Vec<_> = [("ugv-a", "ugv", "kinect_at_wp2"), ("uuv-b", "uuv", "suave")]
        .into_iter()
        .map(|(robot, mission, scenario)| (robot, scripts::play(mission, scenario, 3, 7)))
        .collect();
    let count = scripts.iter().map(|(_, (events, _))| events.len()).sum();
    let settings = Settings { discard_every: 2, look: Duration::from_millis(1), ..Settings::default() };
    let mut crashes = 0;
    for carries_out in [false, true] {
        for operations in 1.. {
            let folder = tempfile::tempdir().expect("a directory");
            let store = open(folder.path(), 1);
            let mut sequences = Vec::new();
            for (robot, (events, _)) in &scripts {
                sequences.push(tell(&store, robot, events).await);
            }
            let left = Arc::new(AtomicU64::new(operations));
            let over = Arc::new(Notify::new());
            let (inner, over_now) = (store.clone(), Arc::clone(&over));
            let (fences, failing) = (true, Arc::default());
            let crashing = Crashing { inner, left, carries_out, fences, failing, over: over_now };
            let (_orders, heard) = watch::channel(Order::Go);
            let task = tokio::spawn(serve(shared(crashing, "first", settings), 0, heard));
            let crashed = tokio::select! {
                () = over.notified() => true,
                () = decided(&store, count) => false,
            };
            task.abort();
            crashes += u32::from(crashed);
            work(&store, "second", settings, count).await;
            let made = decisions(&store).await;
            for ((robot, (_, answers)), sequences) in scripts.iter().zip(&sequences) {
                assert_same(robot, &made[*robot], sequences, answers);
            }
            if !crashed {
                break;
            }
        }
    }
    assert!(crashes > 20, "there were {crashes} crashes");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_owners_of_one_partition_decide_each_event_once() {
    for seed in 0..4 {
        let folder = tempfile::tempdir().expect("a directory");
        let store = open(folder.path(), 1);
        let (events, answers) = scripts::play("ugv", "kinect_comes_and_goes", seed, 30);
        let settings = Settings { discard_every: 3, look: Duration::from_millis(1), ..Settings::default() };
        let own = |name: &str| shared(store.clone(), name, settings);
        let (_orders, heard) = watch::channel(Order::Go);
        let zombie = tokio::spawn(serve(own("zombie"), 0, heard.clone()));
        let mut sequences = tell(&store, "r", &events[..10]).await;
        decided(&store, 3 + seed as usize).await;
        let owner = tokio::spawn(serve(own("owner"), 0, heard));
        for event in &events[10..] {
            sequences.extend(tell(&store, "r", std::slice::from_ref(event)).await);
            tokio::time::sleep(Duration::from_millis(fastrand::u64(0..20))).await;
        }
        decided(&store, events.len()).await;
        zombie.abort();
        owner.abort();
        assert_same("r", &decisions(&store).await["r"], &sequences, &answers);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_the_comparison_events_are_decided_twice() {
    let (events, answers) = scripts::play("ugv", "kinect_comes_and_goes", 1, 30);
    for fences in [true, false] {
        let folder = tempfile::tempdir().expect("a directory");
        let store = open(folder.path(), 1);
        let (_orders, heard) = watch::channel(Order::Go);
        let owners = ["one", "two"].map(|name| {
            let own = shared(Crashing::never(store.clone(), fences), name, Settings::default());
            tokio::spawn(serve(own, 0, heard.clone()))
        });
        let mut sequences = Vec::new();
        for event in &events {
            sequences.extend(tell(&store, "r", std::slice::from_ref(event)).await);
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        let mut count = events.len();
        decided(&store, count).await;
        // An owner that starts late knows the first decisions of the other one, and repeats only later ones.
        while !fences && decisions(&store).await["r"].len() <= count {
            assert!(count < 10_000, "no event is decided twice");
            count += tell(&store, "r", &[r#"{"event": "tick"}"#.to_owned()]).await.len();
            decided(&store, count).await;
        }
        if fences {
            tokio::time::sleep(Duration::from_millis(300)).await;
        }
        owners.iter().for_each(tokio::task::JoinHandle::abort);
        if fences {
            assert_same("r", &decisions(&store).await["r"], &sequences, &answers);
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn owners_that_are_gone_at_any_time_leave_what_is_needed() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = open(folder.path(), 1);
    let scripts: Vec<_> =
        (0..6).map(|seed| scripts::play("ugv", "kinect_comes_and_goes", seed, 30)).collect();
    let count = scripts.iter().map(|(events, _)| events.len()).sum();
    let mut sequences = Vec::new();
    for (robot, (events, _)) in scripts.iter().enumerate() {
        sequences.push(tell(&store, &format!("r{robot}"), events).await);
    }
    let mut random = fastrand::Rng::with_seed(7);
    for _ in 0..40 {
        let discard_every = random.usize(1..12);
        let settings = Settings { discard_every, look: Duration::from_millis(1), ..Settings::default() };
        let (_orders, heard) = watch::channel(Order::Go);
        let task = tokio::spawn(serve(shared(store.clone(), "gone", settings), 0, heard));
        tokio::time::sleep(Duration::from_millis(random.u64(1..60))).await;
        task.abort();
    }
    work(&store, "last", Settings::default(), count).await;
    let made = decisions(&store).await;
    for (robot, ((_, answers), sequences)) in scripts.iter().zip(&sequences).enumerate() {
        let robot = format!("r{robot}");
        assert_same(&robot, &made[&robot], sequences, answers);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn events_are_discarded_after_failed_attempts() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = open(folder.path(), 1);
    let (events, _) = scripts::play("ugv", "kinect_at_wp2", 3, 7);
    tell(&store, "r", &events).await;
    let crashing = Crashing::never(store.clone(), true);
    crashing.failing.store(5, Ordering::SeqCst);
    let (look, discard_within) = (Duration::from_millis(1), Duration::from_millis(10));
    let settings = Settings { look, discard_within, ..Settings::default() };
    let (_orders, heard) = watch::channel(Order::Go);
    let owner = tokio::spawn(serve(shared(crashing, "first", settings), 0, heard));
    settle(&store).await;
    owner.abort();
    assert_eq!(decisions(&store).await["r"].len(), events.len());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_drain_does_not_wait_for_jobs_without_end() {
    let (events, answers) = scripts::play("ugv", "kinect_at_wp2", 3, 7);
    let settings = Settings { drain: Duration::from_millis(100), ..Settings::default() };
    for operations in 3..9 {
        let folder = tempfile::tempdir().expect("a directory");
        let store = open(folder.path(), 1);
        let sequences = tell(&store, "r", &events).await;
        let left = Arc::new(AtomicU64::new(operations));
        let (inner, over) = (store.clone(), Arc::<Notify>::default());
        let (carries_out, fences, failing) = (true, true, Arc::default());
        let crashing = Crashing { inner, left, carries_out, fences, failing, over: Arc::clone(&over) };
        let (orders, heard) = watch::channel(Order::Go);
        let task = tokio::spawn(serve(shared(crashing, "first", settings), 0, heard));
        over.notified().await;
        orders.send_replace(Order::Drain);
        let end = tokio::time::timeout(Duration::from_secs(600), task).await;
        end.expect("it ends in time").expect("no panic");
        work(&store, "second", settings, events.len()).await;
        assert_same("r", &decisions(&store).await["r"], &sequences, &answers);
    }
}
