//! Plan: the situation to a jointly optimal plan, proved, or to the reason why there is none.
//!
//! Plans that the journal has recorded are taken from there and not made again: a plan that was cut short by a time
//! limit would not come out twice.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::time::Duration;

use encodings::{Config, Limits, Status, optimize};
use num_rational::BigRational;
use pddl::ast::Problem;
use serde_json::{Value, json};

use super::knowledge::Running;
use super::live::Live;
use super::memo::Memo;
use super::number;
use super::resume::{resume, resumed_goal};
use super::step::PlannedStep;
use super::watch::Watch;
use crate::mission::Mission;

/// What planning has come to.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outcome {
    /// The plan.
    pub steps: Option<Vec<PlannedStep>>,
    /// Its metric.
    pub cost: BigRational,
    /// Whether the status is proved.
    pub proved: bool,
    /// Why there is no plan.
    pub because: String,
    /// Designs that are not available, by which alone there is none, if that is known; see [`encodings::Replanner::blocking`].
    pub blocking: Vec<String>,
}

/// What is to be planned for.
#[derive(Debug)]
pub(crate) struct Ask<'a> {
    pub mission: &'a Mission,
    /// The problem as it is believed, with what the knowledge base contributes.
    pub problem: &'a Problem,
    /// The action that comes first, if one is under way.
    pub running: Option<&'a Running>,
    /// The plan at hand, if what is planned for goes on from where it is.
    pub old: Option<&'a [PlannedStep]>,
    /// Whether to stay close to it among plans that are as good.
    pub stay_close: bool,
}

/// Makes plans.
#[derive(Debug, Clone, Default)]
pub(crate) struct Planner {
    /// How long one plan may take.
    pub time_limit: Option<Duration>,
    /// Plans that were made before, to be used again in this order.
    pub recorded: VecDeque<Outcome>,
    /// Plans made since the last look.
    pub made: Vec<Outcome>,
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
        let recorded = self.recorded.pop_front();
        let outcome = recorded.or_else(|| self.memo.recall(ask)).unwrap_or_else(|| self.solve(ask));
        self.made.push(outcome.clone());
        outcome
    }

    fn solve(&mut self, ask: &Ask<'_>) -> Outcome {
        let limits = self.time_limit.map_or_else(Limits::none, |time| Limits::none().with_time(time));
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
    let none = |proved, because: String| Outcome {
        steps: None,
        cost: BigRational::default(),
        proved,
        because,
        blocking: Vec::new(),
    };
    let (mut domain, mut problem) = (Cow::Borrowed(ask.mission.domain()), Cow::Borrowed(ask.problem));
    if let Some(running) = ask.running {
        domain = Cow::Owned(resume(&domain, &running.step, &running.progress));
        let goal = resumed_goal(&problem.goal);
        problem.to_mut().goal = goal;
    }
    let task = match ask.mission.ground_with(&domain, &problem, &[], &limits) {
        Ok(task) => task,
        Err(messages) => {
            let texts: Vec<&str> = messages.iter().map(|message| message.message.as_str()).collect();
            return none(false, texts.join("; "));
        }
    };
    let config = Config { limits, ..Config::default() };
    let mut report = |better: encodings::Improvement| {
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

impl Outcome {
    /// For the journal.
    pub fn to_record(&self) -> Value {
        let steps: Option<Vec<Value>> =
            self.steps.as_ref().map(|steps| steps.iter().map(PlannedStep::to_record).collect());
        json!([steps, self.cost.to_string(), self.proved, self.because, self.blocking])
    }

    /// The inverse of [`Outcome::to_record`].
    pub fn from_record(record: &Value) -> Option<Self> {
        let [steps, cost, proved, because, blocking] = record.as_array()?.as_slice() else { return None };
        let text = |value: &Value| value.as_str().map(ToOwned::to_owned);
        let texts = |value: &Value| value.as_array()?.iter().map(text).collect::<Option<Vec<_>>>();
        let steps = match steps {
            Value::Null => None,
            steps => Some(steps.as_array()?.iter().map(PlannedStep::from_record).collect::<Option<_>>()?),
        };
        Some(Self {
            steps,
            cost: cost.as_str()?.parse().ok()?,
            proved: proved.as_bool()?,
            because: because.as_str()?.to_owned(),
            blocking: texts(blocking)?,
        })
    }
}
