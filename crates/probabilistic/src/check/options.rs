//! Options of a check.

use crate::check::answer::Precision;
use crate::check::table::PolicyTable;
use crate::explore::Bounds;
use crate::prism::Settings;
use crate::property::Declarations;

/// Choice between exact and floating-point arithmetic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Exactness {
    /// Exact arithmetic within a budget, for models with up to about 150,000 transitions. Otherwise, doubles
    /// with guaranteed bounds.
    #[default]
    Auto,
    /// Exact arithmetic without a budget.
    Always,
    /// Doubles with guaranteed bounds only.
    Never,
}

/// Options of a check. Each `with_` method sets one option.
#[derive(Clone, Default)]
#[non_exhaustive]
pub struct Options<'a> {
    /// Values of constants, by name. Every undefined constant of the model needs a value; the value
    /// of a defined constant is overridden.
    pub settings: Settings,
    /// Limits of the exploration, such as the number of states.
    pub bounds: Bounds<'a>,
    /// Choice of arithmetic.
    pub exactness: Exactness,
    /// Name of the reward structure that breaks ties between optimal policies if the policy is
    /// reported; `None` breaks ties by the number of steps.
    pub secondary: Option<String>,
    /// Whether the policy is reported, too.
    pub policy: bool,
    /// A given policy to evaluate; if `None`, an optimal policy is computed.
    pub evaluate: Option<PolicyTable>,
    /// Required width of the bounds on values. If the bounds computed in doubles are wider, the
    /// model is solved again in rationals with a larger budget, unless `exactness` is
    /// [`Exactness::Never`].
    pub precision: Option<Precision>,
    /// Constants, labels and named properties of a property file, in addition to those of the
    /// model.
    pub declarations: Declarations,
}

impl<'a> Options<'a> {
    /// Sets the values of constants: of all undefined constants, and of defined constants whose value is
    /// overridden.
    #[must_use]
    pub fn with_settings(self, settings: Settings) -> Self {
        Self { settings, ..self }
    }

    /// Sets the limits of the exploration.
    #[must_use]
    pub fn with_bounds(self, bounds: Bounds<'a>) -> Self {
        Self { bounds, ..self }
    }

    /// Sets the choice between exact and floating-point arithmetic.
    #[must_use]
    pub fn with_exactness(self, exactness: Exactness) -> Self {
        Self { exactness, ..self }
    }

    /// Sets the reward structure that breaks ties between optimal policies; `None` selects the
    /// number of steps.
    #[must_use]
    pub fn with_secondary(self, reward: impl Into<Option<String>>) -> Self {
        Self { secondary: reward.into(), ..self }
    }

    /// Sets whether the policy is reported, too.
    #[must_use]
    pub fn with_policy(self, policy: bool) -> Self {
        Self { policy, ..self }
    }

    /// Sets a given policy to evaluate; with `None`, an optimal policy is computed.
    #[must_use]
    pub fn with_evaluation(self, policy: impl Into<Option<PolicyTable>>) -> Self {
        Self { evaluate: policy.into(), ..self }
    }

    /// Sets the required width of the bounds on values; `None` for no requirement.
    #[must_use]
    pub fn with_precision(self, precision: impl Into<Option<Precision>>) -> Self {
        Self { precision: precision.into(), ..self }
    }

    /// Sets the constants, labels and named properties of a property file.
    #[must_use]
    pub fn with_declarations(self, declarations: Declarations) -> Self {
        Self { declarations, ..self }
    }
}
