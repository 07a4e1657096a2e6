//! What `metaplan explain` answers.

use num_rational::BigRational;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use crate::explain::{BestPlan, Change, DesignExplanation, Target};
use crate::mapek::PlannedStep;
use crate::number::to_json;

const FORMAT: &str = "metaplan-explain/1";

/// What would change the plan.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ChangesAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// The mission's name.
    mission: &'a str,
    /// The best plan as things are.
    best: BestPart<'a>,
    /// The smallest changes that lead to another plan.
    changes: Vec<ChangePart<'a>>,
}

/// All about one design.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct DesignAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// The mission's name.
    mission: &'a str,
    /// The best plan as things are.
    best: BestPart<'a>,
    /// The design.
    design: &'a str,
    /// The functions that it solves.
    functions: &'a [String],
    /// Whether it is available.
    available: bool,
    /// The rules and facts that rule it out.
    because: &'a [String],
    /// Steps of the best plan that use it, from 1.
    used: &'a [usize],
    /// The best plan in which no other design solves its functions; as if it were available if it is not.
    alone: BestPart<'a>,
    /// The best plan that does not use it.
    without: BestPart<'a>,
    /// What would have to change for it to be available, or to be so no more.
    changes: Vec<ChangePart<'a>>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct BestPart<'a> {
    /// Its metric; null without a plan.
    #[schemars(with = "Option<f64>")]
    cost: Option<Value>,
    /// Whether it is proved to be the best, or that there is none.
    proved: bool,
    /// Its steps.
    steps: &'a [PlannedStep],
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ChangePart<'a> {
    /// What changes: an attribute, a function of the problem, or a component.
    name: &'a str,
    /// Its value now; null for components.
    #[schemars(with = "Option<f64>")]
    from: Option<Value>,
    /// `at_least`, `at_most`, `above` or `below` the bound; `failed` or `recovered`.
    relation: &'static str,
    /// The value from which on the plan is another one; null for components.
    #[schemars(with = "Option<f64>")]
    bound: Option<Value>,
    /// The best plan in that case.
    then: BestPart<'a>,
}

impl<'a> ChangesAnswer<'a> {
    /// The smallest changes that lead to another plan than the best.
    pub fn new(mission: &'a str, best: &'a BestPlan, changes: &'a [Change]) -> Self {
        Self {
            format: FORMAT,
            mission,
            best: BestPart::of(best),
            changes: changes.iter().map(ChangePart::of).collect(),
        }
    }
}

impl<'a> DesignAnswer<'a> {
    /// A design beside the best plan.
    pub fn new(mission: &'a str, best: &'a BestPlan, found: &'a DesignExplanation) -> Self {
        Self {
            format: FORMAT,
            mission,
            best: BestPart::of(best),
            design: &found.design,
            functions: &found.functions,
            available: found.available,
            because: &found.because,
            used: &found.used,
            alone: BestPart::of(&found.alone),
            without: BestPart::of(&found.without),
            changes: found.changes.iter().map(ChangePart::of).collect(),
        }
    }
}

impl<'a> BestPart<'a> {
    fn of(plan: &'a BestPlan) -> Self {
        Self { cost: plan.cost.as_ref().map(to_json), proved: plan.proved, steps: &plan.steps }
    }
}

impl<'a> ChangePart<'a> {
    fn of(change: &'a Change) -> Self {
        let (relation, bound): (_, Option<&BigRational>) = match &change.to {
            Target::AtLeast(bound) => ("at_least", Some(bound)),
            Target::AtMost(bound) => ("at_most", Some(bound)),
            Target::Above(bound) => ("above", Some(bound)),
            Target::Below(bound) => ("below", Some(bound)),
            Target::Recovered => ("recovered", None),
            Target::Failed => ("failed", None),
        };
        Self {
            name: &change.name,
            from: change.from.as_ref().map(to_json),
            relation,
            bound: bound.map(to_json),
            then: BestPart::of(&change.then),
        }
    }
}
