//! A worker: runs its share of the partitions.
//!
//! Each worker publishes its status, which expires unless it is published again. All workers with a status, except
//! those that are shutting down, share the partitions by a function of their names (`owners`). The workers need no
//! agreement. If two workers read different statuses, both may run a partition; the chain of decisions ensures that
//! only one of them decides an event. A worker also publishes metrics, and gives its partitions back when it is shut
//! down.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use tokio::sync::watch;
use tokio::task::JoinHandle;

use crate::partition::{Shared, serve};
use crate::store::Store;
use crate::wire::Presence;

struct Worker<S> {
    shared: Arc<Shared<S>>,
    lease: Duration,
    running: BTreeMap<u32, (watch::Sender<bool>, JoinHandle<()>)>,
    /// Time of the last published status, and the working time of all loops in microseconds from the
    /// worker's start until then.
    looked: (Instant, u64),
}

/// Runs a worker until `stop` becomes true or its sender is dropped. Then finishes running decisions and withdraws the
/// status.
pub async fn run<S: Store>(shared: Arc<Shared<S>>, mut stop: watch::Receiver<bool>) {
    let lease = shared.store.lease();
    let mut worker = Worker { shared, lease, running: BTreeMap::new(), looked: (Instant::now(), 0) };
    let mut tick = tokio::time::interval(lease / 4);
    tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            _ = tick.tick() => {}
            // A dropped sender is treated like a request to stop.
            changed = stop.changed() => if changed.is_err() || *stop.borrow_and_update() { break },
        }
        worker.round(false).await;
    }
    worker.round(true).await;
    while !worker.running.is_empty() {
        tokio::select! {
            _ = tick.tick() => worker.round(true).await,
            () = tokio::time::sleep(Duration::from_millis(20)) => worker.remove_ended(),
        }
    }
    // A status that is not withdrawn expires.
    let _ = worker.shared.store.announce(&worker.shared.worker, None).await;
}

impl<S: Store> Worker<S> {
    /// Publishes the worker's status. Then starts the partitions that the worker owns, and ends all others; if it is
    /// `draining`, it owns none. Neither starts nor ends partitions if the statuses cannot be read.
    async fn round(&mut self, draining: bool) {
        self.shared.health.begin_round(draining);
        let presence = self.present(draining).await;
        self.remove_ended();
        let mut owners = BTreeMap::new();
        if !draining {
            let Ok(mut workers) = self.shared.store.workers().await else { return };
            // The log may be read from a replica that does not have the first status of this worker.
            workers.insert(self.shared.worker.clone(), presence);
            owners = self::owners(&workers, self.shared.store.partitions());
        }
        owners.retain(|_, owner| *owner == self.shared.worker);
        for (partition, (drain, _)) in &self.running {
            if !owners.contains_key(partition) {
                drain.send_replace(true);
            }
        }
        for partition in
            owners.into_keys().filter(|partition| !self.running.contains_key(partition)).collect::<Vec<_>>()
        {
            tracing::info!(partition, "taken");
            let (drain, receiver) = watch::channel(false);
            let task = tokio::spawn(serve(Arc::clone(&self.shared), partition, receiver));
            self.running.insert(partition, (drain, task));
        }
    }

    fn remove_ended(&mut self) {
        self.running.retain(|partition, (_, task)| {
            let is_running = !task.is_finished();
            if !is_running {
                tracing::info!(partition, "given back");
            }
            is_running
        });
    }

    async fn present(&mut self, draining: bool) -> Presence {
        let counts = &self.shared.counts;
        let busy = counts.busy.load(Ordering::Relaxed);
        let passed = self.looked.0.elapsed().as_micros() as f64 * self.shared.settings.threads as f64;
        let load = if passed > 0.0 { (busy - self.looked.1) as f64 / passed } else { 0.0 };
        self.looked = (Instant::now(), busy);
        let presence = Presence {
            partitions: self.running.len() as u32,
            robots: counts.robots.load(Ordering::Relaxed),
            waiting: counts.waiting.load(Ordering::Relaxed),
            decided: counts.decided.load(Ordering::Relaxed),
            refused: counts.refused.load(Ordering::Relaxed),
            load: (load.min(1.0) * 1000.0).round() / 1000.0,
            draining,
        };
        metrics::gauge!("metaplan_fleet_partitions").set(f64::from(presence.partitions));
        metrics::gauge!("metaplan_fleet_robots").set(presence.robots as f64);
        metrics::gauge!("metaplan_fleet_events_waiting").set(presence.waiting as f64);
        metrics::gauge!("metaplan_fleet_load").set(presence.load);
        metrics::counter!("metaplan_fleet_decided_total").absolute(presence.decided);
        if self.shared.store.announce(&self.shared.worker, Some(&presence)).await.is_ok() {
            // The status is published four times per lease time, so one lease time without a response means that the
            // log is lost.
            self.shared.health.reach(self.lease);
        }
        presence
    }
}

/// Returns the owner of each partition, by the number of the partition. Each worker that is not shutting down owns
/// an equal share of the partitions, rounded up or down. A partition belongs to the worker with the highest hash of
/// both names (rendezvous hashing [1]) among those with less than their share. Most partitions therefore keep their owner
/// if a worker joins or leaves.
///
/// [1] Thaler and Ravishankar, Using name-based mappings to increase hit rates, IEEE/ACM Transactions on Networking
/// 6(1), 1998.
pub(crate) fn owners(workers: &BTreeMap<String, Presence>, partitions: u32) -> BTreeMap<u32, String> {
    let mut counts: BTreeMap<&str, u32> =
        workers.iter().filter(|(_, status)| !status.draining).map(|(name, _)| (name.as_str(), 0)).collect();
    let mut owners = BTreeMap::new();
    for partition in 0..partitions {
        // At most this number of partitions for each worker, and one more only if all have that number.
        let share =
            counts.values().min().copied().unwrap_or_default().max(partitions / counts.len().max(1) as u32);
        let share = if counts.values().all(|count| *count >= share) { share + 1 } else { share };
        let hash = |name: &str| {
            // CRC-32 is linear: the hashes for two names of the same length differ in the same bits for every partition.
            // Without this multiplication, one bit would decide between the two workers.
            u64::from(crc32fast::hash(format!("{partition} {name}").as_bytes()))
                .wrapping_mul(0x9e37_79b9_7f4a_7c15)
                >> 20
        };
        let free = counts.iter_mut().filter(|(_, count)| **count < share);
        if let Some((name, count)) = free.max_by_key(|(name, _)| hash(name)) {
            *count += 1;
            owners.insert(partition, (*name).to_owned());
        }
    }
    owners
}

#[cfg(test)]
mod tests {
    use super::*;

    fn workers(names: &[&str]) -> BTreeMap<String, Presence> {
        names
            .iter()
            .map(|name| {
                ((*name).to_owned(), Presence { draining: name.starts_with('-'), ..Presence::default() })
            })
            .collect()
    }

    #[test]
    fn shares_are_equal_and_few_partitions_change_their_owner() {
        for (names, expected) in
            [(&["a", "-b"][..], vec![64]), (&["a", "b", "c"], vec![21, 21, 22]), (&[], vec![])]
        {
            let mut counts: BTreeMap<String, u32> = BTreeMap::new();
            for owner in owners(&workers(names), 64).into_values() {
                *counts.entry(owner).or_default() += 1;
            }
            let mut counts: Vec<u32> = counts.into_values().collect();
            counts.sort_unstable();
            assert_eq!(counts, expected);
        }
        let (before, after) =
            (owners(&workers(&["a", "b", "c", "d"]), 64), owners(&workers(&["a", "b", "c"]), 64));
        let moved = before.iter().filter(|(partition, owner)| after[partition] != **owner).count();
        assert!((16..=32).contains(&moved), "{moved}");
    }
}
