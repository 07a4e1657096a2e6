//! Plan (of MAPE-K): computes an optimal plan of actions and designs, or the best one found in time. Without a plan,
//! gives the reason for its absence.
//!
//! During replay, plans are read from the journal and not computed again, because a search that ends at a time limit is
//! not reproducible.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::time::Duration;

use planner::{Config, Limits, Status, optimize};

use crate::mapek::ask::{Outcome, Question};
use crate::mapek::live::Live;
use crate::mapek::memo::{Memo, StoredQuestion};
use crate::mapek::resume::{resume, resumed_goal};
use crate::mapek::step::PlannedStep;
use crate::mapek::watch::Watch;
use crate::mission::ground_with;
use crate::number;

const MAX_DOUBLINGS: u32 = 3;

/// Number of consecutive unusable results for changed problems after which the absence of a plan for a changed problem
/// is a reason for a decision. Otherwise, observations that change the problem all the time would prevent every
/// decision without a plan.
const MAX_LATE: u32 = 3;

#[derive(Debug, Clone, Default)]
pub(crate) struct Planner {
    pub time_limit: Option<Duration>,
    /// Number of earlier searches in the current series of scheduled repetitions. Each doubles the time limit, up to
    /// [`MAX_DOUBLINGS`] times.
    pub attempt: u32,
    /// Limits in addition to the time limit of one search.
    pub limits: Limits,
    pub recorded: VecDeque<Outcome>,
    /// Plans computed for the current decision, for the journal.
    pub computed: Vec<Outcome>,
    /// Whether searches are forbidden: only recorded, prepared and cached plans are used.
    pub forbids_search: bool,
    pub is_missing: bool,
    /// Planning problems of the current deliberation with their outcomes; `None` if they are not logged.
    pub question_log: Option<Vec<(StoredQuestion, Outcome)>>,
    pub prepared: Prepared,
    pub live: Live,
    pub memo: Memo,
    pub watch: Watch,
}

/// Outcomes that another thread has computed, and how the situation has changed since.
#[derive(Debug, Clone, Default)]
pub(crate) struct Prepared {
    /// Planning problems with their outcomes, in order.
    pub outcomes: VecDeque<(StoredQuestion, Outcome)>,
    /// Whether the number of the planning problem has changed since the outcomes were computed.
    pub is_late: bool,
    /// Whether the last outcome is about another situation than the question, from which the situation differs by more
    /// than progress of the action under way.
    pub is_outdated: bool,
    /// Whether an outcome with a plan was about another situation than the question.
    pub has_outdated_plan: bool,
    /// Number of consecutive earlier results for other planning problems that could not be used.
    pub late_results: u32,
}

impl Prepared {
    /// Returns `true` if the absence of a plan for another situation is a reason for a decision, because too many searches
    /// in a row have ended with outcomes for other situations.
    pub fn accepts_absence(&self) -> bool {
        self.is_late && self.late_results >= MAX_LATE
    }
}

impl Planner {
    /// Returns an outcome that is recorded (for replay), prepared by another thread, or cached. Otherwise searches for
    /// a plan. If searches are forbidden, sets `is_missing` and returns an outcome without a plan.
    pub fn plan(&mut self, question: &Question<'_>) -> Outcome {
        // Recorded and prepared outcomes have an order. Therefore, they are consumed even if the memo has the answer.
        let recorded = self.recorded.pop_front().or_else(|| self.next_prepared(question));
        let stored_outcome = recorded.or_else(|| self.memo.recall(question));
        if stored_outcome.is_none() && self.forbids_search {
            self.is_missing = true;
            return Outcome::no_plan(false, "no plan was looked for".to_owned());
        }
        let outcome = stored_outcome.unwrap_or_else(|| self.solve(question));
        if let Some(question_log) = &mut self.question_log {
            question_log.push((StoredQuestion::new(question), outcome.clone()));
        }
        self.computed.push(outcome.clone());
        outcome
    }

    /// Removes and returns the next outcome computed by another thread. Returns `None` without a next outcome, or if
    /// the outcome is about a different action under way. If the situation has changed, for example by progress of the
    /// action, the outcome no longer counts as proved. Progress alone is no reason to doubt that no plan continues the
    /// action, so the outcome states whether this was proved.
    fn next_prepared(&mut self, question: &Question<'_>) -> Option<Outcome> {
        let (answered, mut outcome) = self.prepared.outcomes.pop_front()?;
        if !answered.has_same_action(question) {
            return None;
        }
        if answered.equals(question) {
            self.memo.store(question, &outcome);
        } else {
            let prepared = &mut self.prepared;
            prepared.is_outdated = prepared.is_late || !answered.has_equal_start(question);
            prepared.has_outdated_plan |= outcome.steps.is_some();
            let was_proved = std::mem::take(&mut outcome.proved);
            if outcome.steps.is_none() {
                outcome.was_proved = was_proved && (!prepared.is_outdated || prepared.accepts_absence());
                "no plan was found for an earlier situation".clone_into(&mut outcome.because);
                outcome.blocking.clear();
            }
        }
        Some(outcome)
    }

    fn solve(&mut self, question: &Question<'_>) -> Outcome {
        let time_limit =
            self.time_limit.map(|time| time.saturating_mul(1 << self.attempt.min(MAX_DOUBLINGS)));
        let limits = time_limit.map_or_else(|| self.limits.clone(), |time| self.limits.within(time));
        self.watch.begin();
        let outcome = self
            .live
            .plan(question, &limits, &self.watch)
            .unwrap_or_else(|| from_scratch(question, limits, &self.watch));
        self.watch.end();
        self.memo.store(question, &outcome);
        outcome
    }
}

pub(super) fn from_scratch(question: &Question<'_>, limits: Limits, watch: &Watch) -> Outcome {
    let no_plan = Outcome::no_plan;
    let (mut domain, mut problem) =
        (Cow::Borrowed(question.mission.domain()), Cow::Borrowed(question.problem));
    if let Some(running) = question.running {
        let (resumed, with_changes) = resume(&domain, problem, &running.remainder());
        (domain, problem) = (Cow::Owned(resumed), with_changes);
        let goal = resumed_goal(&problem.goal);
        problem.to_mut().goal = goal;
    }
    let task = match ground_with(question.mission, &domain, &problem, &[], &limits) {
        Ok(task) => task,
        Err(messages) => {
            let texts: Vec<&str> = messages.iter().map(|message| message.message.as_str()).collect();
            return no_plan(false, texts.join("; "));
        }
    };
    let config = Config::default().with_limits(limits);
    let mut report = |better: planner::Improvement| {
        watch.improve(Some(number::of_plan(&better.cost)), number::of_plan(&better.lower_bound));
    };
    let solution = optimize(&task, &config, &mut report);
    match (solution.status, solution.plan) {
        (status, Some(plan)) => Outcome {
            cost: number::of_plan(&plan.cost),
            steps: Some(plan.steps.iter().map(|step| PlannedStep::new(question.mission, step)).collect()),
            proved: status == Status::Optimal,
            ..no_plan(false, String::new())
        },
        (Status::Unsolvable, None) => no_plan(true, "no plan reaches the goal".to_owned()),
        _ => no_plan(false, "no plan was found within the limits".to_owned()),
    }
}
