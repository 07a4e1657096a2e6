//! What is heard to what is asked for: the state machine between the robot and the adaptation loop.
//!
//! It knows no clock and no network: inputs come with a time, and outputs are carried out by [`super::driver`]. A line that the loop hears is
//! written to the journal before it is handled, and what the loop decides before any of it leaves.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt;
use std::time::Duration;

use metaplan::journal::Journal;
use metaplan::mapek::{Answer, Command, Effect, Event, Loop, Observation, PlannedStep};
use metaplan::message::{Message, did_you_mean};
use serde_json::{Value, json};

use crate::manager::settings::Settings;
use crate::perform::Call;

/// The goal of nobody.
const NOTHING: &str = "(and)";

/// A call is made again once where there was no answer.
const TRIES: u32 = 2;

/// The first wait before a function that did not answer is asked again; it doubles with each failure.
const PROBE: Duration = Duration::from_secs(1);

/// The longest one.
const LONGEST_PROBE: Duration = Duration::from_secs(60);

/// After a restart so long diagnostics are waited for, before what was found is judged by what was known before.
const AGAIN: Duration = Duration::from_secs(3);

/// After a refusal, the design is tried again so much later.
const REFUSED: Duration = Duration::from_secs(60);

/// What is heard.
#[derive(Debug)]
pub(super) enum Input {
    /// The functions answer; the mode that each has, as far as it says.
    Ready(Vec<(String, Option<String>)>),
    /// Something was diagnosed that waits to be handled: the driver makes a line of it.
    Diagnosed,
    /// A line of events, as the loop reads them.
    Line(String),
    /// A task is requested; whether it is granted is answered under this number.
    Request(u64, String),
    /// A task is to end.
    Cancel(u64, String),
    /// A function has answered to a call, or has not.
    Changed(Change, Outcome),
    /// The mode that a function was seen to have, by what it tells or by asking.
    Mode(String, String),
    /// Something about a function has changed that does not say its mode.
    Touched(String),
    /// An action has ended.
    Performed(u64, Ended),
    /// How much of it is done, from 0 to 1.
    Progress(u64, f64),
    /// A function that did not answer does again, or not yet.
    Probed(String, bool),
    /// The mode of the autopilot.
    Autopilot(String),
    /// Time passes.
    Tick,
}

/// A call of `change_mode`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Change {
    /// The function.
    pub(super) function: String,
    /// The mode that is asked for.
    pub(super) mode: String,
    /// The loop's effect; none where the function is not needed any more.
    pub(super) effect: Option<u64>,
    /// From 1.
    pub(super) attempt: u32,
}

/// What has come of a call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Outcome {
    /// The function has the mode.
    Done,
    /// It has said no.
    Refused,
    /// It has said nothing that is understood: why.
    Failed(String),
}

/// How an action has ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Ended {
    Succeeded,
    Cancelled,
    Failed(String),
}

/// What is to be done.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Output {
    /// To call `change_mode`.
    Change(Change),
    /// To ask a function for its mode.
    Look(String),
    /// To ask a function, so much later, whether it answers.
    Probe(String, Duration),
    /// To answer a request.
    Reply(u64, bool),
    /// To begin an action.
    Perform(u64, Call),
    /// To end an action early.
    Stop(u64),
    /// To publish a plan.
    Plan(Value),
    /// To publish an event.
    Event(Value),
    /// To log something that is wrong.
    Warn(String),
}

/// Where the machine is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum State {
    WaitGraph,
    Idle,
    Reconfigure,
    Execute,
    Degraded,
}

impl fmt::Display for State {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::WaitGraph => "WAIT_GRAPH",
            Self::Idle => "IDLE",
            Self::Reconfigure => "RECONFIGURE",
            Self::Execute => "EXECUTE",
            Self::Degraded => "DEGRADED",
        })
    }
}

/// An action that was requested by the loop.
#[derive(Debug, Clone)]
struct Action {
    number: u64,
    call: Call,
    effect: u64,
    /// Whether somebody performs it already.
    begun: bool,
}

/// Why a function is not asked.
#[derive(Debug, Clone, Default)]
struct Trouble {
    /// Designs that it did not take, with the time from which each is tried again; none while it does not answer.
    designs: BTreeMap<String, Option<Duration>>,
    /// How often in a row it did not answer.
    silences: u32,
}

/// What is done after a restart as soon as it is known how the robot is.
#[derive(Debug)]
struct Deferred {
    /// What the loop asks for again.
    answers: Vec<Answer>,
    /// The modes that the functions were found with.
    modes: BTreeMap<String, String>,
    /// Diagnostics are waited for until then.
    until: Duration,
}

/// The state machine.
#[derive(Debug)]
pub(super) struct Machine {
    control: Loop,
    journal: Option<Journal>,
    settings: Settings,
    functions: Vec<String>,
    state: State,
    task: Option<String>,
    /// Calls that have no answer yet, by function.
    pending: BTreeMap<String, Change>,
    /// The mode that each function was last heard to have.
    modes: BTreeMap<String, String>,
    action: Option<Action>,
    /// Who waits for the answer to the request of a task, and to the end of one.
    waiting: Vec<u64>,
    ending: Vec<u64>,
    trouble: BTreeMap<String, Trouble>,
    /// Whether the last plan was none.
    without_plan: bool,
    obeyed: bool,
    deferred: Option<Deferred>,
    /// Whether the loop waits for time to pass before it looks for a better plan.
    ticks: bool,
    outputs: Vec<Output>,
    lines: VecDeque<String>,
    now: Duration,
}

impl Machine {
    /// For a loop that has not begun, with the journal that it was brought back from, if there is one.
    pub(super) fn new(control: Loop, journal: Option<Journal>, settings: Settings, ticks: bool) -> Self {
        let mission = control.beliefs().mission();
        let functions = mission.functions();
        let task = control.beliefs().goal().filter(|goal| *goal != NOTHING).and_then(|goal| {
            settings.tasks.iter().find(|(_, own)| own.goal == goal).map(|(name, _)| name.clone())
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
            action: None,
            waiting: Vec::new(),
            ending: Vec::new(),
            trouble: BTreeMap::new(),
            without_plan: false,
            obeyed: false,
            deferred: None,
            ticks,
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

    /// The functions that have designs.
    pub(super) fn functions(&self) -> &[String] {
        &self.functions
    }

    /// All modes that designs and their absence stand for, of a function.
    pub(super) fn modes_of(&self, function: &str) -> Vec<String> {
        let designs = self.control.beliefs().mission().designs_of(function);
        designs.iter().map(|design| self.settings.functions.mode(function, design).to_owned()).collect()
    }

    /// Takes something that was heard, at a time since the start, and says what is to be done.
    ///
    /// # Errors
    /// The journal cannot be written: nothing may be done any more.
    pub(super) fn handle(&mut self, input: Input, now: Duration) -> Result<Vec<Output>, Message> {
        self.now = now;
        let is_over = self.deferred.as_ref().is_some_and(|own| own.until <= now);
        if is_over || matches!(input, Input::Request(..) | Input::Cancel(..)) {
            self.catch_up();
            self.settle()?;
        }
        let is_news = matches!(input, Input::Line(_));
        let because = match input {
            Input::Ready(modes) => self.ready(modes)?,
            Input::Line(line) => self.told(line),
            Input::Request(number, task) => self.request(number, &task),
            Input::Cancel(number, task) => self.cancel(Some(number), &task),
            Input::Changed(change, outcome) => self.changed(change, outcome),
            Input::Mode(function, mode) => self.mode(&function, &mode),
            Input::Touched(function) => {
                if !self.pending.contains_key(&function) {
                    self.outputs.push(Output::Look(function.clone()));
                }
                format!("{function} has changed something")
            }
            Input::Performed(number, ended) => self.performed(number, &ended),
            Input::Progress(number, fraction) => self.progress(number, fraction),
            Input::Probed(function, answers) => self.probed(&function, answers),
            Input::Autopilot(mode) => self.autopilot(&mode),
            Input::Tick | Input::Diagnosed => self.tick(),
        };
        self.settle()?;
        if is_news {
            self.catch_up();
            self.settle()?;
        }
        self.begin();
        self.settle()?;
        self.enter(&because)?;
        Ok(std::mem::take(&mut self.outputs))
    }

    /// Hands the loop all lines that wait.
    fn settle(&mut self) -> Result<(), Message> {
        if self.state == State::WaitGraph {
            return Ok(());
        }
        while let Some(line) = self.lines.pop_front() {
            let answers = self.hand(&line)?;
            self.take(answers);
        }
        Ok(())
    }

    fn hand(&mut self, line: &str) -> Result<Vec<Answer>, Message> {
        match &mut self.journal {
            None => Ok(self.control.handle(&Observation::parse(line), self.now)),
            Some(journal) => {
                journal.handle(&mut self.control, line, self.now).map_err(|error| unwritten(&error))
            }
        }
    }

    fn say(&mut self, event: &Event) {
        self.lines.push_back(event.to_json().to_string());
    }

    /// The state that follows from what is under way; each change is a note in the journal.
    fn enter(&mut self, because: &str) -> Result<(), Message> {
        if self.state == State::WaitGraph {
            return Ok(());
        }
        let next = if !self.pending.is_empty() {
            State::Reconfigure
        } else if self.task.is_none() {
            State::Idle
        } else if self.without_plan {
            State::Degraded
        } else {
            State::Execute
        };
        self.reply();
        if next != self.state {
            let text = format!("{} -> {next}: {because}", self.state);
            self.state = next;
            let answers = self.hand(&Event::Note { text: text.clone() }.to_json().to_string())?;
            self.take(answers);
            self.outputs.push(Output::Event(
                json!({"answer": "state", "state": next.to_string(), "because": because, "task": self.task}),
            ));
        }
        Ok(())
    }

    /// Begins the action that was requested, once every function that it needs has its design.
    fn begin(&mut self) {
        let beliefs = self.control.beliefs();
        let has = |(function, design): &(String, String)| {
            beliefs.configuration().get(function).is_some_and(|own| own == design)
        };
        let is_ready = beliefs.running().is_some_and(|(_, step)| step.configuration.iter().all(has))
            && !beliefs.suspended()
            && !beliefs.cancelling();
        if !self.pending.is_empty() || !is_ready {
            return;
        }
        let Some(action) = self.action.as_mut().filter(|action| !action.begun) else { return };
        action.begun = true;
        let (number, effect, call) = (action.number, action.effect, action.call.clone());
        self.outputs.push(Output::Perform(number, call));
        self.lines.push_back(Event::Acknowledged { effect }.to_json().to_string());
        self.lines.push_back(Event::Started { action: number }.to_json().to_string());
    }

    /// Answers those who wait, where it is known what has come of it.
    fn reply(&mut self) {
        if !self.pending.is_empty() {
            return;
        }
        let granted = self.task.is_some() && !self.without_plan;
        for number in std::mem::take(&mut self.waiting) {
            self.outputs.push(Output::Reply(number, granted));
        }
        for number in std::mem::take(&mut self.ending) {
            let left =
                self.modes.iter().any(|(function, mode)| self.settings.functions.unground(function) != mode);
            self.outputs.push(Output::Reply(number, self.task.is_none() && !left));
        }
    }

    /// The robot is there: what the loop has to say, and what has changed meanwhile.
    fn ready(&mut self, modes: Vec<(String, Option<String>)>) -> Result<String, Message> {
        self.state = State::Idle;
        let answers = match &mut self.journal {
            None => self.control.start(),
            Some(journal) => journal.begin(&mut self.control).map_err(|error| unwritten(&error))?,
        };
        // What was asked for before and has been done meanwhile is not asked for again.
        for (function, mode) in modes {
            if let Some(mode) = mode {
                self.modes.insert(function, mode);
            }
        }
        self.restore_action();
        let until = if self.control.beliefs().lines() == 0 { self.now } else { self.now + AGAIN };
        self.deferred = Some(Deferred { answers, modes: self.modes.clone(), until });
        if until == self.now {
            self.catch_up();
        }
        Ok("every function answers".to_owned())
    }

    /// Asks again for what was asked for before a restart and has not been done, and adopts what has changed meanwhile.
    fn catch_up(&mut self) {
        let Some(Deferred { answers, modes, .. }) = self.deferred.take() else { return };
        let outstanding: BTreeSet<u64> =
            self.control.beliefs().outstanding().map(|effect| effect.number).collect();
        let mut asked = BTreeSet::new();
        let mut rest = Vec::new();
        for answer in answers {
            let Some(effect) = answer.effect() else {
                rest.push(answer);
                continue;
            };
            if !outstanding.contains(&effect.number) {
                // Something else was asked for since.
                continue;
            }
            if let Command::Reconfigure { function, to, .. } = &effect.command {
                let mode = self.settings.functions.mode(function, to);
                if self.modes.get(function).is_some_and(|own| own == mode) {
                    self.say(&Event::Acknowledged { effect: effect.number });
                    continue;
                }
                asked.insert(function.clone());
            }
            rest.push(answer);
        }
        self.take(rest);
        for (function, mode) in modes {
            if !asked.contains(&function) && !self.pending.contains_key(&function) {
                self.observe(&function, &mode);
            }
        }
    }

    /// An action that was under way when the program ended is under way still.
    fn restore_action(&mut self) {
        let Some((number, step)) = self.control.beliefs().running() else { return };
        let call = call(step);
        let is_waiting = |effect: &&Effect| matches!(effect.command, Command::Request { .. });
        let effect = self.control.beliefs().outstanding().find(is_waiting).map(|effect| effect.number);
        // Who performs it may not know of it any more: it is begun again, which is right for what tells by a topic that it is done.
        self.action =
            Some(Action { number, call, effect: effect.unwrap_or_default(), begun: effect.is_none() });
        if effect.is_none()
            && let Some(action) = &self.action
        {
            self.outputs.push(Output::Perform(number, action.call.clone()));
        }
    }

    fn told(&mut self, line: String) -> String {
        let because = "what is known has changed".to_owned();
        self.lines.push_back(line);
        because
    }

    fn request(&mut self, number: u64, task: &str) -> String {
        let Some(settings) = self.settings.tasks.get(task).cloned() else {
            let meant = did_you_mean(task, self.settings.tasks.keys().map(String::as_str));
            let because = format!("there is no task `{task}`{meant}");
            self.outputs.push(Output::Reply(number, false));
            self.refuse(&because);
            return because;
        };
        if self.state == State::WaitGraph {
            self.outputs.push(Output::Reply(number, false));
            let because = format!("the task {task} is requested, and functions are missing");
            self.refuse(&because);
            return because;
        }
        self.waiting.push(number);
        if self.task.as_deref() != Some(task) {
            self.task = Some(task.to_owned());
            for (name, value) in &settings.facts {
                let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
                self.say(&Event::Fact { name: name.clone(), value });
            }
            self.say(&Event::Goal { goal: settings.goal });
        }
        format!("the task {task} is requested")
    }

    fn refuse(&mut self, because: &str) {
        self.outputs.push(Output::Event(json!({"answer": "refused", "because": because})));
        self.outputs.push(Output::Warn(because.to_owned()));
    }

    fn cancel(&mut self, number: Option<u64>, task: &str) -> String {
        if !self.settings.tasks.contains_key(task) {
            let because = format!("there is no task `{task}`");
            self.outputs.extend(number.map(|number| Output::Reply(number, false)));
            self.refuse(&because);
            return because;
        }
        if self.task.as_deref().is_some_and(|own| own != task) {
            // Another task is under way: what is asked for is so already.
            self.outputs.extend(number.map(|number| Output::Reply(number, true)));
            return format!("the task {task} is not under way");
        }
        self.ending.extend(number);
        self.without_plan = false;
        for waiting in std::mem::take(&mut self.waiting) {
            self.outputs.push(Output::Reply(waiting, false));
        }
        if self.task.take().is_some() {
            self.say(&Event::Goal { goal: NOTHING.to_owned() });
        }
        if let Some(action) = self.action.take() {
            self.outputs.push(Output::Stop(action.number));
        }
        if let Some((action, _)) = self.control.beliefs().running() {
            self.say(&Event::Cancelled { action });
        }
        for function in self.functions.clone() {
            self.unground(&function);
        }
        format!("the task {task} ends")
    }

    /// A function that nobody needs gets the mode for that.
    fn unground(&mut self, function: &str) {
        let mode = self.settings.functions.unground(function).to_owned();
        let asked = self.pending.get(function).map(|change| &change.mode);
        let has = asked.or_else(|| self.modes.get(function));
        // A function that was never heard of has no mode that could be taken away.
        if has.is_some_and(|has| *has != mode) {
            self.change(Change { function: function.to_owned(), mode, effect: None, attempt: 1 });
        }
    }

    fn change(&mut self, change: Change) {
        self.pending.insert(change.function.clone(), change.clone());
        self.outputs.push(Output::Change(change));
    }

    /// Takes what the loop says.
    fn take(&mut self, answers: Vec<Answer>) {
        for answer in answers {
            self.outputs.push(Output::Event(answer.to_json()));
            match answer {
                Answer::PlanFound { .. } => {
                    self.without_plan = false;
                    self.outputs.push(Output::Plan(answer.to_json()));
                }
                Answer::PlanKept { .. } => self.without_plan = false,
                Answer::PlanNone { because, .. } => {
                    self.without_plan = self.task.is_some();
                    self.outputs.push(Output::Warn(format!("there is no plan: {because}")));
                }
                Answer::GoalReached => self.reached(),
                Answer::Error { code, message } => {
                    self.outputs.push(Output::Warn(format!("{code}: {message}")))
                }
                Answer::Effect(effect) => self.effect(effect),
                _ => {}
            }
        }
    }

    /// The task is done: nobody needs a function any more.
    fn reached(&mut self) {
        self.without_plan = false;
        self.action = None;
        if self.task.take().is_none() {
            return;
        }
        for number in std::mem::take(&mut self.waiting) {
            self.outputs.push(Output::Reply(number, true));
        }
        self.say(&Event::Goal { goal: NOTHING.to_owned() });
        for function in self.functions.clone() {
            self.unground(&function);
        }
    }

    fn effect(&mut self, effect: Effect) {
        match effect.command {
            Command::Reconfigure { function, to, .. } => {
                let mode = self.settings.functions.mode(&function, &to).to_owned();
                // It was just seen to have it: somebody has given it while this program was not there.
                if self.deferred.is_some() && self.modes.get(&function) == Some(&mode) {
                    self.acknowledge(effect.number);
                    return;
                }
                self.change(Change { function, mode, effect: Some(effect.number), attempt: 1 });
            }
            Command::Request { step } => {
                let call = call(&step);
                let needed: BTreeSet<&String> =
                    step.configuration.iter().map(|(function, _)| function).collect();
                let idle: Vec<String> =
                    self.functions.iter().filter(|function| !needed.contains(function)).cloned().collect();
                for function in &idle {
                    self.unground(function);
                }
                self.action =
                    Some(Action { number: effect.action, call, effect: effect.number, begun: false });
            }
            Command::Cancel { .. } => {
                self.acknowledge(effect.number);
                match &self.action {
                    // Who performs it says when it has ended.
                    Some(action) if action.begun => self.outputs.push(Output::Stop(action.number)),
                    _ => self.say(&Event::Cancelled { action: effect.action }),
                }
            }
            // Functions keep their modes, and so do their nodes what they have done.
            _ => self.acknowledge(effect.number),
        }
    }

    fn acknowledge(&mut self, effect: u64) {
        self.say(&Event::Acknowledged { effect });
    }

    /// A function has answered, or has not.
    fn changed(&mut self, change: Change, outcome: Outcome) -> String {
        let Change { function, mode, effect, attempt } = change.clone();
        if self.pending.get(&function) != Some(&change) {
            // It was asked for something else since; what it did meanwhile is overwritten by that.
            return format!("{function} has answered late");
        }
        match outcome {
            Outcome::Done => {
                self.pending.remove(&function);
                self.modes.insert(function.clone(), mode.clone());
                self.trouble.entry(function.clone()).or_default().silences = 0;
                match effect {
                    Some(effect) => self.acknowledge(effect),
                    None => self.say(&Event::Observed { function: function.clone(), design: None }),
                }
                format!("{function} has the mode {mode}")
            }
            Outcome::Failed(because) if attempt < TRIES => {
                self.complain(&function, &mode, &because);
                self.change(Change { attempt: attempt + 1, ..change });
                because
            }
            Outcome::Failed(because) => {
                self.complain(&function, &mode, &because);
                let trouble = self.trouble.entry(function.clone()).or_default();
                trouble.silences = trouble.silences.saturating_add(1);
                let wait = PROBE.saturating_mul(1 << trouble.silences.min(6)).min(LONGEST_PROBE);
                self.outputs.push(Output::Probe(function.clone(), wait));
                self.failed(&function, effect, None);
                because
            }
            Outcome::Refused => {
                let because = format!("{function} has refused the mode {mode}");
                self.complain(&function, &mode, &because);
                self.failed(&function, effect, Some(self.now + REFUSED));
                because
            }
        }
    }

    fn complain(&mut self, function: &str, mode: &str, because: &str) {
        let system = self.settings.functions.system(function).to_owned();
        self.outputs.push(Output::Warn(format!("/{system}/change_mode {mode}: {because}")));
        self.outputs.push(Output::Event(json!({
            "answer": "call_failed", "service": format!("/{system}/change_mode"), "mode": mode, "because": because,
        })));
    }

    /// A design could not be had; it is tried again from some time on, or when the function answers.
    fn failed(&mut self, function: &str, effect: Option<u64>, again: Option<Duration>) {
        self.pending.remove(function);
        let Some(effect) = effect else { return };
        let asked = self.control.beliefs().outstanding().find(|own| own.number == effect);
        if let Some(Command::Reconfigure { to, .. }) = asked.map(|own| own.command.clone()) {
            self.trouble.entry(function.to_owned()).or_default().designs.insert(to, again);
            self.say(&Event::ReconfigurationFailed { effect });
        }
        self.outputs.push(Output::Look(function.to_owned()));
    }

    /// A function was seen with a mode.
    fn mode(&mut self, function: &str, mode: &str) -> String {
        let because = format!("{function} was seen with the mode {mode}");
        if let Some(change) = self.pending.get(function).cloned() {
            if change.mode == mode && change.attempt >= TRIES {
                // Its answer was lost; that it has the mode is answer enough.
                return self.changed(change, Outcome::Done);
            }
            // It is on its way from one mode to another, on our demand.
            return because;
        }
        if self.modes.get(function).map(String::as_str) == Some(mode) {
            return because;
        }
        self.modes.insert(function.to_owned(), mode.to_owned());
        self.came_late(function, mode);
        self.observe(function, mode);
        because
    }

    /// A mode that was asked for, and that nobody has answered for in time, is there after all.
    fn came_late(&mut self, function: &str, mode: &str) {
        let designs = self.control.beliefs().mission().designs_of(function);
        let Some(design) = self.settings.functions.design(function, mode, &designs) else { return };
        let trouble = self.trouble.get_mut(function).and_then(|own| own.designs.remove(&design));
        if trouble.is_some() {
            self.say(&Event::Design { design, realisable: true });
        }
    }

    /// Tells the loop of a mode that it has not asked for.
    fn observe(&mut self, function: &str, mode: &str) {
        let designs = self.control.beliefs().mission().designs_of(function);
        let design = self.settings.functions.design(function, mode, &designs);
        let believed = self.control.beliefs().configuration().get(function);
        if believed != design.as_ref() {
            self.say(&Event::Observed { function: function.to_owned(), design });
        }
    }

    fn performed(&mut self, number: u64, ended: &Ended) -> String {
        if self.control.beliefs().running().is_none_or(|(running, _)| running != number) {
            return format!("action {number} has ended before");
        }
        self.action = None;
        match ended {
            Ended::Succeeded => self.say(&Event::Succeeded { action: number }),
            Ended::Cancelled => self.say(&Event::Cancelled { action: number }),
            Ended::Failed(reason) => self.say(&Event::Failed { action: number, reason: reason.clone() }),
        }
        format!("action {number} has ended")
    }

    fn progress(&mut self, number: u64, fraction: f64) -> String {
        let is_running = self.control.beliefs().running().is_some_and(|(running, _)| running == number);
        if is_running && (0.0..=1.0).contains(&fraction) {
            let line = json!({"event": "action_progress", "action": number, "fraction": (fraction * 100.0).round() / 100.0});
            self.lines.push_back(line.to_string());
        }
        format!("action {number} goes on")
    }

    fn probed(&mut self, function: &str, answers: bool) -> String {
        let trouble = self.trouble.entry(function.to_owned()).or_default();
        if !answers {
            let wait = PROBE.saturating_mul(1 << trouble.silences.min(6)).min(LONGEST_PROBE);
            self.outputs.push(Output::Probe(function.to_owned(), wait.min(Duration::from_secs(2))));
            return format!("{function} does not answer");
        }
        let back: Vec<String> = trouble
            .designs
            .iter()
            .filter(|(_, again)| again.is_none())
            .map(|(design, _)| design.clone())
            .collect();
        trouble.designs.retain(|_, again| again.is_some());
        for design in back {
            self.say(&Event::Design { design, realisable: true });
        }
        self.outputs.push(Output::Look(function.to_owned()));
        format!("{function} answers again")
    }

    fn autopilot(&mut self, mode: &str) -> String {
        let obeys = self.settings.autopilot.as_ref().is_some_and(|own| own.mode == mode);
        let was = std::mem::replace(&mut self.obeyed, obeys);
        let because = format!("the autopilot is in the mode {mode}");
        match self.task.clone() {
            Some(task) if was && !obeys => {
                self.cancel(None, &task);
                because
            }
            _ => because,
        }
    }

    /// Designs that were refused long ago are tried again, and hopes that had to settle have.
    fn tick(&mut self) -> String {
        let now = self.now;
        let mut back = Vec::new();
        for trouble in self.trouble.values_mut() {
            let due = |again: &Option<Duration>| again.is_some_and(|again| again <= now);
            back.extend(
                trouble.designs.iter().filter(|(_, again)| due(again)).map(|(design, _)| design.clone()),
            );
            trouble.designs.retain(|_, again| !due(again));
        }
        for design in back {
            self.say(&Event::Design { design, realisable: true });
        }
        if self.ticks && self.state == State::Execute {
            self.say(&Event::Tick);
        }
        "time has passed".to_owned()
    }
}

/// An action as whoever performs it hears of it.
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
