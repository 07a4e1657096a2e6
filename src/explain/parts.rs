//! Parts of explanations: plans, and the alterations that lead to them.

use num_rational::BigRational;

use crate::mapek::PlannedStep;

/// The best plan for a mission under some condition.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct BestPlan {
    /// The metric of the best plan, in its unit. `None` without a plan.
    pub cost: Option<BigRational>,
    /// `true` if the cost is proved to be the lowest or, without a cost, if it is proved that there
    /// is no plan. Otherwise a limit was reached.
    pub proved: bool,
    /// The plan.
    pub steps: Vec<PlannedStep>,
}

/// A difference from the current situation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Alteration {
    /// The attribute, function or component.
    pub name: String,
    /// The current value. `None` for a component.
    pub from: Option<BigRational>,
    /// The bound for the new value, or the new state.
    pub to: Target,
}

/// Alterations that have to come true together.
#[derive(Debug, Clone, PartialEq)]
pub struct Repair {
    /// All alterations of the change.
    pub alterations: Vec<Alteration>,
    /// The best plan after the alterations.
    pub then: BestPlan,
}

/// A change that leads to another answer.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Change {
    /// The alteration.
    pub alteration: Alteration,
    /// Upper limit on the error of the bound. `None` if the bound is exact.
    pub within: Option<BigRational>,
    /// For a change of a design's availability, `true` if the alteration suffices by itself.
    pub suffices: bool,
    /// The best plan after the change.
    pub then: BestPlan,
}

/// Target of an alteration: a bound for the new value of a number, or the new state of a component.
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
    /// A value that meets the target: the bound itself, or, if the bound is strict, a value beyond
    /// it by `little()`. Returns 0 for components.
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

/// Smallest difference between values that are distinguished: one millionth.
pub(super) fn little() -> BigRational {
    BigRational::new(1.into(), 1_000_000.into())
}
