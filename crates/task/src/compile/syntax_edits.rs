//! Adds conditions and effects to actions, and predicates and hidden actions to domains.

use crate::error::{Error, File, Place};
use pddl::ast::{
    Action, ActionBody, Condition, ConditionTime, Declaration, Domain, Effect, EffectTime, Name, Span,
};

use super::simplify::{all, identifier};

/// A preference instance: the name of the preference, and its condition on the last state.
pub(super) type PreferenceInstance = (Name, Condition);

pub(super) fn declare(domain: &mut Domain, name: &str) {
    domain.predicates.push(Declaration { identifier: identifier(name), parameters: Vec::new() });
}

pub(super) fn hidden(name: &str, body: ActionBody, span: Span) -> Action {
    Action { identifier: identifier(name), parameters: Vec::new(), body, preferences: Vec::new(), span }
}

/// Adds a condition to an action. For a durative action, it must hold before the start or before the end, depending on
/// `time`. For an instantaneous action, it is a precondition.
pub(super) fn require(action: &mut Action, time: EffectTime, condition: Condition) {
    match &mut action.body {
        ActionBody::Instantaneous { precondition, .. } => {
            let original = std::mem::replace(precondition, Condition::And(Vec::new()));
            *precondition = all([original, condition]);
        }
        ActionBody::Durative { conditions, .. } => {
            let time = match time {
                EffectTime::AtStart => ConditionTime::AtStart,
                EffectTime::AtEnd => ConditionTime::AtEnd,
            };
            conditions.push((time, condition));
        }
    }
}

pub(super) fn happen(action: &mut Action, time: EffectTime, more: Effect) {
    match &mut action.body {
        ActionBody::Instantaneous { effect, .. } => {
            let original = std::mem::replace(effect, Effect::And(Vec::new()));
            *effect = Effect::And(vec![original, more]);
        }
        ActionBody::Durative { effects, .. } => effects.push((time, more)),
    }
}

pub(super) fn unsupported(
    construct: impl Into<String>,
    instead: impl Into<String>,
    (file, span): (File, Span),
) -> Error {
    Error::Unsupported { construct: construct.into(), instead: instead.into(), place: Place { file, span } }
}
