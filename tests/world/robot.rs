//! A robot with one function: it carries effects out, and reports.

use std::collections::BTreeSet;

use metaplan::mapek::{Command, Effect};
use serde_json::{Value, json};

use crate::{COMPONENTS, FUNCTION};

/// An action that the robot carries out.
#[derive(Debug, Clone, PartialEq)]
pub struct Action {
    pub number: u64,
    pub done: u32,
    pub suspended: bool,
}

/// The robot.
#[derive(Debug, Clone, Default)]
pub struct Robot {
    /// Components that have failed.
    pub failed: BTreeSet<&'static str>,
    /// Design of the function.
    pub design: Option<String>,
    pub action: Option<Action>,
    /// Numbers of effects that were carried out, refused, or superseded before they came.
    pub seen: BTreeSet<u64>,
    /// Answers to effects and ends of actions, to be reported again.
    pub said: Vec<Value>,
    /// The greatest number of an action that has begun.
    begun: u64,
}

impl Robot {
    /// Carries an effect out, once; `fails` for a reconfiguration that cannot be carried out. Returns what it reports.
    pub fn take(&mut self, effect: &Effect, fails: bool) -> Vec<Value> {
        self.seen.extend(&effect.supersedes);
        if !self.seen.insert(effect.number) {
            // It has been answered before, and is answered again.
            let is_answer = |said: &&Value| said["effect"] == effect.number;
            let again: Vec<Value> = self.said.iter().filter(is_answer).cloned().collect();
            return again;
        }
        let answer = |kind: &str| json!({ "event": kind, "effect": effect.number });
        let mut reports = Vec::new();
        match &effect.command {
            Command::Reconfigure { to, .. } if !fails => {
                self.design = Some(to.clone());
                reports.push(answer("acknowledged"));
            }
            Command::Reconfigure { .. } => reports.push(answer("reconfiguration_failed")),
            Command::Request { .. } => {
                reports.push(answer("acknowledged"));
                if effect.action > self.begun {
                    self.begun = effect.action;
                    self.action = Some(Action { number: effect.action, done: 0, suspended: false });
                    reports.push(json!({ "event": "action_started", "action": effect.action }));
                }
            }
            command => {
                reports.push(answer("acknowledged"));
                let own = self.action.as_mut().filter(|own| own.number == effect.action);
                match (command, own) {
                    (Command::Suspend { .. }, Some(own)) => own.suspended = true,
                    (Command::Resume, Some(own)) => own.suspended = false,
                    (Command::Cancel { .. }, Some(_)) => {
                        self.action = None;
                        reports.push(json!({ "event": "action_cancelled", "action": effect.action }));
                    }
                    (Command::Cancel { .. }, None) => {
                        // It never begins any more.
                        self.begun = self.begun.max(effect.action);
                        if !self.said.iter().any(|said| said["action"] == effect.action && is_end(said)) {
                            reports.push(json!({ "event": "action_cancelled", "action": effect.action }));
                        }
                    }
                    _ => {}
                }
            }
        }
        self.said.extend(reports.iter().cloned());
        reports
    }

    /// Works for a while; `fails` for an action that fails now. Returns what it reports.
    pub fn work(&mut self, fails: bool) -> Vec<Value> {
        let Some(action) = self.action.as_mut().filter(|own| !own.suspended || fails) else {
            return Vec::new();
        };
        action.done += 1;
        let number = action.number;
        let report = if fails {
            json!({ "event": "action_failed", "action": number })
        } else if action.done >= 4 {
            json!({ "event": "action_succeeded", "action": number })
        } else {
            let fraction = f64::from(action.done) / 4.0;
            return vec![json!({ "event": "action_progress", "action": number, "fraction": fraction })];
        };
        self.action = None;
        self.said.push(report.clone());
        vec![report]
    }

    /// A component's status as it is.
    pub fn status(&self, component: &str) -> Value {
        let status = if self.failed.contains(component) { "FALSE" } else { "TRUE" };
        json!({ "event": "component_status", "component": component, "status": status })
    }

    /// Everything that was said last of each thing, for a robot that makes up for what was lost.
    pub fn again(&self) -> Vec<Value> {
        let mut reports: Vec<Value> = COMPONENTS.iter().map(|component| self.status(component)).collect();
        reports.extend(self.said.iter().filter(|said| said["event"] != "action_started").cloned());
        reports
            .push(json!({ "event": "configuration_observed", "function": FUNCTION, "design": self.design }));
        reports
    }
}

fn is_end(said: &Value) -> bool {
    let kind = said["event"].as_str().unwrap_or_default();
    ["action_succeeded", "action_failed", "action_cancelled"].contains(&kind)
}
