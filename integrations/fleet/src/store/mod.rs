//! What a fleet needs of a log: streams of messages whose appends can be conditional, and buckets of values with revisions.
//!
//! Two things are one: NATS JetStream, and a directory of this machine without a server. Both keep what they have acknowledged, number
//! messages from 1 in the order of appending, and refuse an append or a value behind another one than was expected.

pub mod local;
pub mod nats;

use std::future::Future;
use std::time::Duration;

use futures::stream::BoxStream;

/// The streams.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Stream {
    /// `ev.PARTITION.ROBOT`: what robots say.
    Events,
    /// `dec.PARTITION.ROBOT`: what they are to do.
    Decisions,
}

impl Stream {
    /// Both of them.
    pub const ALL: [Self; 2] = [Self::Events, Self::Decisions];

    /// The first token of its subjects.
    pub fn prefix(self) -> &'static str {
        match self {
            Self::Events => "ev",
            Self::Decisions => "dec",
        }
    }
}

/// The buckets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Bucket {
    /// Key `PARTITION`: who has the partition; gone when it is not renewed.
    Leases,
    /// Key: a worker's name; gone when it is not renewed.
    Workers,
    /// Key `PARTITION`: its [progress](crate::wire::Progress).
    Progress,
    /// Key `PARTITION.ROBOT`: the robot as it was [saved](crate::wire::Saved).
    Robots,
}

impl Bucket {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Leases, Self::Workers, Self::Progress, Self::Robots];

    /// The name of the bucket, behind that of the fleet.
    pub fn name(self) -> &'static str {
        match self {
            Self::Leases => "leases",
            Self::Workers => "workers",
            Self::Progress => "progress",
            Self::Robots => "robots",
        }
    }

    /// Whether values are gone when they are not renewed.
    pub fn expires(self) -> bool {
        matches!(self, Self::Leases | Self::Workers)
    }
}

/// A message of a stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stored {
    /// From 1, over all subjects of the stream.
    pub sequence: u64,
    /// What stands behind the prefix of the stream.
    pub subject: String,
    /// The message id, if it has one.
    pub id: Option<String>,
    /// When it was stored, in microseconds since 1970.
    pub time: u64,
    /// What it says.
    pub payload: Vec<u8>,
}

/// A message to be appended.
#[derive(Debug, Clone, Copy)]
pub struct Message<'a> {
    /// What stands behind the prefix of the stream.
    pub subject: &'a str,
    /// A second message with the same id is not stored.
    pub id: &'a str,
    /// The sequence of the last message of the subject, if that is a condition; 0 where there must be none.
    pub after: Option<u64>,
    /// What it says.
    pub payload: &'a [u8],
}

/// That a message is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Receipt {
    /// Its sequence.
    pub sequence: u64,
    /// Whether it is not this message that is there, but one with the same id that came before it.
    pub is_known: bool,
}

/// A value of a bucket.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Its key.
    pub key: String,
    /// The value.
    pub value: Vec<u8>,
    /// Grows with every value of the bucket.
    pub revision: u64,
}

/// Why something was not done.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// Another message or value is there than was expected.
    #[error("another message or value is there than was expected")]
    Conflict,
    /// The message is longer than the server takes.
    #[error("the message has {0} bytes; that is more than the server takes")]
    TooLong(usize),
    /// It may have been done, or may be done later; ask again.
    #[error("{0}")]
    Unreachable(String),
}

/// What a fleet needs of a log.
pub trait Store: Clone + Send + Sync + 'static {
    /// How many partitions there are. It never changes.
    fn partitions(&self) -> u32;

    /// After this time leases and signs of life are gone unless they are renewed. It never changes.
    fn lease(&self) -> Duration;

    /// The messages of a partition after a sequence, as they come, without an end. Sequences grow.
    fn follow(
        &self,
        stream: Stream,
        partition: u32,
        after: u64,
    ) -> impl Future<Output = Result<BoxStream<'static, Result<Stored, Fault>>, Fault>> + Send;

    /// The messages of a partition after a sequence: all that are there at the time of the call.
    fn history(
        &self,
        stream: Stream,
        partition: u32,
        after: u64,
    ) -> impl Future<Output = Result<Vec<Stored>, Fault>> + Send;

    /// The sequence of the last message of a partition; 0 where there is none.
    fn end(&self, stream: Stream, partition: u32) -> impl Future<Output = Result<u64, Fault>> + Send;

    /// Appends a message; it is durable then.
    fn append(
        &self,
        stream: Stream,
        message: Message<'_>,
    ) -> impl Future<Output = Result<Receipt, Fault>> + Send;

    /// The last message of a subject.
    fn last(
        &self,
        stream: Stream,
        subject: &str,
    ) -> impl Future<Output = Result<Option<Stored>, Fault>> + Send;

    /// The message of a sequence, of whatever subject.
    fn at(&self, stream: Stream, sequence: u64)
    -> impl Future<Output = Result<Option<Stored>, Fault>> + Send;

    /// A value.
    fn get(&self, bucket: Bucket, key: &str) -> impl Future<Output = Result<Option<Entry>, Fault>> + Send;

    /// Writes a value behind that of a revision, 0 where there must be none; gives its own revision.
    fn put(
        &self,
        bucket: Bucket,
        key: &str,
        value: &[u8],
        after: u64,
    ) -> impl Future<Output = Result<u64, Fault>> + Send;

    /// Takes a value away, if it has that revision.
    fn remove(
        &self,
        bucket: Bucket,
        key: &str,
        revision: u64,
    ) -> impl Future<Output = Result<(), Fault>> + Send;

    /// All values of a bucket, or those of a partition's robots; at least as new as that revision.
    fn list(
        &self,
        bucket: Bucket,
        partition: Option<u32>,
        at_least: u64,
    ) -> impl Future<Output = Result<Vec<Entry>, Fault>> + Send;

    /// Tells whoever listens on `err.PARTITION.ROBOT` why an event was refused; it is not kept.
    fn notice(&self, subject: &str, text: &str) -> impl Future<Output = ()> + Send;
}
