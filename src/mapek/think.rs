//! Planning beside the loop: a copy of the loop finds plans on another thread while the loop goes on reacting.
//!
//! The copy deliberates, and its questions are kept with their answers. The loop then deliberates itself with these answers, which
//! takes no search, provided that nothing has been observed meanwhile that makes another question of it. Progress of the action under
//! way, ticks and reports of what is known do not: the plan is then adopted without a claim that it is the best.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use planner::Limits;

use crate::mapek::answer::Answer;
use crate::mapek::ask::Outcome;
use crate::mapek::control::Loop;
use crate::mapek::event::{Event, Observation};
use crate::mapek::memo::Asked;

/// A copy of a loop that deliberates on another thread.
#[derive(Debug)]
pub struct Thinker {
    control: Loop,
    limits: Limits,
}

/// Plans that were found by a [`Thinker`].
#[derive(Debug)]
pub struct Thoughts {
    question: u64,
    answers: Vec<(Asked, Outcome)>,
    /// Whether planning was stopped: the plans are of no use.
    is_stopped: bool,
}

impl Thinker {
    /// The flag that makes planning stop soon when it is set.
    pub fn stop(&self) -> Arc<AtomicBool> {
        self.limits.interrupt()
    }

    /// Finds the plans that the loop needs to deliberate.
    pub fn think(mut self) -> Thoughts {
        self.control.planner.asked = Some(Vec::new());
        self.control.deliberate();
        let answers = self.control.planner.asked.take().unwrap_or_default();
        Thoughts { question: self.control.question, answers, is_stopped: self.limits.reached() }
    }
}

impl Loop {
    /// A copy that finds plans for what there is to deliberate on, as the loop is now.
    pub fn thinker(&self) -> Thinker {
        let (mut control, limits) = (self.clone(), Limits::none());
        control.planner.limits = limits.clone();
        Thinker { control, limits }
    }

    /// Returns `true` if what these plans were looked for is still what there is to deliberate on.
    pub fn is_answered_by(&self, thoughts: &Thoughts) -> bool {
        !thoughts.is_stopped && thoughts.question == self.question
    }

    /// Returns `true` if an observation is about an action or an effect that was not asked for yet.
    pub fn is_ahead(&self, observation: &Observation) -> bool {
        let known = self.beliefs();
        observation.events.iter().flatten().any(|event| match event {
            Event::Started { action }
            | Event::Succeeded { action }
            | Event::Failed { action, .. }
            | Event::Cancelled { action }
            | Event::Progress { action, .. } => *action > known.actions,
            Event::Acknowledged { effect } | Event::ReconfigurationFailed { effect } => {
                *effect > known.effects
            }
            _ => false,
        })
    }

    /// The number of the question: planning that began with another number is of no use.
    pub fn question(&self) -> u64 {
        self.question
    }

    /// As [`Loop::deliberate`], if no plan is needed for it that has to be searched for; nothing has changed otherwise.
    pub fn deliberate_at_once(&mut self) -> Option<Vec<Answer>> {
        if !self.has_agenda() {
            return Some(Vec::new());
        }
        let before = self.checkpoint();
        self.planner.is_idle = true;
        let answers = self.deliberate();
        self.planner.is_idle = false;
        if std::mem::take(&mut self.planner.is_missing) {
            self.roll_back(before);
            return None;
        }
        Some(answers)
    }

    /// As [`Loop::deliberate`], with plans that were found elsewhere; nothing has changed if they do not answer all that is asked, or
    /// do not fit the situation. With `is_late` they may be answers to a question that has changed since.
    pub fn deliberate_with(&mut self, thoughts: Thoughts, is_late: bool) -> Option<Vec<Answer>> {
        if thoughts.is_stopped || !self.is_answered_by(&thoughts) && !is_late {
            return None;
        }
        let before = self.clone();
        self.planner.prepared = thoughts.answers.into();
        self.planner.is_idle = true;
        let answers = self.deliberate();
        let misfits = || self.beliefs.plan.is_some() && self.beliefs.violation().is_some();
        if self.planner.is_missing || misfits() {
            *self = before;
            return None;
        }
        self.planner.is_idle = false;
        self.planner.prepared.clear();
        Some(answers)
    }
}
