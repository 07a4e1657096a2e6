//! Functions for clients of a fleet: append events and query the status.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::partition::pause;
use crate::store::{Bucket, Entry, Fault, Message, Store, Stream};
use crate::wire::{Address, Presence, Progress};

/// Appends the events of a robot. Each event is stored before the next one is sent, so events keep
/// their order, and none is lost unless [`Sender::send`] fails. Repeated attempts store no event
/// twice (with NATS: for ten minutes).
#[derive(Debug)]
pub struct Sender<S> {
    store: S,
    address: Address,
    /// Part of a message id between the robot's name and the number of the event, which is counted
    /// from 1 for each sender. It distinguishes the senders of a robot.
    session: String,
    number: u64,
}

impl<S: Store> Sender<S> {
    /// Creates a sender for a robot. `session` becomes a part of the message ids.
    ///
    /// If a second sender has the same session, it must send the same events in the same order. It
    /// then creates the same message ids. So no event is decided twice, and none is stored twice
    /// (with NATS: within ten minutes).
    pub fn new(store: S, robot: &str, session: &str) -> Self {
        let address = Address::of(robot, store.partitions());
        Self { store, address, session: session.to_owned(), number: 0 }
    }

    /// Returns the address of the robot.
    pub fn address(&self) -> &Address {
        &self.address
    }

    /// Appends an event, and retries with growing pauses until it is stored durably. Returns the
    /// sequence number of the event in the stream of events.
    ///
    /// # Errors
    /// The event is longer than the server accepts.
    pub async fn send(&mut self, event: &str) -> Result<u64, Fault> {
        self.number += 1;
        let subject = self.address.to_string();
        // Another client may have used this message id for another message. Then a different id is
        // chosen.
        for spare in 0_u32.. {
            let mut id = format!("{}:{}{}", self.address.robot, self.session, self.number);
            if spare > 0 {
                id = format!("{id}:{spare}");
            }
            let message = Message { subject: &subject, id: &id, after: None, payload: event.as_bytes() };
            let receipt = until_there(&self.store, message).await?;
            if !receipt.is_known || self.is_own(&subject, receipt.sequence, event).await {
                return Ok(receipt.sequence);
            }
        }
        Err(Fault::Conflict)
    }

    /// Returns `true` if the stored message with this sequence number has the subject and payload
    /// that were sent.
    async fn is_own(&self, subject: &str, sequence: u64, event: &str) -> bool {
        for attempt in 1.. {
            match self.store.at(Stream::Events, sequence).await {
                Ok(found) => {
                    return found.is_some_and(|stored| {
                        stored.subject == subject && stored.payload == event.as_bytes()
                    });
                }
                Err(_) => pause(attempt).await,
            }
        }
        false
    }
}

async fn until_there<S: Store>(store: &S, message: Message<'_>) -> Result<crate::store::Receipt, Fault> {
    for attempt in 1.. {
        match store.append(Stream::Events, message).await {
            Err(Fault::Unreachable(_)) => pause(attempt).await,
            other => return other,
        }
    }
    Err(Fault::Conflict)
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
    /// Name of the worker that leases the partition, if any.
    pub worker: Option<String>,
    /// Number of times that a worker has taken over the partition, or has recovered it again.
    pub epoch: u64,
    /// Sequence number up to which snapshots contain the effects of all events, except those of
    /// suspended or delayed robots.
    pub events: u64,
}

/// Reads the status of a fleet.
///
/// # Errors
/// The log cannot be read.
pub async fn status<S: Store>(store: &S) -> Result<Status, Fault> {
    let leases = texts(store.list(Bucket::Leases, None, 0).await?);
    let workers = store.list(Bucket::Workers, None, 0).await?;
    let progress = store.list(Bucket::Progress, None, 0).await?;
    let progress: BTreeMap<String, Progress> = progress
        .into_iter()
        .filter_map(|entry| Some((entry.key, serde_json::from_slice(&entry.value).ok()?)))
        .collect();
    let partitions = (0..store.partitions()).map(|partition| {
        let key = partition.to_string();
        let position = progress.get(&key).cloned().unwrap_or_default();
        let worker = leases.get(&key).cloned();
        PartitionStatus { partition, worker, epoch: position.epoch, events: position.events }
    });
    let presence = |entry: Entry| Some((entry.key, serde_json::from_slice(&entry.value).ok()?));
    Ok(Status {
        partitions: partitions.collect(),
        workers: workers.into_iter().filter_map(presence).collect(),
    })
}

fn texts(entries: Vec<Entry>) -> BTreeMap<String, String> {
    entries.into_iter().map(|entry| (entry.key, String::from_utf8_lossy(&entry.value).into_owned())).collect()
}
