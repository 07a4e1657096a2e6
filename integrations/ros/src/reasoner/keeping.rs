//! Goals, diagnostics and answers of functions to designs that are asked for: what the reasoner decides, without a clock and a network.

use std::collections::BTreeMap;
use std::time::Duration;

use metaplan::configure::{Keeper, KeeperAnswer, Service};
use metaplan::mapek::{Answer, Event, Observation};
use ros2_client::action::GoalId;
use serde_json::Value;

use crate::interfaces::diagnostic_msgs::msg::KeyValue;
use crate::interfaces::mros2_msgs::msg::QoS;
use crate::manager::Functions;
use crate::reasoner::memory::{Memory, Remembered};

/// A design that was refused is tried again so much later.
const REFUSED: Duration = Duration::from_secs(60);

/// A design for which nobody answered is tried again so much later at first; twice as late with each time.
const SILENT: Duration = Duration::from_secs(2);

/// What is to be done.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Output {
    /// To ask for the mode of a function.
    Configure(Wanted),
    /// To tell how an objective is.
    Feedback(GoalId, QoS),
    /// A goal may be cancelled, and has ended then; or not.
    Cancelled(GoalId, bool),
    /// To publish an event.
    Event(Value),
    /// To log something that is wrong.
    Warn(String),
}

/// A mode that is asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Wanted {
    pub(super) function: String,
    pub(super) mode: String,
    /// The keeper's effect; none where the function is given up.
    effect: Option<u64>,
}

/// What has come of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Outcome {
    Done,
    Refused,
    Failed(String),
}

/// An objective that somebody pursues.
#[derive(Debug)]
struct Pursued {
    objective: String,
    function: String,
    always_improve: bool,
    /// The design that its function has, as far as it has said yes.
    design: Option<String>,
    /// A cancellation waits for its function.
    cancelling: bool,
    /// What was wanted, for who comes after a restart.
    wanted: QoS,
}

/// What the reasoner knows beside the knowledge base.
#[derive(Debug)]
pub(super) struct Keeping {
    keeper: Keeper,
    functions: Functions,
    goals: BTreeMap<GoalId, Pursued>,
    /// Modes that were asked for without an answer, by function, with the design.
    pending: BTreeMap<String, (Wanted, Option<String>)>,
    /// Designs that could not be had, with the time from which they are tried again, and how often nobody answered.
    failed: BTreeMap<String, (Duration, u32)>,
    /// What was measured last.
    measured: BTreeMap<String, String>,
    /// The last event about each thing.
    reports: BTreeMap<String, String>,
    /// Designs that functions have from before a restart.
    had: BTreeMap<String, String>,
    outputs: Vec<Output>,
    count: u64,
}

impl Keeping {
    pub(super) fn new(keeper: Keeper, functions: Functions) -> Self {
        Self {
            keeper,
            functions,
            goals: BTreeMap::new(),
            pending: BTreeMap::new(),
            failed: BTreeMap::new(),
            measured: BTreeMap::new(),
            reports: BTreeMap::new(),
            had: BTreeMap::new(),
            outputs: Vec::new(),
            count: 0,
        }
    }

    /// The functions that have designs.
    pub(super) fn functions(&self) -> Vec<String> {
        self.keeper.configurator().functions()
    }

    /// What a function is called on the robot.
    pub(super) fn system<'s>(&'s self, function: &'s str) -> &'s str {
        self.functions.system(function)
    }

    /// What is to be done since it was asked last.
    pub(super) fn outputs(&mut self) -> Vec<Output> {
        std::mem::take(&mut self.outputs)
    }

    /// What is to be known after a restart.
    pub(super) fn memory(&self) -> Memory {
        let goal = |(goal, own): (&GoalId, &Pursued)| Remembered {
            goal: goal.uuid.into_bytes(),
            wanted: QoS { objective_id: own.objective.clone(), ..own.wanted.clone() },
            design: own.design.clone(),
        };
        let goals = self.goals.iter().filter(|(_, own)| !own.cancelling).map(goal).collect();
        Memory::new(self.reports.clone(), goals)
    }

    /// Goes on after a restart: functions that have the design that is right are not asked for it again. `modes` are those that they were
    /// found with, as far as they say.
    pub(super) fn remember(&mut self, memory: Memory, goals: &[GoalId], modes: &BTreeMap<String, String>) {
        for line in memory.reports.values() {
            self.hear(line);
        }
        for (Remembered { wanted, design, .. }, goal) in memory.goals.into_iter().zip(goals) {
            let function = wanted.objective_type.clone();
            if let Some(design) = design {
                let mode = self.functions.mode(&function, &design);
                if modes.get(&function).is_none_or(|found| found == mode) {
                    self.had.insert(function, design);
                }
            }
            self.pursue(*goal, &wanted);
        }
        self.had.clear();
    }

    /// A goal is wanted: why it cannot be pursued, if it cannot.
    pub(super) fn refused(&self, wanted: &QoS) -> Option<String> {
        let QoS { objective_type: function, .. } = wanted;
        let known = self.functions();
        if known.iter().all(|own| own != function) {
            return Some(format!(
                "no design is for the function `{function}`; designs are for {}",
                known.join(", ")
            ));
        }
        let bad = wanted
            .qos
            .iter()
            .find(|pair| pair.value.trim().parse::<f64>().is_ok_and(f64::is_finite).eq(&false))?;
        Some(format!("the requirement {} is `{}`, which is not a number", bad.key, bad.value))
    }

    /// Begins to pursue a goal that is not refused.
    pub(super) fn pursue(&mut self, goal: GoalId, wanted: &QoS) {
        self.count += 1;
        let asked = wanted.objective_id.trim();
        let is_taken = self.goals.values().any(|own| own.objective == asked);
        let objective = if asked.is_empty() || is_taken {
            format!("obj_{}_{}", wanted.objective_type, self.count)
        } else {
            asked.to_owned()
        };
        let requirements: Vec<String> = wanted
            .qos
            .iter()
            .map(|pair| format!("{}:{}", Value::from(pair.key.as_str()), pair.value.trim()))
            .collect();
        let line = format!(
            r#"{{"event":"objective_added","objective":{},"function":{},"requirements":{{{}}},"always_improve":{}}}"#,
            Value::from(objective.as_str()),
            Value::from(wanted.objective_type.as_str()),
            requirements.join(","),
            wanted.always_improve
        );
        let pursued = Pursued {
            objective,
            function: wanted.objective_type.clone(),
            always_improve: wanted.always_improve,
            design: None,
            cancelling: false,
            wanted: wanted.clone(),
        };
        self.goals.insert(goal, pursued);
        self.hear(&line);
        self.tell(goal);
    }

    /// A goal is to be cancelled: first its function gives up its design.
    pub(super) fn cancel(&mut self, goal: GoalId) {
        let Some(pursued) = self.goals.get_mut(&goal) else {
            self.outputs.push(Output::Cancelled(goal, false));
            return;
        };
        pursued.cancelling = true;
        let function = pursued.function.clone();
        let mode = self.functions.unground(&function).to_owned();
        self.ask(Wanted { function, mode, effect: None }, None);
    }

    fn ask(&mut self, wanted: Wanted, design: Option<String>) {
        self.pending.insert(wanted.function.clone(), (wanted.clone(), design));
        self.outputs.push(Output::Configure(wanted));
    }

    /// A line of events, as a loop reads them.
    pub(super) fn hear(&mut self, line: &str) {
        let observation = Observation::parse(line);
        for event in observation.events.iter().flatten() {
            if let Event::Measured { attribute, .. } = event
                && let Some(Value::Number(value)) = event.to_json().get("value").cloned()
            {
                self.measured.insert(attribute.clone(), value.to_string());
            }
            let about = match event {
                Event::Measured { attribute, .. } => attribute,
                Event::Component { component, .. } => component,
                _ => continue,
            };
            self.reports.insert(about.clone(), event.to_json().to_string());
        }
        let answers = self.keeper.handle(&observation);
        self.take(answers);
    }

    fn take(&mut self, answers: Vec<KeeperAnswer>) {
        for answer in answers {
            // Answers are always data.
            self.outputs.push(Output::Event(serde_json::to_value(&answer).unwrap_or_default()));
            match answer {
                KeeperAnswer::Service(Service::Reconfigure {
                    function: Some(function),
                    to: Some(to),
                    effect,
                    ..
                }) => {
                    if self.had.get(&function) == Some(&to) {
                        self.has(&function, &to, Some(effect));
                        continue;
                    }
                    let mode = self.functions.mode(&function, &to).to_owned();
                    self.ask(Wanted { function, mode, effect: Some(effect) }, Some(to));
                }
                KeeperAnswer::Service(Service::Unserved { objective, because, .. }) => {
                    let text = format!("no design serves {objective} now: {}", because.join("; "));
                    self.outputs.push(Output::Warn(text));
                }
                KeeperAnswer::Loop(Answer::Error { code, message }) => {
                    self.outputs.push(Output::Warn(format!("{code}: {message}")));
                }
                _ => {}
            }
        }
    }

    /// A function has answered, or has not.
    pub(super) fn answered(&mut self, wanted: &Wanted, outcome: Outcome, now: Duration) {
        let is_awaited = self.pending.get(&wanted.function).is_some_and(|(own, _)| own == wanted);
        let Some((_, design)) = is_awaited.then(|| self.pending.remove(&wanted.function)).flatten() else {
            return;
        };
        let goals: Vec<GoalId> = self
            .goals
            .iter()
            .filter(|(_, own)| own.function == wanted.function)
            .map(|(goal, _)| *goal)
            .collect();
        match (outcome, design) {
            (Outcome::Done, Some(design)) => self.has(&wanted.function, &design, wanted.effect),
            (Outcome::Done, None) => {
                for goal in goals {
                    self.end(goal);
                }
            }
            (outcome, Some(design)) => self.could_not(wanted, &design, &outcome, now),
            (outcome, None) => {
                self.complain(wanted, &outcome);
                for goal in goals {
                    if let Some(own) = self.goals.get_mut(&goal).filter(|own| own.cancelling) {
                        own.cancelling = false;
                        self.outputs.push(Output::Cancelled(goal, false));
                    }
                }
            }
        }
    }

    /// A function has a design.
    fn has(&mut self, function: &str, design: &str, effect: Option<u64>) {
        self.failed.remove(design);
        if let Some(effect) = effect {
            self.hear(&Event::Acknowledged { effect }.to_json().to_string());
        }
        let goals: Vec<GoalId> =
            self.goals.iter().filter(|(_, own)| own.function == function).map(|(goal, _)| *goal).collect();
        for goal in goals {
            if let Some(own) = self.goals.get_mut(&goal) {
                own.design = Some(design.to_owned());
            }
            self.tell(goal);
        }
    }

    fn end(&mut self, goal: GoalId) {
        if self.goals.get(&goal).is_some_and(|own| own.cancelling)
            && let Some(own) = self.goals.remove(&goal)
        {
            self.outputs.push(Output::Cancelled(goal, true));
            self.hear(&Event::ObjectiveRemoved { objective: own.objective }.to_json().to_string());
        }
    }

    fn complain(&mut self, wanted: &Wanted, outcome: &Outcome) {
        let because = match outcome {
            Outcome::Failed(because) => because.clone(),
            Outcome::Done | Outcome::Refused => "it was refused".to_owned(),
        };
        self.outputs.push(Output::Warn(format!("{} {}: {because}", wanted.function, wanted.mode)));
        self.outputs.push(Output::Event(serde_json::json!({
            "answer": "call_failed", "function": wanted.function, "mode": wanted.mode, "because": because,
        })));
    }

    /// A design could not be had: it is not realisable for a while.
    fn could_not(&mut self, wanted: &Wanted, design: &str, outcome: &Outcome, now: Duration) {
        self.complain(wanted, outcome);
        let times = self.failed.get(design).map_or(0, |(_, times)| *times);
        let (wait, times) = match outcome {
            Outcome::Failed(_) => (SILENT.saturating_mul(1 << times.min(5)), times.saturating_add(1)),
            Outcome::Done | Outcome::Refused => (REFUSED, 0),
        };
        self.failed.insert(design.to_owned(), (now + wait, times));
        self.hear(&Event::Design { design: design.to_owned(), realisable: false }.to_json().to_string());
        if !self.pending.contains_key(&wanted.function)
            && let Some(effect) = wanted.effect
        {
            // Nothing else serves: it has the design of before.
            self.hear(&Event::ReconfigurationFailed { effect }.to_json().to_string());
        }
    }

    /// Time passes: designs that could not be had are tried again, and objectives are told of.
    pub(super) fn tick(&mut self, now: Duration) {
        let due: Vec<String> = self
            .failed
            .iter()
            .filter(|(_, (again, _))| *again <= now)
            .map(|(design, _)| design.clone())
            .collect();
        for design in due {
            if let Some((again, _)) = self.failed.get_mut(&design) {
                *again = Duration::MAX;
            }
            self.hear(&Event::Design { design, realisable: true }.to_json().to_string());
        }
        let goals: Vec<GoalId> = self.goals.keys().copied().collect();
        for goal in goals {
            self.tell(goal);
        }
    }

    /// How an objective is, as MROS tells it.
    fn tell(&mut self, goal: GoalId) {
        let Some(own) = self.goals.get(&goal) else { return };
        let objectives = self.keeper.configurator().objectives();
        let status = objectives
            .iter()
            .find(|objective| objective.individual.name == own.objective)
            .and_then(|objective| objective.statuses.first().cloned())
            .unwrap_or_else(|| "IN_PROGRESS".to_owned());
        let mode = own.design.as_ref().map(|design| self.functions.mode(&own.function, design).to_owned());
        let pair = |(key, value): (&String, &String)| KeyValue { key: key.clone(), value: value.clone() };
        let told = QoS {
            objective_id: own.objective.clone(),
            objective_type: own.function.clone(),
            objective_status: status,
            selected_mode: mode.unwrap_or_default(),
            always_improve: own.always_improve,
            qos: self.measured.iter().map(pair).collect(),
        };
        self.outputs.push(Output::Feedback(goal, told));
    }
}

#[cfg(test)]
mod tests;
