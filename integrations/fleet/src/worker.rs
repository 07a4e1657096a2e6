//! A worker: leases partitions and runs their robots.
//!
//! A lease is a stored value that expires unless it is renewed. A worker takes free partitions up
//! to its share, which is the number of partitions divided by the number of workers that are not
//! shutting down, rounded up. A worker with more partitions saves the surplus partitions and gives
//! up their leases. Leases affect only efficiency, not correctness. The worker also publishes its
//! status and metrics, and saves everything when it is shut down.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use futures::future::join_all;
use tokio::sync::watch;
use tokio::task::JoinHandle;

use crate::partition::{End, Order, Shared, serve};
use crate::store::{Bucket, Entry, Fault, Store};
use crate::wire::{Presence, partition_of};

struct Held {
    revision: u64,
    /// Time at which the last successful renewal was begun, or the acquisition of the lease.
    renewed: Instant,
    orders: watch::Sender<Order>,
    task: JoinHandle<End>,
}

struct Worker<S> {
    shared: Arc<Shared<S>>,
    lease: Duration,
    held: BTreeMap<u32, Held>,
    /// Revision of the status that this worker has published.
    presence: u64,
    /// Time of the last published status, and the working time of all loops in microseconds from the
    /// worker's start until then.
    looked: (Instant, u64),
}

/// Runs a worker until `stop` becomes true or its sender is dropped. Then saves the partitions and
/// gives up their leases.
pub async fn run<S: Store>(shared: Arc<Shared<S>>, mut stop: watch::Receiver<bool>) {
    let lease = shared.store.lease();
    let mut worker =
        Worker { shared, lease, held: BTreeMap::new(), presence: 0, looked: (Instant::now(), 0) };
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
    worker.drain(tick).await;
}

impl<S: Store> Worker<S> {
    /// Publishes the worker's status, renews its leases, and handles partitions whose task has ended. Then,
    /// unless `draining`, takes free partitions or gives partitions back, so that the worker has its share.
    /// Neither takes nor gives back partitions if the log cannot be read.
    async fn round(&mut self, draining: bool) {
        self.shared.health.begin_round(draining);
        self.present(draining).await;
        self.renew().await;
        self.collect().await;
        if draining {
            return;
        }
        let store = &self.shared.store;
        let (Ok(workers), Ok(leases)) =
            (store.list(Bucket::Workers, None, 0).await, store.list(Bucket::Leases, None, 0).await)
        else {
            return;
        };
        let share = share(&workers, &self.shared.worker, store.partitions());
        self.give_back(share);
        self.acquire(share, &leases).await;
    }

    async fn present(&mut self, draining: bool) {
        let counts = &self.shared.counts;
        let busy = counts.busy.load(Ordering::Relaxed);
        let passed = self.looked.0.elapsed().as_micros() as f64 * self.shared.settings.threads as f64;
        let load = if passed > 0.0 { (busy - self.looked.1) as f64 / passed } else { 0.0 };
        self.looked = (Instant::now(), busy);
        let presence = Presence {
            partitions: self.held.len() as u32,
            robots: counts.robots.load(Ordering::Relaxed),
            warm: counts.warm.load(Ordering::Relaxed),
            waiting: counts.waiting.load(Ordering::Relaxed),
            decided: counts.decided.load(Ordering::Relaxed),
            refused: counts.refused.load(Ordering::Relaxed),
            load: (load.min(1.0) * 1000.0).round() / 1000.0,
            draining,
        };
        metrics::gauge!("metaplan_fleet_partitions").set(f64::from(presence.partitions));
        metrics::gauge!("metaplan_fleet_robots").set(presence.robots as f64);
        metrics::gauge!("metaplan_fleet_robots_ready").set(presence.warm as f64);
        metrics::gauge!("metaplan_fleet_events_waiting").set(presence.waiting as f64);
        metrics::gauge!("metaplan_fleet_load").set(presence.load);
        metrics::counter!("metaplan_fleet_decided_total").absolute(presence.decided);
        let value = serde_json::to_vec(&presence).unwrap_or_default();
        let (store, name) = (&self.shared.store, &self.shared.worker);
        let outcome = store.put(Bucket::Workers, name, &value, self.presence).await;
        if !matches!(outcome, Err(Fault::Unreachable(_))) {
            // The status is published four times per lease time, so one lease time without a response means that the
            // log is lost.
            self.shared.health.reach(self.lease);
        }
        self.presence = match outcome {
            Ok(revision) => revision,
            // The value had expired, or an unacknowledged write succeeded.
            Err(Fault::Conflict) => match store.get(Bucket::Workers, name).await {
                Ok(entry) => entry.map_or(0, |entry| entry.revision),
                Err(_) => self.presence,
            },
            Err(_) => self.presence,
        };
    }

    async fn renew(&mut self) {
        let (store, name) = (&self.shared.store, self.shared.worker.as_bytes());
        let renewals = self.held.iter().map(|(partition, held)| async move {
            let key = partition.to_string();
            let begun = Instant::now();
            let outcome = match store.put(Bucket::Leases, &key, name, held.revision).await {
                // An unacknowledged renewal may have succeeded.
                Err(Fault::Conflict) => match store.get(Bucket::Leases, &key).await {
                    Ok(Some(entry)) if entry.value == name => Ok(entry.revision),
                    Ok(_) => Err(Fault::Conflict),
                    Err(fault) => Err(fault),
                },
                other => other,
            };
            (*partition, begun, outcome)
        });
        for (partition, begun, outcome) in join_all(renewals).await {
            let Some(held) = self.held.get_mut(&partition) else { continue };
            match outcome {
                Ok(revision) => (held.revision, held.renewed) = (revision, begun),
                Err(Fault::Conflict) => lose(held),
                Err(_) if held.renewed.elapsed() >= self.lease => lose(held),
                Err(_) => {}
            }
        }
    }

    /// Removes partitions whose task has ended, and gives up their leases unless these are lost. A
    /// partition is recovered again and stays leased if its task has ended without an order. The
    /// cause is a write of another worker or a panic.
    async fn collect(&mut self) {
        let ended: Vec<u32> = self
            .held
            .iter()
            .filter(|(_, held)| held.task.is_finished())
            .map(|(partition, _)| *partition)
            .collect();
        for partition in ended {
            let Some(held) = self.held.remove(&partition) else { continue };
            let order = *held.orders.borrow();
            let end = held.task.await;
            match (end, order) {
                (Ok(End::Fenced) | Err(_), Order::Go) => {
                    tracing::warn!(
                        partition,
                        "another worker has written to the partition: it is recovered again"
                    );
                    metrics::counter!("metaplan_fleet_fenced_total").increment(1);
                    let restarted = self.serve(partition, held.revision, held.renewed);
                    self.held.insert(partition, restarted);
                }
                (_, Order::Abandon) => {
                    tracing::warn!(partition, "the lease is lost");
                    metrics::counter!("metaplan_fleet_lost_total").increment(1);
                }
                _ => {
                    tracing::info!(partition, "given back");
                    // A lease that is not removed expires.
                    let key = partition.to_string();
                    let _ = self.shared.store.remove(Bucket::Leases, &key, held.revision).await;
                }
            }
        }
    }

    fn give_back(&self, share: usize) {
        let going = self.held.values().filter(|held| *held.orders.borrow() == Order::Go);
        for held in going.skip(share) {
            held.orders.send_replace(Order::Drain);
        }
    }

    async fn acquire(&mut self, share: usize, leases: &[Entry]) {
        let store = &self.shared.store;
        let partition_count = store.partitions();
        let first = partition_of(&self.shared.worker, partition_count);
        let leased: Vec<u32> = leases.iter().filter_map(|lease| lease.key.parse().ok()).collect();
        let free = (0..partition_count).map(|offset| (first + offset) % partition_count);
        let free = free.filter(|partition| !leased.contains(partition) && !self.held.contains_key(partition));
        let missing: Vec<u32> = free.take(share.saturating_sub(self.held.len())).collect();
        for partition in missing {
            let begun = Instant::now();
            let name = self.shared.worker.as_bytes();
            if let Ok(revision) = self.shared.store.put(Bucket::Leases, &partition.to_string(), name, 0).await
            {
                tracing::info!(partition, "taken");
                let lease = self.serve(partition, revision, begun);
                self.held.insert(partition, lease);
            }
        }
    }

    fn serve(&self, partition: u32, revision: u64, renewed: Instant) -> Held {
        let (orders, receiver) = watch::channel(Order::Go);
        let task = tokio::spawn(serve(Arc::clone(&self.shared), partition, receiver));
        Held { revision, renewed, orders, task }
    }

    async fn drain(&mut self, mut tick: tokio::time::Interval) {
        for held in self.held.values() {
            held.orders.send_if_modified(|order| {
                let goes = *order == Order::Go;
                if goes {
                    *order = Order::Drain;
                }
                goes
            });
        }
        self.round(true).await;
        while !self.held.is_empty() {
            tokio::select! {
                _ = tick.tick() => self.round(true).await,
                () = tokio::time::sleep(Duration::from_millis(20)) => self.collect().await,
            }
        }
        let _ = self.shared.store.remove(Bucket::Workers, &self.shared.worker, self.presence).await;
    }
}

fn lose(held: &mut Held) {
    held.orders.send_replace(Order::Abandon);
}

/// Returns the number of partitions that the worker `own` should lease: an equal share of all
/// partitions, rounded up. `own` counts as a worker even if it is not in `workers`. Other workers
/// that are shutting down do not count.
fn share(workers: &[Entry], own: &str, partitions: u32) -> usize {
    let takes = |entry: &&Entry| {
        entry.key != own
            && serde_json::from_slice::<Presence>(&entry.value).is_ok_and(|presence| !presence.draining)
    };
    let count = workers.iter().filter(takes).count() + 1;
    (partitions as usize).div_ceil(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_suffice_for_all() {
        let entry = |key: &str, draining| Entry {
            key: key.to_owned(),
            value: serde_json::to_vec(&Presence { draining, ..Presence::default() }).expect("plain data"),
            revision: 1,
        };
        let workers = [entry("a", false), entry("b", false), entry("c", true)];
        assert_eq!(share(&workers, "a", 7), 4);
        assert_eq!(share(&workers, "b", 7), 4);
        assert_eq!(share(&[], "a", 7), 7);
        assert_eq!(share(&workers[2..], "c", 7), 7);
    }
}
