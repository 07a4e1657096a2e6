//! Tests of fleets in a directory, without a server. The decisions must equal those of `metaplan
//! run`, whatever the interruptions. Only one process can use a directory, and all faults of missions
//! are reported.

mod crashes;
mod hostile;
mod isolation;
mod program;
mod repeated;
mod scripts;
mod shares;
mod versions;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use metaplan_fleet::missions::Missions;
use metaplan_fleet::partition::{Settings, Shared};
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::{Message, Store, Stream};
use metaplan_fleet::wire::{Address, Decided, is_name};
use metaplan_fleet::worker;
use serde_json::Value;
use tokio::sync::watch;

fn missions() -> Missions {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../missions");
    Missions::read(&folder).unwrap_or_else(|errors| panic!("{errors}"))
}

fn open(directory: &Path, partitions: u32) -> Local {
    Local::open(directory, partitions, Duration::from_millis(400))
        .unwrap_or_else(|message| panic!("{message}"))
}

fn shared<S: Store>(store: S, name: &str, settings: Settings) -> Arc<Shared<S>> {
    Arc::new(Shared::new(store, missions(), name.to_owned(), settings))
}

async fn tell<S: Store>(store: &S, robot: &str, events: &[String]) -> Vec<u64> {
    let subject = Address::of(robot, store.partitions()).to_string();
    let mut sequences = Vec::new();
    for event in events {
        let message = Message { subject: &subject, id: "", after: None, payload: event.as_bytes() };
        sequences
            .push(store.append(Stream::Events, message).await.expect("it is our own directory").sequence);
    }
    sequences
}

async fn decisions<S: Store>(store: &S) -> BTreeMap<String, Vec<Decided>> {
    let mut all: BTreeMap<String, Vec<Decided>> = BTreeMap::new();
    for partition in 0..store.partitions() {
        for message in store.history(Stream::Decisions, partition, 0).await.expect("it can be read") {
            let address = Address::parse(&message.subject).expect("an address");
            assert!(is_name(&address.robot));
            let decided = Decided::parse(&message.payload).expect("a decision");
            all.entry(address.robot).or_default().push(decided);
        }
    }
    all
}

async fn decided<S: Store>(store: &S, count: usize) {
    for _ in 0..6000 {
        if decisions(store).await.values().map(Vec::len).sum::<usize>() >= count {
            return;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    panic!("{count} decisions were expected; there are {:?}", decisions(store).await.len());
}

async fn work<S: Store>(store: &S, name: &str, settings: Settings, count: usize) {
    let (stop, heard) = watch::channel(false);
    let shared = shared(store.clone(), name, settings);
    let task = tokio::spawn(worker::run(shared, heard));
    decided(store, count).await;
    stop.send_replace(true);
    task.await.expect("a worker ends in order");
}

/// Checks that a robot received the answers of a single local loop, with one decision per event.
fn assert_same(robot: &str, decided: &[Decided], sequences: &[u64], expected: &[Vec<Value>]) {
    let events: Vec<u64> = decided.iter().map(|own| own.event).collect();
    assert_eq!(events, sequences, "{robot}: each event once, in order");
    for (own, expected) in decided.iter().zip(expected) {
        assert_eq!(
            scripts::essence(&own.answers),
            scripts::essence(expected),
            "{robot}, event {}",
            own.event
        );
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn robots_are_answered_as_by_a_loop_of_their_own() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = open(folder.path(), 4);
    let mut expected = BTreeMap::new();
    let mut count = 0;
    for (number, (mission, scenario)) in scripts::SCENARIOS.into_iter().cycle().take(8).enumerate() {
        let robot = format!("{mission}-{number}");
        let (events, answers) = scripts::play(mission, scenario, number as u64, 40);
        let sequences = tell(&store, &robot, &events).await;
        count += events.len();
        expected.insert(robot, (sequences, answers));
    }
    // The limit of loaded robots is below the number of robots, so that all robots are unloaded and
    // restored.
    let settings = Settings { warm: 2, save_every: 5, ..Settings::default() };
    work(&store, "one", settings, count / 3).await;
    work(&store, "two", settings, count).await;
    let decided = decisions(&store).await;
    assert_eq!(decided.len(), expected.len());
    for (robot, (sequences, answers)) in &expected {
        assert_same(robot, &decided[robot], sequences, answers);
    }
    let workers: std::collections::BTreeSet<&str> =
        decided.values().flatten().map(|own| own.worker.as_str()).collect();
    assert_eq!(workers.into_iter().collect::<Vec<_>>(), ["one", "two"]);
}

#[test]
fn one_process_has_a_directory() {
    let folder = tempfile::tempdir().expect("a directory");
    let _first = open(folder.path(), 4);
    let second = Local::open(folder.path(), 4, Duration::from_secs(1));
    assert_eq!(second.expect_err("it is in use").code, "N310");
}

#[test]
fn missions_that_are_wrong_are_all_told() {
    let folder = tempfile::tempdir().expect("a directory");
    let errors = Missions::read(folder.path()).expect_err("there are none");
    assert_eq!(errors.iter().map(|error| &error.code).collect::<Vec<_>>(), ["N300"]);
    for name in ["a.toml", "b.toml"] {
        std::fs::write(folder.path().join(name), "name = 3").expect("it can be written");
    }
    let errors = Missions::read(folder.path()).expect_err("both are wrong");
    let told: std::collections::BTreeSet<String> = errors.iter().map(ToString::to_string).collect();
    assert!(told.iter().any(|text| text.contains("a.toml")), "{told:?}");
    assert!(told.iter().any(|text| text.contains("b.toml")), "{told:?}");
}
