//! Options of a check.

use crate::check::answer::Precision;
use crate::check::table::PolicyTable;
use crate::explore::Bounds;
use crate::prism::Settings;
use crate::property::Declarations;

/// Choice of exact or floating-point arithmetic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Exactness {
    /// Exact while that is cheap; guaranteed bounds otherwise.
    #[default]
    Auto,
    /// Always exact.
    Always,
    /// Never exact.
    Never,
}

/// Options of a check. Each `with_` method sets one option.
#[derive(Clone, Default)]
#[non_exhaustive]
pub struct Options<'a> {
    /// Values of constants.
    pub settings: Settings,
    /// Limits of exploration.
    pub bounds: Bounds<'a>,
    /// Choice of arithmetic.
    pub exactness: Exactness,
    /// The reward that breaks ties between policies; the number of steps if `None`.
    pub secondary: Option<String>,
    /// `true` if a policy is requested.
    pub policy: bool,
    /// A policy to evaluate instead of an optimal one.
    pub evaluate: Option<PolicyTable>,
    /// Required width of bounds. If the bounds in doubles are wider, the model is solved in
    /// rationals unless that was excluded.
    pub precision: Option<Precision>,
    /// Constants and labels in addition to those of the model.
    pub declarations: Declarations,
}

impl<'a> Options<'a> {
    /// Sets the values of all undefined constants.
    #[must_use]
    pub fn with_settings(self, settings: Settings) -> Self {
        Self { settings, ..self }
    }

    /// Sets the limits of exploration.
    #[must_use]
    pub fn with_bounds(self, bounds: Bounds<'a>) -> Self {
        Self { bounds, ..self }
    }

    /// Sets the choice of arithmetic.
    #[must_use]
    pub fn with_exactness(self, exactness: Exactness) -> Self {
        Self { exactness, ..self }
    }

    /// Sets the reward that breaks ties between policies; `None` for the number of steps.
    #[must_use]
    pub fn with_secondary(self, reward: impl Into<Option<String>>) -> Self {
        Self { secondary: reward.into(), ..self }
    }

    /// Requests a policy.
    #[must_use]
    pub fn with_policy(self, policy: bool) -> Self {
        Self { policy, ..self }
    }

    /// Sets a policy to evaluate; `None` for an optimal one.
    #[must_use]
    pub fn with_evaluation(self, policy: impl Into<Option<PolicyTable>>) -> Self {
        Self { evaluate: policy.into(), ..self }
    }

    /// Sets the required width of bounds; `None` for no requirement.
    #[must_use]
    pub fn with_precision(self, precision: impl Into<Option<Precision>>) -> Self {
        Self { precision: precision.into(), ..self }
    }

    /// Sets the constants and labels in addition to those of the model.
    #[must_use]
    pub fn with_declarations(self, declarations: Declarations) -> Self {
        Self { declarations, ..self }
    }
}
