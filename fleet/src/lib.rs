//! The adaptation loops of many robots, on more than one machine: NATS JetStream is the journal, workers are stateless programs.
//!
//! A robot says what it sees on the subject `ev.PARTITION.ROBOT`, and hears what it is to do on `dec.PARTITION.ROBOT`. Both are streams:
//! nothing is forgotten, and the stream of events is the journal. A worker leases partitions, and runs the [loops](metaplan::mapek::Loop)
//! of their robots. Every event leads to exactly one decision, which is appended only *behind the decision before it*
//! (compare-and-set by the last sequence of the subject). So a worker that was away, and believes that it still has its lease,
//! cannot decide anything twice: leases make it fast, the chain of decisions makes it right.
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
