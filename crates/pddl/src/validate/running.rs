//! Running actions, and the conditions and effects of an action at a given time.

use num_rational::BigRational;

use crate::ast::{ActionBody, Condition, ConditionTime, Effect, EffectTime};

use super::step::{Instance, Step};

#[derive(Debug)]
pub(super) struct Running<'e, 'p> {
    pub(super) step: &'e Step<'p>,
    pub(super) instance: Instance<'p>,
    pub(super) start: BigRational,
    /// Exact duration, in the domain's time unit.
    pub(super) duration: BigRational,
    /// End time. Because the plan may state a rounded duration, the end can differ from `start` plus
    /// `duration`.
    pub(super) end: BigRational,
}

pub(super) fn is_durative(instance: &Instance<'_>) -> bool {
    matches!(instance.action.body, ActionBody::Durative { .. })
}

/// Conditions that an action has at the given time. A precondition counts as a condition at start.
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

/// Effects that an action has at the given time. Effects of an instantaneous action count as effects at
/// start.
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
