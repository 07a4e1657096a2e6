//! Threads for the loops of robots, so that long searches do not delay short work.
//!
//! Work without a search has threads of its own. Each search has a thread, which starts when a place in its class of
//! durations is free (a multilevel feedback queue). A search begins in the class of the robot's last searches, or,
//! for a robot that has not searched, in the class of the last searches for its mission. A search that exceeds the
//! maximum duration of its class gives up its place and continues, so there can be more searches than places.
//! Afterwards its robot and its mission have a higher class, so this happens rarely. The operating system shares the
//! processors among the threads; those of the longer classes have a lower priority.

use std::collections::BTreeMap;
use std::io;
use std::sync::atomic::{AtomicI32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::{Semaphore, SemaphorePermit, oneshot};

use super::pause;

/// Maximum durations of the searches of each class but the last one, which has no maximum. The second class is for
/// short searches on a busy machine.
const MAX_DURATIONS: [Duration; CLASSES - 1] = [Duration::from_millis(25), Duration::from_millis(400)];

const CLASSES: usize = 3;

/// Nice value of the thread of a search in each class. If threads compete, those with a higher value get less processor
/// time.
const NICENESS: [i32; CLASSES] = [0, 5, 15];

#[derive(Debug)]
pub(crate) struct Threads {
    quick: Semaphore,
    searches: [Semaphore; CLASSES],
    /// Estimated duration of the next search by mission.
    costs: Mutex<BTreeMap<String, Duration>>,
}

impl Threads {
    pub(crate) fn new(count: usize) -> Self {
        Self {
            quick: Semaphore::new(count),
            // Long searches leave one processor to short work.
            searches: [count, count, 1.max(count - 1)].map(Semaphore::new),
            costs: Mutex::default(),
        }
    }

    /// Runs work without a search. Returns `None` if it has panicked.
    pub(crate) async fn quick<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Option<T> {
        let _permit = self.quick.acquire().await;
        tokio::task::spawn_blocking(work).await.ok()
    }

    /// Runs a search. `estimate` is the expected duration, if the robot has searched before. Also
    /// returns the [new estimate](updated). Returns `None` if the thread has panicked.
    pub(crate) async fn search<T: Send + 'static>(
        &self,
        mission: &str,
        estimate: Option<Duration>,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Option<(T, Duration)> {
        let (class, permit) = self.enter(mission, estimate).await;
        let (send, mut outcome) = oneshot::channel();
        let thread = Arc::new(AtomicI32::new(0));
        let number = Arc::clone(&thread);
        let timed = move || {
            number.store(thread_number(), Ordering::Relaxed);
            set_niceness(&number, class);
            let begun = Instant::now();
            // The receiver is gone if the partition was given back.
            let _ = send.send((work(), begun.elapsed()));
        };
        // A thread of its own, because a thread cannot raise its priority again. An attempt that fails drops its closure,
        // so the work is outside.
        let slot = Arc::new(Mutex::new(Some(timed)));
        start(|| {
            let slot = Arc::clone(&slot);
            let run = move || {
                let timed = slot.lock().unwrap_or_else(PoisonError::into_inner).take();
                if let Some(timed) = timed {
                    timed();
                }
            };
            std::thread::Builder::new().name("search".to_owned()).spawn(run).map(|_| ())
        })
        .await;
        let limit = MAX_DURATIONS.get(class).copied().unwrap_or(Duration::MAX);
        let (result, duration) = if let Ok(done) = tokio::time::timeout(limit, &mut outcome).await {
            done.ok()?
        } else {
            // Robots of this mission that have not searched yet begin in the next class.
            self.learn(mission, limit * 2);
            drop(permit);
            set_niceness(&thread, class + 1);
            outcome.await.ok()?
        };
        self.learn(mission, duration);
        Some((result, updated(estimate.unwrap_or_default(), duration)))
    }

    /// Waits for a place in the class of a search. The class may change while the search waits.
    async fn enter(&self, mission: &str, estimate: Option<Duration>) -> (usize, Option<SemaphorePermit<'_>>) {
        let class = || class(estimate.unwrap_or_else(|| self.learn(mission, Duration::ZERO)));
        loop {
            let begun = class();
            let permit = self.searches[begun].acquire().await.ok();
            if permit.is_none() || begun >= class() {
                return (begun, permit);
            }
        }
    }

    /// Updates the estimate for a mission after a search, or returns it unchanged if `duration` is zero.
    fn learn(&self, mission: &str, duration: Duration) -> Duration {
        let mut costs = self.costs.lock().unwrap_or_else(PoisonError::into_inner);
        let cost = costs.entry(mission.to_owned()).or_default();
        if duration > Duration::ZERO {
            *cost = updated(*cost, duration);
        }
        *cost
    }
}

/// Starts a thread, with further attempts as long as the operating system refuses it, such as at a limit on threads.
async fn start(mut spawn: impl FnMut() -> io::Result<()>) {
    for attempt in 1.. {
        let Err(error) = spawn() else { return };
        tracing::warn!("the thread of a search cannot be started, and the start is repeated: {error}");
        pause(attempt).await;
    }
}

/// Returns the number of the current thread, or 0 where priorities of threads are not supported.
fn thread_number() -> i32 {
    #[cfg(target_os = "linux")]
    return rustix::thread::gettid().as_raw_nonzero().get();
    #[cfg(not(target_os = "linux"))]
    0
}

fn set_niceness(thread: &AtomicI32, class: usize) {
    // On Linux, the call applies to a thread, although POSIX defines it for a process. A refused change delays other
    // work, but makes no result wrong.
    #[cfg(target_os = "linux")]
    if let Some(number) = rustix::process::Pid::from_raw(thread.load(Ordering::Relaxed)) {
        let _ = rustix::process::setpriority_process(Some(number), NICENESS[class]);
    }
    #[cfg(not(target_os = "linux"))]
    let _ = (thread, NICENESS[class]);
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
        let (mut long, mut holds) = (tokio::task::JoinSet::new(), Vec::new());
        for _ in 0..20 {
            let threads = Arc::clone(&threads);
            // The search ends when the sender is dropped.
            let (hold, held) = std::sync::mpsc::channel::<()>();
            holds.push(hold);
            let work = move || {
                let _ = held.recv();
            };
            long.spawn(async move { threads.search("slow", None, work).await.map(|_| ()) });
        }
        // The first long searches leave their places, and others enter the last class.
        while threads.searches[2].available_permits() > 0 {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        let short = async {
            for _ in 0..50 {
                threads.quick(sleep(0)).await.expect("no panic");
                let usual = Some(Duration::from_millis(1));
                let ((), estimate) = threads.search("fast", usual, sleep(1)).await.expect("no panic");
                assert!(estimate >= Duration::from_millis(1));
            }
        };
        tokio::time::timeout(Duration::from_secs(600), short).await.expect("no wait for long searches");
        drop(holds);
    }

    #[tokio::test]
    async fn a_refused_thread_is_started_later() {
        let mut attempts = 0;
        start(|| {
            attempts += 1;
            if attempts < 3 { Err(io::ErrorKind::WouldBlock.into()) } else { Ok(()) }
        })
        .await;
        assert_eq!(attempts, 3);
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
