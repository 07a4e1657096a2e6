//! Tests with invalid or forged messages, which change nothing and are counted, with invalid events,
//! which are answered with an error, and with writes of former owners, which are rejected.

use std::sync::atomic::Ordering;
use std::time::Duration;

use metaplan_fleet::partition::{Order, Settings, serve};
use metaplan_fleet::robots::Sender;
use metaplan_fleet::store::{Fault, Message, Store, Stream};
use metaplan_fleet::wire::{Address, Decided};
use metaplan_fleet::worker;
use tokio::sync::watch;

use super::{all, assert_same, decided, decisions, open, scripts, shared, tell, work};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn hostile_messages_change_nothing_and_are_counted() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = open(folder.path(), 1);
    let mut notices = store.notices();
    let (events, answers) = scripts::play("ugv", "kinect_at_wp2", 1, 12);
    let subject = Address::of("good", 1).to_string();
    let long = format!("{{\"event\": \"tick\", \"x\": \"{}\"}}", "a".repeat(1 << 20));
    let hostile: [(&str, &str, &[u8]); 9] = [
        ("0.stranger", "", b"{\"event\": \"tick\"}"),
        ("0.stranger", "", b"\xff\xfe not JSON"),
        ("0.stranger", "", long.as_bytes()),
        ("0.stranger", "", b"{\"event\": \"enrol\", \"mission\": \"../ugv\"}"),
        ("0.stranger", "", b"{\"event\": \"retire\"}"),
        (&subject, "", b"{\"event\": \"enrol\", \"mission\": \"uuv\"}"),
        (&subject, "other:1", b"{\"event\": \"retire\"}"),
        (&subject, "no colon", b"{\"event\": \"retire\"}"),
        ("0.a b", "", b"{\"event\": \"enrol\", \"mission\": \"ugv\"}"),
    ];
    let mut sequences = Vec::new();
    let mut sender = Sender::new(store.clone(), "good", "");
    for (number, event) in events.iter().enumerate() {
        sequences.push(sender.send(event).await.expect("it is our own directory"));
        if let Some((subject, id, payload)) = hostile.get(number) {
            let message = Message { subject, id, after: None, payload };
            store.append(Stream::Events, message).await.expect("it is our own directory");
        }
    }
    let shared = shared(store.clone(), "one", Settings::default());
    let (orders, heard) = watch::channel(Order::Go);
    let task = tokio::spawn(serve(std::sync::Arc::clone(&shared), 0, heard));
    decided(&store, events.len()).await;
    // Events of other robots may be handled later.
    while shared.counts.refused.load(Ordering::Relaxed) < 8 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    orders.send_replace(Order::Drain);
    task.await.expect("it ends in order");
    let made = decisions(&store).await;
    assert_eq!(made.keys().collect::<Vec<_>>(), ["good"]);
    assert_same("good", &made["good"], &sequences, &answers);
    // Messages without a valid address belong to no partition, so they are not read.
    assert_eq!(shared.counts.refused.load(Ordering::Relaxed), 8);
    assert_eq!(shared.counts.robots.load(Ordering::Relaxed), 0, "nothing is left behind");
    for _ in 0..8 {
        super::heard(&mut notices).await;
    }
    assert!(notices.try_recv().is_err(), "each refusal has one notice");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nonsense_of_a_robot_is_answered_with_an_error() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = open(folder.path(), 3);
    let mut events = scripts::play("ugv", "kinect_at_wp2", 1, 6).0;
    events.insert(3, "nonsense".to_owned());
    events.insert(4, r#"{"event": "component_status", "component": "nobody", "status": "FALSE"}"#.to_owned());
    let answers = scripts::alone("ugv", &events);
    let mut sender = Sender::new(store.clone(), "r", "s");
    let mut sequences = Vec::new();
    for event in &events {
        sequences.push(sender.send(event).await.expect("it is our own directory"));
    }
    work(&store, "one", Settings::default(), events.len()).await;
    let made = decisions(&store).await;
    assert_same("r", &made["r"], &sequences, &answers);
    assert_eq!(made["r"][3].answers[0]["answer"], "error");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn forged_ids_keep_nobody_from_saying_something() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = open(folder.path(), 1);
    for number in 1..=3 {
        let id = format!("good:s{number}");
        let message = Message { subject: "0.bad", id: &id, after: None, payload: b"{\"event\": \"tick\"}" };
        store.append(Stream::Events, message).await.expect("it is our own directory");
    }
    let events = scripts::play("ugv", "kinect_at_wp2", 1, 5).0;
    let mut sender = Sender::new(store.clone(), "good", "s");
    for event in &events {
        sender.send(event).await.expect("it is our own directory");
    }
    let mut again = Sender::new(store.clone(), "good", "s");
    for event in &events {
        again.send(event).await.expect("it is our own directory");
    }
    let stored = all(&store, Stream::Events).await;
    let good: Vec<&[u8]> =
        stored.iter().filter(|own| own.subject == "0.good").map(|own| own.payload.as_slice()).collect();
    assert_eq!(good, events.iter().map(String::as_bytes).collect::<Vec<_>>(), "each once, though sent twice");
}

#[tokio::test]
async fn a_decision_without_its_predecessor_is_rejected() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = open(folder.path(), 1);
    let message = |after| Message { subject: "0.r", id: "", after: Some(after), payload: b"x" };
    let first = store.append(Stream::Decisions, message(0)).await.expect("the first one").sequence;
    store.append(Stream::Decisions, message(first)).await.expect("the second one");
    for after in [0, first] {
        assert_eq!(store.append(Stream::Decisions, message(after)).await, Err(Fault::Conflict));
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_robot_whose_last_decision_is_unreadable_can_be_retired() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = open(folder.path(), 1);
    let mut notices = store.notices();
    let message = Message { subject: "0.r", id: "", after: Some(0), payload: b"{}" };
    store.append(Stream::Decisions, message).await.expect("the first one");
    let events =
        [r#"{"event": "tick"}"#, r#"{"event": "retire"}"#, r#"{"event": "enrol", "mission": "ugv"}"#];
    let sequences = tell(&store, "r", &events.map(str::to_owned)).await;
    let (stop, stopped) = watch::channel(false);
    let worker = tokio::spawn(worker::run(shared(store.clone(), "one", Settings::default()), stopped));
    while all(&store, Stream::Decisions).await.len() < 3 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    stop.send_replace(true);
    worker.await.expect("it ends in order");
    let made = all(&store, Stream::Decisions).await;
    let made: Vec<u64> =
        made.iter().filter_map(|own| Decided::parse(&own.payload)).map(|decided| decided.event).collect();
    assert_eq!(made, sequences[1..]);
    assert!(super::heard(&mut notices).await.contains("cannot be read"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_event_that_is_sent_again_after_its_decision_is_not_stored_with_another_id() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = open(folder.path(), 1);
    let events = scripts::play("ugv", "kinect_at_wp2", 1, 5).0;
    for copy in 0..2 {
        let mut sender = Sender::new(store.clone(), "r", "s");
        for event in &events {
            sender.send(event).await.expect("it is our own directory");
        }
        // The second copy is stored, because this log forgets the ids of discarded events, and is refused.
        work(&store, "one", Settings::default(), events.len()).await;
        let ids: Vec<_> = all(&store, Stream::Events).await.into_iter().map(|event| event.id).collect();
        assert!(copy == 1 || ids.is_empty(), "{ids:?}");
    }
    assert_eq!(decisions(&store).await["r"].len(), events.len());
}
