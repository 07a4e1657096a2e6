//! What an explanation consists of: plans, and what would have to be otherwise for them.

use num_rational::BigRational;

use crate::mapek::PlannedStep;

/// The best plan for a mission under some condition.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct BestPlan {
    /// The metric of the best plan, in its unit; none where no plan is known.
    pub cost: Option<BigRational>,
    /// Whether that is proved: without a cost, that there is no plan. If not, a limit was reached.
    pub proved: bool,
    /// The plan.
    pub steps: Vec<PlannedStep>,
}

/// Something that is otherwise than it is now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Alteration {
    /// The attribute, function or component.
    pub name: String,
    /// Its value now; none for a component.
    pub from: Option<BigRational>,
    /// What it would have to be.
    pub to: Target,
}

/// Alterations that have to come true together.
#[derive(Debug, Clone, PartialEq)]
pub struct Repair {
    /// All of them.
    pub alterations: Vec<Alteration>,
    /// The answer then.
    pub then: BestPlan,
}

/// A change that leads to another answer.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Change {
    /// What has to be otherwise.
    pub alteration: Alteration,
    /// How far the bound may be from the exact one; none if it is exact.
    pub within: Option<BigRational>,
    /// Of a change of a design's availability, whether it suffices by itself.
    pub suffices: bool,
    /// The answer then.
    pub then: BestPlan,
}

/// What a value would have to be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Target {
    /// At least this.
    AtLeast(BigRational),
    /// At most this.
    AtMost(BigRational),
    /// More than this.
    Above(BigRational),
    /// Less than this.
    Below(BigRational),
    /// A component that has failed works again.
    Recovered,
    /// A component that works fails.
    Failed,
}

impl Target {
    /// A value that is as asked for, as near as can be told apart; 0 for components.
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

/// What is near enough.
pub(super) fn little() -> BigRational {
    BigRational::new(1.into(), 1_000_000.into())
}
