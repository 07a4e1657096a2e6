//! Functions for clients of a fleet: append events and query the status.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::ids::Membership;
use crate::partition::repeat;
use crate::store::{Fault, Message, Store, Stream};
use crate::wire::{Address, Decided, Presence};
use crate::worker::owners;

/// Appends the events of a robot. Each event is stored before the next one is sent, so events keep
/// their order, and none is lost unless [`Sender::send`] fails. Repeated attempts store no event
/// twice (with NATS: for ten minutes; in a directory: until the event is discarded), and no event is decided
/// twice. An event that is refused before its acknowledgement arrives can be stored again, under another id.
#[derive(Debug)]
pub struct Sender<S> {
    store: S,
    address: Address,
    /// Message id without the number of the event, which is counted from 1 for each sender.
    prefix: String,
    number: u64,
}

impl<S: Store> Sender<S> {
    /// Creates a sender for a robot. `session` distinguishes the senders of a robot: message ids are
    /// `ROBOT:SESSION.NUMBER`, or `ROBOT:NUMBER` if it is empty.
    ///
    /// If a second sender has the same session, it must send the same events in the same order. It
    /// then creates the same message ids. So no event is decided twice, and none is stored twice
    /// (with NATS: within ten minutes; in a directory: until it is discarded).
    pub fn new(store: S, robot: &str, session: &str) -> Self {
        let address = Address::of(robot, store.partitions());
        let separator = if session.is_empty() { "" } else { "." };
        Self { store, address, prefix: format!("{robot}:{session}{separator}"), number: 0 }
    }

    /// Returns the address of the robot.
    pub fn address(&self) -> &Address {
        &self.address
    }

    /// Appends an event, and retries with growing pauses until it is stored durably. Returns the
    /// sequence number of the event in the stream of events.
    ///
    /// # Errors
    /// The event is longer than the server accepts, or the log cannot be used any longer.
    pub async fn send(&mut self, event: &str) -> Result<u64, Fault> {
        self.number += 1;
        let subject = self.address.to_string();
        // Another client may have used this message id for another message. Then a different id is
        // chosen.
        for spare in 0_u32.. {
            let mut id = format!("{}{}", self.prefix, self.number);
            if spare > 0 {
                id = format!("{id}:{spare}");
            }
            let message = Message { subject: &subject, id: &id, after: None, payload: event.as_bytes() };
            let receipt = repeat(|| self.store.append(Stream::Events, message)).await?;
            if !receipt.is_known || self.is_own(&subject, receipt.sequence, &id, event).await? {
                return Ok(receipt.sequence);
            }
        }
        Err(Fault::Conflict)
    }

    /// Returns `true` if the event with this sequence number has the subject and payload that were sent, or was
    /// discarded after the robot's decision about it.
    async fn is_own(&self, subject: &str, sequence: u64, id: &str, event: &str) -> Result<bool, Fault> {
        let stored = repeat(|| self.store.next(subject, sequence)).await?;
        if let Some(stored) = stored.filter(|stored| stored.sequence == sequence) {
            return Ok(stored.payload == event.as_bytes());
        }
        let last = repeat(|| self.store.last(Stream::Decisions, subject)).await?;
        Ok(last
            .and_then(|last| Decided::parse(&last.payload))
            .is_some_and(|last| last.state.ids.membership(id) != Membership::Absent))
    }
}

/// Status of a fleet, for display.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Status {
    /// Status of each partition, by number.
    pub partitions: Vec<PartitionStatus>,
    /// Status of each worker, by name.
    pub workers: BTreeMap<String, Presence>,
}

/// Status of a partition.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PartitionStatus {
    /// Number of the partition.
    pub partition: u32,
    /// Name of the worker that owns the partition, if any.
    pub worker: Option<String>,
}

/// Reads the status of a fleet.
///
/// # Errors
/// The log cannot be read.
pub async fn status<S: Store>(store: &S) -> Result<Status, Fault> {
    let workers = store.workers().await?;
    let owners = owners(&workers, store.partitions());
    let partitions = (0..store.partitions())
        .map(|partition| PartitionStatus { partition, worker: owners.get(&partition).cloned() });
    Ok(Status { partitions: partitions.collect(), workers })
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::store::local::Local;

    #[tokio::test]
    async fn sessions_that_end_with_a_digit_share_no_message_ids() {
        let folder = tempfile::tempdir().expect("a directory");
        let store = Local::open(folder.path(), 1, 8, Duration::from_secs(1))
            .unwrap_or_else(|message| panic!("{message}"));
        let mut last = 0;
        // Without a separator, the ids of the last two events would be `r:111`, and the second one would not be stored.
        for (session, count) in [("", 1), ("1", 11), ("11", 1)] {
            let mut sender = Sender::new(store.clone(), "r", session);
            for _ in 0..count {
                last = sender.send("equal").await.expect("the event is short");
            }
        }
        assert_eq!(last, 13);
        for (sequence, id) in [(1, "r:1"), (12, "r:1.11"), (13, "r:11.1")] {
            let stored = store.next("0.r", sequence).await.expect("it can be read").expect("it exists");
            assert_eq!(stored.id.as_deref(), Some(id));
        }
    }
}
