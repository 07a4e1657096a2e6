//! Tests with several workers: partitions are shared, returned, and taken over after the loss of a
//! worker.

use std::collections::BTreeMap;
use std::time::Duration;

use metaplan_fleet::robots::status;

use super::harness::{Client, Fleet, Worker, patient, shared, until};

/// On a slow machine, a shorter lease expires while its owner still works.
const LEASE: Duration = Duration::from_secs(2);

async fn distributed(fleet: &Fleet, expected: &[usize]) {
    let what = format!("partitions are not distributed as {expected:?}");
    let is_distributed = async || {
        let mut counts: BTreeMap<Option<String>, usize> = BTreeMap::new();
        for partition in status(&fleet.store).await.expect("it can be read").partitions {
            *counts.entry(partition.worker).or_default() += 1;
        }
        let mut counts: Vec<usize> = counts.into_values().collect();
        counts.sort_unstable();
        counts == expected
    };
    until(&what, is_distributed).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn partitions_are_shared_and_taken_over() {
    let fleet = Fleet::with(8, 100, LEASE);
    let begin = |name: &str| Worker::start(shared(fleet.store.clone(), name, patient()));
    let mut robot = Client::play("r", ("ugv", "kinect_comes_and_goes"), 5, 30);
    robot.send(&fleet, ..10).await;
    let first = begin("first");
    distributed(&fleet, &[8]).await;
    let second = begin("second");
    distributed(&fleet, &[4, 4]).await;
    robot.send(&fleet, ..20).await;
    // A worker is aborted, so its status expires.
    second.abort();
    robot.send(&fleet, ..).await;
    distributed(&fleet, &[8]).await;
    fleet.decided(robot.events.len()).await;
    let third = begin("third");
    distributed(&fleet, &[4, 4]).await;
    first.stop().await;
    distributed(&fleet, &[8]).await;
    third.stop().await;
    robot.verify(&fleet).await;
    let partitions = status(&fleet.store).await.expect("it can be read").partitions;
    assert!(partitions.iter().all(|partition| partition.worker.is_none()), "{partitions:?}");
}
