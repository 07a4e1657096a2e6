//! An action under way, and what its schema says of a time.

use num_rational::BigRational;

use crate::ast::{ActionBody, Condition, ConditionTime, Effect, EffectTime};

use super::step::{Instance, Step};

/// An action that has started.
#[derive(Debug)]
pub(super) struct Running<'e, 'p> {
    pub(super) step: &'e Step<'p>,
    pub(super) instance: Instance<'p>,
    pub(super) start: BigRational,
    /// The exact duration, in the domain's time unit.
    pub(super) duration: BigRational,
    /// When it ends on the plan's clock, where durations may be rounded.
    pub(super) end: BigRational,
}

pub(super) fn is_durative(instance: &Instance<'_>) -> bool {
    matches!(instance.action.body, ActionBody::Durative { .. })
}

/// The conditions of an action at a time; a precondition counts as one at the start.
pub(super) fn conditions<'p>(
    instance: &Instance<'p>,
    when: ConditionTime,
) -> impl Iterator<Item = &'p Condition> + use<'p> {
    let (single, several) = match &instance.action.body {
        ActionBody::Instantaneous { precondition, .. } => {
            ((when == ConditionTime::AtStart).then_some(precondition), [].as_slice())
        }
        ActionBody::Durative { conditions, .. } => (None, conditions.as_slice()),
    };
    let several = several.iter().filter(move |(time, _)| *time == when).map(|(_, condition)| condition);
    single.into_iter().chain(several)
}

/// The effects of an action at a time; those of an instantaneous one count as effects at the start.
pub(super) fn effects<'p>(
    instance: &Instance<'p>,
    when: EffectTime,
) -> impl Iterator<Item = &'p Effect> + use<'p> {
    let (single, several) = match &instance.action.body {
        ActionBody::Instantaneous { effect, .. } => {
            ((when == EffectTime::AtStart).then_some(effect), [].as_slice())
        }
        ActionBody::Durative { effects, .. } => (None, effects.as_slice()),
    };
    let several = several.iter().filter(move |(time, _)| *time == when).map(|(_, effect)| effect);
    single.into_iter().chain(several)
}
