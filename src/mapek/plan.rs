//! Plan: the situation to a jointly optimal plan, proved, or to the reason why there is none.
//!
//! Plans that the journal has recorded are taken from there and not made again: a plan that was cut short by a time
//! limit would not come out twice.

use std::collections::VecDeque;
use std::time::Duration;

use encodings::pddl::ast::{Domain, Problem};
use encodings::{Config, Limits, Status, optimize};
use num_rational::BigRational;
use serde_json::{Value, json};

use super::number;
use super::step::PlannedStep;
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
}

impl Planner {
    /// The best plan for a filled problem of a mission, with this domain.
    pub fn plan(&mut self, mission: &Mission, domain: &Domain, problem: &Problem) -> Outcome {
        let recorded = self.recorded.pop_front();
        let outcome = recorded.unwrap_or_else(|| self.solve(mission, domain, problem));
        self.made.push(outcome.clone());
        outcome
    }

    fn solve(&self, mission: &Mission, domain: &Domain, problem: &Problem) -> Outcome {
        let mut limits = Limits::none();
        if let Some(time) = self.time_limit {
            limits = limits.with_time(time);
        }
        let none =
            |proved, because: String| Outcome { steps: None, cost: BigRational::default(), proved, because };
        let task = match mission.ground_with(domain, problem, &[], &limits) {
            Ok(task) => task,
            Err(messages) => {
                let texts: Vec<&str> = messages.iter().map(|message| message.message.as_str()).collect();
                return none(false, texts.join("; "));
            }
        };
        let config = Config { limits, ..Config::default() };
        let solution = optimize(&task, &config, &mut |_| {});
        match (solution.status, solution.plan) {
            (status, Some(plan)) => Outcome {
                cost: number::of_plan(plan.cost),
                steps: Some(plan.steps.iter().map(|step| PlannedStep::new(mission, step)).collect()),
                proved: status == Status::Optimal,
                because: String::new(),
            },
            (Status::Unsolvable, None) => none(true, "no plan reaches the goal".to_owned()),
            _ => none(false, "the time limit came before any plan".to_owned()),
        }
    }
}

impl Outcome {
    /// For the journal.
    pub fn to_record(&self) -> Value {
        let steps: Option<Vec<Value>> =
            self.steps.as_ref().map(|steps| steps.iter().map(PlannedStep::to_record).collect());
        json!([steps, self.cost.to_string(), self.proved, self.because])
    }

    /// The inverse of [`Outcome::to_record`].
    pub fn from_record(record: &Value) -> Option<Self> {
        let [steps, cost, proved, because] = record.as_array()?.as_slice() else { return None };
        let steps = match steps {
            Value::Null => None,
            steps => Some(steps.as_array()?.iter().map(PlannedStep::from_record).collect::<Option<_>>()?),
        };
        Some(Self {
            steps,
            cost: cost.as_str()?.parse().ok()?,
            proved: proved.as_bool()?,
            because: because.as_str()?.to_owned(),
        })
    }
}
