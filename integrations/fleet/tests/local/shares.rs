//! Tests with several workers: partitions are shared, returned, and taken over after the loss of a
//! worker.

use std::collections::BTreeMap;
use std::time::Duration;

use metaplan_fleet::partition::Settings;
use metaplan_fleet::robots::status;
use metaplan_fleet::store::local::Local;
use metaplan_fleet::worker;
use tokio::sync::watch;

use super::{assert_same, decided, decisions, scripts, shared, tell};

/// On a slow machine, a shorter lease expires while its owner still works.
const LEASE: Duration = Duration::from_secs(2);

async fn distributed(store: &Local, wanted: &[usize]) {
    let mut counts = Vec::new();
    for _ in 0..10_000 {
        let mut held: BTreeMap<String, usize> = BTreeMap::new();
        for partition in status(store).await.expect("it can be read").partitions {
            *held.entry(partition.worker.unwrap_or_default()).or_default() += 1;
        }
        counts = held.into_values().collect();
        counts.sort_unstable();
        if counts == wanted {
            return;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    panic!("partitions are distributed as {counts:?}, not as {wanted:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn partitions_are_shared_and_taken_over() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = Local::open(folder.path(), 8, 100, LEASE).unwrap_or_else(|message| panic!("{message}"));
    let begin = |name: &str| {
        let (stop, heard) = watch::channel(false);
        let shared = shared(store.clone(), name, Settings::default());
        (stop, tokio::spawn(worker::run(shared, heard)))
    };
    let (events, answers) = scripts::play("ugv", "kinect_comes_and_goes", 5, 30);
    let mut sequences = tell(&store, "r", &events[..10]).await;
    let (first_stop, first) = begin("first");
    distributed(&store, &[8]).await;
    let (_second_stop, second) = begin("second");
    distributed(&store, &[4, 4]).await;
    sequences.extend(tell(&store, "r", &events[10..20]).await);
    // A worker is aborted, so its status expires.
    second.abort();
    sequences.extend(tell(&store, "r", &events[20..]).await);
    distributed(&store, &[8]).await;
    decided(&store, events.len()).await;
    let (third_stop, third) = begin("third");
    distributed(&store, &[4, 4]).await;
    first_stop.send_replace(true);
    first.await.expect("it ends in order");
    distributed(&store, &[8]).await;
    third_stop.send_replace(true);
    third.await.expect("it ends in order");
    assert_same("r", &decisions(&store).await["r"], &sequences, &answers);
    let partitions = status(&store).await.expect("it can be read").partitions;
    assert!(partitions.iter().all(|own| own.worker.is_none()), "{partitions:?}");
}
