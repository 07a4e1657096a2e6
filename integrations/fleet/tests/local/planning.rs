//! Tests of searches for plans that take longer than the reaction to an event.

use std::sync::Arc;
use std::time::Duration;

use metaplan_fleet::partition::{Order, Settings, Shared, serve};
use metaplan_fleet::robot::{Begun, Robot};
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::{Message, Store as _, Stored, Stream};
use metaplan_fleet::wire::Address;
use tokio::sync::watch;

use super::{decisions, has_no_events, missions, open, scripts, settle, tell};

/// Starts an owner of the only partition that does not wait for plans longer than `patience`.
fn start(store: &Local, patience: u64, settings: Settings) -> tokio::task::JoinHandle<()> {
    let settings =
        Settings { patience: Duration::from_millis(patience), look: Duration::from_millis(1), ..settings };
    let shared = Arc::new(Shared::new(store.clone(), missions(), "owner".to_owned(), settings));
    tokio::spawn(async move {
        let (_orders, heard) = watch::channel(Order::Go);
        serve(shared, 0, heard).await;
    })
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_single_owner_handles_all_events_of_a_long_queue() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = open(folder.path(), 1);
    let (events, _) = scripts::play("ugv", "kinect_comes_and_goes", 5, 90);
    let (waiting, queued) = events.split_at(60);
    assert!(queued.len() > 20, "the queue in memory is shorter");
    let owner = start(&store, 0, Settings { discard_every: 1, ..Settings::default() });
    // Events that wait for the plans of earlier ones, and then events that do not.
    let mut sequences = Vec::new();
    for event in waiting {
        sequences.extend(tell(&store, "r", std::slice::from_ref(event)).await);
        settle(&store).await;
    }
    sequences.extend(tell(&store, "r", queued).await);
    // This event is refused while a plan is missing, and must be discarded, too.
    tell(&store, "s", &events[..1]).await;
    let subject = Address::of("s", 1).to_string();
    let forged = Message { subject: &subject, id: "r:1", after: None, payload: b"{\"event\": \"retire\"}" };
    store.append(Stream::Events, forged).await.expect("it is our own directory");
    settle(&store).await;
    owner.abort();
    let made = &decisions(&store).await["r"];
    let compared = scripts::assert_replayed("ugv", &events, made, &sequences);
    assert!(compared > 2, "{compared} plans were compared");
    let is_effect = |answer: &serde_json::Value| answer.get("effect").is_some();
    assert!(
        made.iter().any(|decision| decision.planning && decision.answers.iter().any(is_effect)),
        "safe effects come before the plan"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn reactions_do_not_wait_for_plans_and_each_plan_is_found_by_some_owner() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = open(folder.path(), 1);
    let mut scripts = Vec::new();
    for (number, (mission, scenario)) in scripts::SCENARIOS.into_iter().enumerate() {
        let robot = format!("{mission}-{number}");
        let (events, _) = scripts::play(mission, scenario, number as u64, 40);
        scripts.push((robot.clone(), mission, tell(&store, &robot, &events).await, events));
    }
    let mut random = fastrand::Rng::with_seed(5);
    for owner in 0..100 {
        let settings = Settings { discard_every: random.usize(1..5), warm: 3, ..Settings::default() };
        let task = start(&store, random.u64(..3), settings);
        // Later owners live longer, so that they also find plans on a slow machine.
        tokio::time::sleep(Duration::from_millis(random.u64(1..150) + owner * owner / 50)).await;
        task.abort();
        // Events are discarded only after their plans are found.
        if has_no_events(&store).await {
            break;
        }
    }
    // On a slow machine, a search can take longer than each of these owners lives.
    let last = start(&store, 0, Settings::default());
    settle(&store).await;
    last.abort();
    let made = decisions(&store).await;
    for (robot, mission, sequences, events) in &scripts {
        scripts::assert_replayed(mission, events, &made[robot], sequences);
    }
    // How many plans there are, and which effects precede them, depends on the machine's speed.
    assert!(made.values().flatten().any(|decision| decision.planned), "plans come later");
}

#[test]
fn the_plan_of_an_enrolment_stays_pending_for_the_next_owner() {
    let (missions, mut robot) = (missions(), Robot::default());
    let event = |sequence, payload: &[u8]| {
        let (subject, payload) = ("0.r".to_owned(), payload.to_vec());
        Stored { sequence, subject, id: None, time: 0, payload }
    };
    let enrolment = event(1, br#"{"event": "enrol", "mission": "uuv"}"#);
    let Ok(Begun::Search(search)) = robot.begin(&enrolment, &missions) else {
        panic!("a search is necessary")
    };
    let decided = robot.finish(search, None);
    assert!(decided.planning);
    assert!(Robot::restore(decided).is_pending());
    // A request that plans nothing leaves the plan pending.
    let Ok(Begun::Decided(decided)) = robot.begin(&event(2, br#"{"event": "migrate"}"#), &missions) else {
        panic!("no search is necessary")
    };
    assert!(decided.planning);
}
