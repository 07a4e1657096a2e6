//! Threads for the loops of robots, so that long searches do not delay short work.
//!
//! Work without a search has threads of its own. Searches have a pool of threads for each class of durations (a
//! multilevel feedback queue): a search begins in the class of the robot's last searches, or, for a robot that has
//! not searched, in the class of the last searches for its mission. A search that exceeds the maximum duration of its
//! class moves to the next class. The operating system shares the processors among the pools.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::{Semaphore, SemaphorePermit};
use tokio::task::JoinError;

/// Maximum durations of the searches of each class but the last one, which has no maximum. The second class is for
/// short searches on a busy machine.
const MAX_DURATIONS: [Duration; 2] = [Duration::from_millis(25), Duration::from_millis(400)];

const CLASSES: usize = MAX_DURATIONS.len() + 1;

#[derive(Debug)]
pub(crate) struct Threads {
    quick: Semaphore,
    searches: [Semaphore; CLASSES],
    /// Number of searches that run on extra threads. They have exceeded the maximum of their class while the pool of
    /// the next class was full.
    extra: AtomicUsize,
    max_extra: usize,
    costs: Mutex<BTreeMap<String, Duration>>,
}

struct Extra<'a>(&'a AtomicUsize);

impl Drop for Extra<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Threads {
    pub(crate) fn new(count: usize) -> Self {
        Self {
            quick: Semaphore::new(count),
            searches: std::array::from_fn(|_| Semaphore::new(count)),
            extra: AtomicUsize::new(0),
            max_extra: count,
            costs: Mutex::default(),
        }
    }

    pub(crate) async fn quick<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, JoinError> {
        let _permit = self.quick.acquire().await;
        tokio::task::spawn_blocking(work).await
    }

    /// Runs a search. `estimate` is the expected duration, if the robot has searched before. Also
    /// returns the [new estimate](updated). Fails if the search panics.
    pub(crate) async fn search<T: Send + 'static>(
        &self,
        mission: &str,
        estimate: Option<Duration>,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<(T, Duration), JoinError> {
        let timed = move || {
            let begun = Instant::now();
            let outcome = work();
            (outcome, begun.elapsed())
        };
        let (mut class, mut permit) = self.enter(mission, estimate).await;
        let mut task = tokio::task::spawn_blocking(timed);
        let mut extra = None;
        let (outcome, duration) = loop {
            // Without a permit the search runs on an extra thread until it ends.
            let Some(limit) = MAX_DURATIONS.get(class).filter(|_| permit.is_some()) else {
                break task.await?;
            };
            if let Ok(outcome) = tokio::time::timeout(*limit, &mut task).await {
                break outcome?;
            }
            class += 1;
            // Robots of this mission that have not searched yet begin in the next class.
            self.learn(mission, *limit * 2);
            if let Ok(next) = self.searches[class].try_acquire() {
                permit = Some(next);
            } else if let Some(reserved) = self.extra() {
                extra = Some(reserved);
                permit = None;
            } else {
                tokio::select! {
                    outcome = &mut task => break outcome?,
                    next = self.searches[class].acquire() => permit = next.ok(),
                }
            }
        };
        drop(extra);
        self.learn(mission, duration);
        Ok((outcome, updated(estimate.unwrap_or_default(), duration)))
    }

    /// Waits for a thread of the class of a search. The class may change while the search waits.
    async fn enter(&self, mission: &str, estimate: Option<Duration>) -> (usize, Option<SemaphorePermit<'_>>) {
        loop {
            let class = self.class_of(mission, estimate);
            let permit = self.searches[class].acquire().await.ok();
            if permit.is_none() || class >= self.class_of(mission, estimate) {
                return (class, permit);
            }
        }
    }

    fn class_of(&self, mission: &str, estimate: Option<Duration>) -> usize {
        class(estimate.unwrap_or_else(|| self.cost(mission)))
    }

    fn extra(&self) -> Option<Extra<'_>> {
        let add = |count| (count < self.max_extra).then_some(count + 1);
        let added = self.extra.fetch_update(Ordering::Relaxed, Ordering::Relaxed, add);
        added.is_ok().then(|| Extra(&self.extra))
    }

    fn cost(&self, mission: &str) -> Duration {
        let costs = self.costs.lock().unwrap_or_else(PoisonError::into_inner);
        costs.get(mission).copied().unwrap_or_default()
    }

    fn learn(&self, mission: &str, duration: Duration) {
        let mut costs = self.costs.lock().unwrap_or_else(PoisonError::into_inner);
        let cost = costs.entry(mission.to_owned()).or_default();
        *cost = updated(*cost, duration);
    }
}

fn class(duration: Duration) -> usize {
    MAX_DURATIONS.partition_point(|limit| *limit < duration)
}

/// Returns the estimate after a search: its duration, or half of the former estimate if that is longer. So a
/// robot with a single long search among short ones soon counts as short again.
fn updated(estimate: Duration, duration: Duration) -> Duration {
    duration.max(estimate / 2)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    fn sleep(millis: u64) -> impl FnOnce() + Send + 'static {
        move || std::thread::sleep(Duration::from_millis(millis))
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn long_searches_delay_neither_quick_work_nor_short_searches() {
        let threads = Arc::new(Threads::new(2));
        let mut long = tokio::task::JoinSet::new();
        for _ in 0..20 {
            let threads = Arc::clone(&threads);
            long.spawn(async move { threads.search("slow", None, sleep(2_000)).await.map(|_| ()) });
        }
        // In this time, the first long searches move to the last class.
        tokio::time::sleep(Duration::from_millis(600)).await;
        let mut worst = Duration::ZERO;
        for _ in 0..50 {
            let begun = Instant::now();
            threads.quick(sleep(0)).await.expect("no panic");
            let ((), estimate) = threads.search("fast", None, sleep(1)).await.expect("no panic");
            worst = worst.max(begun.elapsed());
            assert!(estimate >= Duration::from_millis(1));
        }
        assert!(worst < Duration::from_secs(1), "{worst:?}");
        assert!(threads.extra.load(Ordering::Relaxed) <= 2);
        long.abort_all();
        while long.join_next().await.is_some() {}
        assert_eq!(threads.extra.load(Ordering::Relaxed), 0);
    }

    #[test]
    fn one_long_search_is_forgotten() {
        let mut estimate = updated(Duration::ZERO, Duration::from_secs(10));
        assert_eq!(estimate, Duration::from_secs(10));
        for _ in 0..9 {
            estimate = updated(estimate, Duration::from_millis(1));
        }
        assert_eq!(class(estimate), 0, "{estimate:?}");
    }
}
