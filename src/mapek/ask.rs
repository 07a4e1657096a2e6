//! Planning problem of the loop (*question*), and outcome of planning.

use num_rational::BigRational;
use pddl::ast::Problem;
use serde_json::{Value, json};

use crate::mapek::beliefs::Running;
use crate::mapek::step::PlannedStep;
use crate::mission::Mission;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outcome {
    pub steps: Option<Vec<PlannedStep>>,
    /// Metric of the plan; without meaning if there is no plan.
    pub cost: BigRational,
    /// Whether the plan is proved optimal, or its absence is proved.
    pub proved: bool,
    /// Whether the absence of a plan was proved before the latest progress of the action under way.
    pub was_proved: bool,
    pub because: String,
    /// Unavailable designs that block every plan. Empty if not computed, or if there is no plan even with all designs;
    /// see [`planner::Replanner::blocking`].
    pub blocking: Vec<String>,
}

#[derive(Debug)]
pub(crate) struct Question<'a> {
    pub mission: &'a Mission,
    pub problem: &'a Problem,
    /// The text of the goal; `None` for the goal of the mission.
    pub goal: Option<&'a str>,
    /// The action under way, if every plan must begin with its remainder.
    pub running: Option<&'a Running>,
    /// Remaining steps of the current plan; `None` without a plan, or if the action under way is treated as cancelled.
    pub old: Option<&'a [PlannedStep]>,
    /// Whether to prefer, among optimal plans of equal length, one that shares most steps with `old`.
    pub stay_close: bool,
}

impl Question<'_> {
    /// Returns the value of the metric for the empty plan; 0 without a metric, and `None` if the value is undefined.
    pub(super) fn metric(&self) -> Option<BigRational> {
        let zero = BigRational::default();
        if self.problem.metric.is_none() {
            return Some(zero);
        }
        pddl::validate::metric_after(self.mission.domain(), self.problem, &zero)
    }
}

impl Outcome {
    pub(super) fn no_plan(proved: bool, because: String) -> Self {
        let (cost, blocking) = (BigRational::default(), Vec::new());
        Self { steps: None, cost, proved, was_proved: false, because, blocking }
    }

    pub fn to_record(&self) -> Value {
        let steps: Option<Vec<Value>> =
            self.steps.as_ref().map(|steps| steps.iter().map(PlannedStep::to_record).collect());
        let mut record = json!([steps, self.cost.to_string(), self.proved, self.because, self.blocking]);
        if let (true, Value::Array(fields)) = (self.was_proved, &mut record) {
            fields.push(json!(true));
        }
        record
    }

    pub fn from_record(record: &Value) -> Option<Self> {
        let [steps, cost, proved, because, blocking, was_proved @ ..] = record.as_array()?.as_slice() else {
            return None;
        };
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
            was_proved: was_proved.first().and_then(Value::as_bool).unwrap_or_default(),
            because: because.as_str()?.to_owned(),
            blocking: texts(blocking)?,
        })
    }
}
