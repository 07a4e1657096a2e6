//! Limits on time and memory, and signals.
//!
//! While a mission is read and reasoned about, there is no answer to save. So a signal ends the
//! program at once, and a separate thread ends it at a limit, unless an answer is being written.
//! Commands that do not plan need nothing else, except as process 1. In commands that plan, the planner handles the
//! first signal after the mission has been read, and returns the best plan found. A second signal
//! ends the program at once.
//!
//! The loops of the planner, of the validator and of the later stages poll the limits. If a loop
//! does not, the separate thread ends the program about a tenth of the limit later, unless the
//! output of an answer or file has begun. At a time limit, the thread also waits until the
//! processor time of the program exceeds the limit by as much.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::message::Message;
use clap::Args;
use planner::Limits;
use verify::memory;

use crate::cli::common::{Common, Exit, Failure};
use crate::cli::output;
use crate::cli::values::seconds;

/// Lets signals end the program if it is process 1, as in a container. Linux does not deliver signals to this process that
/// it does not handle. Commands with partial results replace these handlers.
#[cfg(unix)]
pub(super) fn handle_signals_of_process_1() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

    if std::process::id() == 1 {
        let is_ended = Arc::new(AtomicBool::new(true));
        for signal in [SIGHUP, SIGINT, SIGTERM] {
            // Without a handler, the program can still be killed.
            let _ = signal_hook::flag::register_conditional_shutdown(signal, 130, Arc::clone(&is_ended));
        }
    }
}

const INTERVAL: Duration = Duration::from_millis(10);

/// Time that is added to 1.1 times the time limit (see [`Deadline`]).
const GRACE: Duration = Duration::from_millis(150);

/// The option `--time-limit`. At the limit, a command with partial results shows them; others end without an answer.
#[derive(Debug, Clone, Args)]
pub(super) struct TimeLimit {
    /// Stop after this many seconds with the results so far, or without an answer if there are no
    /// partial results (status 12).
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    time_limit: Option<Duration>,
}

impl TimeLimit {
    /// Starts to measure time.
    ///
    /// # Errors
    /// The time limit is 0, and so reached before anything is read.
    pub(super) fn guard(&self, common: &Common) -> Result<Guard, Failure> {
        if self.time_limit.is_some_and(|limit| limit.is_zero()) {
            return Err(Failure { exit: Exit::NothingFound, messages: nothing_to_show().into() });
        }
        Guard::new(self.time_limit, None, common)
    }
}

/// Limits of a command while it reads its input; [`Guard::plan`] passes them to the planner.
pub(super) struct Guard {
    limits: Limits,
    has_read: Arc<AtomicBool>,
}

impl Guard {
    /// Starts to measure time and memory. Returns an error if memory is to be limited and the
    /// platform does not report the memory of the process.
    pub(super) fn new(time: Option<Duration>, memory: Option<u64>, common: &Common) -> Result<Self, Failure> {
        let mut limits = Limits::none();
        if let Some(time) = time {
            limits = limits.with_time(time);
        }
        if let Some(megabytes) = memory
            && !memory::watch(megabytes, limits.interrupt())
        {
            let text = "`--memory-limit`: this platform does not report the memory of a process";
            return Err(Failure::usage(Message::error("M115", text)));
        }
        if let Some(megabytes) = memory {
            // A* may use half of the memory limit. The satisficing search, and the improvement of a plan, may each use half of that again.
            let half = usize::try_from(megabytes).unwrap_or(usize::MAX).saturating_mul(1 << 19);
            limits = limits.with_room(half);
        }
        let has_read = Arc::new(AtomicBool::new(false));
        if time.is_some() || memory.is_some() {
            let too_large = Arc::default();
            if let Some(megabytes) = memory {
                let _ = memory::watch(megabytes.saturating_add(megabytes / 10), Arc::clone(&too_large));
            }
            let late = Deadline { started: Instant::now(), time, too_large };
            give_up_late(limits.clone(), Arc::clone(&has_read), late, common.clone());
        }
        Ok(Self { limits, has_read })
    }

    /// Ends the reading stage, and returns the limits for the planner. From now on, the planner handles signals, time
    /// and memory.
    pub(super) fn plan(self) -> Limits {
        if self.has_read.swap(true, Ordering::Relaxed) {
            // The other thread is reporting that a limit was reached and will end the program.
            loop {
                std::thread::park();
            }
        }
        let interrupt = self.limits.interrupt();
        // The system sends this signal at the soft limit on processor time, and kills the program
        // at the hard limit.
        #[cfg(unix)]
        let _ = signal_hook::flag::register(signal_hook::consts::SIGXCPU, Arc::clone(&interrupt));
        // No other handler was set before. If the platform rejects this handler, Ctrl-C ends the program as usual. A
        // second Ctrl-C ends the program without the best plan found.
        let _ = ctrlc::set_handler(move || {
            if interrupt.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        });
        self.limits
    }
}

fn nothing_to_show() -> Message {
    Message::error("M130", "a limit was reached before there was a result")
}

/// The time limit plus a tenth and [`GRACE`], and the memory limit plus a tenth. A program that reaches one of them
/// after it has read its input is ended, unless it has begun to write an answer. The first limit applies to both the
/// elapsed time and the processor time.
struct Deadline {
    started: Instant,
    time: Option<Duration>,
    /// Set when the process occupies a tenth more than its memory limit.
    too_large: Arc<AtomicBool>,
}

impl Deadline {
    fn is_reached(&self) -> bool {
        let is_over = |time: Duration| {
            let end = time.saturating_add(time / 10).saturating_add(GRACE);
            let elapsed = self.started.elapsed();
            // Processor time also has to exceed the limit, since an answer takes longer on a busy
            // machine.
            elapsed > end && processor_time().unwrap_or(elapsed) > end
        };
        self.too_large.load(Ordering::Relaxed) || self.time.is_some_and(is_over)
    }
}

/// Returns the processor time of this process since its start, in steps of 10 ms. Returns `None`
/// without `/proc/self/stat`.
fn processor_time() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name of the program is in parentheses and may contain any characters.
    let (_, fields) = text.rsplit_once(')')?;
    let mut times = fields.split_whitespace().skip(11);
    let mut ticks = || times.next()?.parse::<u64>().ok();
    let (user, system) = (ticks()?, ticks()?);
    Some(Duration::from_millis(user.saturating_add(system).saturating_mul(10)))
}

/// Starts a thread that ends the program if it does not stop at a limit by itself. Reading does not
/// poll the limits, so the thread ends the program when a limit is reached. All later stages should
/// poll the limits. If a loop does not (a bug), the thread ends the program at the deadline `late`.
fn give_up_late(limits: Limits, has_read: Arc<AtomicBool>, late: Deadline, common: Common) {
    std::thread::spawn(move || {
        while !has_read.load(Ordering::Relaxed) && !limits.reached() {
            std::thread::sleep(INTERVAL);
        }
        end_unless(&common, || has_read.swap(true, Ordering::Relaxed));
        while !late.is_reached() {
            std::thread::sleep(INTERVAL);
        }
        end_unless(&common, || false);
    });
}

/// Ends the program, unless the output of an answer or file has begun, or `condition` returns `true`.
fn end_unless(common: &Common, condition: impl FnOnce() -> bool) {
    // A thread that writes an answer holds this lock until the answer is complete.
    let _stdout = std::io::stdout().lock();
    if !output::has_begun() && !condition() {
        output::failure(common, &[nothing_to_show()]);
        std::process::exit(Exit::NothingFound as i32);
    }
}
