//! Session of the configuration loop: connects the loop with its input and output, in two modes:
//! for a file, and for lines as they arrive. Each line is answered completely in both modes,
//! because designs are chosen without planning.

use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use crate::configure::{Keeper, KeeperAnswer};
use crate::journal::Journal;
use crate::mapek::{Observation, Recoverable as _, SystemClock};

use crate::cli::common::{Common, Failure};
use crate::cli::run_lines::{Line, Lines};
use crate::cli::run_outlet::{Outlet, unwritten, warn_if_unrecorded};
use crate::cli::run_session::{Flow, Input, MAX_WAITING, MIN_PAUSE, Resumed, flow, read};

pub(super) struct KeeperSession<'a> {
    common: &'a Common,
    keeper: Keeper,
    journal: Option<Journal>,
    resumed_answers: Vec<KeeperAnswer>,
    outlet: &'a Outlet,
    clock: SystemClock,
    /// Time of the last line or timer event of the resumed journal, since the start; 0 without such an event.
    begun: Duration,
    /// Time of the last line or timer by the clock.
    latest: Duration,
    /// `true` if an accepted line had a time. Time then advances with lines only.
    has_times: bool,
    /// Number of blank lines that were read. The loop does not receive them.
    blank_lines: u64,
}

impl<'a> KeeperSession<'a> {
    pub(super) fn new(
        common: &'a Common,
        keeper: Keeper,
        resumed: Option<Resumed<KeeperAnswer>>,
        outlet: &'a Outlet,
    ) -> Self {
        let (journal, resumed_answers) = match resumed {
            None => (None, Vec::new()),
            Some(Resumed { journal, answers, .. }) => (Some(journal), answers),
        };
        let (begun, has_times, clock) = (keeper.now(), keeper.has_times(), SystemClock::default());
        Self {
            common,
            keeper,
            journal,
            resumed_answers,
            outlet,
            clock,
            begun,
            latest: begun,
            has_times,
            blank_lines: 0,
        }
    }

    /// Answers all lines of a file. Filters that become due between two lines are handled together with the later
    /// line.
    pub(super) fn replay(mut self, mut events: Lines) -> Result<(), Failure> {
        let mut flow = self.begin()?;
        while flow == Flow::GoesOn {
            let Some(line) = events.next(self.common)? else { break };
            flow = self.answer_line(&line, Instant::now())?;
        }
        Ok(())
    }

    pub(super) fn live(mut self, events: Lines) -> Result<(), Failure> {
        let (sender, inputs) = sync_channel(MAX_WAITING);
        read(events, self.common.clone(), sender);
        let mut flow = self.begin()?;
        while flow == Flow::GoesOn {
            let input = match self.pause() {
                Some(pause) => inputs.recv_timeout(pause),
                None => inputs.recv().map_err(|_| RecvTimeoutError::Disconnected),
            };
            flow = match input {
                Ok(Input::Line(line, read)) => self.answer_line(&line, read)?,
                Ok(Input::Failed(message)) => return Err(message.into()),
                Ok(Input::Panicked(panic)) => std::panic::resume_unwind(panic),
                Err(RecvTimeoutError::Timeout) => self.elapse()?,
                Ok(Input::End | Input::Searched) | Err(RecvTimeoutError::Disconnected) => break,
            };
        }
        Ok(())
    }

    fn begin(&mut self) -> Result<Flow, Failure> {
        let read = Instant::now();
        let mut answers = std::mem::take(&mut self.resumed_answers);
        if self.keeper.has_agenda() {
            let mut choice = self.keeper.start();
            if let Some(journal) = &mut self.journal {
                journal.decided(&mut self.keeper, &mut choice).map_err(|error| unwritten(&error))?;
            }
            answers.extend(choice);
        }
        self.warn(&answers);
        flow(self.outlet.answer(self.number(), &answers, read))
    }

    /// Returns the number of the last line that the loop received. Counts blank lines of this process, too.
    fn number(&self) -> u64 {
        self.keeper.lines() + self.blank_lines
    }

    fn answer_line(&mut self, line: &Line, read: Instant) -> Result<Flow, Failure> {
        let observation = Observation::parse(&line.text);
        // The wait of a line for earlier ones does not count as silence of the robot.
        let now = match line.now {
            Some(now) => self.begun + now,
            None => self.monotone_time(read),
        };
        self.blank_lines += line.blank_lines;
        self.outlet.heard(self.number() + 1, now, &line.text);
        let answers = self.handle(&line.text, &observation, now)?;
        self.has_times |= line.now.is_some() || self.keeper.has_times();
        self.warn(&answers);
        flow(self.outlet.answer(self.number(), &answers, read))
    }

    /// Returns the time since the start at which a line arrived or a timer has ended, but never a time before the previous
    /// one.
    fn monotone_time(&mut self, moment: Instant) -> Duration {
        self.latest = self.latest.max(self.begun + self.clock.at(moment));
        self.latest
    }

    /// Returns the time until a filter is due, for example after a debounce time. Returns `None` if
    /// no filter is, or if lines have times.
    fn pause(&mut self) -> Option<Duration> {
        let due = self.keeper.due().filter(|_| !self.has_times)?;
        Some(due.saturating_sub(self.begun + self.clock.at(Instant::now())).max(MIN_PAUSE))
    }

    /// Handles the due time of a filter, if it has passed. The answers have the number of the last
    /// input line, because time has no line of its own.
    fn elapse(&mut self) -> Result<Flow, Failure> {
        let now = self.monotone_time(Instant::now());
        if self.keeper.due().is_none_or(|due| due > now) {
            return Ok(Flow::GoesOn);
        }
        let answers = self.handle(Observation::TIMER, &Observation::timer(), now)?;
        self.warn(&answers);
        flow(self.outlet.answer_so_far(self.number(), &answers))
    }

    fn warn(&self, answers: &[KeeperAnswer]) {
        let of_loop = answers.iter().filter_map(|answer| match answer {
            KeeperAnswer::Loop(answer) => Some(answer),
            _ => None,
        });
        warn_if_unrecorded(self.common, of_loop);
    }

    fn handle(
        &mut self,
        text: &str,
        observation: &Observation,
        now: Duration,
    ) -> Result<Vec<KeeperAnswer>, Failure> {
        match &mut self.journal {
            None => Ok(self.keeper.handle_at(observation, now)),
            Some(journal) => {
                Ok(journal.handle(&mut self.keeper, text, now).map_err(|error| unwritten(&error))?)
            }
        }
    }
}
