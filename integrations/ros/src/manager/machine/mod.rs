//! State machine between the robot and the adaptation loop.
//!
//! It has no clock and no network: each input comes with its time, and [`super::driver`] executes the outputs. If
//! there is a journal, each line for the loop is written to it before the line is handled, and each decision of the
//! loop before its outputs are executed.

mod actions;
mod functions;
mod io;
mod restart;
mod tasks;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use metaplan::journal::Journal;
use metaplan::mapek::{Answer, Command, Effect, Event, Loop, Observation, PlannedStep};
use metaplan::message::Message;
use serde_json::json;

use crate::manager::settings::Settings;
use crate::perform::Call;

use functions::Grant;

pub(super) use io::{Change, Ended, Input, Outcome, Output, State};

const EMPTY_GOAL: &str = "(and)";

#[derive(Debug, Clone)]
struct Action {
    number: u64,
    call: Call,
    /// Effect that requests the action. `None` if it is acknowledged.
    effect: Option<u64>,
    begun: bool,
    /// `true` for an action of the previous run until it is performed again.
    is_lost: bool,
    /// `true` once a request to end the action was sent to the performer, because the loop has suspended the action or
    /// the task has ended.
    is_stopped: bool,
}

/// Request to start a task that waits until the autopilot accepts commands.
#[derive(Debug)]
struct HeldRequest {
    /// Number of the wait after which the task is refused.
    wait: u64,
    number: u64,
    task: String,
}

#[derive(Debug, Clone, Default)]
struct CallFailures {
    /// Failed designs, with the time of the next attempt. `None` if the attempt waits until the function replies.
    designs: BTreeMap<String, Option<Duration>>,
    /// Number of mode changes that failed without a reply (after all attempts) since the last
    /// successful change. It determines the delay of probes.
    missed_replies: u32,
    /// `true` from the first probe until the function replies to a probe. Another timeout then needs no
    /// further probe.
    is_probed: bool,
}

/// Work after a restart that must wait until the state of the robot is known.
#[derive(Debug)]
struct Deferred {
    /// Answers of the loop at the start, which repeat its outstanding effects.
    answers: Vec<Answer>,
    modes: BTreeMap<String, String>,
    until: Duration,
}

#[derive(Debug)]
pub(super) struct Machine {
    control: Loop,
    journal: Option<Journal>,
    settings: Settings,
    functions: Vec<String>,
    state: State,
    task: Option<String>,
    pending: BTreeMap<String, Change>,
    modes: BTreeMap<String, String>,
    grants: BTreeMap<String, Grant>,
    action: Option<Action>,
    /// Number of waits that have begun, see [`Output::Await`].
    waits: u64,
    /// Number of the present wait for the end of an action whose task has ended.
    ending: Option<u64>,
    start_requests: Vec<u64>,
    held_requests: Vec<HeldRequest>,
    end_requests: Vec<u64>,
    failures: BTreeMap<String, CallFailures>,
    without_plan: bool,
    /// `false` if the autopilot has last reported another mode than the one in which it accepts commands.
    autopilot_obeys: bool,
    /// `true` if an action was requested since the goal was last reached.
    has_acted: bool,
    deferred: Option<Deferred>,
    transient_states: Vec<State>,
    outputs: Vec<Output>,
    lines: VecDeque<String>,
    now: Duration,
}

impl Machine {
    /// Creates the machine for a loop that has not started, with the journal from which it was
    /// restored, if there is one.
    pub(super) fn new(control: Loop, journal: Option<Journal>, settings: Settings) -> Self {
        let mission = control.beliefs().mission();
        let functions = mission.functions();
        let task = control.beliefs().goal().filter(|goal| *goal != EMPTY_GOAL).and_then(|goal| {
            settings.tasks.iter().find(|(_, task)| task.goal == goal).map(|(name, _)| name.clone())
        });
        Self {
            control,
            journal,
            settings,
            functions,
            state: State::WaitGraph,
            task,
            pending: BTreeMap::new(),
            modes: BTreeMap::new(),
            grants: BTreeMap::new(),
            action: None,
            waits: 0,
            ending: None,
            start_requests: Vec::new(),
            held_requests: Vec::new(),
            end_requests: Vec::new(),
            failures: BTreeMap::new(),
            without_plan: false,
            autopilot_obeys: true,
            has_acted: false,
            deferred: None,
            transient_states: Vec::new(),
            outputs: Vec::new(),
            lines: VecDeque::new(),
            now: Duration::ZERO,
        }
    }

    pub(super) fn control(&self) -> &Loop {
        &self.control
    }

    pub(super) fn state(&self) -> State {
        self.state
    }

    pub(super) fn task(&self) -> Option<&str> {
        self.task.as_deref()
    }

    pub(super) fn functions(&self) -> &[String] {
        &self.functions
    }

    /// Returns `true` if the measured value of an attribute is the value of a function of the problem.
    pub(super) fn measures_value(&self, attribute: &str) -> bool {
        let mission = self.control.beliefs().mission();
        let (_, name) = attribute.rsplit_once(['#', '/']).unwrap_or(("", attribute));
        mission.is_function(attribute) || !mission.fed_by(name).is_empty()
    }

    pub(super) fn modes_of(&self, function: &str) -> Vec<String> {
        let designs = self.control.beliefs().mission().designs_of(function);
        designs.iter().map(|design| self.settings.functions.mode(function, design).to_owned()).collect()
    }

    /// Returns `true` if requests of tasks wait for the mode of the autopilot.
    pub(super) fn holds_requests(&self) -> bool {
        !self.held_requests.is_empty()
    }

    /// Handles an input at the time `now` of the adaptation loop. Returns the outputs.
    ///
    /// # Errors
    /// The journal cannot be written. No outputs may then be executed.
    pub(super) fn handle(&mut self, input: Input, now: Duration) -> Result<Vec<Output>, Message> {
        self.now = now;
        let is_over = self.deferred.as_ref().is_some_and(|deferred| deferred.until <= now);
        let concerns_task = match &input {
            Input::Request(..) | Input::Cancel(..) => true,
            Input::Autopilot(mode) => !self.accepts_commands(mode),
            _ => false,
        };
        // Deferred work precedes new requests.
        if is_over || concerns_task {
            self.catch_up();
            self.settle()?;
        }
        let is_line = matches!(input, Input::Line(_));
        let because = match input {
            Input::Ready(modes) => self.ready(modes)?,
            Input::Line(line) => self.queue_line(line),
            Input::Request(number, task) => self.request(number, &task),
            Input::Cancel(number, task) => self.cancel(Some(number), &task),
            Input::Changed(change, outcome) => self.changed(change, outcome),
            Input::Mode(function, mode) => self.mode(&function, &mode),
            Input::ModeRequested(function, mode) => self.mode_requested(&function, &mode),
            Input::Touched(function) => {
                if !self.pending.contains_key(&function) {
                    self.outputs.push(Output::Look(function.clone()));
                }
                format!("{function} reports a change")
            }
            Input::Performed(number, ended) => self.performed(number, &ended),
            Input::Progress(number, fraction) => self.progress(number, fraction),
            Input::Probed(function, answers) => self.probed(&function, answers),
            Input::Autopilot(mode) => self.autopilot(&mode),
            Input::Overdue(wait) => self.abandon(wait),
            Input::Tick | Input::Diagnosed => self.tick(),
        };
        self.settle()?;
        // The line may contain the diagnostics for which deferred work waits.
        if is_line {
            self.catch_up();
            self.settle()?;
        }
        if self.deferred.is_none() {
            self.end_lost_action();
            self.begin();
        }
        self.settle()?;
        self.stop_interrupted();
        self.enter(&because)?;
        Ok(std::mem::take(&mut self.outputs))
    }

    /// Passes all pending lines to the loop, unless the machine still waits for the functions.
    fn settle(&mut self) -> Result<(), Message> {
        if self.state == State::WaitGraph {
            return Ok(());
        }
        while let Some(line) = self.lines.pop_front() {
            let answers = self.pass_line(&line)?;
            self.handle_answers(answers);
        }
        Ok(())
    }

    fn pass_line(&mut self, line: &str) -> Result<Vec<Answer>, Message> {
        match &mut self.journal {
            None => Ok(self.control.handle(&Observation::parse(line), self.now)),
            Some(journal) => {
                journal.handle(&mut self.control, line, self.now).map_err(|error| unwritten(&error))
            }
        }
    }

    fn queue(&mut self, event: &Event) {
        self.lines.push_back(event.to_json().to_string());
    }

    /// Enters the state that follows from the pending changes, the plan and the task, and answers requests whose
    /// result is known. Each transition is noted in the journal.
    fn enter(&mut self, because: &str) -> Result<(), Message> {
        if self.state == State::WaitGraph {
            return Ok(());
        }
        let next = if !self.pending.is_empty() {
            State::Reconfigure
        } else if self.without_plan {
            State::Degraded
        } else if self.task.is_some() || self.control.beliefs().running().is_some() {
            State::Execute
        } else {
            State::Idle
        };
        self.reply();
        let transient_states = std::mem::take(&mut self.transient_states);
        if next != self.state {
            let path: Vec<String> = [self.state]
                .into_iter()
                .chain(transient_states)
                .chain([next])
                .map(|state| state.to_string())
                .collect();
            self.state = next;
            self.note(&path, because)?;
        }
        Ok(())
    }

    fn note(&mut self, path: &[String], because: &str) -> Result<(), Message> {
        let text = format!("{}: {because}", path.join(" -> "));
        let answers = self.pass_line(&Event::Note { text }.to_json().to_string())?;
        self.handle_answers(answers);
        let event = json!({"answer": "state", "state": path.last(), "way": path, "because": because, "task": self.task});
        self.outputs.push(Output::Event(event));
        Ok(())
    }

    fn queue_line(&mut self, line: String) -> String {
        let because = "the knowledge has changed".to_owned();
        self.lines.push_back(line);
        because
    }

    fn handle_answers(&mut self, answers: Vec<Answer>) {
        for answer in answers {
            self.outputs.push(Output::Event(answer.to_json()));
            match answer {
                Answer::PlanRequested { .. } => self.transient_states = vec![State::Plan],
                Answer::PlanFound { .. } => {
                    self.without_plan = false;
                    // A plan after the end of the task could only contain a cancelled action, and is not published.
                    if self.task.is_some() || self.control.beliefs().goal().is_none() {
                        self.outputs.push(Output::Plan(answer.to_json()));
                    }
                }
                Answer::PlanKept { .. } => self.without_plan = false,
                Answer::PlanNone { because, .. } => {
                    self.without_plan = self.task.is_some() || self.control.beliefs().goal().is_none();
                    self.outputs.push(Output::Warn(format!("there is no plan: {because}")));
                }
                Answer::GoalReached => self.reached(),
                Answer::Error { code, message } => {
                    self.outputs.push(Output::Warn(format!("{code}: {message}")));
                }
                Answer::Unrecorded { message } => self.outputs.push(Output::Warn(message)),
                Answer::Effect(effect) => self.effect(effect),
                _ => {}
            }
        }
    }

    fn effect(&mut self, effect: Effect) {
        match effect.command {
            Command::Reconfigure { function, to, .. } => {
                let mode = self.settings.functions.mode(&function, &to).to_owned();
                // Steps end by their own timeout; a repeated request must not interrupt them.
                if self.settings.functions.has_steps(&function)
                    && self.pending.get(&function).is_some_and(|change| change.effect == Some(effect.number))
                {
                    return;
                }
                // The mode was already set while this program was not running.
                if self.deferred.is_some() && self.modes.get(&function) == Some(&mode) {
                    self.acknowledge(effect.number);
                    return;
                }
                self.change(function, mode, Some(effect.number));
            }
            Command::Request { step } => {
                let call = call(&step);
                let required: BTreeSet<&String> =
                    step.configuration.iter().map(|(function, _)| function).collect();
                let idle: Vec<String> =
                    self.functions.iter().filter(|function| !required.contains(function)).cloned().collect();
                for function in &idle {
                    self.unground(function);
                }
                self.has_acted = true;
                self.action = Some(Action {
                    number: effect.action,
                    call,
                    effect: Some(effect.number),
                    begun: false,
                    is_lost: false,
                    is_stopped: false,
                });
            }
            Command::Cancel { .. } => {
                self.acknowledge(effect.number);
                match &self.action {
                    // The performer reports the end.
                    Some(action) if action.begun => self.outputs.push(Output::Stop(action.number)),
                    _ => {
                        self.drop_lost_action();
                        self.queue(&Event::Cancelled { action: effect.action });
                    }
                }
            }
            // An action is begun or stopped once all answers are handled.
            _ => self.acknowledge(effect.number),
        }
    }

    fn acknowledge(&mut self, effect: u64) {
        self.queue(&Event::Acknowledged { effect });
    }
}

fn call(step: &PlannedStep) -> Call {
    let written = step.arguments.get(..step.written).unwrap_or(&step.arguments);
    Call {
        action: step.action.clone(),
        arguments: written.to_vec(),
        configuration: step.configuration.iter().cloned().collect(),
        duration: step.duration_rounded(),
    }
}

fn unwritten(error: &std::io::Error) -> Message {
    Message::error("M321", format!("the journal cannot be written: {error}"))
}

#[cfg(test)]
mod tests;
