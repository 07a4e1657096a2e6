//! Tests of robots that do not delay others of their partition.

use metaplan_fleet::partition::Settings;
use metaplan_fleet::store::Stream;
use serde_json::json;

use super::harness::{Client, ENROL, Fleet, patient};

fn flaps(name: &str, count: usize) -> Client {
    let flap = |number: usize| {
        let status = if number.is_multiple_of(2) { "FALSE" } else { "OK" };
        // Times are those of the robot, so that filters do not depend on the speed of this machine.
        let time = 10 * (number + 1);
        json!({"event": "component_status", "component": "c_kinect", "status": status, "time": time})
            .to_string()
    };
    Client::new(name, "ugv", std::iter::once(ENROL.to_owned()).chain((0..count).map(flap)).collect())
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_robot_with_many_events_does_not_delay_another_one() {
    let fleet = Fleet::new(1);
    let (mut sick, mut well) = (flaps("sick", 400), flaps("well", 2));
    sick.send(&fleet, ..).await;
    well.send(&fleet, ..).await;
    let settings = Settings { discard_every: 7, ..patient() };
    // The partition changes its owner while events of `sick` are not in the queue.
    fleet.work("one", settings, 150).await;
    fleet.work("two", settings, sick.events.len() + well.events.len()).await;
    sick.verify(&fleet).await;
    well.verify(&fleet).await;
    let order = fleet.all(Stream::Decisions).await;
    let last = order.iter().rposition(|decision| decision.subject == "0.well").expect("it is decided");
    // The order of the threads also depends on the machine.
    assert!(last + 1 < order.len(), "all events of `sick` come first");
}
