//! Whether the action under way goes on, is suspended, or is cancelled, when it cannot stay as it is.
//!
//! To cancel an action is to lose what it has done so far, so that it is weighed against going on. The rest of the mission is
//! planned twice: with what is left of the action as its first step, and as though the action had been cancelled. The
//! action is cancelled where nothing goes on with it, or where the mission is better without it by more than the
//! minimum benefit. Where there is neither plan, cancelling would gain nothing and lose what was done: the action is
//! suspended, and goes on when its designs, or others, are back. Robots that cannot suspend an action say that it was
//! cancelled.

use num_rational::BigRational;
use pddl::ast::Direction;

use super::Loop;
use super::answer::{Answer, Command};
use super::knowledge::Running;
use super::number;
use super::plan::Outcome;

impl Loop {
    /// Cancels or suspends the action under way if that is better than `going_on`, the plan that begins with what is left of
    /// it. Returns whether it did.
    pub(super) fn interrupt(&mut self, reason: &str, going_on: &Outcome, answers: &mut Vec<Answer>) -> bool {
        let Some(running) = self.knowledge.running.clone() else { return false };
        let is_possible = self.can_go_on(&running);
        if is_possible && (going_on.steps.is_some() || !going_on.proved) {
            return false;
        }
        let without = self.plan(false);
        match (&going_on.steps, &without.steps) {
            (Some(_), Some(_)) => match self.benefit(&going_on.cost, &without.cost) {
                Some(benefit) => {
                    let benefit = number::decimal(&benefit);
                    self.cancel(
                        running,
                        format!("{reason}; the mission is better without it by {benefit}"),
                        answers,
                    );
                    true
                }
                None => false,
            },
            (Some(_), None) => false,
            (None, Some(_)) => {
                let because = if is_possible { "no plan goes on with it" } else { "no other design serves" };
                self.cancel(running, format!("{reason}; {because}"), answers);
                true
            }
            (None, None) if is_possible => false,
            (None, None) => {
                self.suspend(running, reason, answers);
                let status = if without.proved { "unsolvable" } else { "unknown" };
                answers.push(Answer::PlanNone {
                    status,
                    because: without.because,
                    blocking: without.blocking,
                });
                true
            }
        }
    }

    /// By how much another metric is better than one; below zero if it is worse.
    pub(super) fn gain(&self, metric: &BigRational, other: &BigRational) -> BigRational {
        let declared = self.knowledge.mission.problem().metric.as_ref();
        let maximize = declared.is_some_and(|metric| metric.direction == Direction::Maximize);
        if maximize { other - metric } else { metric - other }
    }

    /// The same, if it is more than nothing and at least the minimum benefit.
    pub(super) fn benefit(&self, metric: &BigRational, other: &BigRational) -> Option<BigRational> {
        let is_enough =
            |gain: &BigRational| *gain > BigRational::default() && *gain >= self.settings.minimum_benefit;
        Some(self.gain(metric, other)).filter(is_enough)
    }

    /// Whether the designs of an action are available, and what is left of it can be done with them.
    fn can_go_on(&self, running: &Running) -> bool {
        let designs = running.step.configuration.iter();
        designs.into_iter().all(|(_, design)| self.is_available(design)) && self.obstacle(running).is_none()
    }

    fn cancel(&mut self, running: Running, because: String, answers: &mut Vec<Answer>) {
        self.knowledge.plan = None;
        self.effect(running.action, Command::Cancel { because }, answers);
        self.knowledge.running = Some(Running { cancelling: true, ..running });
    }

    fn suspend(&mut self, running: Running, reason: &str, answers: &mut Vec<Answer>) {
        self.knowledge.plan = None;
        self.knowledge.stuck = true;
        if running.suspended {
            return;
        }
        let because = format!("{reason}; no other design serves, and there is no plan without it");
        self.effect(running.action, Command::Suspend { because }, answers);
        self.knowledge.running = Some(Running { suspended: true, ..running });
    }

    /// Lets a suspended action go on.
    pub(super) fn resume_suspended(&mut self, running: &mut Running, answers: &mut Vec<Answer>) {
        if std::mem::take(&mut running.suspended) {
            self.effect(running.action, Command::Resume, answers);
        }
    }
}
