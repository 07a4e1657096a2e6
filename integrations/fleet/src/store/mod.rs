//! Interface of a log: streams of messages with conditional appends, and buckets with values that
//! have revisions.
//!
//! NATS JetStream and a local directory implement the interface. Both store data durably before
//! they acknowledge it, and number messages from 1 in the order of appends. They reject an append
//! or a value if the last message or value is not the expected predecessor.

pub mod local;
pub mod nats;

use std::future::Future;
use std::time::Duration;

use futures::stream::BoxStream;

/// The two streams of messages of a fleet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Stream {
    /// Events of robots, with subjects `ev.PARTITION.ROBOT` after the prefix of the fleet.
    Events,
    /// Decisions for robots, with subjects `dec.PARTITION.ROBOT` after the prefix of the fleet.
    Decisions,
}

impl Stream {
    /// Both streams.
    pub const ALL: [Self; 2] = [Self::Events, Self::Decisions];

    /// Returns the first token of the stream's subjects after the prefix of the fleet.
    pub fn prefix(self) -> &'static str {
        match self {
            Self::Events => "ev",
            Self::Decisions => "dec",
        }
    }
}

/// The buckets of a fleet, i.e. tables from keys to values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Bucket {
    /// Key `PARTITION`: the worker that leases the partition. Expires unless it is renewed.
    Leases,
    /// Key: name of a worker; value: its [status](crate::wire::Presence). Expires unless it is
    /// renewed.
    Workers,
    /// Key `PARTITION`: the [progress](crate::wire::Progress) of the partition.
    Progress,
    /// Key `PARTITION.ROBOT`: the [snapshot](crate::wire::Saved) of the robot.
    Robots,
}

impl Bucket {
    /// All buckets.
    pub const ALL: [Self; 4] = [Self::Leases, Self::Workers, Self::Progress, Self::Robots];

    /// Returns the name of the bucket. The full name begins with the name of the fleet.
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

/// A stored message of a stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stored {
    /// Sequence number in the stream, from 1, over all subjects.
    pub sequence: u64,
    /// Subject without the prefixes of fleet and stream: `PARTITION.ROBOT`.
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
    /// Subject without the prefixes of fleet and stream: `PARTITION.ROBOT`.
    pub subject: &'a str,
    /// Message id. A further message with the same id is not stored (with NATS: for ten minutes). An
    /// empty id is not compared.
    pub id: &'a str,
    /// For a conditional append: the sequence number that the last message of the subject must
    /// have. 0 requires that the subject has no message.
    pub after: Option<u64>,
    /// Contents of the message.
    pub payload: &'a [u8],
}

/// Acknowledgement that a message is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Receipt {
    /// Sequence number of the message.
    pub sequence: u64,
    /// `true` if the message was not stored, because an earlier message has the same id.
    pub is_known: bool,
}

/// A value of a bucket with its revision.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Key of the value.
    pub key: String,
    /// Bytes of the value.
    pub value: Vec<u8>,
    /// Number of the write of this value. It grows with every write in the bucket.
    pub revision: u64,
}

/// Reason why an operation on the log failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// The last message of the subject or the current value of the key is not the expected
    /// predecessor.
    #[error("the stored message or value is not the expected one")]
    Conflict,
    /// The message with this number of bytes is longer than the server accepts.
    #[error("the message has {0} bytes; that is more than the server accepts")]
    TooLong(usize),
    /// The result is unknown: the operation may still succeed. It has to be retried.
    #[error("{0}")]
    Unreachable(String),
}

/// The log of a fleet: streams and buckets. Clones share the log.
pub trait Store: Clone + Send + Sync + 'static {
    /// Returns the number of partitions, which never changes.
    fn partitions(&self) -> u32;

    /// Returns the time after which leases and published statuses expire unless they are renewed.
    /// The time never changes.
    fn lease(&self) -> Duration;

    /// Returns the messages of a partition after a sequence number, in ascending order. The stream
    /// is endless: it waits for new messages.
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

    /// Returns the messages of one subject after a sequence number, in ascending order, but at most
    /// the first `most`. Messages that are appended during the call may be missing.
    fn of_subject(
        &self,
        stream: Stream,
        subject: &str,
        after: u64,
        most: usize,
    ) -> impl Future<Output = Result<Vec<Stored>, Fault>> + Send;

    /// Returns the sequence number of the last message of a partition, or 0 for an empty partition.
    fn end(&self, stream: Stream, partition: u32) -> impl Future<Output = Result<u64, Fault>> + Send;

    /// Appends a message and waits until it is stored durably. Stores nothing if an earlier message
    /// has the same id. Fails with [`Fault::Conflict`] if the last message of the subject is not the
    /// one that [`Message::after`] requires.
    fn append(
        &self,
        stream: Stream,
        message: Message<'_>,
    ) -> impl Future<Output = Result<Receipt, Fault>> + Send;

    /// Returns the last message of a subject, or `None` if the subject has no message.
    fn last(
        &self,
        stream: Stream,
        subject: &str,
    ) -> impl Future<Output = Result<Option<Stored>, Fault>> + Send;

    /// Returns the message of a stream with this sequence number, or `None` if it does not exist.
    /// The message may have any subject.
    fn at(&self, stream: Stream, sequence: u64)
    -> impl Future<Output = Result<Option<Stored>, Fault>> + Send;

    /// Returns the value of a key with its revision, or `None` if there is no value.
    fn get(&self, bucket: Bucket, key: &str) -> impl Future<Output = Result<Option<Entry>, Fault>> + Send;

    /// Writes a value if the current revision of the key is `after` (0: the key has no value).
    /// Returns the new revision, or [`Fault::Conflict`] if the current revision is another one.
    fn put(
        &self,
        bucket: Bucket,
        key: &str,
        value: &[u8],
        after: u64,
    ) -> impl Future<Output = Result<u64, Fault>> + Send;

    /// Removes the value of a key if its revision is `revision`; fails with [`Fault::Conflict`]
    /// otherwise.
    fn remove(
        &self,
        bucket: Bucket,
        key: &str,
        revision: u64,
    ) -> impl Future<Output = Result<(), Fault>> + Send;

    /// Returns all values of a bucket, or those of one partition's robots. The result contains at
    /// least all writes up to the revision `at_least`.
    fn list(
        &self,
        bucket: Bucket,
        partition: Option<u32>,
        at_least: u64,
    ) -> impl Future<Output = Result<Vec<Entry>, Fault>> + Send;

    /// Publishes a notice about a robot on `err.PARTITION.ROBOT`, such as the reason why an event
    /// was refused. The notice is not persistent.
    fn notice(&self, subject: &str, text: &str) -> impl Future<Output = ()> + Send;
}
