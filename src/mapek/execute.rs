//! Execute: actions are requested one by one, each with its configuration: Algorithm 2 of the paper.
//!
//! Before each request the rest of the plan is validated against the state as it is believed.

use std::collections::VecDeque;

use crate::mapek::adapt::{Adapting, Need};
use crate::mapek::answer::Answer;
use crate::mapek::effects::{finish, request};

/// Requests the next action if none is under way. A plan that does not fit is replaced once; one that still does not fit is none.
pub(super) fn execute(adapting: &mut Adapting<'_>, answers: &mut Vec<Answer>) {
    for attempt in 0..2 {
        let beliefs = &mut *adapting.beliefs;
        let is_known = beliefs.fault.is_none();
        if adapting.planner.is_missing
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
        if let Some(step) = next.and_then(VecDeque::pop_front) {
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
                adapting.replan(vec![because], Need::Must, answers);
            }
            Some(because) => {
                answers.push(Answer::PlanNone { status: "unknown", because, blocking: Vec::new() });
                beliefs.plan = None;
                beliefs.stuck = true;
            }
        }
    }
}
