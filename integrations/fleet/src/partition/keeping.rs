//! Checkpoints: stores snapshots of robots, and the progress of the partition.

use std::sync::Arc;

use super::asking::{bytes, write};
use super::own::Partition;
use super::slot::{Done, Slot};
use crate::store::{Bucket, Store};
use crate::wire::{Address, Progress};

impl<S: Store> Partition<S> {
    /// Starts to save the robots that have had unsaved decisions for [`Settings::save_within`], or
    /// with `all` every robot with unsaved decisions. Omits robots as [`Self::save_robot`] does.
    /// Returns `true` if a snapshot was started.
    pub(super) fn save(&mut self, all: bool) -> bool {
        let within = self.shared.settings.save_within;
        let is_due = |slot: &Slot| all || slot.since.is_some_and(|since| since.elapsed() >= within);
        let due = self.slots.iter().filter(|(_, slot)| is_due(slot)).map(|(name, _)| name.clone());
        let due: Vec<String> = due.collect();
        let begun = due.iter().filter(|name| self.save_robot(name)).count();
        begun > 0
    }

    /// Starts to save a robot. Does nothing if the robot is handling an event, is already being saved,
    /// is stopped (`faulted`), or has no unsaved decisions. Returns `true` if a snapshot was started.
    pub(super) fn save_robot(&mut self, name: &str) -> bool {
        let Some(slot) = self.slots.get_mut(name) else { return false };
        let (Some(robot), Some(last)) = (&slot.robot, slot.unsaved.back()) else { return false };
        if slot.is_saving || slot.faulted {
            return false;
        }
        let saved = robot.save(&self.shared.missions, last.1);
        slot.is_saving = true;
        let (shared, name, revision) = (Arc::clone(&self.shared), name.to_owned(), slot.revision);
        let key = Address { partition: self.number, robot: name.clone() }.to_string();
        self.jobs.push(Box::pin(async move {
            let revision = write(&shared.store, Bucket::Robots, &key, &bytes(&saved), revision).await;
            Done::Kept { robot: name, event: saved.event, revision }
        }));
        true
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
        for slot in self.slots.values() {
            let waits = slot.waiting.front().map(|event| event.sequence);
            let first = slot.unsaved.front();
            let events = [waits, slot.at.map(|at| at.0), first.map(|first| first.0)];
            for event in events.into_iter().flatten() {
                next.events = next.events.min(event - 1);
            }
            let before = slot.before.front().map(|(decision, _)| decision - 1);
            for decision in
                [first.map(|first| first.1 - 1), slot.at.map(|at| at.1), before].into_iter().flatten()
            {
                next.decisions = next.decisions.min(decision);
            }
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
