//! Plan: the situation to a jointly optimal plan, proved, or to the reason why there is none.
//!
//! Plans that the journal has recorded are taken from there and not made again: a plan that was cut short by a time
//! limit would not come out twice.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::time::Duration;

use planner::{Config, Limits, Status, optimize};

use crate::mapek::ask::{Ask, Outcome};
use crate::mapek::live::Live;
use crate::mapek::memo::{Asked, Memo};
use crate::mapek::resume::{resume, resumed_goal};
use crate::mapek::step::PlannedStep;
use crate::mapek::watch::Watch;
use crate::mission::ground_with;
use crate::number;

/// Upper limit on how often the time limit of a search is doubled.
const MAX_DOUBLINGS: u32 = 3;

/// Makes plans.
#[derive(Debug, Clone, Default)]
pub(crate) struct Planner {
    /// How long one plan may take.
    pub time_limit: Option<Duration>,
    /// Number of searches in a row that were cut short: the time limit doubles with each.
    pub attempt: u32,
    /// Limits at which all planning ends.
    pub limits: Limits,
    /// Plans that were made before, to be used again in this order.
    pub recorded: VecDeque<Outcome>,
    /// Plans made since the last look.
    pub made: Vec<Outcome>,
    /// Whether plans are made only where no search is needed for them.
    pub is_idle: bool,
    /// Whether a plan was needed that would have taken a search.
    pub is_missing: bool,
    /// The questions that were asked since the last look, if they are kept, with the answers.
    pub asked: Option<Vec<(Asked, Outcome)>>,
    /// Questions that were answered elsewhere, in the order in which they come up.
    pub prepared: VecDeque<(Asked, Outcome)>,
    /// What is kept from one plan to the next.
    pub live: Live,
    /// Plans of situations that may come back.
    pub memo: Memo,
    /// Who looks on.
    pub watch: Watch,
}

impl Planner {
    /// The best plan for a situation.
    pub fn plan(&mut self, ask: &Ask<'_>) -> Outcome {
        let recorded = self.recorded.pop_front().or_else(|| self.prepared(ask));
        let known = recorded.or_else(|| self.memo.recall(ask));
        if known.is_none() && self.is_idle {
            self.is_missing = true;
            return Outcome::none(false, "no plan was looked for".to_owned());
        }
        let outcome = known.unwrap_or_else(|| self.solve(ask));
        if let Some(asked) = &mut self.asked {
            asked.push((Asked::new(ask), outcome.clone()));
        }
        self.made.push(outcome.clone());
        outcome
    }

    /// The answer that was found elsewhere. Time has passed since, and the action under way has gone on: then the plan serves, but is
    /// not proved to be the best.
    fn prepared(&mut self, ask: &Ask<'_>) -> Option<Outcome> {
        let (asked, mut outcome) = self.prepared.pop_front()?;
        if !asked.is_about(ask) {
            return None;
        }
        if asked.is(ask) {
            self.memo.note(ask, &outcome);
        } else {
            outcome.proved = false;
        }
        Some(outcome)
    }

    fn solve(&mut self, ask: &Ask<'_>) -> Outcome {
        let time_limit =
            self.time_limit.map(|time| time.saturating_mul(1 << self.attempt.min(MAX_DOUBLINGS)));
        let limits = time_limit.map_or_else(|| self.limits.clone(), |time| self.limits.within(time));
        self.watch.begin();
        let outcome = self
            .live
            .plan(ask, &limits, &self.watch)
            .unwrap_or_else(|| from_scratch(ask, limits, &self.watch));
        self.watch.end();
        self.memo.note(ask, &outcome);
        outcome
    }
}

/// The best plan of a task that is ground for it alone.
pub(super) fn from_scratch(ask: &Ask<'_>, limits: Limits, watch: &Watch) -> Outcome {
    let none = Outcome::none;
    let (mut domain, mut problem) = (Cow::Borrowed(ask.mission.domain()), Cow::Borrowed(ask.problem));
    if let Some(running) = ask.running {
        domain = Cow::Owned(resume(&domain, &running.step, &running.progress));
        let goal = resumed_goal(&problem.goal);
        problem.to_mut().goal = goal;
    }
    let task = match ground_with(ask.mission, &domain, &problem, &[], &limits) {
        Ok(task) => task,
        Err(messages) => {
            let texts: Vec<&str> = messages.iter().map(|message| message.message.as_str()).collect();
            return none(false, texts.join("; "));
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
            steps: Some(plan.steps.iter().map(|step| PlannedStep::new(ask.mission, step)).collect()),
            proved: status == Status::Optimal,
            because: String::new(),
            blocking: Vec::new(),
        },
        (Status::Unsolvable, None) => none(true, "no plan reaches the goal".to_owned()),
        _ => none(false, "the time limit came before any plan".to_owned()),
    }
}
