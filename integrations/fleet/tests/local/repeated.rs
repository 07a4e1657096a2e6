//! Tests of messages that are sent again after the log has forgotten their ids, because the events are discarded.

use metaplan_fleet::robot::{Refused, Robot};
use metaplan_fleet::store::Stored;

use super::harness::{Client, ENROL, Fleet, MISSIONS, RETIRE, TICK, event, heard, patient};

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
    assert_eq!(decide(&format!("{long}1"), TICK), Err(Refused::Repeated.into()));
    assert_eq!(decide(&format!("{long}2"), TICK), Ok(()));
    // 17 ranges, of which the two lowest ones are merged to 0..=2.
    for number in (0..=32).step_by(2) {
        assert_eq!(decide(&format!("r:{number}"), TICK), Ok(()));
    }
    assert_eq!(decide("r:1", TICK), Err(Refused::Late.into()));
    assert_eq!(decide("r:2", TICK), Err(Refused::Late.into()));
    assert_eq!(decide("r:4", TICK), Err(Refused::Repeated.into()));
    assert_eq!(decide("r:3", TICK), Ok(()));
}
