//! Interface of a log: two streams of messages with conditional appends, and the status of the workers.
//!
//! NATS JetStream and a local directory implement the interface. Both store data durably before
//! they acknowledge it, and number messages from 1 in the order of appends. They reject an append
//! if the last message of the subject is not the expected predecessor. Events are kept until they are
//! discarded. The last decisions of each robot never expire.

pub mod local;
pub mod nats;

use std::collections::BTreeMap;
use std::time::Duration;

use futures::stream::BoxStream;

use crate::wire::Presence;

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
    /// Message id. A further message with the same id is not stored (with NATS: for ten minutes; in a directory: while
    /// the first one is stored). An empty id is not compared.
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

/// Reason why an operation on the log failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// The last message of the subject is not the expected predecessor.
    #[error("the last message is not the expected one")]
    Conflict,
    /// The message with this number of bytes is longer than the server accepts.
    #[error("the message has {0} bytes; that is more than the server accepts")]
    TooLong(usize),
    /// The result is unknown: the operation may still succeed. It has to be retried.
    #[error("{0}")]
    Unreachable(String),
    /// The log cannot be used any longer, for example because its disk is full. Further attempts also fail.
    #[error("{0}")]
    Failed(String),
}

fn failed(error: impl std::fmt::Display) -> Fault {
    Fault::Unreachable(error.to_string())
}

/// Endless stream of the messages of a partition.
pub type Subscription = BoxStream<'static, Result<Stored, Fault>>;

/// The log of a fleet. Clones share the log.
#[trait_variant::make(Send)]
pub trait Store: Clone + Send + Sync + 'static {
    /// Returns the number of partitions, which never changes.
    fn partitions(&self) -> u32;

    /// Returns the time after which the status of a worker expires unless it is published again. The time never
    /// changes.
    fn lease(&self) -> Duration;

    /// Returns the messages of a partition after a sequence number, in ascending order. The stream
    /// is endless: it waits for new messages.
    async fn follow(&self, stream: Stream, partition: u32, after: u64) -> Result<Subscription, Fault>;

    /// Returns the sequence number of the last message of a partition that exists, or 0 for an empty
    /// partition.
    async fn end(&self, stream: Stream, partition: u32) -> Result<u64, Fault>;

    /// Appends a message and waits until it is stored durably. Stores nothing if an earlier message
    /// has the same id. Fails with [`Fault::Conflict`] if the last message of the subject is not the
    /// one that [`Message::after`] requires.
    async fn append(&self, stream: Stream, message: Message<'_>) -> Result<Receipt, Fault>;

    /// Removes the events of a subject up to and including a sequence number, which is at least 1.
    async fn discard(&self, subject: &str, last: u64) -> Result<(), Fault>;

    /// Returns the last message of a subject, or `None` if the subject has no message.
    async fn last(&self, stream: Stream, subject: &str) -> Result<Option<Stored>, Fault>;

    /// Returns the first event of a subject with at least this sequence number, or `None` if it does not exist.
    async fn next(&self, subject: &str, start: u64) -> Result<Option<Stored>, Fault>;

    /// Publishes the status of a worker until it expires, or withdraws it.
    async fn announce(&self, worker: &str, status: Option<&Presence>) -> Result<(), Fault>;

    /// Returns the status of all workers, by name.
    async fn workers(&self) -> Result<BTreeMap<String, Presence>, Fault>;

    /// Publishes a notice about a robot on `err.PARTITION.ROBOT`, such as the reason why an event
    /// was refused. The notice is not persistent.
    async fn notice(&self, subject: &str, text: &str);
}
