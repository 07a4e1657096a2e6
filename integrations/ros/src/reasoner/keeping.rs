//! Decisions of the reasoner about goals, diagnostics and replies of functions, without clock and
//! network.

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

const REFUSED_DELAY: Duration = Duration::from_secs(60);

/// Initial delay until a design without a reply is retried; doubled with each attempt, up to 64 s.
const SILENT_DELAY: Duration = Duration::from_secs(2);

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Output {
    Configure(Wanted),
    Feedback(GoalId, QoS),
    /// Answer a cancel request. `true` if the goal has ended.
    Cancelled(GoalId, bool),
    Event(Value),
    Warn(String),
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Wanted {
    pub(super) function: String,
    pub(super) mode: String,
    /// Number of the keeper's effect that requires the mode. `None` if the cancellation of a goal requires it.
    effect: Option<u64>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Outcome {
    Done,
    Refused,
    /// There was no valid answer, for this reason.
    Failed(String),
    /// A step or condition has failed for this reason, and the earlier steps were undone as far as possible.
    StepFailed(String),
}

#[derive(Debug)]
struct Pursued {
    objective: String,
    function: String,
    always_improve: bool,
    design: Option<String>,
    cancelling: bool,
    /// The goal as requested, to restore it after a restart.
    wanted: QoS,
}

#[derive(Debug)]
pub(super) struct Keeping {
    keeper: Keeper,
    functions: Functions,
    goals: BTreeMap<GoalId, Pursued>,
    /// Requested modes without a reply, by function. The second value is the design, or `None` for the unground mode.
    pending: BTreeMap<String, (Wanted, Option<String>)>,
    /// Modes and designs that the keeper requires of functions whose goals are all being cancelled, by function. They
    /// are requested if the cancellation is rejected.
    withheld: BTreeMap<String, (Wanted, String)>,
    /// Failed designs with the time of the next attempt and the number of missing replies.
    failed: BTreeMap<String, (Duration, u32)>,
    measured: BTreeMap<String, String>,
    reports: BTreeMap<String, String>,
    /// Designs that functions had before a restart, by function. Empty after the restart is handled.
    restored: BTreeMap<String, String>,
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
            withheld: BTreeMap::new(),
            failed: BTreeMap::new(),
            measured: BTreeMap::new(),
            reports: BTreeMap::new(),
            restored: BTreeMap::new(),
            outputs: Vec::new(),
            count: 0,
        }
    }

    pub(super) fn functions(&self) -> Vec<String> {
        self.keeper.configurator().functions()
    }

    pub(super) fn system<'s>(&'s self, function: &'s str) -> &'s str {
        self.functions.system(function)
    }

    pub(super) fn outputs(&mut self) -> Vec<Output> {
        std::mem::take(&mut self.outputs)
    }

    /// Returns the state that must survive a restart, without goals that are being cancelled.
    pub(super) fn memory(&self) -> Memory {
        let goal = |(goal, pursued): (&GoalId, &Pursued)| Remembered {
            goal: goal.uuid.into_bytes(),
            wanted: QoS { objective_id: pursued.objective.clone(), ..pursued.wanted.clone() },
            design: pursued.design.clone(),
        };
        let goals = self.goals.iter().filter(|(_, pursued)| !pursued.cancelling).map(goal).collect();
        Memory::new(self.reports.clone(), goals)
    }

    /// Restores the state after a restart. Functions that already have the right design are not requested again.
    /// `modes` are the known modes on the robot, by function; a function without a known mode counts as unchanged.
    pub(super) fn remember(&mut self, memory: Memory, goals: &[GoalId], modes: &BTreeMap<String, String>) {
        for line in memory.reports.values() {
            self.handle_line(line);
        }
        for (Remembered { wanted, design, .. }, goal) in memory.goals.into_iter().zip(goals) {
            let function = wanted.objective_type.clone();
            if let Some(design) = design {
                let mode = self.functions.mode(&function, &design);
                if modes.get(&function).is_none_or(|found| found == mode) {
                    self.restored.insert(function, design);
                }
            }
            self.pursue(*goal, &wanted);
        }
        self.restored.clear();
    }

    pub(super) fn refused(&self, wanted: &QoS) -> Option<String> {
        let QoS { objective_type: function, .. } = wanted;
        let functions = self.functions();
        if functions.iter().all(|known| known != function) {
            return Some(format!(
                "no design is for the function `{function}`; designs are for {}",
                functions.join(", ")
            ));
        }
        let invalid = wanted
            .qos
            .iter()
            .find(|pair| pair.value.trim().parse::<f64>().is_ok_and(f64::is_finite).eq(&false))?;
        Some(format!("the requirement {} is `{}`, which is not a number", invalid.key, invalid.value))
    }

    pub(super) fn pursue(&mut self, goal: GoalId, wanted: &QoS) {
        self.count += 1;
        let requested = wanted.objective_id.trim();
        let is_taken = |name: &str| self.goals.values().any(|pursued| pursued.objective == name);
        let counted = |count: u64| format!("obj_{}_{count}", wanted.objective_type);
        let mut objective = requested.to_owned();
        if objective.is_empty() || is_taken(&objective) {
            objective = counted(self.count);
        }
        // After a restart, the count begins again, and restored goals have names of the previous run.
        while is_taken(&objective) {
            self.count += 1;
            objective = counted(self.count);
        }
        let requirements: Vec<String> = wanted
            .qos
            .iter()
            .map(|pair| format!("{}:{}", Value::from(pair.key.as_str()), json_number(pair.value.trim())))
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
        self.handle_line(&line);
        self.publish_status(goal);
    }

    /// Cancels a goal: requests the unground mode of its function, and ends the goal when the mode
    /// is set. If this fails, the cancellation is rejected. Without such a mode, or if another goal needs the function,
    /// the goal ends at once. The cancellation of an unknown goal is rejected.
    pub(super) fn cancel(&mut self, goal: GoalId) {
        let Some(pursued) = self.goals.get_mut(&goal) else {
            self.outputs.push(Output::Cancelled(goal, false));
            return;
        };
        pursued.cancelling = true;
        let function = pursued.function.clone();
        let is_needed = self.goals.values().any(|other| other.function == function && !other.cancelling);
        match self.functions.unground(&function).filter(|_| !is_needed).map(str::to_owned) {
            Some(mode) => self.request_mode(Wanted { function, mode, effect: None }, None),
            // The function keeps its design.
            None => self.end(goal),
        }
    }

    /// Requests the mode of a design, unless all goals of its function are being cancelled: the request would replace
    /// that of the unground mode, whose reply ends the goals. If only some are being cancelled, they end at once.
    fn require(&mut self, wanted: Wanted, design: String) {
        let of_function = self.goals.iter().filter(|(_, pursued)| pursued.function == wanted.function);
        let (ending, others): (Vec<_>, Vec<_>) = of_function.partition(|(_, pursued)| pursued.cancelling);
        let is_needed = ending.is_empty() || !others.is_empty();
        let ending: Vec<GoalId> = ending.into_iter().map(|(goal, _)| *goal).collect();
        if !is_needed {
            self.withheld.insert(wanted.function.clone(), (wanted, design));
            return;
        }
        self.request_mode(wanted, Some(design));
        for goal in ending {
            self.end(goal);
        }
    }

    fn request_mode(&mut self, wanted: Wanted, design: Option<String>) {
        self.pending.insert(wanted.function.clone(), (wanted.clone(), design));
        self.outputs.push(Output::Configure(wanted));
    }

    pub(super) fn handle_line(&mut self, line: &str) {
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
        self.handle_answers(answers);
    }

    fn handle_answers(&mut self, answers: Vec<KeeperAnswer>) {
        for answer in answers {
            // Serialisation cannot fail: answers consist of texts and numbers.
            self.outputs.push(Output::Event(serde_json::to_value(&answer).unwrap_or_default()));
            match answer {
                KeeperAnswer::Service(Service::Reconfigure {
                    function: Some(function),
                    to: Some(to),
                    effect,
                    ..
                }) => {
                    // The function still has the design from before the restart.
                    if self.restored.get(&function) == Some(&to) {
                        self.has(&function, &to, Some(effect));
                        continue;
                    }
                    let mode = self.functions.mode(&function, &to).to_owned();
                    self.require(Wanted { function, mode, effect: Some(effect) }, to);
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

    pub(super) fn answered(&mut self, wanted: &Wanted, outcome: Outcome, now: Duration) {
        let is_awaited = self.pending.get(&wanted.function).is_some_and(|(pending, _)| pending == wanted);
        let Some((_, design)) = is_awaited.then(|| self.pending.remove(&wanted.function)).flatten() else {
            return;
        };
        let goals: Vec<GoalId> = self
            .goals
            .iter()
            .filter(|(_, pursued)| pursued.function == wanted.function)
            .map(|(goal, _)| *goal)
            .collect();
        match (outcome, design) {
            (Outcome::Done, Some(design)) => self.has(&wanted.function, &design, wanted.effect),
            (Outcome::Done, None) => {
                self.withheld.remove(&wanted.function);
                for goal in goals {
                    self.end(goal);
                }
            }
            (outcome, Some(design)) => self.could_not(wanted, &design, &outcome, now),
            (outcome, None) => {
                self.complain(wanted, &outcome);
                for goal in goals {
                    if let Some(pursued) = self.goals.get_mut(&goal).filter(|pursued| pursued.cancelling) {
                        pursued.cancelling = false;
                        self.outputs.push(Output::Cancelled(goal, false));
                    }
                }
                if let Some((wanted, design)) = self.withheld.remove(&wanted.function) {
                    self.request_mode(wanted, Some(design));
                }
            }
        }
    }

    fn has(&mut self, function: &str, design: &str, effect: Option<u64>) {
        self.failed.remove(design);
        if let Some(effect) = effect {
            self.handle_line(&Event::Acknowledged { effect }.to_json().to_string());
        }
        let goals: Vec<GoalId> = self
            .goals
            .iter()
            .filter(|(_, pursued)| pursued.function == function)
            .map(|(goal, _)| *goal)
            .collect();
        for goal in goals {
            if let Some(pursued) = self.goals.get_mut(&goal) {
                pursued.design = Some(design.to_owned());
            }
            self.publish_status(goal);
        }
    }

    fn end(&mut self, goal: GoalId) {
        if self.goals.get(&goal).is_some_and(|pursued| pursued.cancelling)
            && let Some(pursued) = self.goals.remove(&goal)
        {
            self.outputs.push(Output::Cancelled(goal, true));
            self.handle_line(&Event::ObjectiveRemoved { objective: pursued.objective }.to_json().to_string());
        }
    }

    fn complain(&mut self, wanted: &Wanted, outcome: &Outcome) {
        let because = match outcome {
            Outcome::Failed(because) | Outcome::StepFailed(because) => because.clone(),
            Outcome::Done | Outcome::Refused => "it was refused".to_owned(),
        };
        self.outputs.push(Output::Warn(format!("{} {}: {because}", wanted.function, wanted.mode)));
        self.outputs.push(Output::Event(serde_json::json!({
            "answer": "call_failed", "function": wanted.function, "mode": wanted.mode, "because": because,
        })));
    }

    /// Handles a design that could not be set: it counts as not realisable until it is retried.
    fn could_not(&mut self, wanted: &Wanted, design: &str, outcome: &Outcome, now: Duration) {
        self.complain(wanted, outcome);
        let times = self.failed.get(design).map_or(0, |(_, times)| *times);
        let (wait, times) = match outcome {
            Outcome::Failed(_) => (SILENT_DELAY.saturating_mul(1 << times.min(5)), times.saturating_add(1)),
            Outcome::Done | Outcome::Refused | Outcome::StepFailed(_) => (REFUSED_DELAY, 0),
        };
        self.failed.insert(design.to_owned(), (now + wait, times));
        self.handle_line(
            &Event::Design { design: design.to_owned(), realisable: false }.to_json().to_string(),
        );
        if !self.pending.contains_key(&wanted.function)
            && let Some(effect) = wanted.effect
        {
            // No other design was requested instead, so the function keeps its former design.
            self.handle_line(&Event::ReconfigurationFailed { effect }.to_json().to_string());
        }
    }

    /// Handles a function that is in none of its modes after failed steps. Unless another design was requested instead,
    /// its objectives need a design again.
    pub(super) fn lose_design(&mut self, function: &str) {
        for pursued in self.goals.values_mut().filter(|pursued| pursued.function == function) {
            pursued.design = None;
        }
        if !self.pending.contains_key(function) {
            let answers = self.keeper.lose_design(function);
            self.handle_answers(answers);
        }
    }

    /// Retries failed designs whose delay has passed, and publishes the status of objectives.
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
            self.handle_line(&Event::Design { design, realisable: true }.to_json().to_string());
        }
        let goals: Vec<GoalId> = self.goals.keys().copied().collect();
        for goal in goals {
            self.publish_status(goal);
        }
    }

    fn publish_status(&mut self, goal: GoalId) {
        let Some(pursued) = self.goals.get(&goal) else { return };
        let objectives = self.keeper.configurator().objectives();
        let status = objectives
            .iter()
            .find(|objective| objective.individual.name == pursued.objective)
            .and_then(|objective| objective.statuses.first().cloned())
            .unwrap_or_else(|| "IN_PROGRESS".to_owned());
        let mode =
            pursued.design.as_ref().map(|design| self.functions.mode(&pursued.function, design).to_owned());
        let pair = |(key, value): (&String, &String)| KeyValue { key: key.clone(), value: value.clone() };
        let status = QoS {
            objective_id: pursued.objective.clone(),
            objective_type: pursued.function.clone(),
            objective_status: status,
            selected_mode: mode.unwrap_or_default(),
            always_improve: pursued.always_improve,
            qos: self.measured.iter().map(pair).collect(),
        };
        self.outputs.push(Output::Feedback(goal, status));
    }
}

/// Returns a number as JSON text: with its digits if it is a JSON number, and otherwise (`+1`, `.5`) as the nearest
/// double.
fn json_number(text: &str) -> String {
    match serde_json::from_str::<serde_json::Number>(text) {
        Ok(_) => text.to_owned(),
        Err(_) => Value::from(text.parse::<f64>().unwrap_or_default()).to_string(),
    }
}

#[cfg(test)]
mod tests;
