//! The judge: knows the designs, the messages and the robot, and nothing of how the loop decides.

use std::collections::{BTreeMap, BTreeSet};

use metaplan::mapek::{Answer, Command, Effect, Loop, OverdueOutcome};
use serde_json::Value;

use crate::robot::{Action, Robot};
use crate::schedule::Message;
use crate::{DESIGNS, FUNCTION, GOAL};

/// Whatever the messages have said.
#[derive(Debug, Default)]
pub struct Judge {
    /// Components that have failed by the reports that were delivered to the loop.
    failed: BTreeSet<String>,
    /// Designs that the robot has refused, or the loop has given up.
    refused: BTreeSet<String>,
    /// Effects that the loop has asked for.
    asked: BTreeMap<u64, Effect>,
    /// Effects that a later one has superseded, and those of which the loop has an answer.
    superseded: BTreeSet<u64>,
    answered: BTreeSet<u64>,
    /// Effects that the loop has given up aloud.
    given_up: BTreeSet<u64>,
    /// Whether the loop may know no design of the function: a reconfiguration was given up, or the function was seen without one.
    is_design_unknown: bool,
    /// Whether the report that the robot has restarted was lost: then nobody can know that the function has no design.
    is_restart_unreported: bool,
    /// Actions of which the loop has heard the end.
    ended: BTreeSet<u64>,
    /// The last decision on plans, and whether the goal is reached.
    plan: Plan,
    /// Number of steps in a row in which the robot has moved with a forbidden design.
    forbidden: u64,
}

/// The last decision on plans.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
enum Plan {
    #[default]
    Open,
    Reached,
    None(&'static str),
}

impl Judge {
    /// Takes a line that was delivered to the loop.
    pub fn hear(&mut self, event: &Value, is_taken: bool) {
        let component = event["component"].as_str().unwrap_or_default().to_owned();
        match event["event"].as_str().unwrap_or_default() {
            _ if !is_taken => {}
            "component_status" if event["status"] == "FALSE" => {
                self.failed.insert(component);
            }
            "component_status" => {
                self.failed.remove(&component);
            }
            "acknowledged" => {
                self.answered.extend(event["effect"].as_u64());
            }
            "reconfiguration_failed" => {
                let effect = event["effect"].as_u64().unwrap_or_default();
                self.answered.insert(effect);
                self.refuse(effect);
                // The design before may be none.
                self.is_design_unknown = true;
            }
            "design_status" => {
                self.refused.remove(event["design"].as_str().unwrap_or_default());
            }
            "configuration_observed" => {
                self.is_design_unknown |= event["design"].is_null();
                self.is_restart_unreported = false;
            }
            "action_succeeded" | "action_failed" | "action_cancelled" => {
                self.ended.extend(event["action"].as_u64());
            }
            _ => {}
        }
    }

    /// The design of a reconfiguration cannot be had until the robot says that it can.
    fn refuse(&mut self, effect: u64) {
        if let Some(Command::Reconfigure { to, .. }) = self.asked.get(&effect).map(|own| &own.command) {
            self.refused.insert(to.clone());
        }
    }

    /// Takes a message that is lost.
    pub fn lose(&mut self, message: &Message) {
        self.is_restart_unreported |=
            matches!(message, Message::Event(event) if event["event"] == "configuration_observed");
    }

    /// Takes an answer of the loop.
    pub fn note(&mut self, answer: &Answer) {
        match answer {
            Answer::Effect(effect) => {
                self.superseded.extend(&effect.supersedes);
                self.asked.insert(effect.number, effect.clone());
                if matches!(effect.command, Command::Request { .. }) {
                    self.plan = Plan::Open;
                }
            }
            Answer::GoalReached => self.plan = Plan::Reached,
            Answer::PlanNone { status, .. } => self.plan = Plan::None(status),
            Answer::PlanFound { .. } => self.plan = Plan::Open,
            Answer::Overdue { effect, outcome, .. } => {
                if matches!(outcome, OverdueOutcome::Failed | OverdueOutcome::Cancelled) {
                    self.given_up.extend(*effect);
                    self.refuse(effect.unwrap_or_default());
                    self.is_design_unknown = true;
                }
            }
            _ => {}
        }
    }

    /// The component by whose failure a design is forbidden.
    fn forbids(&self, design: &str) -> Option<&'static str> {
        let components = DESIGNS.iter().find(|own| own.0 == design).map(|own| own.1).unwrap_or_default();
        components.iter().find(|component| self.failed.contains(**component)).copied()
    }

    /// (a) If all effects that are on their way or that the loop still waits for were carried out now, no action would move with a
    /// design that is forbidden by the reports delivered so far, or without one.
    pub fn intended_motion<'a>(
        &self,
        robot: &Robot,
        control: &Loop,
        messages: impl Iterator<Item = &'a Message>,
    ) -> Result<(), String> {
        let mut pending: BTreeMap<u64, &Effect> =
            control.beliefs().outstanding().map(|effect| (effect.number, effect)).collect();
        for message in messages {
            if let Message::Effect(effect) = message {
                pending.insert(effect.number, effect);
            }
        }
        // The loop cannot know of a refusal before its answer comes.
        let refused = self.asked.iter().filter(|(number, _)| robot.refused == Some(**number));
        pending.extend(refused.map(|(number, effect)| (*number, effect)));
        pending.retain(|number, _| !robot.seen.contains(number) || robot.refused == Some(*number));
        let mut robot_then = robot.clone();
        for (number, effect) in pending {
            let is_over = self.answered.contains(&number) || self.superseded.contains(&number);
            let is_moot =
                self.ended.contains(&effect.action) && !matches!(effect.command, Command::Reconfigure { .. });
            if !is_over && !is_moot {
                robot_then.carry_out(effect);
            }
        }
        let action = robot_then.action.as_ref().filter(|own| own.is_moving());
        let Some(action) = action.filter(|own| !self.ended.contains(&own.number)) else { return Ok(()) };
        let Some(design) = &robot_then.design else {
            return Err(format!("(a) action {} goes on without a design", action.number));
        };
        match self.forbids(design) {
            Some(component) => {
                Err(format!("(a) action {} goes on with {design}, which needs {component}", action.number))
            }
            None => Ok(()),
        }
    }

    /// (a) The robot does not move with a forbidden design for longer than the bound, in steps.
    pub fn motion(&mut self, robot: &Robot, bound: Option<u64>) -> Result<(), String> {
        let is_moving = robot.action.as_ref().is_some_and(Action::is_moving);
        let forbidden = robot.design.as_ref().filter(|_| is_moving).and_then(|design| self.forbids(design));
        self.forbidden = if forbidden.is_some() { self.forbidden + 1 } else { 0 };
        match (forbidden, bound) {
            (Some(component), Some(bound)) if self.forbidden > bound => Err(format!(
                "(a) the robot has moved for {} steps with {:?}, which needs {component}",
                self.forbidden, robot.design
            )),
            _ => Ok(()),
        }
    }

    /// (b) Where no reconfiguration is pending, the design that the function is believed to have is the one that it has.
    pub fn configuration<'a>(
        &self,
        robot: &Robot,
        control: &Loop,
        mut messages: impl Iterator<Item = &'a Message>,
    ) -> Result<(), String> {
        let beliefs = control.beliefs();
        let is_on_its_way = messages.any(|message| match message {
            Message::Effect(effect) => {
                matches!(effect.command, Command::Reconfigure { .. }) && !robot.seen.contains(&effect.number)
            }
            Message::Event(event) => {
                let is_about_designs = ["acknowledged", "reconfiguration_failed", "configuration_observed"];
                is_about_designs.iter().any(|kind| event["event"] == *kind)
            }
        });
        if is_on_its_way || beliefs.is_unsettled(FUNCTION) || self.is_restart_unreported {
            return Ok(());
        }
        match beliefs.configuration().get(FUNCTION) {
            None if self.is_design_unknown || robot.design.is_none() => Ok(()),
            believed if believed == robot.design.as_ref() => Ok(()),
            believed => Err(format!("(b) believed {believed:?}, actual {:?}", robot.design)),
        }
    }

    /// (c) Each effect was carried out, superseded, about an action that has ended, or given up aloud. (d) The goal is reached, or
    /// there is no plan.
    pub fn at_the_end(&self, robot: &Robot) -> Result<(), String> {
        let is_open = |(number, effect): &(&u64, &Effect)| {
            let is_moot =
                self.ended.contains(&effect.action) && !matches!(effect.command, Command::Reconfigure { .. });
            let is_closed = robot.seen.contains(number)
                || self.superseded.contains(number)
                || self.given_up.contains(number);
            !is_closed && !is_moot
        };
        let open: Vec<&u64> = self.asked.iter().filter(is_open).map(|(number, _)| number).collect();
        if !open.is_empty() {
            return Err(format!("(c) effects {open:?} were neither carried out nor given up"));
        }
        let mut designs = DESIGNS.iter().map(|(design, _)| *design);
        let is_possible =
            designs.any(|design| self.forbids(design).is_none() && !self.refused.contains(design));
        match self.plan {
            Plan::Reached if robot.place == GOAL && robot.action.is_none() => Ok(()),
            Plan::Reached => Err(format!("(d) the goal is reached, but the robot is at {}", robot.place)),
            // The same step has failed three times in a row; it is not tried again until something changes.
            Plan::None("failed") => Ok(()),
            Plan::None("unsolvable") if !is_possible => Ok(()),
            plan => Err(format!("(d) the last decision is {plan:?}; a plan is possible: {is_possible}")),
        }
    }
}
