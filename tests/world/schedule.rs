//! One schedule: the loop, the robot, and the messages between them.

use std::collections::BTreeMap;
use std::time::Duration;

use fastrand::Rng;
use metaplan::mapek::{Answer, Effect, Loop, Observation, Snapshot, Thoughts};
use serde_json::{Value, json};

use crate::judge::Judge;
use crate::robot::Robot;
use crate::{COMPONENTS, DESIGNS, FUNCTION};

/// A step of virtual time.
const STEP: Duration = Duration::from_millis(500);

/// Steps with faults, and fair steps after them.
const STEPS: (u64, u64) = (60, 300);

/// Number of messages that are printed of a schedule with a violation.
const MAX_LOG: usize = 400;

/// Steps that a belated message is under way: longer than two deadlines.
const BELATED: (u64, u64) = (45, 90);

/// Number of lines after which the loop gets a new snapshot to be restored from.
const SNAPSHOT_EVERY: usize = 23;

/// Number of lines that are reacted to before there is a deliberation, at most.
const MAX_UNDELIBERATED: u32 = 4;

/// Faults of a schedule: each in so many of a hundred cases.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fault of its own")]
pub struct Faults {
    pub lost: u32,
    pub doubled: u32,
    /// Greatest delay of a message, in steps.
    pub delay: u64,
    pub breaks: u32,
    pub refuses: u32,
    pub fails: u32,
    pub crashes: u32,
    pub restarts: u32,
    /// Reconfigurations that fail after they were acknowledged.
    pub late: u32,
    /// Observations of the function's design.
    pub observes: u32,
    /// Messages that arrive after deadlines have passed.
    pub belated: u32,
    /// Whether a robot that restarts does not know any more which action was under way.
    pub forgets: bool,
    /// Whether the effects of the start may be lost, too.
    pub start: bool,
    /// Whether lines have numbers.
    pub numbered: bool,
    /// Whether plans are looked for beside the input.
    pub beside: bool,
    /// Whether a robot of which nothing fails any more reports things once only.
    pub quiet: bool,
}

impl Faults {
    /// Those of a seed: each kind is absent from some schedules.
    pub fn of(seed: u64) -> Self {
        let mut random = Rng::with_seed(seed ^ 0x5eed);
        let mut share = |most: u32| if random.bool() { 0 } else { random.u32(0..=most) };
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

    /// The kinds that were added when seeds of violations had been kept already: they change nothing of the others.
    fn with_later_kinds(self, seed: u64) -> Self {
        let mut random = Rng::with_seed(seed ^ 0x1a7e);
        let mut share = |most: u32| if random.bool() { 0 } else { random.u32(0..=most) };
        let (late, observes) = (share(4), share(6));
        Self { late, observes, belated: share(8), forgets: random.bool(), ..self }
    }

    /// The same without the kinds that were added later.
    pub fn of_earlier_kinds(self) -> Self {
        Self { late: 0, observes: 0, belated: 0, forgets: false, ..self }
    }

    /// The same where the effects of the start may be lost.
    pub fn with_lost_start(self) -> Self {
        Self { start: true, ..self }
    }
}

/// A message on its way.
#[derive(Debug, Clone)]
pub enum Message {
    Effect(Effect),
    Event(Value),
}

/// A step of the loop, as its journal has it.
#[derive(Debug)]
enum Step {
    React(String, Duration),
    Deliberate(Vec<Value>),
}

/// The schedule as it goes.
pub struct Schedule<'a> {
    pristine: &'a Loop,
    control: Loop,
    robot: Robot,
    random: Rng,
    faults: Faults,
    now: u64,
    /// Number of the last line.
    line: u64,
    /// Messages by the step of their arrival and a random number that orders those of one step.
    messages: BTreeMap<(u64, u64), Message>,
    /// A search for plans that goes on beside the input.
    thoughts: Option<Thoughts>,
    /// Number of lines that were reacted to since the last deliberation.
    undeliberated: u32,
    /// What the loop was brought back from, and the steps since.
    snapshot: Option<Snapshot>,
    steps: Vec<Step>,
    judge: Judge,
    /// Messages, where they are kept.
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

    /// The same with a log, for a schedule that is known to violate something.
    pub fn with_log(self) -> Self {
        Self { log: Some(Vec::new()), ..self }
    }

    fn log(&mut self, message: impl FnOnce() -> String) {
        let now = self.now;
        if let Some(log) = &mut self.log {
            log.push(format!("{now}: {}", message()));
        }
    }

    /// Runs it to its end.
    ///
    /// # Errors
    /// The first violation, with the last messages.
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
            // A robot repeats this report until it has arrived: without it nobody can know.
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

    /// Reports of a robot of which nothing fails any more.
    fn fair_reports(&mut self) {
        if self.now == STEPS.0 + 1 && self.random.bool() {
            self.robot.failed.clear();
        }
        let is_first = self.now == STEPS.0 + 1;
        if is_first || !self.faults.quiet && self.now % 20 == 1 {
            for report in self.robot.again() {
                self.report(report);
            }
        }
        if is_first || !self.faults.quiet && self.now % 100 == 1 {
            for (design, _) in DESIGNS {
                self.report(json!({ "event": "design_status", "design": design, "realisable": true }));
            }
        }
    }

    /// Number of steps for which the robot may move with a design that is forbidden by delivered reports; none where the last
    /// message about it may have been lost or refused.
    fn bound(&self) -> Option<u64> {
        // Two deadlines and a step each way: the effect is repeated once, and then given up.
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

    /// Time since the start of the mission.
    fn time(&self) -> Duration {
        STEP * u32::try_from(self.now).unwrap_or(u32::MAX)
    }

    /// Sends a report of the robot.
    fn report(&mut self, mut event: Value) {
        if self.faults.numbered {
            self.line += 1;
            event["seq"] = json!(self.line);
        }
        self.post(&Message::Event(event));
    }

    /// Sends a report that is not lost.
    fn report_safely(&mut self, event: Value) {
        let lost = std::mem::take(&mut self.faults.lost);
        self.report(event);
        self.faults.lost = lost;
    }

    /// Sends a message, which may be lost, doubled and overtaken.
    fn post(&mut self, message: &Message) {
        // As long as nothing was acknowledged the loop cannot know whether this robot ever acknowledges anything.
        let is_safe = self.now == 0 && !self.faults.start;
        if !is_safe && self.chance(self.faults.lost) {
            self.log(|| format!("lost {message:?}"));
            return;
        }
        let copies = 1 + u32::from(self.chance(self.faults.doubled));
        for _ in 0..copies {
            let (mut arrival, mut order) = (self.now, (1 << 41) + self.messages.len() as u64);
            // Fair messages stay in their order.
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

    /// Delivers a line, or the passing of time, to the loop, and judges what follows.
    fn deliver(&mut self, line: &str) -> Result<(), String> {
        if line != Observation::TIMER {
            self.log(|| format!("loop hears {line}"));
        }
        self.steps.push(Step::React(line.to_owned(), self.time()));
        let known = self.control.beliefs();
        let going_on = known.running().filter(|_| !known.cancelling() && !known.suspended());
        let before = going_on.and_then(|(action, step)| Some((action, step.design(FUNCTION)?.to_owned())));
        let answers = self.control.react(&Observation::recorded(line), self.time());
        let is_taken = !answers.iter().any(|answer| {
            matches!(answer, Answer::Error { .. } | Answer::Duplicate { .. } | Answer::Stale { .. })
        });
        if let Ok(event) = serde_json::from_str::<Value>(line) {
            self.judge.hear(&event, is_taken, &self.robot);
        }
        self.control.decision(&[]);
        for answer in &answers {
            self.judge.note(answer);
        }
        self.judge.reaction(before, &self.control, &answers)?;
        self.send(answers);
        self.undeliberated += 1;
        // The effect that makes the robot safe precedes any planning.
        self.judge.intended_motion(&self.robot, &self.control, self.messages.values())?;
        self.continue_deliberation()?;
        self.judge.intended_motion(&self.robot, &self.control, self.messages.values())?;
        self.judge.configuration(&self.robot, &self.control, self.messages.values())
    }

    /// Deliberates at once, begins a search beside the input, or concludes one.
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

    /// Sends effects, and notes other answers.
    fn send(&mut self, answers: Vec<Answer>) {
        for answer in answers {
            self.log(|| answer.to_json().to_string());
            if let Answer::Effect(effect) = answer {
                self.post(&Message::Effect(effect));
            }
        }
    }

    /// The loop ends, and comes back from its snapshot and the steps since.
    fn crash(&mut self) -> Result<(), String> {
        self.log(|| "crash".to_owned());
        let mut again = self.pristine.clone();
        if let Some(snapshot) = &self.snapshot {
            again.restore(snapshot).map_err(|message| message.message.clone())?;
        }
        for step in &self.steps {
            match step {
                Step::React(line, now) => drop(again.react(&Observation::recorded(line), *now)),
                Step::Deliberate(plans) => drop(again.deliberate_again(plans)),
            }
        }
        if again.snapshot() != self.control.snapshot() || again.has_agenda() != self.control.has_agenda() {
            return Err("(e) another state after a restart".to_owned());
        }
        self.control = again;
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

/// An effect as its number, action and command.
fn brief(effect: &Effect) -> String {
    let json = Answer::Effect(effect.clone()).to_json();
    format!("{} {} {} {}", json["effect"], json["answer"], json["action"], json["to"])
}
