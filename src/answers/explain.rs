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

/// Changes that lead to another plan.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ChangesAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// The mission's name.
    mission: &'a str,
    /// Best plan in the current situation.
    best: BestPart<'a>,
    /// The smallest changes that lead to another plan.
    changes: Vec<ChangePart<'a>>,
    /// Whether all values were examined; if not, a plan was not proved to be the best, for example at
    /// a limit.
    complete: bool,
    /// Comparisons of measurements in rules that were not examined, in words.
    unexamined: &'a [String],
}

/// Explanation of one design.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct DesignAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// The mission's name.
    mission: &'a str,
    /// Best plan in the current situation.
    best: BestPart<'a>,
    /// The design.
    design: &'a str,
    /// Functions that the design solves.
    functions: &'a [String],
    /// Whether the design is available.
    available: bool,
    /// Rules and facts that rule the design out, and reasons why some actions could not use it even if it
    /// were available.
    because: &'a [String],
    /// Steps of the best plan that use the design, from 1.
    used: &'a [usize],
    /// Best plan in which only this design provides its functions, as if it were available.
    alone: BestPart<'a>,
    /// Best plan without the design.
    without: BestPart<'a>,
    /// The changes of all sets in `repairs`, each once and with the best plan after this change alone.
    changes: Vec<ChangePart<'a>>,
    /// Failed components and measurements that contribute to ruling the design out.
    causes: Vec<CausePart<'a>>,
    /// If the design is unavailable: sets of changes that make it available; some may be missing if
    /// there are many. Otherwise: single changes, each of which makes it unavailable. The changes
    /// of a set suffice together, and none of them was found to be superfluous.
    repairs: Vec<RepairPart<'a>>,
    /// Whether each plan of this answer is proved optimal, or proved not to exist. False, for example,
    /// if a limit was reached or reasoning failed.
    complete: bool,
    /// Changes of the situation that were not examined, in words.
    unexamined: &'a [String],
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct BestPart<'a> {
    /// Metric of the plan; null without a plan.
    #[schemars(with = "Option<f64>")]
    cost: Option<Value>,
    /// Whether it is proved that the plan is optimal, or that no plan exists.
    proved: bool,
    /// Steps of the plan.
    steps: &'a [PlannedStep],
}

/// A change of the situation.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct AlterationPart<'a> {
    /// The changed attribute, function of the problem, or component.
    name: &'a str,
    /// Current value; null for components.
    #[schemars(with = "Option<f64>")]
    from: Option<Value>,
    /// `at_least`, `at_most`, `above` or `below` the bound; `failed` or `recovered`.
    relation: &'static str,
    /// Bound that the value has to reach or cross; null for components.
    #[schemars(with = "Option<f64>")]
    bound: Option<Value>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ChangePart<'a> {
    #[serde(flatten)]
    alteration: AlterationPart<'a>,
    /// Maximum error of the bound; null if it is exact.
    #[schemars(with = "Option<f64>")]
    within: Option<Value>,
    /// Whether this change alone changes the availability of the design or, without a design, the
    /// plan.
    suffices: bool,
    /// Best plan after this change.
    then: BestPart<'a>,
}

/// A contribution to ruling a design out.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct CausePart<'a> {
    #[serde(flatten)]
    alteration: AlterationPart<'a>,
    /// Rules and facts that rule the design out even after the other changes of a set in `repairs`.
    because: &'a [String],
}

/// A set of changes that together change the availability of the design.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct RepairPart<'a> {
    /// The changes. Together they suffice, and none of them was found to be superfluous.
    changes: Vec<AlterationPart<'a>>,
    /// Best plan after these changes.
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
            unexamined: &found.unexamined,
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
            unexamined: &availability.unexamined,
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
