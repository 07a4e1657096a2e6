//! Session of `metaplan run`: connects the adaptation loop with its input and output, in two modes.
//!
//! If all input is available, as in a file, each line is answered completely before the next one is
//! read. So the same lines give the same answers.
//!
//! If lines arrive from a pipe or a terminal, the loop reacts to all waiting lines before it
//! deliberates. Only a line about an action or effect that was not requested yet waits for the deliberation.
//! Plans are computed on another thread while the loop keeps reacting. A line that changes the
//! planning problem cancels the search, but only a few times in a row.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, TryRecvError, channel, sync_channel};
use std::time::{Duration, Instant};

use crate::journal::{Journal, Recovery};
use crate::mapek::{Answer, Loop, Observation, ParallelSearch, SystemClock, Thoughts};
use crate::message::Message;

use crate::cli::common::{Common, Failure};
use crate::cli::run_lines::{Line, Lines};
use crate::cli::run_outlet::{Outlet, is_over, unwritten, warn_if_unrecorded};

/// Capacity of the channel of inputs, and maximum length of the queue of waiting inputs.
pub(super) const MAX_WAITING: usize = 1024;

pub(super) const MIN_PAUSE: Duration = Duration::from_millis(1);

/// Upper limit on the time between the arrival of a line and its answers that counts as part of the robot's deadlines.
const MAX_WAIT: Duration = Duration::from_secs(1);

pub(super) enum Input {
    Line(Line, Instant),
    /// A search has ended. Its result is in a channel of its own, because inputs can fill the queue while a line waits
    /// for it.
    Searched,
    End,
    Failed(Message),
    /// A thread has panicked. The main thread resumes the panic.
    Panicked(Panic),
}

type Panic = Box<dyn std::any::Any + Send>;

type SearchResult = Result<Thoughts, Panic>;

/// Sender of inputs, and channel of the results of searches.
struct Channels {
    sender: SyncSender<Input>,
    result_sender: Sender<SearchResult>,
    results: Receiver<SearchResult>,
}

#[derive(PartialEq, Eq)]
pub(super) enum Flow {
    GoesOn,
    /// The reader of the answers has closed the pipe, which is not an error.
    Over,
}

pub(super) struct Resumed<A> {
    pub(super) journal: Journal,
    pub(super) recovery: Recovery,
    /// Answers of the reaction to an event without a recorded reaction, and effects that still await an
    /// acknowledgement. Empty before this reaction.
    pub(super) answers: Vec<A>,
}

pub(super) struct Session<'a> {
    common: &'a Common,
    control: Loop,
    journal: Option<Journal>,
    resumed_answers: Vec<Answer>,
    outlet: &'a Outlet,
    clock: SystemClock,
    /// Time of the last line or timer event of the resumed journal, since the start of the mission; 0 without
    /// such an event.
    begun: Duration,
    /// Time for which the clock of the mission was stopped, see [`Session::set_back`].
    delay: Duration,
    /// Time of the last line or timer by the clock of the mission.
    latest: Duration,
    /// Number of the current line, shared with the thread that reports the progress of planning.
    line: Arc<AtomicU64>,
    /// Number of the last line and the time at which it was read, until the line is acknowledged.
    open: Option<(u64, Instant)>,
    search: ParallelSearch,
    /// `true` if an accepted line had a time of its own. Time then advances with lines only.
    has_times: bool,
    /// Number of blank lines that were read. The loop does not receive them.
    blank_lines: u64,
}

impl<'a> Session<'a> {
    pub(super) fn new(
        common: &'a Common,
        control: Loop,
        resumed: Option<Resumed<Answer>>,
        outlet: &'a Outlet,
        line: Arc<AtomicU64>,
    ) -> Self {
        let (journal, resumed_answers) = match resumed {
            None => (None, Vec::new()),
            Some(Resumed { journal, answers, .. }) => (Some(journal), answers),
        };
        let (begun, has_times) = (control.beliefs().now(), control.beliefs().has_times());
        Self {
            common,
            control,
            journal,
            resumed_answers,
            outlet,
            clock: SystemClock::default(),
            begun,
            delay: Duration::ZERO,
            latest: begun,
            line,
            open: None,
            search: ParallelSearch::default(),
            has_times,
            blank_lines: 0,
        }
    }

    pub(super) fn replay(mut self, mut events: Lines) -> Result<(), Failure> {
        if self.begin(Instant::now())? == Flow::Over {
            return Ok(());
        }
        while let Some(line) = events.next(self.common)? {
            if self.answer_line(&line, Instant::now())? == Flow::Over {
                return Ok(());
            }
        }
        Ok(())
    }

    pub(super) fn live(mut self, events: Lines) -> Result<(), Failure> {
        let (sender, inputs) = sync_channel(MAX_WAITING);
        read(events, self.common.clone(), sender.clone());
        let (result_sender, results) = channel();
        let channels = Channels { sender, result_sender, results };
        let read = Instant::now();
        let answers = std::mem::take(&mut self.resumed_answers);
        self.open = Some((self.number(), read));
        let mut flow = self.say(&answers)?;
        let (mut waiting, mut is_ended) = (VecDeque::new(), false);
        while flow == Flow::GoesOn {
            gather(&inputs, &mut waiting);
            flow = match waiting.pop_front() {
                Some(Input::Line(line, read)) if self.is_early(&line) => {
                    waiting.push_front(Input::Line(line, read));
                    self.catch_up(&channels)?
                }
                Some(Input::Line(line, read)) => self.line(&line, read, waiting.is_empty())?,
                // A line that waited for the result may already have used it.
                Some(Input::Searched) => match channels.results.try_recv() {
                    Ok(result) => self.conclude(result)?,
                    Err(_) => Flow::GoesOn,
                },
                Some(Input::End) => {
                    is_ended = true;
                    Flow::GoesOn
                }
                Some(Input::Failed(message)) => return Err(message.into()),
                Some(Input::Panicked(panic)) => resume_unwind(panic),
                None if self.control.has_agenda() && !self.search.is_running() => {
                    self.deliberate(&channels)?
                }
                None if is_ended && !self.search.is_running() => {
                    self.close()?;
                    return Ok(());
                }
                None => {
                    if !self.search.is_running() {
                        flow = self.close()?;
                    }
                    let pause = self.pause();
                    // The session keeps a sender, so the channel is never closed.
                    match pause.map_or_else(|| inputs.recv().ok(), |pause| inputs.recv_timeout(pause).ok()) {
                        None if flow == Flow::GoesOn && pause.is_some() => self.elapse()?,
                        input => {
                            waiting.extend(input);
                            flow
                        }
                    }
                }
            };
        }
        Ok(())
    }

    fn begin(&mut self, read: Instant) -> Result<Flow, Failure> {
        let mut answers = std::mem::take(&mut self.resumed_answers);
        if self.control.has_agenda() {
            let mut decision = self.control.deliberate();
            self.decided(&mut decision)?;
            answers.extend(decision);
        }
        let number = self.number();
        self.answer(number, &answers, read)
    }

    fn answer_line(&mut self, line: &Line, read: Instant) -> Result<Flow, Failure> {
        let now = self.heard(line, read);
        let answers = match &mut self.journal {
            None => self.control.handle(&Observation::parse(&line.text), now),
            Some(journal) => {
                journal.handle(&mut self.control, &line.text, now).map_err(|error| unwritten(&error))?
            }
        };
        let number = self.number();
        self.answer(number, &answers, read)
    }

    /// Returns the number of the last line that the loop received. Counts blank lines of this process, too.
    fn number(&self) -> u64 {
        self.control.beliefs().lines() + self.blank_lines
    }

    /// Forwards a line to the recording and the web page. Returns the time of the line since the start of the mission.
    /// This is the time of its arrival, so that its wait for earlier lines does not count as silence of the robot.
    fn heard(&mut self, line: &Line, read: Instant) -> Duration {
        let now = match line.now {
            Some(now) => self.begun + now,
            None => self.monotone_time(read),
        };
        self.blank_lines += line.blank_lines;
        let number = self.number() + 1;
        self.line.store(number, Ordering::Relaxed);
        self.outlet.heard(number, now, &line.text);
        now
    }

    /// Reacts to a line. Also deliberates if no further line is waiting (`is_last`), the reaction
    /// has no effects, and no search is necessary or running. A line of a recording is answered
    /// completely.
    fn line(&mut self, line: &Line, read: Instant, is_last: bool) -> Result<Flow, Failure> {
        if self.close()? == Flow::Over {
            return Ok(Flow::Over);
        }
        // A recording has its own clock, so its lines are handled like those of a file.
        if line.now.is_some() {
            self.has_times = true;
            return self.recorded(line, read);
        }
        let now = self.heard(line, read);
        let mut answers = match &mut self.journal {
            None => self.control.react(&Observation::parse(&line.text), now),
            Some(journal) => {
                journal.observe(&mut self.control, &line.text, now).map_err(|error| unwritten(&error))?
            }
        };
        self.has_times |= self.control.beliefs().has_times();
        self.open = Some((self.number(), read));
        self.search.update(Some(self.control.question()));
        // A reaction with effects is written at once. A reaction without effects is joined with the deliberation, so
        // that one decision is written instead of two.
        let is_safe = answers.iter().all(|answer| answer.effect().is_none());
        if is_last
            && is_safe
            && !self.search.is_running()
            && self.control.has_agenda()
            && let Some(more) = self.control.deliberate_at_once()
        {
            self.search.reset();
            answers.extend(more);
            self.decided(&mut answers)?;
        } else if let Some(journal) = &mut self.journal {
            journal.reacted(&mut self.control, &mut answers).map_err(|error| unwritten(&error))?;
        }
        self.say_late(&answers)
    }

    /// Prints answers to a line that may have arrived long ago, for example because a search was necessary.
    fn say_late(&mut self, answers: &[Answer]) -> Result<Flow, Failure> {
        let flow = self.say(answers)?;
        self.set_back(answers);
        Ok(flow)
    }

    /// Sets the clock of the mission back to the time of the loop if these answers request effects of a line that has
    /// waited. Their deadlines begin at the time of the loop, and must not pass before the robot receives them.
    fn set_back(&mut self, answers: &[Answer]) {
        let wait = self.time(Instant::now()).saturating_sub(self.control.beliefs().now());
        if wait > MAX_WAIT && !self.has_times && answers.iter().any(|answer| answer.effect().is_some()) {
            self.delay += wait;
        }
    }

    /// Returns the time since the start of the mission at a moment.
    fn time(&self, moment: Instant) -> Duration {
        (self.begun + self.clock.at(moment)).saturating_sub(self.delay)
    }

    /// Returns the time since the start of the mission at which a line arrived or a timer has ended, but never a time
    /// before the previous one: a line may have arrived before the end of the previous timer.
    fn monotone_time(&mut self, moment: Instant) -> Duration {
        self.latest = self.latest.max(self.time(moment));
        self.latest
    }

    /// Returns the time until the loop must act without a line. Returns `None` if nothing is due, or if lines have
    /// times of their own.
    fn pause(&mut self) -> Option<Duration> {
        let due = self.control.due().filter(|_| !self.has_times)?;
        Some(due.saturating_sub(self.time(Instant::now())).max(MIN_PAUSE))
    }

    fn elapse(&mut self) -> Result<Flow, Failure> {
        let now = self.monotone_time(Instant::now());
        if self.control.due().is_none_or(|due| due > now) {
            return Ok(Flow::GoesOn);
        }
        let mut answers = match &mut self.journal {
            None => self.control.react(&Observation::timer(), now),
            Some(journal) => journal
                .observe(&mut self.control, Observation::TIMER, now)
                .map_err(|error| unwritten(&error))?,
        };
        self.search.update(Some(self.control.question()));
        if let Some(journal) = &mut self.journal {
            journal.reacted(&mut self.control, &mut answers).map_err(|error| unwritten(&error))?;
        }
        self.say_late(&answers)
    }

    /// Returns `true` if deliberation is pending, no action is under way, and the line is about an
    /// action or effect that was not requested yet. Such a line was written for an answer that the
    /// loop has not given yet, as in a file that is piped.
    fn is_early(&self, line: &Line) -> bool {
        let is_idle = self.control.has_agenda() && self.control.beliefs().running().is_none();
        is_idle && self.control.is_ahead(&Observation::parse(&line.text))
    }

    /// Advances the pending deliberation before the next line is handled: deliberates at once, starts a search, or
    /// waits for the result of the search.
    fn catch_up(&mut self, channels: &Channels) -> Result<Flow, Failure> {
        if !self.search.is_running() {
            return self.deliberate(channels);
        }
        match channels.results.recv() {
            Ok(result) => self.conclude(result),
            // The session keeps a sender.
            Err(_) => Ok(Flow::GoesOn),
        }
    }

    fn deliberate(&mut self, channels: &Channels) -> Result<Flow, Failure> {
        if let Some(mut answers) = self.control.deliberate_at_once() {
            self.search.reset();
            self.decided(&mut answers)?;
            return self.say_late(&answers);
        }
        let thinker = self.control.thinker();
        self.search.begin(thinker.handle());
        search_in_parallel(channels, move || thinker.think());
        Ok(Flow::GoesOn)
    }

    /// Deliberates with the result of another thread. A result for an outdated problem is discarded and the search is
    /// repeated, except after several cancelled searches in a row ([`ParallelSearch`]).
    fn conclude(&mut self, result: SearchResult) -> Result<Flow, Failure> {
        let thoughts = result.unwrap_or_else(|panic| resume_unwind(panic));
        self.control.keep_planner(&thoughts);
        let is_late = self.search.accepts_late_plans();
        if self.search.end() {
            return Ok(Flow::GoesOn);
        }
        let Some(mut answers) = self.control.deliberate_with(thoughts, is_late) else {
            return Ok(Flow::GoesOn);
        };
        self.search.reset();
        self.decided(&mut answers)?;
        self.say_late(&answers)
    }

    fn recorded(&mut self, line: &Line, read: Instant) -> Result<Flow, Failure> {
        self.search.interrupt();
        if self.control.has_agenda() {
            let mut answers = self.control.deliberate();
            self.decided(&mut answers)?;
            if self.say(&answers)? == Flow::Over {
                return Ok(Flow::Over);
            }
        }
        self.answer_line(line, read)
    }

    fn decided(&mut self, answers: &mut Vec<Answer>) -> Result<(), Failure> {
        if let Some(journal) = &mut self.journal {
            journal.decided(&mut self.control, answers).map_err(|error| unwritten(&error))?;
        }
        Ok(())
    }

    fn say(&self, answers: &[Answer]) -> Result<Flow, Failure> {
        warn_if_unrecorded(self.common, answers);
        let number = self.number();
        let flow = flow(self.outlet.answer_so_far(number, answers))?;
        self.outlet.plan(self.control.beliefs(), answers);
        Ok(flow)
    }

    fn answer(&self, number: u64, answers: &[Answer], read: Instant) -> Result<Flow, Failure> {
        warn_if_unrecorded(self.common, answers);
        let flow = flow(self.outlet.answer(number, answers, read))?;
        self.outlet.plan(self.control.beliefs(), answers);
        Ok(flow)
    }

    fn close(&mut self) -> Result<Flow, Failure> {
        match self.open.take() {
            None => Ok(Flow::GoesOn),
            Some((number, read)) => flow(self.outlet.answer(number, &[] as &[Answer], read)),
        }
    }
}

pub(super) fn flow(written: std::io::Result<()>) -> Result<Flow, Failure> {
    Ok(if is_over(written)? { Flow::Over } else { Flow::GoesOn })
}

/// Runs a search on another thread, which sends the result or the panic of the search.
fn search_in_parallel(channels: &Channels, search: impl FnOnce() -> Thoughts + Send + 'static) {
    let (sender, results) = (channels.sender.clone(), channels.result_sender.clone());
    std::thread::spawn(move || {
        // The receivers are closed if the run has ended.
        let _ = results.send(catch_unwind(AssertUnwindSafe(search)));
        let _ = sender.send(Input::Searched);
    });
}

fn gather(inputs: &Receiver<Input>, waiting: &mut VecDeque<Input>) {
    while waiting.len() < MAX_WAITING {
        match inputs.try_recv() {
            Ok(input) => waiting.push_back(input),
            Err(TryRecvError::Empty | TryRecvError::Disconnected) => return,
        }
    }
}

pub(super) fn read(mut events: Lines, common: Common, sender: SyncSender<Input>) {
    std::thread::spawn(move || {
        loop {
            let input = match catch_unwind(AssertUnwindSafe(|| events.next(&common))) {
                Ok(Ok(Some(line))) => Input::Line(line, Instant::now()),
                Ok(Ok(None)) => Input::End,
                Ok(Err(message)) => Input::Failed(message),
                Err(panic) => Input::Panicked(panic),
            };
            let is_last = !matches!(input, Input::Line(..));
            if sender.send(input).is_err() || is_last {
                return;
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{channel, sync_channel};

    use super::{Channels, Input, search_in_parallel};

    #[test]
    fn a_panic_of_a_search_is_sent_to_the_session() {
        let ((sender, inputs), (result_sender, results)) = (sync_channel(1), channel());
        let channels = Channels { sender, result_sender, results };
        search_in_parallel(&channels, || panic!("a fault of the planner"));
        assert!(matches!(inputs.recv(), Ok(Input::Searched)));
        let panic = channels.results.recv().expect("a result").expect_err("a panic");
        assert_eq!(panic.downcast_ref(), Some(&"a fault of the planner"));
    }
}
