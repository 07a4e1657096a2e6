//! Running actions.

use num_rational::BigRational;

use crate::ast::ActionBody;

use super::step::{Instance, Step};

#[derive(Debug)]
pub(super) struct Running<'e, 'p> {
    pub(super) step: &'e Step<'p>,
    pub(super) instance: Instance<'p>,
    pub(super) start: BigRational,
    pub(super) duration: BigRational,
    /// End time. Because the plan may state a rounded duration, the end can differ from `start` plus
    /// `duration`.
    pub(super) end: BigRational,
}

pub(super) fn is_durative(instance: &Instance<'_>) -> bool {
    matches!(instance.action.body, ActionBody::Durative { .. })
}
