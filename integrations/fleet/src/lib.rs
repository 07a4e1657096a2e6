//! The adaptation loops of many robots, on more than one machine: NATS JetStream is the journal, workers are stateless programs.
//!
//! A robot says what it sees on the subject `ev.PARTITION.ROBOT`, and hears what it is to do on `dec.PARTITION.ROBOT`. Both are streams:
//! nothing is forgotten, and the stream of events is the journal. A worker leases partitions, and runs the [loops](metaplan::mapek::Loop)
//! of their robots. Every event leads to exactly one decision, which is appended only *behind the decision before it*
//! (compare-and-set by the last sequence of the subject). So a worker that was away, and believes that it still has its lease,
//! cannot decide anything twice: leases make it fast, the chain of decisions makes it right.
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
//! let store = Local::open(directory, 4, Duration::from_secs(2))?;
//! let missions = Missions::read(Path::new("../../missions"))?;
//! let shared = Arc::new(Shared::new(store.clone(), missions, "worker-1".to_owned(), Settings::default()));
//! let (stop, stopped) = tokio::sync::watch::channel(false);
//! let worker = tokio::spawn(worker::run(shared, stopped));
//!
//! let mut robot = Sender::new(store.clone(), "ugv-1", "");
//! let event = robot.send(r#"{"event": "enrol", "mission": "ugv"}"#).await?;
//! let subject = robot.address().to_string();
//! let message = loop {
//!     match store.last(Stream::Decisions, &subject).await? {
//!         Some(message) => break message,
//!         None => tokio::time::sleep(Duration::from_millis(10)).await,
//!     }
//! };
//! let decided = Decided::parse(&message.payload).ok_or("no decision")?;
//! assert_eq!((decided.event, decided.enrolled.as_deref()), (event, Some("ugv")));
//! assert_eq!(decided.answers[1]["answer"], "plan_found");
//! stop.send_replace(true);
//! worker.await?;
//! # Ok(())
//! # }
//! ```
//!
//! - [`store`]: what is needed of a log; NATS JetStream, or a directory without a server.
//! - [`robot`]: one robot: an event in, a decision out; no clock and no network.
//! - [`partition`]: the robots of one partition: recovery, order, snapshots.
//! - [`worker`]: leases, their fair share, metrics, the end.
//! - [`robots`](mod@robots): what robots and people do: append events, follow decisions, look at the fleet.

pub mod missions;
pub mod partition;
pub mod robot;
pub mod robots;
pub mod store;
pub mod wire;
pub mod worker;
