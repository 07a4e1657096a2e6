//! Tests of fleets in a directory, without a server. The decisions must equal those of `metaplan
//! run`, whatever the interruptions. Only one process can use a directory, and all faults of missions
//! are reported.

mod crashes;
mod harness;
mod hostile;
mod http;
mod isolation;
mod planning;
mod program;
mod repeated;
mod scripts;
mod shares;
mod versions;

use std::collections::BTreeSet;
use std::time::Duration;

use metaplan_fleet::missions::Missions;
use metaplan_fleet::partition::Settings;
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::{Message, Store as _, Stream};

use harness::{Client, Fleet, patient};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn robots_are_answered_as_by_a_loop_of_their_own() {
    let fleet = Fleet::new(4);
    let mut robots = Vec::new();
    for (number, scenario) in scripts::SCENARIOS.into_iter().cycle().take(8).enumerate() {
        let mut robot = Client::play(&format!("r-{number}"), scenario, number as u64, 40);
        robot.send(&fleet, ..).await;
        robots.push(robot);
    }
    let count = robots.iter().map(|robot| robot.events.len()).sum();
    // The limit of loaded robots is below the number of robots, so that all robots are unloaded and
    // restored.
    let settings = Settings { warm: 2, discard_every: 5, ..patient() };
    fleet.work("one", settings, count / 3).await;
    fleet.work("two", settings, count).await;
    let mut workers = BTreeSet::new();
    for robot in &robots {
        robot.verify(&fleet).await;
        workers.extend(fleet.of(&robot.name).await.into_iter().map(|decided| decided.worker));
    }
    assert_eq!(fleet.all(Stream::Decisions).await.len(), count);
    assert_eq!(fleet.all(Stream::Events).await, [], "decided events are discarded");
    assert_eq!(workers.into_iter().collect::<Vec<_>>(), ["one", "two"]);
}

#[test]
fn one_process_has_a_directory() {
    let fleet = Fleet::new(4);
    let second = Local::open(fleet.folder.path(), 4, 8, Duration::from_secs(1));
    assert_eq!(second.expect_err("it is in use").code, "N310");
}

#[tokio::test]
async fn only_the_last_decisions_of_a_robot_are_kept() {
    let fleet = Fleet::with(1, 3, Duration::from_secs(1));
    let mut last = 0;
    for number in 0..10_u8 {
        let payload = [number];
        let message = Message { subject: "0.r", id: "", after: Some(last), payload: &payload };
        last = fleet.append(Stream::Decisions, message).await;
        let other = Message { subject: "0.s", after: None, ..message };
        fleet.append(Stream::Decisions, other).await;
        fleet.append(Stream::Events, other).await;
    }
    let kept = fleet.all(Stream::Decisions).await;
    let kept: Vec<u8> =
        kept.iter().filter(|message| message.subject == "0.r").map(|message| message.payload[0]).collect();
    assert_eq!(kept, [7, 8, 9]);
    let seventh = fleet.store.event(7).await.expect("it can be read").expect("it exists");
    assert_eq!((seventh.sequence, seventh.payload), (7, vec![6]));
    fleet.store.discard("0.s", 7).await.expect("it can be written");
    assert_eq!(fleet.store.event(7).await, Ok(None));
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
