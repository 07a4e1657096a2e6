//! Tests of messages that are sent again after the log has forgotten their ids, because the events are discarded.

use metaplan_fleet::partition::Settings;
use metaplan_fleet::robot::{Refused, Robot};
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::{Message, Store, Stored, Stream};
use metaplan_fleet::wire::{Address, Decided};

use super::{assert_same, decisions, heard, missions, open, scripts, work};

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

#[test]
fn an_event_is_decided_once_or_refused_as_late_after_a_restart() {
    let (missions, mut last, mut sequence) = (missions(), None::<Decided>, 0);
    let mut decide = |id: &str, event: &str| {
        sequence += 1;
        let mut robot = last.clone().map_or_else(Robot::default, Robot::restore);
        let (subject, id, payload) = ("0.r".to_owned(), Some(id.to_owned()), event.as_bytes().to_vec());
        let event = Stored { sequence, subject, id, time: sequence, payload };
        let outcome = robot.decide(&event, &missions).expect("the state fits the mission");
        outcome.map(|decided| last = Some(decided))
    };
    let tick = r#"{"event": "tick"}"#;
    let long = format!("r:{}", "x".repeat(200));
    assert_eq!(decide(&format!("{long}1"), r#"{"event": "enrol", "mission": "ugv"}"#), Ok(()));
    assert_eq!(decide(&format!("{long}1"), tick), Err(Refused::Repeated));
    assert_eq!(decide(&format!("{long}2"), tick), Ok(()));
    // 17 ranges, of which the two lowest ones are merged to 0..=2.
    for number in (0..=32).step_by(2) {
        assert_eq!(decide(&format!("r:{number}"), tick), Ok(()));
    }
    assert_eq!(decide("r:1", tick), Err(Refused::Late));
    assert_eq!(decide("r:2", tick), Err(Refused::Late));
    assert_eq!(decide("r:4", tick), Err(Refused::Repeated));
    assert_eq!(decide("r:3", tick), Ok(()));
}
