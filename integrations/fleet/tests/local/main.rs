//! Tests of fleets in a directory, without a server. The decisions must equal those of `metaplan run`, whatever the
//! interruptions. Workers share the partitions, and no robot delays another one. Only one process can use a directory,
//! and all faults of missions are reported.

mod common;
mod crashes;
mod harness;
mod hostile;
mod planning;
mod program;
mod scripts;
mod versions;

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use metaplan_fleet::missions::Missions;
use metaplan_fleet::partition::Settings;
use metaplan_fleet::robots::status;
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::{Fault, Message, Store as _, Stream};
use serde_json::json;

use harness::{Client, ENROL, Fleet, Running, patient, shared, until};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn robots_are_answered_as_by_a_loop_of_their_own() {
    let fleet = Fleet::new(4);
    let mut robots = Vec::new();
    for (number, scenario) in scripts::SCENARIOS.into_iter().cycle().take(8).enumerate() {
        let mut robot = Client::play(&format!("r-{number}"), scenario, number as u64, 40);
        // Nonsense is answered with an error.
        robot.events.insert(3, "nonsense".to_owned());
        let unknown = json!({"event": "component_status", "component": "nobody", "status": "FALSE"});
        robot.events.insert(4, unknown.to_string());
        robot.sequences = fleet.send(&robot.name, "s", &robot.events).await;
        robots.push(robot);
    }
    let count: usize = robots.iter().map(|robot| robot.events.len()).sum();
    // The limit of loaded robots is below the number of robots, so that all robots are unloaded and
    // restored.
    let settings = Settings { warm: 2, discard_every: 5, ..patient() };
    fleet.work("one", settings, count / 3).await;
    fleet.work("two", settings, count).await;
    let mut workers = BTreeSet::new();
    for robot in &robots {
        robot.verify(&fleet).await;
        let made = fleet.of(&robot.name).await;
        assert!(made[3..5].iter().all(|decided| decided.answers[0]["answer"] == "error"));
        workers.extend(made.into_iter().map(|decided| decided.worker));
    }
    assert_eq!(fleet.all(Stream::Decisions).await.len(), count);
    assert_eq!(fleet.all(Stream::Events).await, [], "decided events are discarded");
    assert_eq!(workers.into_iter().collect::<Vec<_>>(), ["one", "two"]);
}

fn flaps(name: &str, count: usize) -> Client {
    let flap = |number: usize| {
        let status = if number.is_multiple_of(2) { "FALSE" } else { "OK" };
        // Times are those of the robot, so that filters do not depend on the speed of this machine.
        let time = 10 * (number + 1);
        json!({"event": "component_status", "component": "c_kinect", "status": status, "time": time})
            .to_string()
    };
    Client::new(name, "ugv", std::iter::once(ENROL.to_owned()).chain((0..count).map(flap)).collect())
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_robot_with_many_events_does_not_delay_another_one() {
    let fleet = Fleet::new(1);
    let (mut sick, mut well) = (flaps("sick", 400), flaps("well", 2));
    sick.send_all(&fleet).await;
    well.send_all(&fleet).await;
    let settings = Settings { discard_every: 7, ..patient() };
    // The partition changes its owner while events of `sick` are not in the queue.
    fleet.work("one", settings, 150).await;
    fleet.work("two", settings, sick.events.len() + well.events.len()).await;
    sick.verify(&fleet).await;
    well.verify(&fleet).await;
    let order = fleet.all(Stream::Decisions).await;
    let last = order.iter().rposition(|decision| decision.subject == "0.well").expect("it is decided");
    // The order of the threads also depends on the machine.
    assert!(last + 1 < order.len(), "all events of `sick` come first");
}

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
    let begin = |name: &str| Running::worker(shared(fleet.store.clone(), name, patient()));
    let mut robot = Client::play("r", ("ugv", "kinect_comes_and_goes"), 5, 30);
    robot.send(&fleet, 10).await;
    let first = begin("first");
    distributed(&fleet, &[8]).await;
    let second = begin("second");
    distributed(&fleet, &[4, 4]).await;
    robot.send(&fleet, 20).await;
    // A worker is aborted, so its status expires.
    drop(second);
    robot.send_all(&fleet).await;
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

#[test]
fn one_process_has_a_directory() {
    let fleet = Fleet::new(4);
    let second = Local::open(fleet.folder.path(), 4, 8, Duration::from_secs(1));
    assert_eq!(second.expect_err("it is in use").code, "N310");
}

#[tokio::test]
async fn only_the_last_decisions_of_a_robot_are_kept_each_after_its_predecessor() {
    let fleet = Fleet::with(1, 3, Duration::from_secs(1));
    let mut last = 0;
    for number in 0..10_u8 {
        let payload = [number];
        let message = Message { subject: "0.r", id: "", after: Some(last), payload: &payload };
        last = fleet.append(Stream::Decisions, message).await;
        // Another decision after the same predecessor is rejected.
        assert_eq!(fleet.store.append(Stream::Decisions, message).await, Err(Fault::Conflict));
        let other = Message { subject: "0.s", after: None, ..message };
        fleet.append(Stream::Decisions, other).await;
        fleet.append(Stream::Events, other).await;
    }
    let kept = fleet.all(Stream::Decisions).await;
    let kept: Vec<u8> =
        kept.iter().filter(|message| message.subject == "0.r").map(|message| message.payload[0]).collect();
    assert_eq!(kept, [7, 8, 9]);
    let next = async |start| fleet.store.next("0.s", start).await.expect("it can be read");
    assert_eq!(next(7).await.map(|event| (event.sequence, event.payload)), Some((7, vec![6])));
    fleet.store.discard("0.s", 7).await.expect("it can be written");
    assert_eq!(next(0).await.map(|event| event.sequence), Some(8));
    assert_eq!(next(11).await, None);
    assert_eq!(fleet.all(Stream::Events).await.len(), 3);
}

#[test]
fn missions_that_are_wrong_are_all_told() {
    let folder = tempfile::tempdir().expect("a directory");
    let errors = Missions::read(folder.path()).expect_err("there are none");
    assert_eq!(errors.iter().map(|error| &error.code).collect::<Vec<_>>(), ["N300"]);
    for name in ["a.toml", "b.toml"] {
        std::fs::write(folder.path().join(name), "name = 3").expect("it can be written");
    }
    let errors = Missions::read(folder.path()).expect_err("both are wrong").to_string();
    assert!(errors.contains("a.toml") && errors.contains("b.toml"), "{errors}");
}
