//! How a property is checked.

use crate::check::answer::Precision;
use crate::check::table::PolicyTable;
use crate::explore::Bounds;
use crate::prism::Settings;
use crate::property::Declarations;

/// Whether to solve in rationals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Exactness {
    /// While that is cheap; the result is bounds otherwise.
    #[default]
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

/// How a property is checked. Each `with_` changes one thing.
#[derive(Clone, Default)]
#[non_exhaustive]
pub struct Options<'a> {
    /// Values of constants.
    pub settings: Settings,
    /// Limits of exploration.
    pub bounds: Bounds<'a>,
    /// Whether to solve in rationals.
    pub exactness: Exactness,
    /// The reward that breaks ties of policies; the number of steps otherwise.
    pub secondary: Option<String>,
    /// Whether a policy is wanted.
    pub policy: bool,
    /// A policy to evaluate, in place of the best one.
    pub evaluate: Option<PolicyTable>,
    /// How wide bounds may be: where they are wider in doubles, the model is solved in rationals unless that was excluded.
    pub precision: Option<Precision>,
    /// Constants and labels besides those of the model.
    pub declarations: Declarations,
}

impl<'a> Options<'a> {
    /// The values of all constants that are set from outside.
    #[must_use]
    pub fn with_settings(self, settings: Settings) -> Self {
        Self { settings, ..self }
    }

    /// Limits of exploration.
    #[must_use]
    pub fn with_bounds(self, bounds: Bounds<'a>) -> Self {
        Self { bounds, ..self }
    }

    /// Whether to solve in rationals.
    #[must_use]
    pub fn with_exactness(self, exactness: Exactness) -> Self {
        Self { exactness, ..self }
    }

    /// The reward that breaks ties of policies; `None` for the number of steps.
    #[must_use]
    pub fn with_secondary(self, reward: impl Into<Option<String>>) -> Self {
        Self { secondary: reward.into(), ..self }
    }

    /// Whether a policy is wanted.
    #[must_use]
    pub fn with_policy(self, policy: bool) -> Self {
        Self { policy, ..self }
    }

    /// A policy to evaluate; `None` for the best one.
    #[must_use]
    pub fn with_evaluation(self, policy: impl Into<Option<PolicyTable>>) -> Self {
        Self { evaluate: policy.into(), ..self }
    }

    /// How wide bounds may be; `None` for as wide as they come.
    #[must_use]
    pub fn with_precision(self, precision: impl Into<Option<Precision>>) -> Self {
        Self { precision: precision.into(), ..self }
    }

    /// Constants and labels besides those of the model.
    #[must_use]
    pub fn with_declarations(self, declarations: Declarations) -> Self {
        Self { declarations, ..self }
    }
}
