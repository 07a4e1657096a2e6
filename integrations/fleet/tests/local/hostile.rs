//! Tests with invalid or forged messages, which change nothing and are counted, with invalid events, which are answered
//! with an error, and with writes of former owners, which are rejected. Messages are sent again after the log has
//! forgotten their ids, because the events are discarded.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use metaplan_fleet::robot::{Refused, Robot};
use metaplan_fleet::robots::Sender;
use metaplan_fleet::store::{Message, Stored, Stream};

use super::harness::{
    Client, ENROL, Fleet, MISSIONS, RETIRE, Running, TICK, event, heard, patient, shared, until,
};
use super::scripts;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn hostile_messages_change_nothing_and_are_counted() {
    let fleet = Fleet::new(1);
    let mut notices = fleet.store.notices();
    let mut robot = Client::play("good", ("ugv", "kinect_at_wp2"), 1, 12);
    let long = format!("{{\"event\": \"tick\", \"x\": \"{}\"}}", "a".repeat(1 << 20));
    let hostile: [(&str, &str, &[u8]); 9] = [
        ("0.stranger", "", TICK.as_bytes()),
        ("0.stranger", "", b"\xff\xfe not JSON"),
        ("0.stranger", "", long.as_bytes()),
        ("0.stranger", "", b"{\"event\": \"enrol\", \"mission\": \"../ugv\"}"),
        ("0.stranger", "", RETIRE.as_bytes()),
        ("0.good", "", b"{\"event\": \"enrol\", \"mission\": \"uuv\"}"),
        ("0.good", "other:1", RETIRE.as_bytes()),
        ("0.good", "no colon", RETIRE.as_bytes()),
        ("0.a b", "", ENROL.as_bytes()),
    ];
    let mut sender = Sender::new(fleet.store.clone(), "good", "");
    for (number, event) in robot.events.iter().enumerate() {
        robot.sequences.push(sender.send(event).await.expect("it is our own directory"));
        if let Some((subject, id, payload)) = hostile.get(number) {
            fleet.append_event(subject, id, payload).await;
        }
    }
    let shared = shared(fleet.store.clone(), "one", patient());
    let owner = Running::owner(Arc::clone(&shared));
    fleet.decided(robot.events.len()).await;
    // Events of other robots may be handled later.
    until("refusals", async || shared.counts.refused.load(Ordering::Relaxed) >= 8).await;
    owner.stop().await;
    assert_eq!(fleet.all(Stream::Decisions).await.len(), robot.events.len());
    robot.verify(&fleet).await;
    // Messages without a valid address belong to no partition, so they are not read.
    assert_eq!(shared.counts.refused.load(Ordering::Relaxed), 8);
    assert_eq!(shared.counts.robots.load(Ordering::Relaxed), 0, "nothing is left behind");
    for _ in 0..8 {
        heard(&mut notices).await;
    }
    assert!(notices.try_recv().is_err(), "each refusal has one notice");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn forged_ids_keep_nobody_from_saying_something() {
    let fleet = Fleet::new(1);
    for number in 1..=3 {
        fleet.append_event("0.bad", &format!("good:s.{number}"), TICK.as_bytes()).await;
    }
    let events = scripts::play(("ugv", "kinect_at_wp2"), 1, 5);
    for _ in 0..2 {
        fleet.send("good", "s", &events).await;
    }
    let stored = fleet.all(Stream::Events).await;
    let good = stored.iter().filter(|event| event.subject == "0.good").map(|event| event.payload.as_slice());
    let sent = events.iter().map(String::as_bytes);
    assert_eq!(good.collect::<Vec<_>>(), sent.collect::<Vec<_>>(), "each once, though sent twice");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_robot_whose_last_decision_is_unreadable_can_be_retired() {
    let fleet = Fleet::new(1);
    let mut notices = fleet.store.notices();
    let message = Message { subject: "0.r", id: "", after: Some(0), payload: b"{}" };
    fleet.append(Stream::Decisions, message).await;
    let sequences = fleet.tell("r", &[TICK, RETIRE, ENROL]).await;
    fleet.work("one", patient(), 3).await;
    let made: Vec<u64> = fleet.of("r").await.iter().map(|decided| decided.event).collect();
    assert_eq!(made, sequences[1..]);
    assert!(heard(&mut notices).await.contains("cannot be read"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_event_that_is_sent_again_after_its_decision_is_not_stored_with_another_id() {
    let fleet = Fleet::new(1);
    let events = scripts::play(("ugv", "kinect_at_wp2"), 1, 5);
    for copy in 0..2 {
        fleet.send("r", "s", &events).await;
        // The second copy is stored, because this log forgets the ids of discarded events, and is refused.
        fleet.work("one", patient(), events.len()).await;
        let ids: Vec<_> = fleet.all(Stream::Events).await.into_iter().map(|event| event.id).collect();
        assert!(copy == 1 || ids.is_empty(), "{ids:?}");
    }
    assert_eq!(fleet.of("r").await.len(), events.len());
}

/// Sends events of the robot `r` with the ids of their numbers.
async fn send(fleet: &Fleet, events: &[String], numbers: impl IntoIterator<Item = usize>) -> Vec<u64> {
    let mut sequences = Vec::new();
    for number in numbers {
        sequences.push(fleet.append_event("0.r", &format!("r:{number}"), events[number].as_bytes()).await);
    }
    sequences
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_event_is_decided_once_though_the_log_has_forgotten_its_id() {
    let fleet = Fleet::new(1);
    let mut notices = fleet.store.notices();
    let mut robot = Client::play("r", ("ugv", "kinect_comes_and_goes"), 5, 30);
    let count = robot.events.len();
    let events = [robot.events.clone(), vec![RETIRE.to_owned(), ENROL.to_owned()]].concat();
    robot.sequences = send(&fleet, &events, 0..12).await;
    fleet.work("one", patient(), 12).await;
    // An acknowledgement was lost: the robot repeats two events, and then sends new ones.
    send(&fleet, &events, 7..9).await;
    robot.sequences.extend(send(&fleet, &events, 12..20).await);
    fleet.work("two", patient(), 20).await;
    send(&fleet, &events, 3..20).await;
    robot.sequences.extend(send(&fleet, &events, 20..count).await);
    fleet.work("three", patient(), count).await;
    robot.verify(&fleet).await;
    // A retired robot is not enrolled by a repetition, though only ids are stored about it.
    send(&fleet, &events, [count]).await;
    fleet.work("four", patient(), count + 1).await;
    let again = send(&fleet, &events, [0, count + 1]).await;
    fleet.work("five", patient(), count + 2).await;
    assert_eq!(fleet.of("r").await.last().map(|decided| decided.event), again.last().copied());
    let refusals = 2 + 17 + 1;
    for _ in 0..refusals {
        let reason = heard(&mut notices).await;
        assert!(reason.contains("decided before"), "{reason}");
    }
    assert!(notices.try_recv().is_err(), "there are no further refusals");
}

#[test]
fn an_event_is_decided_once_or_refused_as_late_after_a_restart() {
    let (mut last, mut sequence) = (None, 0);
    let mut decide = |id: &str, text: &str| {
        sequence += 1;
        let mut robot = last.clone().map_or_else(Robot::default, Robot::restore);
        let event = Stored { id: Some(id.to_owned()), ..event(sequence, text) };
        robot.decide(&event, &MISSIONS).map(|decided| last = Some(decided))
    };
    let long = format!("r:{}", "x".repeat(200));
    assert_eq!(decide(&format!("{long}1"), ENROL), Ok(()));
    assert_eq!(decide(&format!("{long}1"), TICK), Err(Refused::RepeatedId.into()));
    assert_eq!(decide(&format!("{long}2"), TICK), Ok(()));
    // 17 ranges, of which the two lowest ones are merged to 0..=2.
    for number in (0..=32).step_by(2) {
        assert_eq!(decide(&format!("r:{number}"), TICK), Ok(()));
    }
    assert_eq!(decide("r:1", TICK), Err(Refused::LateId.into()));
    assert_eq!(decide("r:2", TICK), Err(Refused::LateId.into()));
    assert_eq!(decide("r:4", TICK), Err(Refused::RepeatedId.into()));
    assert_eq!(decide("r:3", TICK), Ok(()));
}

#[test]
fn only_objects_are_requests_for_the_fleet() {
    let mut robot = Robot::default();
    let mut decide = |sequence, text: &str| robot.decide(&event(sequence, text), &MISSIONS);
    assert_eq!(decide(1, r#"["enrol", "ugv"]"#), Err(Refused::NotEnrolled.into()));
    assert!(decide(2, ENROL).is_ok());
    assert!(decide(3, r#"["retire"]"#).is_ok_and(|decided| !decided.retired));
    assert_eq!(decide(4, r#"{"event": "migrate", "at": null}"#), Err(Refused::UnknownSafePoint.into()));
    assert!(decide(5, RETIRE).is_ok_and(|decided| decided.retired));
}
