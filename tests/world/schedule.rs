//! Simulation of one schedule: the loop, the robot, and the messages between them.

use std::collections::BTreeMap;
use std::time::Duration;

use fastrand::Rng;
use metaplan::mapek::{Answer, Effect, Loop, Observation, Snapshot, Thoughts};
use serde_json::{Value, json};

use crate::judge::Judge;
use crate::robot::Robot;
use crate::{COMPONENTS, DESIGNS, FUNCTION};

const STEP: Duration = Duration::from_millis(500);

/// Number of steps with faults, and number of steps in the subsequent fair phase, which has no faults.
const STEPS: (u64, u64) = (60, 300);

const MAX_LOG: usize = 400;

/// Range of the additional delay of a belated message, in steps: longer than two deadlines of the loop.
const BELATED: (u64, u64) = (45, 90);

const SNAPSHOT_EVERY: usize = 23;

const MAX_UNDELIBERATED: u32 = 4;

/// Fault rates of a schedule. Unless stated otherwise, each number is a percentage.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fault of its own")]
pub struct Faults {
    pub lost: u32,
    pub doubled: u32,
    /// Maximum delay of a message, in steps.
    pub delay: u64,
    pub breaks: u32,
    pub refuses: u32,
    pub fails: u32,
    pub crashes: u32,
    pub restarts: u32,
    /// Percentage of steps at which the last reconfiguration fails after its acknowledgement.
    pub late: u32,
    /// Percentage of steps with an observation of the function's design.
    pub observes: u32,
    /// Percentage of messages that arrive after the deadlines.
    pub belated: u32,
    /// Whether a restarting robot forgets the action under way.
    pub forgets: bool,
    /// Whether the effects sent at the start can be lost, too.
    pub start: bool,
    pub numbered: bool,
    /// Whether planning runs in parallel to the processing of events.
    pub beside: bool,
    /// Whether the robot sends its reports of the fair phase only once.
    pub quiet: bool,
}

impl Faults {
    /// Returns the fault rates of a seed. Each kind of fault except `breaks` is absent from some schedules.
    pub fn of(seed: u64) -> Self {
        let mut random = Rng::with_seed(seed ^ 0x5eed);
        let mut share = |maximum: u32| if random.bool() { 0 } else { random.u32(0..=maximum) };
        Self {
            lost: share(30),
            doubled: share(30),
            delay: u64::from(share(12)),
            breaks: 5 + share(25),
            refuses: share(40),
            fails: share(15),
            crashes: share(10),
            restarts: share(3),
            start: false,
            numbered: random.bool(),
            beside: random.bool(),
            quiet: random.bool(),
            late: 0,
            observes: 0,
            belated: 0,
            forgets: false,
        }
        .with_later_kinds(seed)
    }

    /// Adds the kinds of faults that were introduced after the first seeds of violations had been recorded.
    /// The other rates must not change.
    fn with_later_kinds(self, seed: u64) -> Self {
        let mut random = Rng::with_seed(seed ^ 0x1a7e);
        let mut share = |maximum: u32| if random.bool() { 0 } else { random.u32(0..=maximum) };
        let (late, observes) = (share(4), share(6));
        Self { late, observes, belated: share(8), forgets: random.bool(), ..self }
    }

    pub fn of_earlier_kinds(self) -> Self {
        Self { late: 0, observes: 0, belated: 0, forgets: false, ..self }
    }

    pub fn with_lost_start(self) -> Self {
        Self { start: true, ..self }
    }
}

#[derive(Debug, Clone)]
pub enum Message {
    Effect(Effect),
    Event(Value),
}

/// A step of the loop, as recorded in its journal: a reaction to an event line at a time, or a deliberation
/// with the resulting plans.
#[derive(Debug)]
enum Step {
    React(String, Duration),
    Deliberate(Vec<Value>),
}

pub struct Schedule<'a> {
    pristine: &'a Loop,
    control: Loop,
    robot: Robot,
    random: Rng,
    faults: Faults,
    now: u64,
    /// Sequence number of the last report; 0 if reports have none.
    line: u64,
    /// Messages in transit, by step of arrival and a number that orders the messages of one step.
    messages: BTreeMap<(u64, u64), Message>,
    /// Result of planning in parallel to the events that is not adopted yet.
    thoughts: Option<Thoughts>,
    undeliberated: u32,
    snapshot: Option<Snapshot>,
    steps: Vec<Step>,
    judge: Judge,
    log: Option<Vec<String>>,
}

impl<'a> Schedule<'a> {
    pub fn new(pristine: &'a Loop, seed: u64, faults: Faults) -> Self {
        Self {
            pristine,
            control: pristine.clone(),
            robot: Robot::default(),
            random: Rng::with_seed(seed),
            faults,
            now: 0,
            line: 0,
            messages: BTreeMap::new(),
            thoughts: None,
            undeliberated: 0,
            snapshot: None,
            steps: Vec::new(),
            judge: Judge::default(),
            log: None,
        }
    }

    pub fn with_log(self) -> Self {
        Self { log: Some(Vec::new()), ..self }
    }

    fn log(&mut self, message: impl FnOnce() -> String) {
        let now = self.now;
        if let Some(log) = &mut self.log {
            log.push(format!("{now}: {}", message()));
        }
    }

    /// Runs the schedule to its end or its first violation. With the log, the message ends with the
    /// fault rates and the last messages.
    pub fn run(mut self) -> Result<(), String> {
        self.deliberate();
        for now in 1..=STEPS.0 + STEPS.1 {
            self.now = now;
            self.step().map_err(|violation| self.explained(&violation))?;
        }
        self.judge.at_the_end(&self.robot).map_err(|violation| self.explained(&violation))
    }

    fn explained(&self, violation: &str) -> String {
        let Some(log) = &self.log else { return violation.to_owned() };
        let from = log.len().saturating_sub(MAX_LOG);
        format!("{violation}\n{:?}\n{}", self.faults, log[from..].join("\n"))
    }

    fn is_unfair(&self) -> bool {
        self.now <= STEPS.0
    }

    fn chance(&mut self, share: u32) -> bool {
        self.is_unfair() && self.random.u32(..100) < share
    }

    fn step(&mut self) -> Result<(), String> {
        if self.chance(self.faults.breaks) {
            let component = COMPONENTS[self.random.usize(..COMPONENTS.len())];
            if !self.robot.failed.remove(component) {
                self.robot.failed.insert(component);
            }
            self.report(self.robot.status(component));
        }
        if self.chance(self.faults.restarts) {
            self.log(|| "the robot restarts".to_owned());
            let reports = self.robot.restart(self.faults.forgets);
            for report in reports {
                self.report(report);
            }
        }
        if self.faults.late > 0
            && self.chance(self.faults.late)
            && let Some(report) = self.robot.fail_late()
        {
            self.log(|| "a reconfiguration fails late".to_owned());
            // A robot repeats this report until it arrives; otherwise no loop could learn of the failure.
            self.report_safely(report);
        }
        if self.faults.observes > 0 && self.chance(self.faults.observes) {
            self.report(self.robot.observed());
        }
        if !self.is_unfair() {
            self.fair_reports();
        }
        if self.now.is_multiple_of(2) {
            let fails = self.chance(self.faults.fails);
            let report = self.robot.work(fails);
            if let Some(report) = report {
                self.report(report);
            }
        }
        if self.chance(self.faults.crashes) {
            self.crash()?;
        }
        let due: Vec<(u64, u64)> =
            self.messages.keys().take_while(|key| key.0 <= self.now).copied().collect();
        for key in due {
            match self.messages.remove(&key) {
                Some(Message::Effect(effect)) => {
                    let fails = self.chance(self.faults.refuses);
                    self.log(|| format!("robot takes {} {fails}", brief(&effect)));
                    for report in self.robot.take(&effect, fails) {
                        self.report(report);
                    }
                }
                Some(Message::Event(event)) => self.deliver(&event.to_string())?,
                None => {}
            }
        }
        if self.control.due().is_some_and(|due| due <= self.time()) {
            self.deliver(Observation::TIMER)?;
        }
        if !self.is_unfair() || !self.faults.beside {
            self.finish_deliberation()?;
        }
        let bound = self.bound();
        self.judge.motion(&self.robot, bound)
    }

    fn fair_reports(&mut self) {
        if self.now == STEPS.0 + 1 && self.random.bool() {
            self.robot.failed.clear();
        }
        let is_first = self.now == STEPS.0 + 1;
        if is_first || !self.faults.quiet && self.now % 20 == 1 {
            for report in self.robot.periodic_reports() {
                self.report(report);
            }
        }
        if is_first || !self.faults.quiet && self.now % 100 == 1 {
            for (design, _) in DESIGNS {
                self.report(json!({ "event": "design_status", "design": design, "realisable": true }));
            }
        }
    }

    /// Returns the maximum number of steps for which the robot may move with a design that the delivered reports
    /// forbid. `None` while messages about designs may be lost, refused or late.
    fn bound(&self) -> Option<u64> {
        // Two deadlines of 20 steps and a margin: the effect is repeated once, and then abandoned.
        let deadlines = 2 * 20 + 6;
        let is_reliable = self.faults.lost == 0
            && self.faults.refuses == 0
            && self.faults.restarts == 0
            && self.faults.late == 0
            && self.faults.belated == 0
            && self.faults.observes == 0;
        let last_arrival = if self.faults.belated > 0 { BELATED.1 } else { self.faults.delay };
        if self.now > STEPS.0 + last_arrival {
            Some(deadlines)
        } else {
            is_reliable.then_some(self.faults.delay + 2)
        }
    }

    fn time(&self) -> Duration {
        STEP * u32::try_from(self.now).unwrap_or(u32::MAX)
    }

    fn report(&mut self, mut event: Value) {
        if self.faults.numbered {
            self.line += 1;
            event["seq"] = json!(self.line);
        }
        self.post(&Message::Event(event));
    }

    fn report_safely(&mut self, event: Value) {
        let lost = std::mem::take(&mut self.faults.lost);
        self.report(event);
        self.faults.lost = lost;
    }

    /// Puts a message in transit. In the phase with faults, the message can be lost, duplicated, and overtaken by later
    /// messages.
    fn post(&mut self, message: &Message) {
        // Before the first acknowledgement, the loop cannot detect whether this robot sends acknowledgements.
        let is_safe = self.now == 0 && !self.faults.start;
        if !is_safe && self.chance(self.faults.lost) {
            self.log(|| format!("lost {message:?}"));
            return;
        }
        let copies = 1 + u32::from(self.chance(self.faults.doubled));
        for _ in 0..copies {
            let (mut arrival, mut order) = (self.now, (1 << 41) + self.messages.len() as u64);
            // In the fair phase, messages arrive in order.
            if self.is_unfair() {
                arrival += self.random.u64(0..=self.faults.delay);
                order = self.random.u64(..1 << 40);
                if self.faults.belated > 0 && self.random.u32(..100) < self.faults.belated {
                    arrival += self.random.u64(BELATED.0..=BELATED.1);
                }
            }
            let mut key = (arrival.max(self.now + 1), order);
            while self.messages.contains_key(&key) {
                key.1 += 1;
            }
            self.messages.insert(key, message.clone());
        }
    }

    fn deliver(&mut self, line: &str) -> Result<(), String> {
        if line != Observation::TIMER {
            self.log(|| format!("loop hears {line}"));
        }
        self.steps.push(Step::React(line.to_owned(), self.time()));
        let beliefs = self.control.beliefs();
        let going_on = beliefs.running().filter(|_| !beliefs.cancelling() && !beliefs.suspended());
        let before = going_on.and_then(|(action, step)| Some((action, step.design(FUNCTION)?.to_owned())));
        let answers = self.control.react(&Observation::recorded(line), self.time());
        let is_taken = !answers.iter().any(|answer| {
            matches!(answer, Answer::Error { .. } | Answer::Duplicate { .. } | Answer::Stale { .. })
        });
        if let Ok(event) = serde_json::from_str::<Value>(line) {
            self.judge.record_event(&event, is_taken, &self.robot);
        }
        self.control.decision(&[]);
        for answer in &answers {
            self.judge.note(answer);
        }
        self.judge.reaction(before, &self.control, &answers)?;
        self.send(answers);
        self.undeliberated += 1;
        // The safe effect must precede planning.
        self.judge.intended_motion(&self.robot, &self.control, self.messages.values())?;
        self.continue_deliberation()?;
        self.judge.intended_motion(&self.robot, &self.control, self.messages.values())?;
        self.judge.configuration(&self.robot, &self.control, self.messages.values())
    }

    /// Deliberates, starts planning in parallel to the events, adopts the resulting plans, or does nothing.
    fn continue_deliberation(&mut self) -> Result<(), String> {
        if !self.faults.beside || self.undeliberated >= MAX_UNDELIBERATED {
            return self.finish_deliberation();
        }
        match self.thoughts.take() {
            Some(thoughts) if self.random.bool() => {
                let is_late = self.random.u32(..4) == 0;
                if let Some(answers) = self.control.deliberate_with(thoughts, is_late) {
                    self.decided(answers);
                }
            }
            Some(thoughts) => self.thoughts = Some(thoughts),
            None if self.control.has_agenda() && self.random.bool() => {
                if let Some(answers) = self.control.deliberate_at_once() {
                    self.decided(answers);
                } else {
                    self.thoughts = Some(self.control.thinker().think());
                }
            }
            None => {}
        }
        Ok(())
    }

    fn finish_deliberation(&mut self) -> Result<(), String> {
        self.thoughts = None;
        if self.control.has_agenda() {
            self.deliberate();
            self.judge.intended_motion(&self.robot, &self.control, self.messages.values())?;
            self.judge.standstill(&self.control)?;
        }
        Ok(())
    }

    fn deliberate(&mut self) {
        let answers = self.control.deliberate();
        self.decided(answers);
    }

    fn decided(&mut self, answers: Vec<Answer>) {
        let plans = self.control.decision(&[]).plans;
        for answer in &answers {
            self.judge.note(answer);
        }
        self.steps.push(Step::Deliberate(plans));
        self.undeliberated = 0;
        self.send(answers);
        if self.steps.len() >= SNAPSHOT_EVERY && !self.control.has_agenda() {
            (self.snapshot, self.steps) = (Some(self.control.snapshot()), Vec::new());
        }
    }

    fn send(&mut self, answers: Vec<Answer>) {
        for answer in answers {
            self.log(|| answer.to_json().to_string());
            if let Answer::Effect(effect) = answer {
                self.post(&Message::Effect(effect));
            }
        }
    }

    fn crash(&mut self) -> Result<(), String> {
        self.log(|| "crash".to_owned());
        let mut restored = self.pristine.clone();
        if let Some(snapshot) = &self.snapshot {
            restored.restore(snapshot).map_err(|message| message.message.clone())?;
        }
        for step in &self.steps {
            match step {
                Step::React(line, now) => drop(restored.react(&Observation::recorded(line), *now)),
                Step::Deliberate(plans) => drop(restored.deliberate_again(plans)),
            }
        }
        if restored.snapshot() != self.control.snapshot()
            || restored.has_agenda() != self.control.has_agenda()
        {
            return Err("(e) another state after a restart".to_owned());
        }
        self.control = restored;
        self.thoughts = None;
        let repeated = self.control.repeat();
        for answer in &repeated {
            self.judge.note(answer);
        }
        let verdict = self.judge.repeated(&repeated);
        self.send(repeated);
        verdict
    }
}

fn brief(effect: &Effect) -> String {
    let json = Answer::Effect(effect.clone()).to_json();
    format!("{} {} {} {}", json["effect"], json["answer"], json["action"], json["to"])
}
