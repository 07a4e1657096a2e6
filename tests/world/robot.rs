//! A robot with one function: it carries effects out, each once, and reports.

use std::collections::{BTreeMap, BTreeSet};

use metaplan::mapek::{Command, Effect};
use serde_json::{Value, json};

use crate::{COMPONENTS, FUNCTION, START};

/// Number of steps of work that an action takes.
const WORK: u32 = 4;

/// An action that the robot carries out.
#[derive(Debug, Clone, PartialEq)]
pub struct Action {
    pub number: u64,
    /// Number of the effect that has requested or resumed it last.
    request: u64,
    /// Steps of work done so far.
    pub done: u32,
    pub suspended: bool,
    /// The place where the action ends.
    pub to: String,
    /// The design that the action waits for before it begins or goes on.
    wanted: Option<String>,
}

impl Action {
    /// Whether the action has begun and does not stand still.
    pub fn is_moving(&self) -> bool {
        self.wanted.is_none() && !self.suspended
    }
}

/// The robot.
#[derive(Debug, Clone)]
pub struct Robot {
    /// Components that have failed.
    pub failed: BTreeSet<&'static str>,
    /// Design of the function.
    pub design: Option<String>,
    pub action: Option<Action>,
    /// The place of the robot.
    pub place: String,
    /// Numbers of effects that were carried out, refused, or superseded before they came.
    pub seen: BTreeSet<u64>,
    /// Reconfigurations since the last successful one that were refused, and that one if it has failed after it was acknowledged.
    pub refused: BTreeSet<u64>,
    /// As `refused`, for the design before the last reconfiguration.
    refused_before: BTreeSet<u64>,
    /// Answers to effects and ends of actions, to be reported again.
    pub said: Vec<Value>,
    /// The greatest number of an action that has begun.
    begun: u64,
    has_restarted: bool,
    /// Whether the function has lost its design in a restart and has got none since.
    pub has_lost_design: bool,
    /// The last reconfiguration that was carried out, with the design before, if it can still fail.
    before: Option<(u64, String)>,
    /// The action and the number of the last reconfiguration that was carried out.
    configured: (u64, u64),
    /// Actions to come that are to stand still from their beginning.
    still: BTreeSet<u64>,
    /// Actions to come that were suspended and resumed, with the number of the resumption and its design.
    resumed: BTreeMap<u64, (u64, Option<String>)>,
}

impl Default for Robot {
    fn default() -> Self {
        Self {
            failed: BTreeSet::new(),
            design: None,
            action: None,
            place: START.to_owned(),
            seen: BTreeSet::new(),
            refused: BTreeSet::new(),
            refused_before: BTreeSet::new(),
            said: Vec::new(),
            begun: 0,
            has_restarted: false,
            has_lost_design: false,
            before: None,
            configured: (0, 0),
            still: BTreeSet::new(),
            resumed: BTreeMap::new(),
        }
    }
}

impl Robot {
    /// Carries an effect out, once; `fails` for a reconfiguration that cannot be carried out. Returns its reports.
    pub fn take(&mut self, effect: &Effect, fails: bool) -> Vec<Value> {
        self.seen.extend(&effect.supersedes);
        if !self.seen.insert(effect.number) {
            // The effect has been answered before, and is answered again.
            let is_answer = |said: &&Value| said["effect"] == effect.number;
            return self.said.iter().filter(is_answer).cloned().collect();
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
        self.said.extend(reports.iter().cloned());
        reports
    }

    /// The last reconfiguration fails after it was acknowledged: the function has the design before again. Returns the report.
    pub fn fail_late(&mut self) -> Option<Value> {
        let (effect, design) = self.before.take()?;
        self.design = Some(design);
        self.refused.append(&mut self.refused_before);
        self.refused.insert(effect);
        let report = json!({ "event": "reconfiguration_failed", "effect": effect });
        self.said.push(report.clone());
        Some(report)
    }

    /// A copy without what was said, to be changed as effects to come say.
    pub fn prospect(&self) -> Self {
        Self {
            failed: BTreeSet::new(),
            design: self.design.clone(),
            action: self.action.clone(),
            place: String::new(),
            seen: self.seen.clone(),
            said: self.said.iter().filter(|said| is_end(said)).cloned().collect(),
            still: self.still.clone(),
            resumed: self.resumed.clone(),
            before: None,
            refused: BTreeSet::new(),
            refused_before: BTreeSet::new(),
            ..*self
        }
    }

    /// Changes the robot as an effect says. Returns reports about its action.
    pub fn carry_out(&mut self, effect: &Effect) -> Option<Value> {
        let number = effect.action;
        let own = self.action.as_mut().filter(|own| own.number == number);
        match (&effect.command, own) {
            (Command::Reconfigure { to, .. }, _) => {
                self.has_lost_design = false;
                let before = self.design.replace(to.clone());
                self.before = before.filter(|before| before != to).map(|before| (effect.number, before));
                self.configured = (number, effect.number);
                // An action begins only when its function has its design: that of the request, whichever action it was asked for,
                // or a later one for the action.
                if let Some(own) = &mut self.action
                    && let Some(wanted) = &own.wanted
                    && (wanted == to || own.number == number && effect.number > own.request)
                {
                    own.wanted = None;
                    return Some(json!({ "event": "action_started", "action": own.number }));
                }
            }
            (Command::Request { step }, _) if number > self.begun => {
                self.begun = number;
                let to = step.arguments.get(1).cloned().unwrap_or_default();
                // Later effects for the action may have come before its request.
                let of_request = (effect.number, step.design(FUNCTION).map(ToOwned::to_owned));
                let (request, design) = self.resumed.get(&number).cloned().unwrap_or(of_request);
                let is_later = self.design.is_some() && self.configured > (number, request);
                let wanted = design.filter(|design| !is_later && self.design.as_ref() != Some(design));
                let is_begun = wanted.is_none();
                let suspended = self.still.contains(&number);
                self.action = Some(Action { number, request, done: 0, suspended, to, wanted });
                return is_begun.then(|| json!({ "event": "action_started", "action": number }));
            }
            (Command::Suspend { .. }, Some(own)) => own.suspended = true,
            // What is said of an action before its request comes holds when it begins.
            (Command::Suspend { .. }, None) => drop(self.still.insert(number)),
            (Command::Resume { configuration }, None) => {
                self.still.remove(&number);
                self.resumed.insert(number, (effect.number, design_in(configuration).cloned()));
            }
            (Command::Resume { configuration }, Some(own)) => {
                let design = design_in(configuration);
                // A later reconfiguration for the action may have come before.
                let is_later = self.design.is_some() && self.configured > (number, effect.number);
                let wanted = design.filter(|design| !is_later && self.design.as_ref() != Some(design));
                (own.suspended, own.request) = (false, effect.number);
                let has_waited = own.wanted.is_some();
                own.wanted = wanted.cloned();
                if has_waited && own.wanted.is_none() {
                    return Some(json!({ "event": "action_started", "action": number }));
                }
            }
            (Command::Cancel { .. }, Some(_)) => {
                self.action = None;
                return Some(json!({ "event": "action_cancelled", "action": number }));
            }
            (Command::Cancel { .. }, None) => {
                // The action never begins any more.
                self.begun = self.begun.max(number);
                let end = self.said.iter().find(|said| said["action"] == number && is_end(said));
                let cancelled = || json!({ "event": "action_cancelled", "action": number });
                return Some(end.cloned().unwrap_or_else(cancelled));
            }
            _ => {}
        }
        None
    }

    /// Works for a while; `fails` for an action that fails now. Returns its reports.
    pub fn work(&mut self, fails: bool) -> Option<Value> {
        let action = self.action.as_mut().filter(|own| own.is_moving() || fails)?;
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
        self.said.push(report.clone());
        Some(report)
    }

    /// Restarts. The function has no design any more, and the action under way has ended; `forgets` if the robot does not know any
    /// more that there was one. Returns its reports.
    pub fn restart(&mut self, forgets: bool) -> Vec<Value> {
        (self.design, self.has_restarted, self.has_lost_design, self.before) = (None, true, true, None);
        let failed = self.action.take().filter(|_| !forgets);
        let failed = failed.map(|own| json!({ "event": "action_failed", "action": own.number }));
        self.said.extend(failed.clone());
        failed.into_iter().chain([self.observed()]).collect()
    }

    /// A component's status as it is.
    pub fn status(&self, component: &str) -> Value {
        let status = if self.failed.contains(component) { "FALSE" } else { "TRUE" };
        json!({ "event": "component_status", "component": component, "status": status })
    }

    /// The function's design as it is.
    pub fn observed(&self) -> Value {
        json!({ "event": "configuration_observed", "function": FUNCTION, "design": self.design })
    }

    /// Statuses of all components, and ends of actions, as robots publish them again and again. Answers to effects are not repeated:
    /// the loop has to repeat effects that have no answer.
    pub fn again(&self) -> Vec<Value> {
        let mut reports: Vec<Value> = COMPONENTS.iter().map(|component| self.status(component)).collect();
        reports.extend(self.said.iter().filter(|said| is_end(said)).cloned());
        reports.extend(self.has_restarted.then(|| self.observed()));
        reports
    }
}

/// Returns the design of the function in a configuration.
fn design_in(configuration: &[(String, String)]) -> Option<&String> {
    configuration.iter().find(|(function, _)| function == FUNCTION).map(|pair| &pair.1)
}

fn is_end(said: &Value) -> bool {
    let kind = said["event"].as_str().unwrap_or_default();
    ["action_succeeded", "action_failed", "action_cancelled"].contains(&kind)
}
