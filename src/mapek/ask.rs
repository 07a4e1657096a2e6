//! What the planner is asked, and what planning has come to.

use num_rational::BigRational;
use pddl::ast::Problem;
use serde_json::{Value, json};

use crate::mapek::beliefs::Running;
use crate::mapek::step::PlannedStep;
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
    /// Designs that are not available, by which alone there is none, if that is known; see [`planner::Replanner::blocking`].
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

impl Ask<'_> {
    /// The metric of the mission if it ended now; without a metric, 0.
    pub(super) fn metric(&self) -> Option<BigRational> {
        let zero = BigRational::default();
        if self.problem.metric.is_none() {
            return Some(zero);
        }
        pddl::validate::metric_after(self.mission.domain(), self.problem, &zero)
    }
}

impl Outcome {
    /// No plan.
    pub(super) fn none(proved: bool, because: String) -> Self {
        Self { steps: None, cost: BigRational::default(), proved, because, blocking: Vec::new() }
    }

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
