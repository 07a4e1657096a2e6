//! Limits of a computation: a deadline, an interrupt flag, and the memory limit of a search.
//!
//! Ctrl-C sets the flag, and so does the memory limit of the process. Long loops iterate through [`Limits::watch`] or
//! call [`LimitPoll::beat`]. Both check the deadline and the flag from time to time, and return [`Interrupted`] at a
//! limit. Callers usually propagate this error with `?`, so that an incomplete result is not taken for an answer.
//! Searches compare their estimated memory with [`Limits::room`].

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rules::Interrupt;

use crate::thresholds::Thresholds;

/// The limits of one planning run. Clones share the interrupt flag.
#[derive(Debug, Clone, Default)]
pub struct Limits {
    deadline: Option<Instant>,
    time: Duration,
    interrupt: Arc<AtomicBool>,
    /// Flags of the computations that this one is a part of.
    outer: Vec<Arc<AtomicBool>>,
    room: Option<usize>,
    thresholds: Thresholds,
}

/// Time for completing an answer after the deadline, in addition to a tenth of the time limit. It is less than what
/// tests tolerate for a whole command (0.2 s), because the process must also start and print.
const GRACE: Duration = Duration::from_millis(120);

const DEFAULT_MEMORY: usize = 1 << 31;

impl Limits {
    /// Returns limits without a deadline, with a new interrupt flag and the default memory limit.
    pub fn none() -> Self {
        Self::default()
    }

    /// Sets the deadline to `time` from now.
    #[must_use]
    pub fn with_time(mut self, time: Duration) -> Self {
        self.deadline = Instant::now().checked_add(time);
        self.time = time;
        self
    }

    /// Returns limits with half of the remaining time, so that time remains for a later computation. Without a
    /// deadline, returns equal limits. The interrupt flag is shared.
    #[must_use]
    pub fn half(&self) -> Self {
        let remaining = self.deadline.map(|deadline| deadline.saturating_duration_since(Instant::now()));
        match remaining {
            Some(remaining) => self.clone().with_time(remaining.mul_f64(0.5)),
            None => self.clone(),
        }
    }

    /// Returns limits with the earlier of two deadlines: the current one, and `time` from now. The interrupt
    /// flag is shared.
    #[must_use]
    pub fn within(&self, time: Duration) -> Self {
        let limits = self.clone().with_time(time);
        match self.deadline {
            Some(deadline) if limits.deadline.is_none_or(|sooner| deadline < sooner) => self.clone(),
            _ => limits,
        }
    }

    /// Returns limits for completing an answer after the deadline, because freeing the memory of a search takes time.
    /// The new deadline is the present deadline (or now, if later) plus a tenth of the time limit and a constant grace
    /// period. Without a deadline, there is no new deadline. The interrupt flag is new; the memory limit and thresholds
    /// are the defaults.
    #[must_use]
    pub fn extended(&self) -> Self {
        let grace = self.time.mul_f64(0.1).saturating_add(GRACE);
        let deadline = self.deadline.and_then(|deadline| deadline.max(Instant::now()).checked_add(grace));
        Self { deadline, time: self.time, ..Self::default() }
    }

    /// Returns limits for an optional part of completing an answer: half of the time of [`Self::extended`], and the
    /// interrupt flags of these limits.
    #[must_use]
    pub fn extended_until_interrupted(&self) -> Self {
        Self { interrupt: self.interrupt(), outer: self.outer.clone(), ..self.extended().half() }
    }

    /// Sets the memory limit of a search in bytes. Searches compare it with their own estimate.
    #[must_use]
    pub fn with_room(mut self, bytes: usize) -> Self {
        self.room = Some(bytes);
        self
    }

    /// Sets the thresholds (numbers of states, nodes or labels, or amounts of work) at which searches switch
    /// optional parts on or off.
    #[doc(hidden)]
    #[must_use]
    pub fn with_thresholds(mut self, thresholds: Thresholds) -> Self {
        self.thresholds = thresholds;
        self
    }

    /// Returns the thresholds (numbers of states, nodes or labels, or amounts of work) at which searches switch
    /// optional parts on or off.
    pub fn thresholds(&self) -> &Thresholds {
        &self.thresholds
    }

    /// Returns the memory limit of a search in bytes; 2 GiB if none was set.
    pub fn room(&self) -> usize {
        self.room.unwrap_or(DEFAULT_MEMORY)
    }

    /// Returns limits for a part of a computation, with a new interrupt flag that ends only this part. All flags
    /// that end the computation of `self` also end the part.
    #[must_use]
    pub fn with_own_interrupt(&self) -> Self {
        let mut part = self.clone();
        part.outer.push(std::mem::take(&mut part.interrupt));
        part
    }

    fn is_interrupted(&self) -> bool {
        self.outer.iter().chain([&self.interrupt]).any(|flag| flag.load(Ordering::Relaxed))
    }

    /// Returns the interrupt flag of these limits. Setting it to `true` interrupts the computations that use
    /// it.
    pub fn interrupt(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.interrupt)
    }

    /// Checks the deadline and the interrupt flag.
    ///
    /// # Errors
    /// [`Interrupted`] if the deadline has passed or the flag is set.
    pub fn check(&self) -> Result<(), Interrupted> {
        if self.reached() { Err(Interrupted) } else { Ok(()) }
    }

    /// Iterates over the items. If the deadline passes or the interrupt flag is set, yields a single error and
    /// ends; fast loops may notice this some items later.
    pub fn watch<I: IntoIterator>(&self, items: I) -> LimitedIter<'_, I::IntoIter> {
        LimitedIter { items: items.into_iter(), pulse: self.pulse(), is_over: false }
    }

    /// Returns a poll that checks the limits in loops without an iterator.
    pub fn pulse(&self) -> LimitPoll<'_> {
        LimitPoll { limits: self, left: 0, stride: 1, last: None }
    }

    /// Returns `true` if the computation has a time limit.
    pub fn has_deadline(&self) -> bool {
        self.deadline.is_some()
    }

    /// Returns `true` if the deadline has passed or the interrupt flag is set.
    pub fn reached(&self) -> bool {
        self.is_interrupted() || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

impl From<&Limits> for Interrupt {
    fn from(limits: &Limits) -> Self {
        let limits = limits.clone();
        Self::new(move || limits.reached())
    }
}

/// Error: the deadline has passed or the interrupt flag is set, so the computation has no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interrupted;

/// Polls the limits with an adaptive stride (number of beats between two checks). Slow loops check the limits
/// at every second beat; fast loops check them rarely, because reading the clock would dominate the loop.
#[derive(Debug)]
pub struct LimitPoll<'a> {
    limits: &'a Limits,
    left: u32,
    stride: u32,
    last: Option<Instant>,
}

const LONGEST_STRIDE: u32 = 1 << 14;
const POLL_INTERVAL: Duration = Duration::from_millis(2);

impl LimitPoll<'_> {
    /// Counts one loop iteration; checks the limits if enough iterations have passed since the last check.
    ///
    /// # Errors
    /// [`Interrupted`] if the deadline has passed or the interrupt flag is set.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "above 0 where it is taken from; a stride is at most twice the longest"
    )]
    pub fn beat(&mut self) -> Result<(), Interrupted> {
        if self.left > 0 {
            self.left -= 1;
            return Ok(());
        }
        if self.limits.is_interrupted() {
            return Err(Interrupted);
        }
        let now = Instant::now();
        if self.limits.deadline.is_some_and(|deadline| now >= deadline) {
            return Err(Interrupted);
        }
        self.stride = match self.last.map(|last| now.duration_since(last)) {
            Some(passed) if passed > POLL_INTERVAL => (self.stride / 4).max(1),
            Some(passed) if passed < POLL_INTERVAL / 4 => (self.stride * 2).min(LONGEST_STRIDE),
            _ => self.stride,
        };
        self.last = Some(now);
        self.left = self.stride;
        Ok(())
    }
}

/// Iterator that ends with an error at the deadline or an interruption; see [`Limits::watch`].
#[derive(Debug)]
pub struct LimitedIter<'a, I> {
    items: I,
    pulse: LimitPoll<'a>,
    is_over: bool,
}

impl<I: Iterator> Iterator for LimitedIter<'_, I> {
    type Item = Result<I::Item, Interrupted>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        if let Err(interrupted) = self.pulse.beat() {
            self.is_over = true;
            return Some(Err(interrupted));
        }
        self.items.next().map(Ok)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn watched_iterators_end_with_an_error_and_never_early_without_one() {
        let limits = Limits::none();
        assert_eq!(limits.watch(0..100_000).filter_map(Result::ok).count(), 100_000);
        let mut watched = limits.watch(0..);
        assert_eq!(watched.next(), Some(Ok(0)));
        limits.interrupt().store(true, Ordering::Relaxed);
        // The flag may be noticed only after a stride of items. A single error follows.
        let results: Vec<_> = watched.collect();
        assert_eq!(results.iter().filter(|item| item.is_err()).count(), 1);
        assert_eq!(results.last(), Some(&Err(Interrupted)));
        let late = Limits::none().with_time(Duration::ZERO);
        assert_eq!(late.watch(0..3).collect::<Vec<_>>(), [Err(Interrupted)]);
    }

    #[test]
    fn an_own_interrupt_flag_ends_a_part() {
        let whole = Limits::none();
        let part = whole.with_own_interrupt();
        part.interrupt().store(true, Ordering::Relaxed);
        assert!(part.reached() && !whole.reached());
        let other_part = whole.with_own_interrupt();
        assert!(!other_part.reached());
        whole.interrupt().store(true, Ordering::Relaxed);
        assert!(other_part.reached() && other_part.pulse().beat().is_err());
        let nested = whole.with_own_interrupt().with_own_interrupt();
        assert!(nested.reached());
    }

    #[test]
    fn slow_items_are_watched_at_least_at_every_second_item() {
        // An interrupt instead of a deadline: a busy machine may stop the test for any time.
        let limits = Limits::none();
        let slow = |item: i32| {
            std::thread::sleep(Duration::from_millis(5));
            if item == 10 {
                limits.interrupt().store(true, Ordering::Relaxed);
            }
        };
        let passed = limits.watch(0..1_000).map_while(Result::ok).map(slow).count();
        assert!((11..=12).contains(&passed), "{passed}");
    }
}
