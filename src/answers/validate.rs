//! JSON answer of `metaplan validate`.

use num_rational::BigRational;
use pddl::validate::{Unmet, Verdict, Violation};
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value};

use crate::number::to_json;

const FORMAT: &str = "metaplan-verdict/1";

/// Validity of a plan, with its cost or its first violation.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct VerdictAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// Whether the plan is executable, reaches the goal, and satisfies all mandatory constraints.
    valid: bool,
    /// Value of the metric after a valid plan; null without `:metric`, or if it is undefined.
    #[schemars(with = "Option<f64>")]
    metric: Option<Value>,
    /// Sum of the durations; with `--concurrent`, the time of the last start or end of an action.
    /// In the domain's time unit.
    #[schemars(with = "f64")]
    total_time: Value,
    /// Value of each numeric function that actions can change, with its arguments, after the last executed step.
    /// Functions without a value are omitted.
    #[schemars(with = "std::collections::BTreeMap<String, Option<f64>>")]
    values: Map<String, Value>,
    /// First violation; null for a valid plan.
    violation: Option<ViolationPart<'a>>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ViolationPart<'a> {
    /// Number of the step, from 1; null for the goal and for constraints.
    step: Option<usize>,
    /// Action of the step; null for the goal and for constraints.
    action: Option<&'a str>,
    /// Time of the violation, in the domain's time unit.
    #[schemars(with = "f64")]
    time: Value,
    /// `unknown_action`, `unknown_object`, `arguments`, `duration`, `at_start`, `over_all`, `at_end`, `undefined`, `conflict`, `overlap`,
    /// `interference`, `goal` or `constraint`.
    kind: &'static str,
    /// Message, one sentence.
    message: &'a str,
    /// Conditions that do not hold.
    unmet: Vec<UnmetPart<'a>>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct UnmetPart<'a> {
    /// The condition, as PDDL.
    condition: &'a str,
    /// Value of each numeric function with its arguments; null if it is undefined.
    #[schemars(with = "std::collections::BTreeMap<String, Option<f64>>")]
    values: Map<String, Value>,
}

impl<'a> VerdictAnswer<'a> {
    /// Answer with the verdict of the validator.
    pub fn new(verdict: &'a Verdict) -> Self {
        let value = |(name, value): (&String, &BigRational)| (name.clone(), to_json(value));
        Self {
            format: FORMAT,
            valid: verdict.valid,
            metric: verdict.metric.as_ref().map(to_json),
            total_time: to_json(&verdict.total_time),
            values: verdict.values.iter().map(|(name, number)| value((name, number))).collect(),
            violation: verdict.violation.as_deref().map(ViolationPart::of),
        }
    }
}

impl<'a> ViolationPart<'a> {
    fn of(violation: &'a Violation) -> Self {
        Self {
            step: violation.step,
            action: violation.action.as_deref(),
            time: to_json(&violation.time),
            kind: violation.kind.as_str(),
            message: &violation.message,
            unmet: violation.unmet.iter().map(UnmetPart::of).collect(),
        }
    }
}

impl<'a> UnmetPart<'a> {
    fn of(unmet: &'a Unmet) -> Self {
        let values = unmet.values.iter();
        let values = values.map(|(name, value)| (name.clone(), value.as_ref().map_or(Value::Null, to_json)));
        Self { condition: &unmet.condition, values: values.collect() }
    }
}
