//! Checkpoints: stores snapshots of robots, and the progress of the partition.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::asking::{bytes, pause, persist, write};
use super::own::Partition;
use super::slot::{Done, Slot};
use crate::store::{Bucket, Fault, Store};
use crate::wire::{Address, Progress, Saved};

impl<S: Store> Partition<S> {
    /// Starts to save all robots whose decisions have been unsaved for [`Settings::save_within`],
    /// or, with `all`, all robots with unsaved decisions. Also starts to mark the snapshots of
    /// suspended robots. Robots that [`Self::save_robot`] cannot save now are omitted. Returns
    /// `true` if a write was started.
    pub(super) fn save(&mut self, all: bool) -> bool {
        let within = self.shared.settings.save_within;
        let is_due = |slot: &Slot| {
            all || slot.suspended.is_some() || slot.since.is_some_and(|since| since.elapsed() >= within)
        };
        let due = self.slots.iter().filter(|(_, slot)| is_due(slot)).map(|(name, _)| name.clone());
        let due: Vec<String> = due.collect();
        let begun = due.iter().filter(|name| self.save_robot(name) || self.set_apart(name)).count();
        begun > 0
    }

    /// Starts to save a robot. Does nothing if the robot is handling an event, is already being saved,
    /// is suspended, or has no unsaved decisions. Returns `true` if a snapshot was started.
    pub(super) fn save_robot(&mut self, name: &str) -> bool {
        let Some(slot) = self.slots.get_mut(name) else { return false };
        let (Some(robot), Some(last)) = (&slot.robot, slot.unsaved.back()) else { return false };
        if slot.is_saving || slot.suspended.is_some() {
            return false;
        }
        let mut saved = robot.save(last.1);
        // Events that wait may be earlier than the progress of the partition.
        saved.behind = slot.behind.is_some() || slot.is_apart && !slot.waiting.is_empty();
        // From now on, the progress must not pass later events, because the snapshot may be stored at any time.
        slot.is_apart &= saved.behind;
        slot.is_saving = true;
        let (shared, name, revision) = (Arc::clone(&self.shared), name.to_owned(), slot.revision);
        let key = Address { partition: self.number, robot: name.clone() }.to_string();
        self.jobs.push(Box::pin(async move {
            let revision = write(&shared.store, Bucket::Robots, &key, &bytes(&saved), revision).await;
            Done::Kept { robot: name, event: saved.event, behind: saved.behind, revision }
        }));
        true
    }

    /// Starts to mark the snapshot of a suspended robot, so that the progress of the partition does not wait for the
    /// robot. Does nothing if the snapshot has this mark or is being written. Returns `true` if a write was started.
    fn set_apart(&mut self, name: &str) -> bool {
        // For a robot without a snapshot, an empty one is stored. It ends at the progress of the partition, because all
        // known events and decisions of the robot have greater sequence numbers.
        let (event, decision) = (self.progress.events, self.progress.decisions);
        let Some(slot) = self.slots.get_mut(name) else { return false };
        if slot.suspended.is_none() || slot.is_apart || slot.is_saving {
            return false;
        }
        slot.is_saving = true;
        let (shared, name, revision) = (Arc::clone(&self.shared), name.to_owned(), slot.revision);
        let key = Address { partition: self.number, robot: name.clone() }.to_string();
        self.jobs.push(Box::pin(async move {
            let store = &shared.store;
            let stored = stored(store, &key, revision).await.map(|value| match value {
                Some(value) => serde_json::from_slice(&value).ok(),
                None => Some(Saved { event, decision, ..Saved::default() }),
            });
            let (event, revision) = match stored {
                Ok(Some(saved)) => {
                    let saved = Saved { behind: true, ..saved };
                    (saved.event, write(store, Bucket::Robots, &key, &bytes(&saved), revision).await)
                }
                // Not expected: a robot whose snapshot could not be parsed at recovery has revision 0 here. The
                // snapshot keeps its content and gets no mark.
                Ok(None) => {
                    return Done::Kept { robot: name, event: 0, behind: false, revision: Ok(revision) };
                }
                Err(fault) => (0, Err(fault)),
            };
            Done::Kept { robot: name, event, behind: true, revision }
        }));
        true
    }

    /// Removes retired robots whose last event and decision the stored progress includes, from memory and
    /// from the bucket of snapshots.
    pub(super) fn forget(&mut self) {
        let is_obsolete = |slot: &Slot| slot.is_obsolete(&self.progress);
        let obsolete = self.slots.iter().filter(|(_, slot)| is_obsolete(slot)).map(|(name, _)| name.clone());
        for name in obsolete.collect::<Vec<_>>() {
            let Some(slot) = self.slots.get_mut(&name) else { continue };
            if slot.revision == 0 {
                self.slots.remove(&name);
                self.shared.counts.robots.fetch_sub(1, Ordering::Relaxed);
                continue;
            }
            slot.is_saving = true;
            let (shared, revision) = (Arc::clone(&self.shared), slot.revision);
            let key = Address { partition: self.number, robot: name.clone() }.to_string();
            self.jobs.push(Box::pin(async move {
                let outcome = remove(&shared.store, &key, revision).await;
                Done::Removed { robot: name, outcome }
            }));
        }
    }

    /// Starts to write the progress of the partition if it has advanced: with `must` by at least one
    /// event or decision, otherwise by at least [`Settings::save_every`]. Starts nothing while an
    /// earlier write of the progress is running. Returns `true` if a write is running.
    pub(super) fn advance(&mut self, must: bool) -> bool {
        if self.is_progressing {
            return true;
        }
        let mut next = Progress {
            epoch: self.progress.epoch,
            events: self.seen.0,
            decisions: self.seen.1,
            snapshots: self.snapshots,
        };
        for (events, decisions) in self.slots.values().filter_map(Slot::limits) {
            next.events = next.events.min(events);
            next.decisions = next.decisions.min(decisions);
        }
        // The stored progress must never decrease.
        next.events = next.events.max(self.progress.events);
        next.decisions = next.decisions.max(self.progress.decisions);
        let worth = if must { 1 } else { self.shared.settings.save_every as u64 };
        if next.events < self.progress.events + worth && next.decisions < self.progress.decisions + worth {
            return false;
        }
        self.is_progressing = true;
        let (shared, key, revision) = (Arc::clone(&self.shared), self.number.to_string(), self.revision);
        self.jobs.push(Box::pin(async move {
            let revision = write(&shared.store, Bucket::Progress, &key, &bytes(&next), revision).await;
            Done::Progressed { progress: next, revision }
        }));
        true
    }
}

/// Reads the snapshot of a robot with this revision; `None` for revision 0. Returns [`Fault::Conflict`] if there
/// is a newer snapshot.
async fn stored<S: Store>(store: &S, key: &str, revision: u64) -> Result<Option<Vec<u8>>, Fault> {
    if revision == 0 {
        return Ok(None);
    }
    for attempt in 1.. {
        match persist(|| store.get(Bucket::Robots, key)).await? {
            Some(entry) if entry.revision == revision => return Ok(Some(entry.value)),
            Some(entry) if entry.revision > revision => return Err(Fault::Conflict),
            // Another owner has removed the snapshot.
            _ if attempt > 10 => return Err(Fault::Conflict),
            // The value is read from a server that lags behind.
            _ => pause(attempt).await,
        }
    }
    Err(Fault::Conflict)
}

/// Removes the snapshot of a robot, which has this revision. Retries until the result is known. Returns
/// [`Fault::Conflict`] if there is a newer snapshot.
async fn remove<S: Store>(store: &S, key: &str, revision: u64) -> Result<(), Fault> {
    for attempt in 1.. {
        match store.remove(Bucket::Robots, key, revision).await {
            Ok(()) => return Ok(()),
            Err(Fault::Conflict) => match persist(|| store.get(Bucket::Robots, key)).await? {
                // An unacknowledged removal has succeeded.
                None => return Ok(()),
                Some(entry) if entry.revision > revision => return Err(Fault::Conflict),
                Some(_) => {}
            },
            Err(_) => {}
        }
        pause(attempt).await;
    }
    Err(Fault::Conflict)
}
