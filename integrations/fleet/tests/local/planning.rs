//! Tests of searches for plans that take longer than the reaction to an event.

use std::time::Duration;

use metaplan_fleet::partition::Settings;
use metaplan_fleet::robot::{Begun, Robot};
use metaplan_fleet::store::{Store as _, Stored};

use super::harness::{Client, Fleet, MISSIONS, RETIRE, TICK, event, patient};
use super::scripts;

/// Settings with which a decision waits this number of milliseconds for its plan.
fn hasty(millis: u64) -> Settings {
    Settings { patience: Duration::from_millis(millis), ..patient() }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_single_owner_handles_all_events_of_a_long_queue() {
    let fleet = Fleet::new(1);
    let mut robot = Client::play("r", ("ugv", "kinect_comes_and_goes"), 5, 90);
    assert!(robot.events.len() > 80, "the queue in memory is shorter");
    let _owner = fleet.own("owner", Settings { discard_every: 1, ..hasty(0) });
    // Events that wait for the plans of earlier ones, and then events that do not.
    for number in 0..60 {
        robot.send(&fleet, number + 1).await;
        fleet.settle().await;
    }
    robot.send_all(&fleet).await;
    // This event is refused while a plan is missing, and must be discarded, too.
    fleet.tell("s", &robot.events[..1]).await;
    fleet.append_event("0.s", "r:1", RETIRE.as_bytes()).await;
    fleet.settle().await;
    let made = &fleet.of("r").await;
    let compared = scripts::assert_replayed("r", "ugv", &robot.events, made, &robot.sequences);
    assert!(compared > 2, "{compared} plans were compared");
    let is_effect = |answer: &serde_json::Value| answer.get("effect").is_some();
    assert!(
        made.iter().any(|decision| decision.planning && decision.answers.iter().any(is_effect)),
        "safe effects come before the plan"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn reactions_do_not_wait_for_plans_and_each_plan_is_found_by_some_owner() {
    let fleet = Fleet::new(1);
    let mut robots = Vec::new();
    for (number, scenario) in scripts::SCENARIOS.into_iter().enumerate() {
        let mut robot = Client::play(&format!("r-{number}"), scenario, number as u64, 40);
        robot.send_all(&fleet).await;
        robots.push(robot);
    }
    let mut random = fastrand::Rng::with_seed(5);
    for owner in 0..100 {
        let patience = [0, 1, 2, 600_000][random.usize(..4)];
        let settings = Settings { discard_every: random.usize(1..12), warm: 3, ..hasty(patience) };
        let _owner = fleet.own("owner", settings);
        // Later owners live longer, so that they also find plans on a slow machine.
        tokio::time::sleep(Duration::from_millis(random.u64(1..150) + owner * owner / 50)).await;
        // Events are discarded only after their plans are found.
        if fleet.has_no_events().await {
            break;
        }
    }
    // On a slow machine, a search can take longer than each of these owners lives.
    let _last = fleet.own("owner", hasty(0));
    fleet.settle().await;
    let mut has_plans = false;
    for robot in &robots {
        let made = fleet.of(&robot.name).await;
        scripts::assert_replayed(&robot.name, robot.mission, &robot.events, &made, &robot.sequences);
        has_plans |= made.iter().any(|decision| decision.planned);
    }
    // How many plans there are, and which effects precede them, depends on the machine's speed.
    assert!(has_plans, "plans come later");
}

/// The former owner has discarded the event that its last decision is about.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_refused_event_starts_the_search_for_a_pending_plan() {
    let fleet = Fleet::new(1);
    let enrolment = fleet.enrol_without_plan(&MISSIONS).await;
    fleet.store.discard("0.r", enrolment).await.expect("it is our own directory");
    fleet.append_event("0.r", "s:1", TICK.as_bytes()).await;
    let _owner = fleet.own("owner", Settings { discard_every: 1, ..hasty(0) });
    fleet.settle().await;
    assert!(fleet.of("r").await.last().is_some_and(|decided| decided.planned));
}

#[test]
fn the_plan_of_an_enrolment_stays_pending_for_the_next_owner() {
    let mut robot = Robot::default();
    let enrolment = event(1, r#"{"event": "enrol", "mission": "uuv"}"#);
    let Ok(Begun::Search(search)) = robot.begin(&enrolment, &MISSIONS) else {
        panic!("a search is necessary")
    };
    let decided = robot.finish(search, None);
    assert!(decided.planning);
    assert!(Robot::restore(decided).is_pending());
    // A request that plans nothing leaves the plan pending.
    let Ok(Begun::Decided(decided)) = robot.begin(&event(2, r#"{"event": "migrate"}"#), &MISSIONS) else {
        panic!("no search is necessary")
    };
    assert!(decided.planning);
}

#[test]
fn the_stored_state_does_not_grow_with_the_events() {
    for (mission, component) in [("camara_like", "c_kinect"), ("ugv", "c_kinect"), ("uuv", "c_thruster_1")] {
        let enrolment = format!(r#"{{"event": "enrol", "mission": "{mission}"}}"#);
        let status = |status| {
            format!(r#"{{"event": "component_status", "component": "{component}", "status": "{status}"}}"#)
        };
        let [lost, well] = [status("FALSE"), status("OK")];
        let mut robot = Robot::default();
        let size = |number: u64| {
            let text = match number {
                1 => &enrolment,
                number if number.is_multiple_of(100) => &lost,
                number if number % 100 == 50 => &well,
                _ => TICK,
            };
            let event = Stored { id: Some(format!("r:{number}")), ..event(number, text) };
            let decided = robot.decide(&event, &MISSIONS).expect("it is not refused");
            serde_json::to_vec(&decided).expect("plain data").len()
        };
        let sizes: Vec<usize> = (1..=600).map(size).collect();
        let [first, last] = [100..300, 300..600].map(|numbers| sizes[numbers].iter().max());
        // Numbers of events have further digits.
        assert!(
            last <= first.map(|first| first + 8).as_ref() && last < Some(&4000),
            "{mission}: {first:?}, {last:?}"
        );
    }
}
