//! One schedule: the loop, the robot, the messages between them, and the judge.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use fastrand::Rng;
use metaplan::mapek::{Answer, Command, Effect, Loop, Observation, Snapshot};
use serde_json::{Value, json};

use crate::robot::Robot;
use crate::{COMPONENTS, DESIGNS, FUNCTION};

/// A step of virtual time.
const STEP: Duration = Duration::from_millis(500);

/// Steps with faults, and fair steps after them.
const STEPS: (u64, u64) = (60, 300);

/// Faults of a schedule: each in so many of a hundred cases.
#[derive(Debug, Clone, Copy)]
pub struct Faults {
    lost: u32,
    doubled: u32,
    /// Greatest delay of a message, in steps.
    delay: u64,
    breaks: u32,
    refuses: u32,
    fails: u32,
    crashes: u32,
    /// Whether the effects of the start may be lost, too.
    start: bool,
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
            start: false,
        }
    }

    /// The same where the effects of the start may be lost.
    pub fn from_the_start(self) -> Self {
        Self { start: true, ..self }
    }
}

/// A message on its way.
#[derive(Debug, Clone)]
enum Message {
    Effect(Effect),
    Event(Value),
}

/// The schedule as it goes.
pub struct Schedule<'a> {
    pristine: &'a Loop,
    control: Loop,
    robot: Robot,
    random: Rng,
    faults: Faults,
    now: u64,
    /// Messages by the step of their arrival and a random number that orders those of one step.
    messages: BTreeMap<(u64, u64), Message>,
    /// What the loop was brought back from, and the lines since.
    snapshot: Snapshot,
    lines: Vec<(String, Duration)>,
    judge: Judge,
    log: Vec<String>,
}

/// What is known from messages alone.
#[derive(Debug, Default)]
struct Judge {
    /// Components that have failed by the reports delivered to the loop.
    failed: BTreeSet<String>,
    /// Effects that the loop has asked for.
    asked: BTreeMap<u64, Effect>,
    /// Effects that a later one has superseded, were answered to the loop, or given up aloud.
    superseded: BTreeSet<u64>,
    answered: BTreeSet<u64>,
    given_up: BTreeSet<u64>,
    /// Actions of which the loop has heard the end.
    ended: BTreeSet<u64>,
    /// The last word on plans: `true` if the goal is reached or there is no plan.
    is_settled: bool,
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
            messages: BTreeMap::new(),
            snapshot: pristine.snapshot(),
            lines: Vec::new(),
            judge: Judge::default(),
            log: Vec::new(),
        }
    }

    /// Runs it to its end.
    ///
    /// # Errors
    /// The first violation, with the last messages.
    pub fn run(mut self) -> Result<(), String> {
        let answers = self.control.start();
        self.snapshot = self.control.snapshot();
        self.send(answers);
        for now in 1..=STEPS.0 + STEPS.1 {
            self.now = now;
            self.step(now <= STEPS.0).map_err(|violation| self.told(&violation))?;
        }
        self.at_the_end().map_err(|violation| self.told(&violation))
    }

    fn told(&self, violation: &str) -> String {
        let from = self.log.len().saturating_sub(60);
        format!("{violation}\n{}", self.log[from..].join("\n"))
    }

    fn step(&mut self, is_unfair: bool) -> Result<(), String> {
        let chance = |random: &mut Rng, share: u32| is_unfair && random.u32(..100) < share;
        if chance(&mut self.random, self.faults.breaks) {
            let component = COMPONENTS[self.random.usize(..COMPONENTS.len())];
            if !self.robot.failed.remove(component) {
                self.robot.failed.insert(component);
            }
            self.report(self.robot.status(component), is_unfair);
        }
        if self.now == STEPS.0 + 1 {
            self.faults = Faults { lost: 0, doubled: 0, ..self.faults };
            let all: Vec<&str> = self.robot.failed.iter().copied().collect();
            if self.random.bool() {
                all.into_iter().for_each(|component| {
                    self.robot.failed.remove(component);
                });
            }
        }
        if !is_unfair && self.now % 20 == 1 {
            for report in self.robot.again() {
                self.report(report, is_unfair);
            }
            let refused: Vec<&str> = DESIGNS.iter().map(|(design, _)| *design).collect();
            for design in refused {
                let report = json!({ "event": "design_status", "design": design, "realisable": true });
                if self.now % 100 == 1 {
                    self.report(report, is_unfair);
                }
            }
        }
        if self.now % 2 == 0 {
            let fails = chance(&mut self.random, self.faults.fails);
            for report in self.robot.work(fails) {
                self.report(report, is_unfair);
            }
        }
        if chance(&mut self.random, self.faults.crashes) {
            self.crash()?;
        }
        let due: Vec<(u64, u64)> =
            self.messages.keys().take_while(|key| key.0 <= self.now).copied().collect();
        for key in due {
            match self.messages.remove(&key) {
                Some(Message::Effect(effect)) => {
                    let fails = chance(&mut self.random, self.faults.refuses);
                    self.log.push(format!("{}: robot takes {effect:?} {fails}", self.now));
                    for report in self.robot.take(&effect, fails) {
                        self.report(report, is_unfair);
                    }
                }
                Some(Message::Event(event)) => self.deliver(&event)?,
                None => {}
            }
        }
        if self.now.is_multiple_of(4) { self.deliver(&json!({ "event": "tick" })) } else { Ok(()) }
    }

    /// Sends a report of the robot.
    fn report(&mut self, event: Value, is_unfair: bool) {
        self.post(Message::Event(event), is_unfair);
    }

    /// Sends a message, which may be lost, doubled and overtaken.
    fn post(&mut self, message: Message, is_unfair: bool) {
        // As long as nothing was acknowledged the loop cannot know whether this robot ever acknowledges anything.
        let is_safe = self.now == 0 && !self.faults.start;
        if is_unfair && self.random.u32(..100) < self.faults.lost && !is_safe {
            self.log.push(format!("{}: lost {message:?}", self.now));
            return;
        }
        let copies = 1 + u32::from(is_unfair && self.random.u32(..100) < self.faults.doubled);
        for _ in 0..copies {
            let arrival = self.now + if is_unfair { self.random.u64(0..=self.faults.delay) } else { 0 };
            // Fair messages stay in their order.
            let order =
                if is_unfair { self.random.u64(..1 << 40) } else { (1 << 41) + self.messages.len() as u64 };
            let mut key = (arrival.max(self.now + 1), order);
            while self.messages.contains_key(&key) {
                key.1 += 1;
            }
            self.messages.insert(key, message.clone());
        }
    }

    /// Delivers a line to the loop, and judges what follows.
    fn deliver(&mut self, event: &Value) -> Result<(), String> {
        let line = event.to_string();
        if event["event"] != "tick" {
            self.log.push(format!("{}: loop hears {line}", self.now));
        }
        let now = STEP * u32::try_from(self.now).unwrap_or(u32::MAX);
        self.lines.push((line.clone(), now));
        let answers = self.control.handle(&Observation::parse(&line), now);
        let is_refused = answers.iter().any(|answer| matches!(answer, Answer::Error { .. }));
        self.judge.hear(event, is_refused);
        self.send(answers);
        if self.lines.len() >= 23 {
            (self.snapshot, self.lines) = (self.control.snapshot(), Vec::new());
        }
        self.judge_motion()?;
        self.judge_configuration()
    }

    /// Sends effects, and notes what the loop says.
    fn send(&mut self, answers: Vec<Answer>) {
        for answer in answers {
            if !matches!(answer, Answer::Error { .. }) {
                self.log.push(format!("{}: {}", self.now, answer.to_json()));
            }
            self.judge.note(&answer);
            if let Answer::Effect(effect) = answer {
                self.post(Message::Effect(effect), self.now <= STEPS.0);
            }
        }
    }

    /// The loop ends, and comes back from its snapshot and the lines since.
    fn crash(&mut self) -> Result<(), String> {
        self.log.push(format!("{}: crash", self.now));
        let mut again = self.pristine.clone();
        again.restore(&self.snapshot).map_err(|message| message.message.clone())?;
        for (line, now) in &self.lines {
            again.handle(&Observation::parse(line), *now);
        }
        if again.snapshot() != self.control.snapshot() {
            return Err("another state after a restart".to_owned());
        }
        self.control = again;
        let repeated = self.control.repeat();
        self.send(repeated);
        Ok(())
    }

    /// (a) Were all effects carried out, no action would go on with a forbidden design, or without one.
    fn judge_motion(&self) -> Result<(), String> {
        let Some(action) = self.judge.in_motion() else { return Ok(()) };
        let design = self.judge.asked_design().or_else(|| self.robot.design.clone());
        let Some(design) = design else {
            return Err(format!("(a) action {action} goes on without a design"));
        };
        let components = DESIGNS.iter().find(|own| own.0 == design).map(|own| own.1).unwrap_or_default();
        match components.iter().find(|component| self.judge.failed.contains(**component)) {
            Some(component) => {
                Err(format!("(a) action {action} goes on with {design}, which needs {component}"))
            }
            None => Ok(()),
        }
    }

    /// (b) What is believed is so.
    fn judge_configuration(&self) -> Result<(), String> {
        let known = self.control.beliefs();
        if !self.messages.is_empty() || known.outstanding().next().is_some() || known.is_unsettled(FUNCTION) {
            return Ok(());
        }
        let believed = known.configuration().get(FUNCTION);
        // Of a function whose reconfiguration was given up aloud it is not known which design it has.
        let is_unknown = believed.is_none() && !self.judge.given_up.is_empty();
        if is_unknown || believed == self.robot.design.as_ref() {
            return Ok(());
        }
        Err(format!("(b) believed {believed:?}, actual {:?}", self.robot.design))
    }

    /// (c) and (d).
    fn at_the_end(&self) -> Result<(), String> {
        let judge = &self.judge;
        let is_open = |number: &&u64| {
            let ended = judge.ended.contains(&judge.asked[*number].action);
            let is_moot = ended && !matches!(judge.asked[*number].command, Command::Reconfigure { .. });
            !self.robot.seen.contains(number)
                && !judge.superseded.contains(number)
                && !judge.given_up.contains(number)
                && !is_moot
        };
        let open: Vec<&u64> = judge.asked.keys().filter(is_open).collect();
        if !open.is_empty() {
            return Err(format!("(c) effects {open:?} were neither carried out nor given up"));
        }
        if !judge.is_settled {
            return Err("(d) neither the goal nor a word that there is no plan".to_owned());
        }
        Ok(())
    }
}

impl Judge {
    /// Takes a line that the loop was told.
    fn hear(&mut self, event: &Value, is_refused: bool) {
        let component = event["component"].as_str().unwrap_or_default().to_owned();
        match event["event"].as_str().unwrap_or_default() {
            "component_status" if event["status"] == "FALSE" => {
                self.failed.insert(component);
            }
            "component_status" => {
                self.failed.remove(&component);
            }
            "acknowledged" | "reconfiguration_failed" => {
                self.answered.extend(event["effect"].as_u64());
            }
            "action_succeeded" | "action_failed" | "action_cancelled" if !is_refused => {
                self.ended.extend(event["action"].as_u64());
            }
            _ => {}
        }
    }

    /// Takes an answer of the loop.
    fn note(&mut self, answer: &Answer) {
        match answer {
            Answer::Effect(effect) => {
                self.superseded.extend(&effect.supersedes);
                self.asked.insert(effect.number, effect.clone());
                if matches!(effect.command, Command::Request { .. }) {
                    self.is_settled = false;
                }
            }
            Answer::GoalReached | Answer::PlanNone { .. } => self.is_settled = true,
            Answer::PlanFound { .. } => self.is_settled = false,
            Answer::Overdue { effect, .. } => self.given_up.extend(*effect),
            _ => {}
        }
    }

    /// The action that goes on if all effects are carried out.
    fn in_motion(&self) -> Option<u64> {
        let mut moving = None;
        for effect in self.asked.values() {
            match effect.command {
                Command::Request { .. } | Command::Resume => moving = Some(effect.action),
                Command::Suspend { .. } | Command::Cancel { .. } => moving = None,
                _ => {}
            }
        }
        moving.filter(|action| !self.ended.contains(action))
    }

    /// The design of the last reconfiguration that has no answer; none if there is no such reconfiguration.
    fn asked_design(&self) -> Option<String> {
        let last = self.asked.values().rev().find_map(|effect| match &effect.command {
            Command::Reconfigure { to, .. } => Some((effect.number, to.clone())),
            _ => None,
        });
        last.filter(|(number, _)| !self.answered.contains(number)).map(|(_, to)| to)
    }
}
