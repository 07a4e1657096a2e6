//! Planning in parallel to the loop: a copy of the loop plans on another thread while the loop reacts to observations.
//!
//! The copy records each planning problem (*question*) with its outcome. The loop then uses the recorded outcomes
//! without a search, provided that no observation has changed the question in the meantime. Progress of the action
//! under way, ticks, and repeated reports do not change the question. After such progress, however, the plan is no
//! longer reported as optimal. Late plans can be used, too, if they fit the situation.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use planner::Limits;

use crate::mapek::answer::Answer;
use crate::mapek::ask::Outcome;
use crate::mapek::control::Loop;
use crate::mapek::event::{Event, Observation};
use crate::mapek::memo::StoredQuestion;

/// A copy of an adaptation loop that computes plans on another thread.
#[derive(Debug)]
pub struct Thinker {
    control: Loop,
    limits: Limits,
}

/// Plans computed by a [`Thinker`].
#[derive(Debug)]
pub struct Thoughts {
    question: u64,
    answers: Vec<(StoredQuestion, Outcome)>,
    /// Whether planning was interrupted, so that the plans must not be used.
    is_stopped: bool,
}

impl Thinker {
    /// Returns the flag that interrupts planning once it is set to `true`.
    pub fn stop(&self) -> Arc<AtomicBool> {
        self.limits.interrupt()
    }

    /// Computes the plans for the pending decisions of the copied loop. [`Loop::deliberate_with`] applies them to the
    /// loop.
    pub fn think(mut self) -> Thoughts {
        self.control.planner.question_log = Some(Vec::new());
        self.control.deliberate();
        let answers = self.control.planner.question_log.take().unwrap_or_default();
        Thoughts { question: self.control.question, answers, is_stopped: self.limits.reached() }
    }
}

impl Loop {
    /// Copies the loop for planning on another thread.
    pub fn thinker(&self) -> Thinker {
        let (mut control, limits) = (self.clone(), Limits::none());
        control.planner.limits = limits.clone();
        Thinker { control, limits }
    }

    /// Returns `true` if `thoughts` are plans for the loop's current planning problem, and planning was not
    /// interrupted.
    pub fn is_answered_by(&self, thoughts: &Thoughts) -> bool {
        !thoughts.is_stopped && thoughts.question == self.question
    }

    /// Returns `true` if an observation mentions an action or an effect whose number has not been used in a request
    /// yet.
    pub fn is_ahead(&self, observation: &Observation) -> bool {
        let beliefs = self.beliefs();
        observation.events.iter().flatten().any(|event| match event {
            Event::Started { action }
            | Event::Succeeded { action }
            | Event::Failed { action, .. }
            | Event::Cancelled { action }
            | Event::Progress { action, .. } => *action > beliefs.actions,
            Event::Acknowledged { effect } | Event::ReconfigurationFailed { effect } => {
                *effect > beliefs.effects
            }
            _ => false,
        })
    }

    /// Returns the number of the current planning problem. Plans for another number are obsolete.
    pub fn question(&self) -> u64 {
        self.question
    }

    /// Runs [`Loop::deliberate`] if no search is necessary. Otherwise returns `None`, and the loop is unchanged.
    pub fn deliberate_at_once(&mut self) -> Option<Vec<Answer>> {
        if !self.has_agenda() {
            return Some(Vec::new());
        }
        let before = self.checkpoint();
        self.planner.forbids_search = true;
        let answers = self.deliberate();
        self.planner.forbids_search = false;
        if std::mem::take(&mut self.planner.is_missing) {
            self.roll_back(before);
            return None;
        }
        Some(answers)
    }

    /// Runs [`Loop::deliberate`] with the plans in `thoughts`. Returns `None` and leaves the loop unchanged if planning
    /// was interrupted, or if a plan is missing or does not fit the situation. Unless `is_late` is `true`, this is also
    /// the case if the planning problem has changed since.
    pub fn deliberate_with(&mut self, thoughts: Thoughts, is_late: bool) -> Option<Vec<Answer>> {
        if thoughts.is_stopped || !self.is_answered_by(&thoughts) && !is_late {
            return None;
        }
        // A checkpoint covers only changes before the first plan. Therefore, the whole loop is copied.
        let before = self.clone();
        self.planner.prepared = thoughts.answers.into();
        self.planner.forbids_search = true;
        let answers = self.deliberate();
        // A late plan may not fit the current situation.
        let misfits = || self.beliefs.plan.is_some() && self.beliefs.violation().is_some();
        if self.planner.is_missing || misfits() {
            *self = before;
            return None;
        }
        self.planner.forbids_search = false;
        self.planner.prepared.clear();
        Some(answers)
    }
}
