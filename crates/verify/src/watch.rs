//! When a verification has to stop: a certificate may come from anybody, and ask for more than there is.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::manifest::{Verification, VerifiedPart};
use crate::memory;

/// The process may take so much, in megabytes of 2^20 bytes.
const MEMORY_LIMIT: u64 = 4096;
/// Time after a limit, besides a tenth of the time limit, until a verification that does not stop by itself is given up.
const GRACE: Duration = Duration::from_millis(100);
const LATE: &str = "it takes longer than `--time-limit` allows";
const INTERVAL: Duration = Duration::from_millis(50);

/// The limits of a verification that is under way. Clones are about the same one.
#[derive(Debug, Clone)]
pub struct Watch {
    started: Instant,
    time: Duration,
    interrupt: Arc<AtomicBool>,
    answered: Arc<AtomicBool>,
}

impl Watch {
    /// Begins to measure time and memory. Not all that is done asks whether to stop, so that a thread of its own waits for the
    /// end: some time after a limit has been reached it calls `give_up` with what there is to say then. That should end the
    /// program.
    pub fn start(time: Duration, give_up: impl FnOnce(&Verification) + Send + 'static) -> Self {
        let (interrupt, answered) = (Arc::default(), Arc::default());
        let watch = Self { started: Instant::now(), time, interrupt, answered };
        // Where the platform does not tell how much memory is taken, there is no limit on it.
        let _ = memory::watch(MEMORY_LIMIT, Arc::clone(&watch.interrupt));
        let own = watch.clone();
        std::thread::spawn(move || {
            while !own.reached() {
                std::thread::sleep(INTERVAL);
            }
            std::thread::sleep(own.time / 10 + GRACE);
            if !own.answered.swap(true, Ordering::Relaxed) {
                let reason = format!("{LATE}, or more than {MEMORY_LIMIT} MB");
                let parts = vec![VerifiedPart { part: "limits", result: Err(reason) }];
                give_up(&Verification { claim: None, subject: None, parts });
            }
        });
        watch
    }

    /// Whether a limit is reached.
    pub fn reached(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed) || self.started.elapsed() >= self.time
    }

    /// What came of the verification; it fails if it took too long. Nobody gives up from now on.
    #[must_use]
    pub fn end(&self, mut report: Verification) -> Verification {
        if self.started.elapsed() > self.time {
            report.parts.push(VerifiedPart { part: "limits", result: Err(LATE.to_owned()) });
        }
        // The other thread has begun to say that time is up, and ends the program.
        while self.answered.swap(true, Ordering::Relaxed) {
            std::thread::park();
        }
        report
    }
}

/// A time from a number of seconds, as an option has it.
///
/// # Errors
/// It is not a number of seconds, or negative.
pub fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("`{text}` is not a number of seconds"))?;
    Duration::try_from_secs_f64(seconds).map_err(|error| error.to_string())
}
