//! The time and memory limits of a verification. They are needed because a certificate is untrusted
//! and may require unlimited resources.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::manifest::{Verification, VerifiedPart};
use crate::memory;

/// Upper limit on the memory of the process, in megabytes of 2^20 bytes.
const MEMORY_LIMIT: u64 = 4096;
/// A verification that does not end is aborted after this time, counted from the memory limit or from a tenth
/// more than the time limit. Memory may grow fast, so the memory limit gives no more time.
const GRACE: Duration = Duration::from_millis(100);
const LATE: &str = "it takes longer than `--time-limit` allows";
const INTERVAL: Duration = Duration::from_millis(50);

/// The time and memory limits of a running verification. Clones share the same limits.
#[derive(Debug, Clone)]
pub struct Watch {
    started: Instant,
    time: Duration,
    interrupt: Arc<AtomicBool>,
    answered: Arc<AtomicBool>,
}

impl Watch {
    /// Starts measuring time and memory. Some computations do not poll the limits. A separate
    /// thread therefore calls `give_up` some time after a limit was reached if the verification has
    /// not ended. `give_up` should end the program.
    pub fn start(time: Duration, give_up: impl FnOnce(&Verification) + Send + 'static) -> Self {
        let (interrupt, answered) = (Arc::default(), Arc::default());
        let watch = Self { started: Instant::now(), time, interrupt, answered };
        // If the platform does not report the memory of a process, memory is unlimited.
        let _ = memory::watch(MEMORY_LIMIT, Arc::clone(&watch.interrupt));
        let watcher = watch.clone();
        std::thread::spawn(move || {
            let latest = watcher.time.saturating_add(watcher.time / 10);
            while !watcher.interrupt.load(Ordering::Relaxed) && watcher.started.elapsed() < latest {
                std::thread::sleep(INTERVAL);
            }
            std::thread::sleep(GRACE);
            if !watcher.answered.swap(true, Ordering::Relaxed) {
                let reason = format!("{LATE}, or more than {MEMORY_LIMIT} MB");
                let parts = vec![VerifiedPart { part: "limits", result: Err(reason) }];
                give_up(&Verification { claim: None, subject: None, parts });
            }
        });
        watch
    }

    /// Returns `true` if the time or memory limit is reached.
    pub fn reached(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed) || self.started.elapsed() >= self.time
    }

    /// Ends the verification and returns its report, with a failed part `limits` if a limit is
    /// exceeded. Afterwards `give_up` is not called; if it is being called already, this
    /// function does not return.
    #[must_use]
    pub fn end(&self, mut report: Verification) -> Verification {
        let is_late = self.started.elapsed() > self.time;
        // Some computations do not poll the limits.
        let is_large = self.interrupt.load(Ordering::Relaxed);
        if is_late || is_large {
            let large = || format!("it needs more than {MEMORY_LIMIT} MB");
            let reason = if is_late { LATE.to_owned() } else { large() };
            report.parts.push(VerifiedPart { part: "limits", result: Err(reason) });
        }
        // If the flag was set already, the watching thread is reporting the limit and ends the
        // program.
        while self.answered.swap(true, Ordering::Relaxed) {
            std::thread::park();
        }
        report
    }
}

/// Parses a command-line value as a duration in seconds.
///
/// # Errors
/// The text is not a number, or the number is negative or too large.
pub fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("`{text}` is not a number of seconds"))?;
    Duration::try_from_secs_f64(seconds).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verification_with_too_much_memory_is_aborted_at_once() {
        let (sender, receiver) = std::sync::mpsc::channel();
        let watch = Watch::start(Duration::from_secs(3600), move |report| {
            let _ = sender.send(report.to_string());
        });
        watch.interrupt.store(true, Ordering::Relaxed);
        let report = receiver.recv_timeout(Duration::from_secs(60)).expect("aborted");
        assert!(report.contains("more than 4096 MB"), "{report}");
    }

    #[test]
    fn nothing_is_verified_with_too_much_memory() {
        let watch = Watch::start(Duration::from_secs(3600), |_| {});
        watch.interrupt.store(true, Ordering::Relaxed);
        let report = watch.end(Verification { claim: None, subject: None, parts: Vec::new() });
        assert!(report.parts.iter().any(|part| part.part == "limits" && part.result.is_err()));
    }
}
