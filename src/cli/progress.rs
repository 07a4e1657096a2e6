//! Progress of a command on standard error: a changing line on a terminal, otherwise a line every few seconds.
//! `--quiet` suppresses it.

use std::io::IsTerminal as _;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::cli::common::Common;
use crate::cli::output;

/// A command that ends within this delay prints no progress, unless standard error is a terminal.
const INITIAL_DELAY: Duration = Duration::from_secs(3);

const INTERVAL: Duration = Duration::from_secs(5);

pub(super) struct Progress {
    bar: ProgressBar,
    message: Arc<Mutex<String>>,
    teller: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Progress {
    pub(super) fn new(what: &'static str, common: &Common) -> Self {
        let is_terminal = std::io::stderr().is_terminal();
        let is_shown = is_terminal && !common.quiet;
        let target = if is_shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(None, target);
        if let Ok(style) = ProgressStyle::with_template(&format!("{{spinner}} {what} {{elapsed}} {{msg}}")) {
            bar.set_style(style);
        }
        if is_shown {
            bar.enable_steady_tick(Duration::from_millis(200));
        }
        let message = Arc::default();
        let tells = !is_terminal && !common.quiet;
        let teller = tells.then(|| tell(what, Arc::clone(&message)));
        Self { bar, message, teller }
    }

    pub(super) fn set_message(&self, text: String) {
        text.clone_into(&mut self.message.lock().unwrap_or_else(PoisonError::into_inner));
        self.bar.set_message(text);
    }

    pub(super) fn finish(self) {
        drop(self);
    }
}

pub(super) fn during<T>(what: &'static str, common: &Common, work: impl FnOnce() -> T) -> T {
    let _progress = Progress::new(what, common);
    work()
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        if let Some((sender, thread)) = self.teller.take() {
            drop(sender);
            // The thread ends at once, because its channel is closed.
            let _ = thread.join();
        }
    }
}

/// Writes a progress line every few seconds until the returned sender is dropped.
fn tell(what: &'static str, message: Arc<Mutex<String>>) -> (Sender<()>, JoinHandle<()>) {
    let (sender, receiver) = channel();
    let started = Instant::now();
    let thread = std::thread::spawn(move || {
        let mut wait = INITIAL_DELAY;
        while receiver.recv_timeout(wait) == Err(RecvTimeoutError::Timeout) {
            let text = message.lock().unwrap_or_else(PoisonError::into_inner).clone();
            output::note(&line(what, started.elapsed(), &text));
            wait = INTERVAL;
        }
    });
    (sender, thread)
}

fn line(what: &str, elapsed: Duration, text: &str) -> String {
    let separator = if text.is_empty() { "" } else { ": " };
    format!("{what}, {} s{separator}{text}\n", elapsed.as_secs())
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::line;

    #[test]
    fn lines_contain_the_current_message() {
        assert_eq!(line("planning", Duration::from_millis(3_100), ""), "planning, 3 s\n");
        assert_eq!(line("planning", Duration::from_secs(8), "cost 4"), "planning, 8 s: cost 4\n");
    }
}
