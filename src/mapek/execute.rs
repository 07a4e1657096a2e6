//! Execute (of MAPE-K): requests the actions of a plan one by one, each with its configuration (Algorithm 2 of the
//! paper, see [`crate::mapek`]).
//!
//! Before each request, the remaining plan is validated against the believed situation.

use std::collections::VecDeque;

use crate::mapek::adapt::{Adaptation, Need};
use crate::mapek::answer::Answer;
use crate::mapek::effects::{finish, request};

/// Requests the next action if none is under way, or ends the mission if no step remains and the goal holds. A plan
/// that is missing, or invalid in the believed situation, is replaced once. If the second plan is invalid, too,
/// planning pauses. Does nothing during a pause, after the goal was reached, or while conclusions are missing. Also
/// stops if a plan is missing and the planner may not search for it.
pub(super) fn execute(adaptation: &mut Adaptation<'_>, answers: &mut Vec<Answer>) {
    for attempt in 0..2 {
        let beliefs = &mut *adaptation.beliefs;
        let is_known = beliefs.fault.is_none();
        if adaptation.planner.is_missing
            || beliefs.running.is_some()
            || beliefs.stuck
            || beliefs.reached
            || !is_known
        {
            return;
        }
        let is_planned = beliefs.plan.is_some();
        let violation = beliefs.violation();
        let next = beliefs.plan.as_mut().filter(|_| violation.is_none());
        if let Some(mut step) = next.and_then(VecDeque::pop_front) {
            // The situation may have changed since the plan was made, without a reason to replan.
            beliefs.reassess(&mut step);
            request(beliefs, step, answers);
            return;
        }
        match violation {
            None => {
                finish(beliefs, answers);
                return;
            }
            Some(because) if attempt == 0 => {
                let because = if is_planned { because } else { "there is no plan".to_owned() };
                adaptation.replan(vec![because], Need::Must, answers);
            }
            Some(because) => {
                answers.push(Answer::PlanNone { status: "unknown", because, blocking: Vec::new() });
                beliefs.plan = None;
                beliefs.stuck = true;
            }
        }
    }
}
