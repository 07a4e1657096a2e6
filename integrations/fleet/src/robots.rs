//! What robots and people do with a fleet: say what happens, hear what is to be done, and look at it.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::partition::pause;
use crate::store::{Bucket, Entry, Fault, Message, Store, Stream};
use crate::wire::{Address, Presence, Progress};

/// Says what happens to one robot, one event after the other: each is stored before the next one is sent, so that order is kept and none is
/// lost or there twice.
#[derive(Debug)]
pub struct Sender<S> {
    store: S,
    address: Address,
    /// What ids begin with behind the robot's name: nothing where the robot numbers its events itself.
    session: String,
    number: u64,
}

impl<S: Store> Sender<S> {
    /// For one robot. Of two senders with the same session, the second one repeats what the first one has said.
    pub fn new(store: S, robot: &str, session: &str) -> Self {
        let address = Address::of(robot, store.partitions());
        Self { store, address, session: session.to_owned(), number: 0 }
    }

    /// Where the robot is.
    pub fn address(&self) -> &Address {
        &self.address
    }

    /// Appends an event; gives its sequence when it is durable. It is tried until then, with growing pauses.
    ///
    /// # Errors
    /// The event is longer than the server takes.
    pub async fn send(&mut self, event: &str) -> Result<u64, Fault> {
        self.number += 1;
        let subject = self.address.to_string();
        // Somebody else's message may have the id that ours was to have; then another one is taken.
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

    /// Whether the message of a sequence, which has our id, says what we say, in our place.
    async fn is_own(&self, subject: &str, sequence: u64, event: &str) -> bool {
        for attempt in 1.. {
            match self.store.at(Stream::Events, sequence).await {
                Ok(found) => {
                    return found
                        .is_some_and(|own| own.subject == subject && own.payload == event.as_bytes());
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

/// A fleet, as it is seen from outside.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Status {
    /// Each partition.
    pub partitions: Vec<PartitionStatus>,
    /// Each worker by its name.
    pub workers: BTreeMap<String, Presence>,
}

/// A partition.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PartitionStatus {
    /// Its number.
    pub partition: u32,
    /// Who has it, if somebody has.
    pub worker: Option<String>,
    /// How often it was taken.
    pub epoch: u64,
    /// Up to which event it is saved.
    pub events: u64,
}

/// Looks at a fleet.
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
        let known = progress.get(&key).cloned().unwrap_or_default();
        let worker = leases.get(&key).cloned();
        PartitionStatus { partition, worker, epoch: known.epoch, events: known.events }
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
