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

/// How a property is checked.
#[derive(Default)]
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
