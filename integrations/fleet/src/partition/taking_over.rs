//! Recovery of a partition from the stored data of former owners.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use futures::stream::FuturesUnordered;

use super::asking::{bytes, pause, persist};
use super::own::Partition;
use super::{End, Shared};
use crate::robot::{Faulted, Robot};
use crate::store::{Bucket, Store, Stored, Stream};
use crate::wire::{Address, Decided, Progress, Saved};

impl<S: Store> Partition<S> {
    /// Takes ownership of a partition and restores its robots: increments the epoch, reads the
    /// snapshots, and collects later decisions for replay. Robots whose version of the mission is
    /// missing are suspended. Snapshots and decisions that cannot be parsed are counted and
    /// ignored.
    pub(super) async fn recover(shared: &Arc<Shared<S>>, number: u32) -> Result<Self, End> {
        let key = number.to_string();
        let store = &shared.store;
        let (progress, revision) = loop {
            let stored_progress =
                persist(|| store.get(Bucket::Progress, &key)).await.map_err(|_| End::Fenced)?;
            let (mut progress, revision) = match stored_progress {
                Some(entry) => (serde_json::from_slice(&entry.value).unwrap_or_default(), entry.revision),
                None => (Progress::default(), 0),
            };
            progress.epoch += 1;
            let value = bytes(&progress);
            match persist(|| store.put(Bucket::Progress, &key, &value, revision)).await {
                Ok(revision) => break (progress, revision),
                // Another worker has written the progress, or an unacknowledged write has
                // succeeded.
                Err(_) => pause(1).await,
            }
        };
        let saved = persist(|| store.list(Bucket::Robots, Some(number), progress.snapshots));
        let saved = saved.await.map_err(|_| End::Fenced)?;
        let history = persist(|| store.history(Stream::Decisions, number, progress.decisions));
        let history = history.await.map_err(|_| End::Fenced)?;
        shared.counts.partitions.fetch_add(1, Ordering::Relaxed);
        let mut partition = Self {
            shared: Arc::clone(shared),
            number,
            seen: (progress.events, progress.decisions),
            snapshots: progress.snapshots,
            progress,
            revision,
            slots: BTreeMap::new(),
            recovered: 0,
            behind: 0,
            jobs: FuturesUnordered::new(),
            waiting: 0,
            is_progressing: false,
            clock: 0,
            recent: VecDeque::new(),
        };
        let mut apart = Vec::new();
        for entry in saved {
            partition.snapshots = partition.snapshots.max(entry.revision);
            apart.extend(partition.take_saved(&entry.key, &entry.value, entry.revision));
        }
        for (address, event, decision) in apart {
            let subject = address.to_string();
            let decisions = persist(|| store.of_subject(Stream::Decisions, &subject, decision, usize::MAX));
            for message in decisions.await.map_err(|_| End::Fenced)? {
                partition.take_decision(&message);
            }
            let slot = partition.slot(&address.robot);
            // A former owner may have retired a robot that is suspended here.
            if slot.suspended.is_none() || !slot.before.is_empty() {
                slot.behind = Some(event + 1);
                partition.behind += 1;
            }
        }
        for message in history {
            partition.take_decision(&message);
        }
        partition.recovered = partition.seen.1;
        Ok(partition)
    }

    /// Restores a robot from its snapshot, or suspends it. If later events and decisions have to be read
    /// separately, returns the robot and the sequence numbers of the last ones that the snapshot contains.
    fn take_saved(&mut self, key: &str, value: &[u8], revision: u64) -> Option<(Address, u64, u64)> {
        let Some(address) = Address::parse(key) else {
            self.refuse(None, "not_a_snapshot");
            return None;
        };
        let Ok(saved) = serde_json::from_slice::<Saved>(value) else {
            self.refuse(None, "not_a_snapshot");
            // The next snapshot of the robot replaces this one.
            self.slot(&address.robot).revision = revision;
            return None;
        };
        let (robot, fault) = Robot::restore(&saved, &self.shared.missions);
        let slot = self.slot(&address.robot);
        slot.robot = Some(Box::new(robot));
        (slot.is_apart, slot.revision) = (saved.behind, revision);
        slot.chain = (!saved.behind).then_some(saved.decision);
        if let Some(Faulted(why)) = fault {
            self.fault(&address.robot, saved.event + 1, saved.decision + 1, &why);
        }
        saved.behind.then_some((address, saved.event, saved.decision))
    }

    fn take_decision(&mut self, message: &Stored) {
        self.seen.1 = self.seen.1.max(message.sequence);
        let Some(address) = Address::parse(&message.subject) else { return };
        let slot = self.slot(&address.robot);
        if slot.chain.is_some_and(|chain| chain >= message.sequence) {
            return;
        }
        // The next decision has to follow this message, even if the message cannot be parsed.
        slot.chain = Some(message.sequence);
        match Decided::parse(&message.payload) {
            Some(decided) => slot.before.push_back((message.sequence, decided)),
            None => self.refuse(None, "not_a_decision"),
        }
    }
}
