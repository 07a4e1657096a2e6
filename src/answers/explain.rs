//! JSON answers of `metaplan explain`.

use num_rational::BigRational;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use crate::explain::{
    Alteration, BestPlan, Cause, Change, DesignExplanation, Repair, SmallestChanges, Target,
};
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
    /// Whether these are all; if not, a limit was reached.
    complete: bool,
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
    /// Single changes that have a part in whether it is available.
    changes: Vec<ChangePart<'a>>,
    /// Each failed component and each measurement that has a part in ruling it out.
    causes: Vec<CausePart<'a>>,
    /// If it is not available, the smallest sets of changes that make it available; else the changes that make it unavailable. Each suffices if all
    /// of its changes come true together, and not without one of them.
    repairs: Vec<RepairPart<'a>>,
    /// Whether all plans of this answer are proved; if not, a limit was reached.
    complete: bool,
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

/// What is otherwise than it is now.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct AlterationPart<'a> {
    /// What changes: an attribute, a function of the problem, or a component.
    name: &'a str,
    /// Its value now; null for components.
    #[schemars(with = "Option<f64>")]
    from: Option<Value>,
    /// `at_least`, `at_most`, `above` or `below` the bound; `failed` or `recovered`.
    relation: &'static str,
    /// The value from which on it has come true; null for components.
    #[schemars(with = "Option<f64>")]
    bound: Option<Value>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ChangePart<'a> {
    #[serde(flatten)]
    alteration: AlterationPart<'a>,
    /// How far the bound may be from the exact one; null if it is exact.
    #[schemars(with = "Option<f64>")]
    within: Option<Value>,
    /// Whether the design is available, or is so no more, if this change alone comes true.
    suffices: bool,
    /// The best plan in that case.
    then: BestPart<'a>,
}

/// Something that has a part in ruling a design out.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct CausePart<'a> {
    #[serde(flatten)]
    alteration: AlterationPart<'a>,
    /// The rules and facts by which the design is ruled out, whatever else is repaired.
    because: &'a [String],
}

/// Changes that have to come true together.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct RepairPart<'a> {
    /// All of them.
    changes: Vec<AlterationPart<'a>>,
    /// The best plan then.
    then: BestPart<'a>,
}

impl<'a> ChangesAnswer<'a> {
    /// Answer with the smallest changes that lead to another plan.
    pub fn new(mission: &'a str, found: &'a SmallestChanges) -> Self {
        Self {
            format: FORMAT,
            mission,
            best: BestPart::of(&found.best),
            changes: found.changes.iter().map(ChangePart::of).collect(),
            complete: found.complete,
        }
    }
}

impl<'a> DesignAnswer<'a> {
    /// Answer that compares a design with the best plan.
    pub fn new(mission: &'a str, found: &'a DesignExplanation) -> Self {
        let availability = &found.availability;
        Self {
            format: FORMAT,
            mission,
            best: BestPart::of(&found.best),
            design: &availability.design,
            functions: &availability.functions,
            available: availability.available,
            because: &availability.because,
            used: &found.used,
            alone: BestPart::of(&found.alone),
            without: BestPart::of(&found.without),
            changes: found.changes.iter().map(ChangePart::of).collect(),
            causes: availability.causes.iter().map(CausePart::of).collect(),
            repairs: found.repairs.iter().map(RepairPart::of).collect(),
            complete: found.complete,
        }
    }
}

impl<'a> BestPart<'a> {
    fn of(plan: &'a BestPlan) -> Self {
        Self { cost: plan.cost.as_ref().map(to_json), proved: plan.proved, steps: &plan.steps }
    }
}

impl<'a> AlterationPart<'a> {
    fn of(alteration: &'a Alteration) -> Self {
        let (relation, bound): (_, Option<&BigRational>) = match &alteration.to {
            Target::AtLeast(bound) => ("at_least", Some(bound)),
            Target::AtMost(bound) => ("at_most", Some(bound)),
            Target::Above(bound) => ("above", Some(bound)),
            Target::Below(bound) => ("below", Some(bound)),
            Target::Recovered => ("recovered", None),
            Target::Failed => ("failed", None),
        };
        let from = alteration.from.as_ref().map(to_json);
        Self { name: &alteration.name, from, relation, bound: bound.map(to_json) }
    }
}

impl<'a> ChangePart<'a> {
    fn of(change: &'a Change) -> Self {
        Self {
            alteration: AlterationPart::of(&change.alteration),
            within: change.within.as_ref().map(to_json),
            suffices: change.suffices,
            then: BestPart::of(&change.then),
        }
    }
}

impl<'a> CausePart<'a> {
    fn of(cause: &'a Cause) -> Self {
        Self { alteration: AlterationPart::of(&cause.alteration), because: &cause.because }
    }
}

impl<'a> RepairPart<'a> {
    fn of(repair: &'a Repair) -> Self {
        let changes = repair.alterations.iter().map(AlterationPart::of).collect();
        Self { changes, then: BestPart::of(&repair.then) }
    }
}
