//! Example: a fleet of two robots whose events and decisions are stored in a local directory instead of on a server. Each
//! robot enrols, one loses its Kinect sensor, and the program prints the decision on the last event of each robot.

#![expect(clippy::print_stdout, reason = "an example prints")]

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use metaplan_fleet::missions::Missions;
use metaplan_fleet::partition::{Settings, Shared};
use metaplan_fleet::robots::Sender;
use metaplan_fleet::store::{Store as _, Stream, local::Local};
use metaplan_fleet::{wire::Decided, worker};

#[tokio::main]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let directory = tempfile::tempdir()?;
    let missions = Missions::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../missions"))?;
    let store = Local::open(directory.path(), 4, 8, Duration::from_secs(2))?;
    let shared = Arc::new(Shared::new(store.clone(), missions, "worker-1".to_owned(), Settings::default()));
    let (stop, stopped) = tokio::sync::watch::channel(false);
    let worker = tokio::spawn(worker::run(shared, stopped));
    for (name, mission) in [("ugv-1", "ugv"), ("uuv-1", "uuv")] {
        let mut robot = Sender::new(store.clone(), name, "");
        let mut last = robot.send(&format!(r#"{{"event": "enrol", "mission": "{mission}"}}"#)).await?;
        if mission == "ugv" {
            let failure = r#"{"event": "component_status", "component": "c_kinect", "status": "FALSE"}"#;
            last = robot.send(failure).await?;
        }
        let subject = robot.address().to_string();
        let decided = loop {
            let message = store.last(Stream::Decisions, &subject).await?;
            match message.and_then(|message| Decided::parse(&message.payload)) {
                Some(decided) if decided.event == last => break decided,
                _ => tokio::time::sleep(Duration::from_millis(10)).await,
            }
        };
        let answers: Vec<&str> =
            decided.answers.iter().filter_map(|answer| answer["answer"].as_str()).collect();
        println!("{name}: {}", answers.join(", "));
    }
    stop.send_replace(true);
    worker.await?;
    Ok(())
}
