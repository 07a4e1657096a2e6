//! Threads for the loops of robots, so that long searches do not delay short work.
//!
//! There are three pools, each with the configured number of threads: for work without a search, for short
//! searches, and for long ones. The operating system shares the processors among them. A search counts as
//! long if the robot's last searches took longer than [`SHORT`]; for a robot that has not searched, the last
//! searches for its mission count. A search that turns out to be long leaves the pool of short searches.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::Semaphore;
use tokio::task::JoinError;

/// Maximum duration of a short search.
const SHORT: Duration = Duration::from_millis(25);

#[derive(Debug)]
pub(crate) struct Threads {
    quick: Semaphore,
    short: Semaphore,
    long: Semaphore,
    /// Number of long searches that have left the pool of short searches while that of long ones was full.
    extra: AtomicUsize,
    max_extra: usize,
    /// Estimated duration of a search by mission.
    costs: Mutex<BTreeMap<String, Duration>>,
}

/// Reserves one of the extra threads until it is dropped.
struct Extra<'a>(&'a AtomicUsize);

impl Drop for Extra<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Threads {
    pub(crate) fn new(count: usize) -> Self {
        let pool = || Semaphore::new(count);
        Self {
            quick: pool(),
            short: pool(),
            long: pool(),
            extra: AtomicUsize::new(0),
            max_extra: count,
            costs: Mutex::default(),
        }
    }

    /// Runs work that does not search for a plan.
    ///
    /// # Errors
    /// The work has panicked.
    pub(crate) async fn quick<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, JoinError> {
        let _permit = self.quick.acquire().await;
        tokio::task::spawn_blocking(work).await
    }

    /// Runs a search. `estimate` is the expected duration, if the robot has searched before. Returns also the
    /// [new estimate](updated).
    ///
    /// # Errors
    /// The search has panicked.
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
        let is_long = || estimate.unwrap_or_else(|| self.cost(mission)) > SHORT;
        let mut short = None;
        if !is_long() {
            // The estimate may have changed in the meantime.
            short = self.short.acquire().await.ok().filter(|_| !is_long());
        }
        let (outcome, duration) = if short.is_none() {
            let _permit = self.long.acquire().await;
            tokio::task::spawn_blocking(timed).await?
        } else {
            let mut task = tokio::task::spawn_blocking(timed);
            match tokio::time::timeout(SHORT, &mut task).await {
                Ok(outcome) => outcome?,
                Err(_) => {
                    // Robots of this mission that have not searched yet wait with the long searches.
                    self.learn(mission, SHORT * 2);
                    if let Ok(_long) = self.long.try_acquire() {
                        drop(short);
                        task.await?
                    } else if let Some(_extra) = self.extra() {
                        drop(short);
                        task.await?
                    } else {
                        tokio::select! {
                            outcome = &mut task => outcome?,
                            _long = self.long.acquire() => {
                                drop(short);
                                (&mut task).await?
                            }
                        }
                    }
                }
            }
        };
        self.learn(mission, duration);
        Ok((outcome, updated(estimate.unwrap_or_default(), duration)))
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
        // The first long searches are recognised.
        tokio::time::sleep(Duration::from_millis(200)).await;
        let mut worst = Duration::ZERO;
        for _ in 0..50 {
            let begun = Instant::now();
            threads.quick(sleep(0)).await.expect("no panic");
            let (_, estimate) = threads.search("fast", None, sleep(1)).await.expect("no panic");
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
        assert!(estimate < SHORT, "{estimate:?}");
    }
}
