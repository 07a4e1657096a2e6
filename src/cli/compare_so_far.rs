//! Results of `metaplan compare`: all of them, or those that are available at the time limit or at Ctrl-C.
//!
//! The comparison does not check the clock. So a separate thread waits for the time limit or for
//! Ctrl-C, shows the results that are available then, and ends the program.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use crate::answers::{CompareAnswer, ComparisonAnswer, Pair, Row, begun_rows, rows};
use crate::comparison::{Candidate, Comparison, Costs};
use crate::message::Message;
use crate::report::comparison_sheet;
use planner::Limits;

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::compare_table::{as_text, costs_text, csv};
use crate::cli::drawn::Pages;
use crate::cli::output;

const INTERVAL: Duration = Duration::from_millis(10);

#[derive(Debug, Clone, Default)]
pub(super) struct SoFar {
    /// Total number of comparisons. `None` before the first one begins.
    pub of: Option<usize>,
    pub done: Vec<(Option<Pair>, Comparison)>,
    pub begun: Option<Begun>,
    pub added: Vec<Row>,
    pub csv: Option<PathBuf>,
    pub mission: String,
    pub pages: Pages,
}

#[derive(Debug, Clone)]
pub(super) struct Begun {
    pub pair: Option<Pair>,
    pub candidates: Vec<Candidate>,
    pub costs: Costs,
}

/// Results shared with the thread that waits for the time limit. `None` once they are being shown.
#[derive(Debug, Clone)]
pub(super) struct Shared(Arc<Mutex<Option<SoFar>>>);

impl Shared {
    pub fn new() -> Self {
        Self(Arc::new(Mutex::new(Some(SoFar::default()))))
    }

    /// Changes the results. Does nothing once they are being shown, because the program then ends.
    pub fn change(&self, change: impl FnOnce(&mut SoFar)) {
        if let Some(so_far) = &mut *self.0.lock().unwrap_or_else(PoisonError::into_inner) {
            change(so_far);
        }
    }

    fn take(&self) -> Option<SoFar> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Starts a thread that shows the available results at the time limit or at Ctrl-C, and ends
    /// the program. A second Ctrl-C ends it at once.
    pub fn show_after(&self, time: Option<Duration>, common: &Common) {
        let limits = time.map_or_else(Limits::none, |time| Limits::none().with_time(time));
        let (common, shared, interrupt) = (common.clone(), self.clone(), limits.interrupt());
        // If no handler can be set, Ctrl-C ends the program as usual.
        let _ = ctrlc::set_handler(move || {
            if interrupt.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        });
        std::thread::spawn(move || {
            while !limits.reached() {
                std::thread::sleep(INTERVAL);
            }
            let Some(so_far) = shared.take() else { return };
            let message = so_far.message();
            if so_far.of.is_none() {
                output::failure(&common, &[message]);
            } else if let Err(failure) = so_far.show(&common, Some(message)) {
                output::failure(&common, &failure.messages);
                std::process::exit(failure.exit as i32);
            }
            std::process::exit(Exit::NothingFound as i32);
        });
    }

    /// Shows all results. Does not return if the time limit or Ctrl-C came first: then the other
    /// thread ends the program. Returns an error if a requested file cannot be written.
    pub fn end(&self, common: &Common) -> Result<Exit, Failure> {
        let Some(so_far) = self.take() else {
            // The other thread is showing the results and will end the program.
            loop {
                std::thread::park();
            }
        };
        so_far.show(common, None)?;
        Ok(Exit::Done)
    }
}

impl SoFar {
    fn message(&self) -> Message {
        let Some(of) = self.of else {
            return Message::error(
                "M130",
                "the time limit or an interruption stopped the comparison before its first result",
            );
        };
        let measured = self.begun.as_ref().map_or(0, |begun| begun.candidates.len());
        let text = format!(
            "the time limit or an interruption stopped the comparison; the results are incomplete: {} of {of} \
             comparisons, and {measured} candidates of the next",
            self.done.len()
        );
        Message::error("M130", text)
    }

    /// Writes the answer, and the requested files if anything was evaluated. `message` is the reason why the answer is
    /// incomplete.
    fn show(mut self, common: &Common, message: Option<Message>) -> Result<(), Failure> {
        let done = self.done.iter().flat_map(|(pair, comparison)| rows(pair.as_ref(), comparison));
        let begun = self
            .begun
            .iter()
            .flat_map(|comparison| begun_rows(comparison.pair.as_ref(), &comparison.candidates));
        let measured: Vec<Row> = done.chain(begun).collect();
        let is_empty = measured.is_empty();
        let added = std::mem::take(&mut self.added);
        let rows: Vec<Row> = measured.into_iter().chain(added.iter().cloned()).collect();
        if let Some(path) = self.csv.as_ref().filter(|_| !is_empty) {
            output::write_file(path, &csv(&rows))?;
        }
        if self.pages.are_wanted() && !is_empty {
            self.pages.write(&comparison_sheet(&self.mission, &self.done, &rows))?;
        }
        if common.format == Format::Json {
            let done =
                self.done.iter().map(|(pair, comparison)| ComparisonAnswer::new(pair.as_ref(), comparison));
            let begun = self.begun.iter();
            let begun = begun.map(|comparison| {
                ComparisonAnswer::begun(comparison.pair.as_ref(), &comparison.candidates, &comparison.costs)
            });
            let messages: Vec<Message> = message.into_iter().collect();
            output::json_answer(&CompareAnswer::new(done.chain(begun).collect(), &added, &messages));
            return Ok(());
        }
        if !is_empty {
            let mut text = as_text(&rows, &self.done);
            if let Some(begun) = &self.begun {
                let of = begun.pair.as_ref().map(|(start, goal)| format!("{start}-{goal}: "));
                let (of, costs) = (of.unwrap_or_default(), costs_text(&begun.costs));
                let _ = writeln!(text, "\n{of}incomplete\n{costs}");
            }
            output::answer(&text);
        }
        if let Some(message) = message {
            output::failure(common, &[message]);
        }
        Ok(())
    }
}
