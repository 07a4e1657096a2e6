//! Tests of decisions about the passing of time.

use std::sync::Arc;
use std::time::Duration;

use metaplan::mapek::Observation;
use metaplan_fleet::missions::Missions;
use metaplan_fleet::partition::Shared;
use metaplan_fleet::robot::{Begun, Robot};
use metaplan_fleet::wire::Decided;

use super::harness::{ENROL, Fleet, MISSIONS, Running, TICK, event, patient, until, write_version};
use super::scripts::essence;

/// Returns the mission `ugv`, whose actions are overdue after half a second without a report.
fn impatient() -> Missions {
    let folder = tempfile::tempdir().expect("a directory");
    let directory = folder.path().join("missions");
    write_version(&directory, "deadline = 0.5\ndeadline_factor = 0.001");
    Missions::read(&directory).unwrap_or_else(|errors| panic!("{errors}"))
}

fn is_overdue(decided: &Decided) -> bool {
    decided.answers.iter().any(|answer| answer["answer"] == "overdue")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_action_without_reports_is_overdue_without_an_event() {
    let (fleet, missions) = (Fleet::new(1), impatient());
    let shared = Shared::new(fleet.store.clone(), missions, "one".to_owned(), patient());
    let _owner = Running::owner(Arc::new(shared));
    let mut events = fleet.tell("r", &[ENROL]).await;
    let has_timers =
        async |count| fleet.of("r").await.iter().filter(|decided| decided.timer).count() >= count;
    until("there are no timers", async || has_timers(2).await).await;
    events.extend(fleet.tell("r", &[TICK]).await);
    let is_decided = async || fleet.of("r").await.iter().any(|decided| decided.event == events[1]);
    until("the tick is not decided", is_decided).await;
    let decisions = fleet.of("r").await;
    for pair in decisions.windows(2).filter(|pair| pair[1].timer) {
        assert!(is_overdue(&pair[1]), "{:?}", pair[1].answers);
        assert_eq!(pair[1].event, pair[0].event);
    }
    // No timer is early. The deadlines of the action are 1, 2, 3, 5, … times half a second after its request.
    let timers = decisions.iter().filter(|decided| decided.timer);
    for (decided, deadline) in timers.zip([500_000, 1_000_000, 1_500_000, 2_500_000]) {
        assert!(decided.now >= deadline, "{} {deadline}", decided.now);
    }
    let about_events: Vec<u64> =
        decisions.iter().filter(|decided| !decided.timer).map(|decided| decided.event).collect();
    assert_eq!(about_events, events);
}

#[test]
fn a_timer_is_decided_as_by_a_loop_of_its_own() {
    let missions = impatient();
    let mut control = missions.get("ugv").expect("it exists").control.clone();
    let mut robot = Robot::default();
    robot.decide(&event(1, ENROL), &missions).expect("it is not refused");
    control.start();
    for _ in 0..4 {
        let pause = robot.pause().expect("an action is under way");
        let due = control.due().expect("an action is under way");
        assert_eq!(control.beliefs().now() + pause, due);
        let Ok(Begun::Decided(decided)) = robot.begin_timer(pause, &missions) else {
            panic!("no search is necessary")
        };
        assert!(decided.timer && is_overdue(&decided));
        assert_eq!((decided.event, u128::from(decided.now)), (1, due.as_micros()));
        let answers = control.handle(&Observation::timer(), due);
        assert_eq!(essence(&decided.answers), essence(&control.decision(&answers).answers));
        // The next owner continues from there.
        robot = Robot::restore(decided);
        assert_eq!(robot.pause(), None, "the loop is not loaded");
        robot.begin_timer(Duration::ZERO, &missions).expect("it is loaded");
        control.handle(&Observation::timer(), due);
    }
}

#[test]
fn a_robot_whose_events_state_their_times_has_no_timers() {
    let mut robot = Robot::default();
    assert_eq!(robot.pause(), None);
    robot.decide(&event(1, ENROL), &MISSIONS).expect("it is not refused");
    assert_eq!(robot.pause(), Some(Duration::from_secs(180)), "three times the duration of an action");
    let timed = r#"{"event": "tick", "time": 1}"#;
    let decided = robot.decide(&event(2, timed), &MISSIONS).expect("it is not refused");
    assert_eq!(robot.pause(), None);
    // The next owner knows it, too.
    let mut robot = Robot::restore(decided);
    robot.decide(&event(3, TICK), &MISSIONS).expect("it is not refused");
    assert_eq!(robot.pause(), None);
}
