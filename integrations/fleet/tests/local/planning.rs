//! Tests of searches for plans that take longer than the reaction to an event.

use std::sync::Arc;
use std::time::Duration;

use metaplan_fleet::partition::{Order, Settings, Shared, serve};
use metaplan_fleet::store::Stream;
use tokio::sync::watch;

use super::{all, decisions, missions, open, scripts, tell};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn reactions_do_not_wait_for_plans_and_each_plan_is_found_by_some_owner() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = open(folder.path(), 1);
    let mut scripts = Vec::new();
    for (number, (mission, scenario)) in scripts::SCENARIOS.into_iter().cycle().take(8).enumerate() {
        let robot = format!("{mission}-{number}");
        let (events, _) = scripts::play(mission, scenario, number as u64, 40);
        scripts.push((robot.clone(), mission, tell(&store, &robot, &events).await, events));
    }
    let mut random = fastrand::Rng::with_seed(5);
    for owner in 0.. {
        assert!(owner < 300, "the owners do not come to an end");
        let settings = Settings {
            patience: Duration::from_millis(random.u64(..3)),
            discard_every: random.usize(1..5),
            look: Duration::from_millis(1),
            warm: 3,
            ..Settings::default()
        };
        let shared = Arc::new(Shared::new(store.clone(), missions(), format!("owner-{owner}"), settings));
        let (_orders, heard) = watch::channel(Order::Go);
        let task = tokio::spawn(serve(shared, 0, heard));
        tokio::time::sleep(Duration::from_millis(random.u64(1..150))).await;
        task.abort();
        // Events are discarded only after their plans are found.
        if all(&store, Stream::Events).await.is_empty() {
            break;
        }
    }
    let made = decisions(&store).await;
    for (robot, mission, sequences, events) in &scripts {
        scripts::assert_replayed(mission, events, &made[robot], sequences);
    }
    let made: Vec<_> = made.values().flatten().collect();
    assert!(made.iter().filter(|own| own.planned && !own.late).count() > 20);
    let is_effect = |answer: &serde_json::Value| answer.get("effect").is_some();
    assert!(
        made.iter().any(|own| own.planning && own.answers.iter().any(is_effect)),
        "safe reactions come first"
    );
}
