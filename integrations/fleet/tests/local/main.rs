//! Tests of fleets in a directory, without a server. The decisions must equal those of `metaplan
//! run`, whatever the interruptions. Only one process can use a directory, and all faults of missions
//! are reported.

mod crashes;
mod hostile;
mod isolation;
mod planning;
mod program;
mod repeated;
mod scripts;
mod shares;
mod versions;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use futures::StreamExt as _;
use metaplan_fleet::missions::Missions;
use metaplan_fleet::partition::{Settings, Shared};
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::{Message, Store, Stored, Stream};
use metaplan_fleet::wire::{Address, Decided};
use metaplan_fleet::worker;
use serde_json::Value;
use tokio::sync::{broadcast, watch};

fn missions() -> Missions {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../missions");
    Missions::read(&folder).unwrap_or_else(|errors| panic!("{errors}"))
}

fn open(directory: &Path, partitions: u32) -> Local {
    Local::open(directory, partitions, usize::MAX - 1, Duration::from_millis(400))
        .unwrap_or_else(|message| panic!("{message}"))
}

/// Patience with which each decision contains its plan, so that the answers do not depend on the speed of this machine.
const PATIENT: Duration = Duration::from_secs(600);

fn shared<S: Store>(store: S, name: &str, settings: Settings) -> Arc<Shared<S>> {
    let settings = Settings { patience: PATIENT, ..settings };
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

/// Returns the messages of a stream, one partition after another.
async fn all<S: Store>(store: &S, stream: Stream) -> Vec<Stored> {
    let mut messages = Vec::new();
    for partition in 0..store.partitions() {
        let end = store.end(stream, partition).await.expect("it can be read");
        let mut reader = store.follow(stream, partition, 0).await.expect("it can be read");
        let mut last = 0;
        while last < end {
            let message = reader.next().await.expect("it does not end").expect("it can be read");
            last = message.sequence;
            messages.push(message);
        }
    }
    messages
}

/// Returns `true` if there are no events. Unlike [`all`], it does not wait for events that are discarded meanwhile.
async fn has_no_events<S: Store>(store: &S) -> bool {
    for partition in 0..store.partitions() {
        if store.end(Stream::Events, partition).await.expect("it can be read") > 0 {
            return false;
        }
    }
    true
}

/// Waits until all events are handled, their plans are found, and the events are discarded.
async fn settle<S: Store>(store: &S) {
    for _ in 0..120_000 {
        if has_no_events(store).await {
            return;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    panic!("events are not handled");
}

async fn decisions<S: Store>(store: &S) -> BTreeMap<String, Vec<Decided>> {
    let mut decisions: BTreeMap<String, Vec<Decided>> = BTreeMap::new();
    for message in all(store, Stream::Decisions).await {
        let address = Address::parse(&message.subject).expect("an address");
        let decided = Decided::parse(&message.payload).expect("a decision");
        decisions.entry(address.robot).or_default().push(decided);
    }
    decisions
}

async fn decided<S: Store>(store: &S, count: usize) {
    for _ in 0..60_000 {
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

/// Waits for the next notice, which is sent by another task, and returns its text.
async fn heard(notices: &mut broadcast::Receiver<(String, String)>) -> String {
    let notice = tokio::time::timeout(PATIENT, notices.recv()).await.expect("there is a notice");
    notice.expect("there are few notices").1
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
    let settings = Settings { warm: 2, discard_every: 5, ..Settings::default() };
    work(&store, "one", settings, count / 3).await;
    work(&store, "two", settings, count).await;
    let decided = decisions(&store).await;
    assert_eq!(decided.len(), expected.len());
    for (robot, (sequences, answers)) in &expected {
        assert_same(robot, &decided[robot], sequences, answers);
    }
    assert_eq!(all(&store, Stream::Events).await, [], "decided events are discarded");
    let workers: std::collections::BTreeSet<&str> =
        decided.values().flatten().map(|own| own.worker.as_str()).collect();
    assert_eq!(workers.into_iter().collect::<Vec<_>>(), ["one", "two"]);
}

#[test]
fn one_process_has_a_directory() {
    let folder = tempfile::tempdir().expect("a directory");
    let _first = open(folder.path(), 4);
    let second = Local::open(folder.path(), 4, 8, Duration::from_secs(1));
    assert_eq!(second.expect_err("it is in use").code, "N310");
}

#[tokio::test]
async fn only_the_last_decisions_of_a_robot_are_kept() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = Local::open(folder.path(), 1, 3, Duration::from_secs(1))
        .unwrap_or_else(|message| panic!("{message}"));
    let mut last = 0;
    for number in 0..10_u8 {
        let payload = [number];
        let message = Message { subject: "0.r", id: "", after: Some(last), payload: &payload };
        last = store.append(Stream::Decisions, message).await.expect("it is the last one").sequence;
        let other = Message { subject: "0.s", after: None, ..message };
        store.append(Stream::Decisions, other).await.expect("it is unconditional");
        store.append(Stream::Events, other).await.expect("it is unconditional");
    }
    let kept = all(&store, Stream::Decisions).await;
    let kept: Vec<u8> = kept.iter().filter(|own| own.subject == "0.r").map(|own| own.payload[0]).collect();
    assert_eq!(kept, [7, 8, 9]);
    let seventh = store.event(7).await.expect("it can be read").expect("it exists");
    assert_eq!((seventh.sequence, seventh.payload), (7, vec![6]));
    store.discard("0.s", 7).await.expect("it can be written");
    assert_eq!(store.event(7).await, Ok(None));
    assert_eq!(all(&store, Stream::Events).await.len(), 3);
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
