//! Adaptation loops of many robots on several machines, with NATS JetStream as the journal and
//! stateless workers.
//!
//! Robots append events to the subject `ev.PARTITION.ROBOT`, and receive decisions on `dec.PARTITION.ROBOT`. Except in
//! the default fleet, both subjects begin with the name of the fleet. A partition is a fixed group of robots. Both
//! streams are persistent. The last decision about a robot contains its state. A worker owns partitions and runs the
//! [loops](metaplan::mapek::Loop) of their robots.
//!
//! Every event that is not refused leads to exactly one decision, unless the robot is suspended because it cannot
//! continue. A further decision may add the plan. A decision is appended only if the robot's previous decision is
//! still the last one (compare-and-set on the last sequence of the subject). So two workers that own a partition at
//! the same time cannot both decide an event: the division of partitions is for efficiency, and the chain of
//! decisions guarantees correctness.
//!
//! ```
#![doc = include_str!("../examples/directory.rs")]
//! ```
//!
//! - [`store`]: the interface of a log, which NATS JetStream and a local directory implement.
//! - [`wire`]: data formats of messages and of stored values, and syntax of subjects.
//! - [`robot`]: a single robot, which turns events into decisions, without clock and network.
//! - [`missions`]: current and former versions of missions; [`ids`]: recognition of repeated messages.
//! - [`partition`]: the robots of a partition: order, loading, discarding of handled events.
//! - [`worker`]: division of partitions among workers, metrics, shutdown.
//! - [`health`]: state of a worker for liveness and readiness probes.
//! - [`robots`](mod@robots): clients: append events, query the fleet.

pub mod health;
pub mod ids;
pub mod missions;
pub mod partition;
pub mod robot;
pub mod robots;
pub mod store;
pub mod wire;
pub mod worker;
