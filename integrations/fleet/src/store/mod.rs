//! Interface of a log: streams of messages with conditional appends, and buckets of values with
//! revisions.
//!
//! It is implemented by NATS JetStream and by a local directory without a server. Both persist what
//! they have acknowledged, number messages from 1 in the order of appends, and reject an append or
//! a value if the expected predecessor is not the last one.

pub mod local;
pub mod nats;

use std::future::Future;
use std::time::Duration;

use futures::stream::BoxStream;

/// The streams of a fleet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Stream {
    /// `ev.PARTITION.ROBOT`: events of robots.
    Events,
    /// `dec.PARTITION.ROBOT`: decisions.
    Decisions,
}

impl Stream {
    /// Both streams.
    pub const ALL: [Self; 2] = [Self::Events, Self::Decisions];

    /// First token of the subjects.
    pub fn prefix(self) -> &'static str {
        match self {
            Self::Events => "ev",
            Self::Decisions => "dec",
        }
    }
}

/// The buckets of a fleet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Bucket {
    /// Key `PARTITION`: the owner of the partition. Expires unless it is renewed.
    Leases,
    /// Key: name of a worker. Expires unless it is renewed.
    Workers,
    /// Key `PARTITION`: its [progress](crate::wire::Progress).
    Progress,
    /// Key `PARTITION.ROBOT`: the [saved](crate::wire::Saved) state of the robot.
    Robots,
}

impl Bucket {
    /// All buckets.
    pub const ALL: [Self; 4] = [Self::Leases, Self::Workers, Self::Progress, Self::Robots];

    /// Name of the bucket, which follows the name of the fleet.
    pub fn name(self) -> &'static str {
        match self {
            Self::Leases => "leases",
            Self::Workers => "workers",
            Self::Progress => "progress",
            Self::Robots => "robots",
        }
    }

    /// Returns `true` if values expire unless they are renewed.
    pub fn expires(self) -> bool {
        matches!(self, Self::Leases | Self::Workers)
    }
}

/// A message of a stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stored {
    /// Sequence number from 1, over all subjects of the stream.
    pub sequence: u64,
    /// Subject without the prefix of the stream.
    pub subject: String,
    /// The message id, if it has one.
    pub id: Option<String>,
    /// Time of storage in microseconds since 1970.
    pub time: u64,
    /// Contents of the message.
    pub payload: Vec<u8>,
}

/// A message to append.
#[derive(Debug, Clone, Copy)]
pub struct Message<'a> {
    /// Subject without the prefix of the stream.
    pub subject: &'a str,
    /// Message id. A second message with the same id is not stored.
    pub id: &'a str,
    /// Required sequence number of the last message of the subject, if the append is conditional; 0
    /// requires that the subject has no message.
    pub after: Option<u64>,
    /// Contents of the message.
    pub payload: &'a [u8],
}

/// Acknowledgement of an append.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Receipt {
    /// Sequence number of the message.
    pub sequence: u64,
    /// `true` if an earlier message with the same id was found instead.
    pub is_known: bool,
}

/// A value of a bucket.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Its key.
    pub key: String,
    /// The value.
    pub value: Vec<u8>,
    /// Revision, which grows with every value of the bucket.
    pub revision: u64,
}

/// Reason for a failed operation.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// The expected predecessor is not the last message or value.
    #[error("another message or value is there than was expected")]
    Conflict,
    /// The message exceeds the server's limit.
    #[error("the message has {0} bytes; that is more than the server takes")]
    TooLong(usize),
    /// The result is unknown; the operation may succeed later and must be retried.
    #[error("{0}")]
    Unreachable(String),
}

/// The log of a fleet.
pub trait Store: Clone + Send + Sync + 'static {
    /// Number of partitions, which never changes.
    fn partitions(&self) -> u32;

    /// Time after which leases and presences expire unless they are renewed. It never changes.
    fn lease(&self) -> Duration;

    /// Returns the messages of a partition after a sequence number as an endless stream, in
    /// ascending order.
    fn follow(
        &self,
        stream: Stream,
        partition: u32,
        after: u64,
    ) -> impl Future<Output = Result<BoxStream<'static, Result<Stored, Fault>>, Fault>> + Send;

    /// Returns all messages of a partition after a sequence number that exist at the time of the
    /// call.
    fn history(
        &self,
        stream: Stream,
        partition: u32,
        after: u64,
    ) -> impl Future<Output = Result<Vec<Stored>, Fault>> + Send;

    /// Returns the sequence number of the last message of a partition; 0 for an empty partition.
    fn end(&self, stream: Stream, partition: u32) -> impl Future<Output = Result<u64, Fault>> + Send;

    /// Appends a message durably.
    fn append(
        &self,
        stream: Stream,
        message: Message<'_>,
    ) -> impl Future<Output = Result<Receipt, Fault>> + Send;

    /// Returns the last message of a subject.
    fn last(
        &self,
        stream: Stream,
        subject: &str,
    ) -> impl Future<Output = Result<Option<Stored>, Fault>> + Send;

    /// Returns the message with a sequence number, of any subject.
    fn at(&self, stream: Stream, sequence: u64)
    -> impl Future<Output = Result<Option<Stored>, Fault>> + Send;

    /// Returns a value.
    fn get(&self, bucket: Bucket, key: &str) -> impl Future<Output = Result<Option<Entry>, Fault>> + Send;

    /// Writes a value if the current revision is the given one (0: no value). Returns the new
    /// revision.
    fn put(
        &self,
        bucket: Bucket,
        key: &str,
        value: &[u8],
        after: u64,
    ) -> impl Future<Output = Result<u64, Fault>> + Send;

    /// Removes a value if it has that revision.
    fn remove(
        &self,
        bucket: Bucket,
        key: &str,
        revision: u64,
    ) -> impl Future<Output = Result<(), Fault>> + Send;

    /// Returns all values of a bucket, or those of a partition's robots, at least as new as a
    /// revision.
    fn list(
        &self,
        bucket: Bucket,
        partition: Option<u32>,
        at_least: u64,
    ) -> impl Future<Output = Result<Vec<Entry>, Fault>> + Send;

    /// Publishes on `err.PARTITION.ROBOT` why an event was refused. The message is not persistent.
    fn notice(&self, subject: &str, text: &str) -> impl Future<Output = ()> + Send;
}
