//! Parts of explanations: best plans, and the alterations of the situation that lead to them.

use num_rational::BigRational;

use crate::mapek::PlannedStep;

/// The best plan for a mission under some assumption, e.g. without a design.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct BestPlan {
    /// The metric of the best plan, in its unit. `None` without a plan.
    pub cost: Option<BigRational>,
    /// `true` if it is proved that no plan is better or, without a cost, that there is no plan. `false`, for example,
    /// if a limit was reached or reasoning failed.
    pub proved: bool,
    /// Steps of the plan; empty without a plan.
    pub steps: Vec<PlannedStep>,
}

/// A change of one value or one component relative to the current situation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Alteration {
    /// Name of the changed attribute, numeric function or component.
    pub name: String,
    /// Current value of the attribute or function. `None` for a component.
    pub from: Option<BigRational>,
    /// Bound for the new value, or the new state of the component.
    pub to: Target,
}

impl Alteration {
    /// Returns `true` if the other alteration holds, too, once this one holds.
    pub(super) fn implies(&self, other: &Self) -> bool {
        self.name == other.name && self.to.implies(&other.to)
    }
}

/// A set of alterations that together make the explained design available or unavailable.
#[derive(Debug, Clone, PartialEq)]
pub struct Repair {
    /// All alterations of the set.
    pub alterations: Vec<Alteration>,
    /// The best plan after all alterations.
    pub then: BestPlan,
}

/// A single alteration, with the best plan after it. It changes the best plan, or it contributes to a change of
/// the availability of a design.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Change {
    /// The alteration of one value or one component.
    pub alteration: Alteration,
    /// Upper limit on the error of the alteration's bound. `None` if the bound is exact.
    pub within: Option<BigRational>,
    /// `true` if the alteration alone changes the availability of the explained design, or the
    /// plan.
    pub suffices: bool,
    /// The best plan after this alteration.
    pub then: BestPlan,
}

/// Target of an alteration: a bound for a numeric value, or the new state of a component.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Target {
    /// A value of at least this bound.
    AtLeast(BigRational),
    /// A value of at most this bound.
    AtMost(BigRational),
    /// A value greater than this bound.
    Above(BigRational),
    /// A value less than this bound.
    Below(BigRational),
    /// A failed component is repaired.
    Recovered,
    /// A working component fails.
    Failed,
}

impl Target {
    /// Returns `true` if every value that meets this target meets `other`, too.
    fn implies(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::AtLeast(bound), Self::Above(limit)) => bound > limit,
            (Self::AtLeast(bound) | Self::Above(bound), Self::AtLeast(limit))
            | (Self::Above(bound), Self::Above(limit)) => bound >= limit,
            (Self::AtMost(bound), Self::Below(limit)) => bound < limit,
            (Self::AtMost(bound) | Self::Below(bound), Self::AtMost(limit))
            | (Self::Below(bound), Self::Below(limit)) => bound <= limit,
            _ => self == other,
        }
    }

    /// Returns a value that meets the target: the bound itself or, if the bound is strict, a value
    /// that differs from it by [`little`]. Returns 0 for components.
    pub(super) fn example(&self) -> BigRational {
        let little = little();
        match self {
            Self::AtLeast(bound) | Self::AtMost(bound) => bound.clone(),
            Self::Above(bound) => bound + little,
            Self::Below(bound) => bound - little,
            Self::Recovered | Self::Failed => BigRational::default(),
        }
    }
}

/// One millionth: the distance between a strict bound and the value that is tried beyond it, and the least error of
/// bounds found by bisection.
pub(super) fn little() -> BigRational {
    BigRational::new(1.into(), 1_000_000.into())
}
