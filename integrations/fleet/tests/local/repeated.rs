//! Tests of messages that are sent again after the log has forgotten their ids, because the events are discarded.

use metaplan_fleet::partition::Settings;
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::{Message, Store, Stream};
use metaplan_fleet::wire::Address;

use super::{assert_same, decisions, heard, open, scripts, work};

/// Sends events of the robot `r` with the ids of their numbers.
async fn send(store: &Local, events: &[(usize, &str)]) -> Vec<u64> {
    let subject = Address::of("r", 1).to_string();
    let mut sequences = Vec::new();
    for (number, event) in events {
        let id = format!("r:{number}");
        let message = Message { subject: &subject, id: &id, after: None, payload: event.as_bytes() };
        let receipt = store.append(Stream::Events, message).await.expect("it is our own directory");
        assert!(!receipt.is_known, "the log has forgotten the id");
        sequences.push(receipt.sequence);
    }
    sequences
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_event_is_decided_once_though_the_log_has_forgotten_its_id() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = open(folder.path(), 1);
    let mut notices = store.notices();
    let (events, answers) = scripts::play("ugv", "kinect_comes_and_goes", 5, 30);
    let numbered: Vec<(usize, &str)> = events.iter().map(String::as_str).enumerate().collect();
    let mut sequences = send(&store, &numbered[..12]).await;
    work(&store, "one", Settings::default(), 12).await;
    // An acknowledgement was lost: the robot repeats two events, and then sends new ones.
    send(&store, &numbered[7..9]).await;
    sequences.extend(send(&store, &numbered[12..20]).await);
    work(&store, "two", Settings::default(), 20).await;
    send(&store, &numbered[3..20]).await;
    sequences.extend(send(&store, &numbered[20..]).await);
    work(&store, "three", Settings::default(), events.len()).await;
    assert_same("r", &decisions(&store).await["r"], &sequences, &answers);
    // A retired robot is not enrolled by a repetition, though only ids are stored about it.
    let number = events.len();
    send(&store, &[(number, r#"{"event": "retire"}"#)]).await;
    work(&store, "four", Settings::default(), number + 1).await;
    let again = send(&store, &[(0, events[0].as_str()), (number + 1, events[0].as_str())]).await;
    work(&store, "five", Settings::default(), number + 2).await;
    let made = &decisions(&store).await["r"];
    assert_eq!(made.last().map(|decided| decided.event), again.last().copied());
    let refusals = 2 + 17 + 1;
    for _ in 0..refusals {
        let reason = heard(&mut notices).await;
        assert!(reason.contains("decided before"), "{reason}");
    }
    assert!(notices.try_recv().is_err(), "there are no further refusals");
}
