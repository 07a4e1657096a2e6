//! The time and memory limits of a verification. A certificate is untrusted and may require
//! unlimited resources.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::manifest::{Verification, VerifiedPart};
use crate::memory;

/// Upper limit on the memory of the process, in megabytes of 2^20 bytes.
const MEMORY_LIMIT: u64 = 4096;
/// Time after a limit, in addition to a tenth of the time limit, until a verification that has
/// not stopped is aborted.
const GRACE: Duration = Duration::from_millis(100);
const LATE: &str = "it takes longer than `--time-limit` allows";
const INTERVAL: Duration = Duration::from_millis(50);

/// The limits of a running verification. Clones share the same limits.
#[derive(Debug, Clone)]
pub struct Watch {
    started: Instant,
    time: Duration,
    interrupt: Arc<AtomicBool>,
    answered: Arc<AtomicBool>,
}

impl Watch {
    /// Starts measuring time and memory. Not every computation polls the limits, so a separate
    /// thread calls `give_up` some time after a limit was reached if the verification has not
    /// ended. `give_up` should end the program.
    pub fn start(time: Duration, give_up: impl FnOnce(&Verification) + Send + 'static) -> Self {
        let (interrupt, answered) = (Arc::default(), Arc::default());
        let watch = Self { started: Instant::now(), time, interrupt, answered };
        // Without a measurement of the platform, memory is unlimited.
        let _ = memory::watch(MEMORY_LIMIT, Arc::clone(&watch.interrupt));
        let watcher = watch.clone();
        std::thread::spawn(move || {
            while !watcher.reached() {
                std::thread::sleep(INTERVAL);
            }
            std::thread::sleep(watcher.time / 10 + GRACE);
            if !watcher.answered.swap(true, Ordering::Relaxed) {
                let reason = format!("{LATE}, or more than {MEMORY_LIMIT} MB");
                let parts = vec![VerifiedPart { part: "limits", result: Err(reason) }];
                give_up(&Verification { claim: None, subject: None, parts });
            }
        });
        watch
    }

    /// Returns `true` if a limit is reached.
    pub fn reached(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed) || self.started.elapsed() >= self.time
    }

    /// Ends the verification and returns its report, which fails if the time limit is exceeded.
    /// `give_up` is not called afterwards.
    #[must_use]
    pub fn end(&self, mut report: Verification) -> Verification {
        if self.started.elapsed() > self.time {
            report.parts.push(VerifiedPart { part: "limits", result: Err(LATE.to_owned()) });
        }
        // The watching thread is already reporting the limit and ends the program.
        while self.answered.swap(true, Ordering::Relaxed) {
            std::thread::park();
        }
        report
    }
}

/// Parses a duration in seconds, for command-line options.
///
/// # Errors
/// The text is not a number of seconds, or the number is negative.
pub fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("`{text}` is not a number of seconds"))?;
    Duration::try_from_secs_f64(seconds).map_err(|error| error.to_string())
}
