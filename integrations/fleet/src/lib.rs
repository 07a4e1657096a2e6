//! Adaptation loops of many robots on several machines, with NATS JetStream as the journal and
//! stateless workers.
//!
//! Robots append events to the subject `ev.PARTITION.ROBOT`, and receive decisions on `dec.PARTITION.ROBOT`. Except in
//! the default fleet, both subjects begin with the name of the fleet. A partition is a fixed group of robots. Both
//! streams are persistent. The last decision about a robot contains its state. A worker owns partitions and runs the
//! [loops](metaplan::mapek::Loop) of their robots.
//!
//! Every event that is not refused leads to exactly one decision, unless the robot is suspended because it cannot
//! continue. A decision is appended only if the robot's previous decision is still the last one (compare-and-set on the
//! last sequence of the subject). So two workers that own a partition at the same time cannot both decide an event: the
//! division of partitions is for efficiency, and the chain of decisions guarantees correctness.
//!
//! ```
//! use std::{path::Path, sync::Arc, time::Duration};
//!
//! use metaplan_fleet::missions::Missions;
//! use metaplan_fleet::partition::{Settings, Shared};
//! use metaplan_fleet::robots::Sender;
//! use metaplan_fleet::store::{Store as _, Stream, local::Local};
//! use metaplan_fleet::{wire::Decided, worker};
//!
//! # #[tokio::main]
//! # async fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let directory = folder.path();
//! let store = Local::open(directory, 4, 8, Duration::from_secs(2))?;
//! let missions = Missions::read(Path::new("../../missions"))?;
//! let shared = Arc::new(Shared::new(store.clone(), missions, "worker-1".to_owned(), Settings::default()));
//! let (stop, stopped) = tokio::sync::watch::channel(false);
//! let worker = tokio::spawn(worker::run(shared, stopped));
//!
//! let mut robot = Sender::new(store.clone(), "ugv-1", "");
//! let event = robot.send(r#"{"event": "enrol", "mission": "ugv"}"#).await?;
//! let subject = robot.address().to_string();
//! // A search that takes longer than `Settings::patience` has a decision of its own, which follows that of the event.
//! let decided = loop {
//!     if let Some(message) = store.last(Stream::Decisions, &subject).await? {
//!         let decided = Decided::parse(&message.payload).ok_or("no decision")?;
//!         if !decided.planning {
//!             break decided;
//!         }
//!     }
//!     tokio::time::sleep(Duration::from_millis(10)).await;
//! };
//! assert_eq!(decided.event, event);
//! assert!(decided.answers.iter().any(|answer| answer["answer"] == "plan_found"));
//! stop.send_replace(true);
//! worker.await?;
//! # Ok(())
//! # }
//! ```
//!
//! - [`store`]: the interface of a log, which NATS JetStream and a local directory implement.
//! - [`wire`]: data formats of messages and of stored values, and syntax of subjects.
//! - [`robot`]: a single robot, which turns events into decisions, without clock and network.
//! - [`missions`]: current and former versions of missions; [`ids`]: recognition of repeated messages.
//! - [`partition`]: the robots of a partition: order, loading, discarding of handled events.
//! - [`worker`]: division of partitions among workers, metrics, shutdown.
//! - [`health`]: state of a worker for liveness and readiness probes.
//! - [`robots`](mod@robots): clients: append events, follow decisions, query the fleet.

pub mod health;
pub mod ids;
pub mod missions;
pub mod partition;
pub mod robot;
pub mod robots;
pub mod store;
pub mod wire;
pub mod worker;
