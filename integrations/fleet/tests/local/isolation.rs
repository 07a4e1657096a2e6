//! Tests of robots that do not delay others of their partition.

use std::time::Duration;

use metaplan_fleet::partition::Settings;
use metaplan_fleet::store::Stream;
use metaplan_fleet::wire::Address;
use serde_json::json;

use super::{all, assert_same, decisions, open, scripts, tell, work};

fn flaps(count: usize) -> Vec<String> {
    let flap = |number: usize| {
        let status = if number.is_multiple_of(2) { "FALSE" } else { "OK" };
        // Times are those of the robot, so that filters do not depend on the speed of this machine.
        let time = 10 * (number + 1);
        json!({"event": "component_status", "component": "c_kinect", "status": status, "time": time})
            .to_string()
    };
    let enrol = json!({"event": "enrol", "mission": "ugv"}).to_string();
    std::iter::once(enrol).chain((0..count).map(flap)).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_robot_with_many_events_does_not_delay_another_one() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = open(folder.path(), 1);
    let (many, few) = (flaps(400), flaps(2));
    let first = tell(&store, "sick", &many).await;
    let second = tell(&store, "well", &few).await;
    let settings = Settings { discard_every: 7, look: Duration::from_millis(5), ..Settings::default() };
    // The partition changes its owner while events of `sick` are not in the queue.
    work(&store, "one", settings, 150).await;
    work(&store, "two", settings, many.len() + few.len()).await;
    let made = decisions(&store).await;
    assert_same("sick", &made["sick"], &first, &scripts::alone("ugv", &many));
    assert_same("well", &made["well"], &second, &scripts::alone("ugv", &few));
    let order = all(&store, Stream::Decisions).await;
    let subject = Address::of("well", 1).to_string();
    let last = order.iter().rposition(|decision| decision.subject == subject).expect("it is decided");
    // The order of the threads also depends on the machine.
    assert!(last + 1 < order.len(), "all events of `sick` come first");
}
