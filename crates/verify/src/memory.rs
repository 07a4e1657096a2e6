//! The memory limit: a thread measures the memory of the process and sets a flag.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Interval between two measurements. The process may exceed the limit for about this time.
const INTERVAL: Duration = Duration::from_millis(5);

/// Starts a thread that sets `interrupt` as soon as the process occupies more than `megabytes` of
/// main memory (units of 2^20 bytes). Child processes do not count. Returns `false`, without an
/// effect, if the platform does not report the memory of a process.
#[must_use]
pub fn watch(megabytes: u64, interrupt: Arc<AtomicBool>) -> bool {
    let occupied = || memory_stats::memory_stats().map(|stats| stats.physical_mem as u64);
    if occupied().is_none() {
        return false;
    }
    std::thread::spawn(move || {
        while occupied().is_none_or(|bytes| bytes >> 20 <= megabytes) {
            std::thread::sleep(INTERVAL);
        }
        interrupt.store(true, Ordering::Relaxed);
    });
    true
}
