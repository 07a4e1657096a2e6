//! How a property is checked.

use crate::check::table::PolicyTable;
use crate::explore::Bounds;
use crate::prism::Settings;

/// Whether to solve in rationals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Exactness {
    /// Where the model is small.
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
}
