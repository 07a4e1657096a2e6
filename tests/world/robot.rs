//! Simulated robot with one function. The robot carries out each effect at most once and sends reports.

use std::collections::{BTreeMap, BTreeSet};

use metaplan::mapek::{Command, Effect};
use serde_json::{Value, json};

use crate::{COMPONENTS, FUNCTION, START};

const WORK: u32 = 4;

#[derive(Debug, Clone, PartialEq)]
pub struct Action {
    pub number: u64,
    /// Number of the last effect that requested or resumed the action.
    request: u64,
    pub done: u32,
    pub suspended: bool,
    pub to: String,
    /// Design that the action waits for, if any.
    awaited_design: Option<String>,
}

impl Action {
    pub fn is_moving(&self) -> bool {
        self.awaited_design.is_none() && !self.suspended
    }
}

#[derive(Debug, Clone)]
pub struct Robot {
    pub failed: BTreeSet<&'static str>,
    pub design: Option<String>,
    pub action: Option<Action>,
    pub place: String,
    /// Numbers of effects that were carried out, refused, or superseded before their arrival.
    pub processed: BTreeSet<u64>,
    /// Reconfigurations that were refused since the last successful one. If this one fails after its acknowledgement,
    /// it counts as refused, too. Then the list again contains the reconfigurations that were refused before it
    /// (`refused_before`).
    pub refused: BTreeSet<u64>,
    refused_before: BTreeSet<u64>,
    /// Answers to effects, reports of late failures, and reports of ended actions, kept for repetition.
    pub past_reports: Vec<Value>,
    /// Greatest number of an action whose request or cancellation has arrived.
    last_started: u64,
    has_restarted: bool,
    /// Whether the function lost its design in a restart and has not got a new design since.
    pub has_lost_design: bool,
    /// Number of the last reconfiguration that was carried out and can still fail, with the previous design.
    before: Option<(u64, String)>,
    /// Action number and effect number of the last reconfiguration that was carried out.
    pub configured: (u64, u64),
    suspended_early: BTreeSet<u64>,
    /// Future actions that were suspended and resumed before their request arrived, with the effect number
    /// and the design of the resumption.
    resumed: BTreeMap<u64, (u64, Option<String>)>,
}

impl Default for Robot {
    fn default() -> Self {
        Self {
            failed: BTreeSet::new(),
            design: None,
            action: None,
            place: START.to_owned(),
            processed: BTreeSet::new(),
            refused: BTreeSet::new(),
            refused_before: BTreeSet::new(),
            past_reports: Vec::new(),
            last_started: 0,
            has_restarted: false,
            has_lost_design: false,
            before: None,
            configured: (0, 0),
            suspended_early: BTreeSet::new(),
            resumed: BTreeMap::new(),
        }
    }
}

impl Robot {
    /// Receives an effect and carries it out unless it was processed before. With `fails`, a reconfiguration
    /// is refused. Returns the reports.
    pub fn take(&mut self, effect: &Effect, fails: bool) -> Vec<Value> {
        self.processed.extend(&effect.supersedes);
        if !self.processed.insert(effect.number) {
            // A repeated effect gets the same answer as before.
            let is_answer = |past_reports: &&Value| past_reports["effect"] == effect.number;
            return self.past_reports.iter().filter(is_answer).cloned().collect();
        }
        let is_refused = fails && matches!(effect.command, Command::Reconfigure { .. });
        let kind = if is_refused { "reconfiguration_failed" } else { "acknowledged" };
        let mut reports = vec![json!({ "event": kind, "effect": effect.number })];
        if matches!(effect.command, Command::Reconfigure { .. }) {
            if is_refused {
                self.refused.insert(effect.number);
            } else {
                self.refused_before = std::mem::take(&mut self.refused);
            }
        }
        if !is_refused {
            reports.extend(self.carry_out(effect));
        }
        self.past_reports.extend(reports.iter().cloned());
        reports
    }

    /// Makes the last reconfiguration fail after its acknowledgement, so that the function has the previous design
    /// again. Returns the report, or `None` if no reconfiguration can fail in this way.
    pub fn fail_late(&mut self) -> Option<Value> {
        let (effect, design) = self.before.take()?;
        self.design = Some(design);
        // The action may have waited for the previous design.
        if let Some(action) = &mut self.action {
            action.awaited_design.take_if(|awaited| self.design.as_ref() == Some(awaited));
        }
        self.refused.append(&mut self.refused_before);
        self.refused.insert(effect);
        let report = json!({ "event": "reconfiguration_failed", "effect": effect });
        self.past_reports.push(report.clone());
        Some(report)
    }

    /// Returns a copy with the state on which later effects depend, to predict their result.
    pub fn prospect(&self) -> Self {
        Self {
            failed: BTreeSet::new(),
            design: self.design.clone(),
            action: self.action.clone(),
            place: String::new(),
            processed: self.processed.clone(),
            past_reports: self
                .past_reports
                .iter()
                .filter(|past_reports| is_end(past_reports))
                .cloned()
                .collect(),
            suspended_early: self.suspended_early.clone(),
            resumed: self.resumed.clone(),
            before: None,
            refused: BTreeSet::new(),
            refused_before: BTreeSet::new(),
            ..*self
        }
    }

    pub fn carry_out(&mut self, effect: &Effect) -> Option<Value> {
        let number = effect.action;
        let action = self.action.as_mut().filter(|action| action.number == number);
        match (&effect.command, action) {
            (Command::Reconfigure { to, .. }, _) => {
                self.has_lost_design = false;
                let before = self.design.replace(to.clone());
                self.before = before.filter(|before| before != to).map(|before| (effect.number, before));
                self.configured = (number, effect.number);
                // An action starts only when the function has the requested design, regardless of the action
                // to which the reconfiguration belongs. A later reconfiguration for this action also starts
                // it.
                if let Some(action) = &mut self.action
                    && let Some(awaited_design) = &action.awaited_design
                    && (awaited_design == to || action.number == number && effect.number > action.request)
                {
                    action.awaited_design = None;
                    return Some(json!({ "event": "action_started", "action": action.number }));
                }
            }
            (Command::Request { step }, _) if number > self.last_started => {
                self.last_started = number;
                let to = step.arguments.get(1).cloned().unwrap_or_default();
                // Later effects for the action can arrive before its request.
                let of_request = (effect.number, step.design(FUNCTION).map(ToOwned::to_owned));
                let (request, design) = self.resumed.get(&number).cloned().unwrap_or(of_request);
                let is_later = self.design.is_some() && self.configured > (number, request);
                let awaited_design =
                    design.filter(|design| !is_later && self.design.as_ref() != Some(design));
                let is_begun = awaited_design.is_none();
                let suspended = self.suspended_early.contains(&number);
                self.action = Some(Action { number, request, done: 0, suspended, to, awaited_design });
                return is_begun.then(|| json!({ "event": "action_started", "action": number }));
            }
            (Command::Suspend { .. }, Some(action)) => action.suspended = true,
            // A suspension that arrives before the request takes effect at the start.
            (Command::Suspend { .. }, None) => drop(self.suspended_early.insert(number)),
            (Command::Resume { configuration }, None) => {
                self.suspended_early.remove(&number);
                self.resumed.insert(number, (effect.number, design_in(configuration).cloned()));
            }
            (Command::Resume { configuration }, Some(action)) => {
                let design = design_in(configuration);
                // A later reconfiguration for the action can arrive before the resumption.
                let is_later = self.design.is_some() && self.configured > (number, effect.number);
                let awaited_design =
                    design.filter(|design| !is_later && self.design.as_ref() != Some(design));
                (action.suspended, action.request) = (false, effect.number);
                let has_waited = action.awaited_design.is_some();
                action.awaited_design = awaited_design.cloned();
                if has_waited && action.awaited_design.is_none() {
                    return Some(json!({ "event": "action_started", "action": number }));
                }
            }
            (Command::Cancel { .. }, Some(_)) => {
                self.action = None;
                return Some(json!({ "event": "action_cancelled", "action": number }));
            }
            (Command::Cancel { .. }, None) => {
                // An action cancelled before its request never starts.
                self.last_started = self.last_started.max(number);
                let end = self
                    .past_reports
                    .iter()
                    .find(|past_reports| past_reports["action"] == number && is_end(past_reports));
                let cancelled = || json!({ "event": "action_cancelled", "action": number });
                return Some(end.cloned().unwrap_or_else(cancelled));
            }
            _ => {}
        }
        None
    }

    /// Advances a moving action by one work step. With `fails`, the action fails instead, even if
    /// it stands still.
    pub fn work(&mut self, fails: bool) -> Option<Value> {
        let action = self.action.as_mut().filter(|action| action.is_moving() || fails)?;
        action.done += 1;
        let number = action.number;
        let report = if fails {
            json!({ "event": "action_failed", "action": number })
        } else if action.done >= WORK {
            self.place.clone_from(&action.to);
            json!({ "event": "action_succeeded", "action": number })
        } else {
            let fraction = f64::from(action.done) / f64::from(WORK);
            return Some(json!({ "event": "action_progress", "action": number, "fraction": fraction }));
        };
        self.action = None;
        self.past_reports.push(report.clone());
        Some(report)
    }

    /// Restarts the robot: the function loses its design, and the action under way ends. With `forgets`, the
    /// end of the action is not reported. Returns the reports.
    pub fn restart(&mut self, forgets: bool) -> Vec<Value> {
        (self.design, self.has_restarted, self.has_lost_design, self.before) = (None, true, true, None);
        let failed = self.action.take().filter(|_| !forgets);
        let failed = failed.map(|action| json!({ "event": "action_failed", "action": action.number }));
        self.past_reports.extend(failed.clone());
        failed.into_iter().chain([self.observed()]).collect()
    }

    pub fn status(&self, component: &str) -> Value {
        let status = if self.failed.contains(component) { "FALSE" } else { "TRUE" };
        json!({ "event": "component_status", "component": component, "status": status })
    }

    pub fn observed(&self) -> Value {
        json!({ "event": "configuration_observed", "function": FUNCTION, "design": self.design })
    }

    /// Returns repeated reports of the statuses of all components, of ended actions and, after a restart, of the
    /// design. Answers to effects are not repeated: the loop has to repeat unanswered effects.
    pub fn periodic_reports(&self) -> Vec<Value> {
        let mut reports: Vec<Value> = COMPONENTS.iter().map(|component| self.status(component)).collect();
        reports.extend(self.past_reports.iter().filter(|past_reports| is_end(past_reports)).cloned());
        reports.extend(self.has_restarted.then(|| self.observed()));
        reports
    }
}

fn design_in(configuration: &[(String, String)]) -> Option<&String> {
    configuration.iter().find(|(function, _)| function == FUNCTION).map(|pair| &pair.1)
}

fn is_end(past_reports: &Value) -> bool {
    let kind = past_reports["event"].as_str().unwrap_or_default();
    ["action_succeeded", "action_failed", "action_cancelled"].contains(&kind)
}
