//! The limit on memory: what the process occupies, to a flag that stops it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How often the memory is measured. So long the process may go on taking more.
const INTERVAL: Duration = Duration::from_millis(5);

/// Sets the flag as soon as the process occupies more than so many megabytes (of 2^20 bytes) of main memory. Programs that
/// it starts do not count. False if the platform does not tell how much memory a process occupies: there is no limit then.
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
