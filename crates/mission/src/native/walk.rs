//! In-place visitors for the expressions of conditions and effects.

use pddl::ast::{Assignment, Condition, Effect, Expression, Name};

/// Sets `found` if the expression contains a numeric function that `wanted` accepts.
pub(super) fn mentions(expression: &Expression, wanted: &dyn Fn(&Name) -> bool, found: &mut bool) {
    match expression {
        Expression::Fluent(fluent) => *found |= wanted(&fluent.predicate.name),
        Expression::Operation(_, parts, _) => parts.iter().for_each(|part| mentions(part, wanted, found)),
        Expression::Number(..) | Expression::Duration(_) | Expression::TotalTime(_) => {}
    }
}

/// Applies a change to every leaf of an expression.
pub(super) fn walk_expression(expression: &mut Expression, change: &dyn Fn(&mut Expression)) {
    match expression {
        Expression::Operation(_, parts, _) => {
            for part in parts {
                walk_expression(part, change);
            }
        }
        other => change(other),
    }
}

/// Applies a change to every leaf of all expressions in a condition.
pub(super) fn walk_condition(condition: &mut Condition, change: &dyn Fn(&mut Expression)) {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => {
            for part in parts {
                walk_condition(part, change);
            }
        }
        Condition::Not(inner) | Condition::Exists(_, inner) | Condition::ForAll(_, inner) => {
            walk_condition(inner, change);
        }
        Condition::Imply(left, right) => {
            walk_condition(left, change);
            walk_condition(right, change);
        }
        Condition::Compare(_, left, right, _) => {
            walk_expression(left, change);
            walk_expression(right, change);
        }
        Condition::Atom(_) | Condition::Equal(..) => {}
    }
}

/// Visits the expressions of an effect in which changes of designs cannot be counted: all except
/// the amounts of unconditional `increase` and `decrease` effects.
pub(super) fn walk_uncounted(effect: Effect, see: &dyn Fn(&mut Expression)) {
    match effect {
        Effect::And(parts) => parts.into_iter().for_each(|part| walk_uncounted(part, see)),
        Effect::Assign(Assignment::Increase | Assignment::Decrease, ..) => {}
        mut other => walk_effect(&mut other, see),
    }
}

/// Applies a change to every leaf of all expressions in an effect.
pub(super) fn walk_effect(effect: &mut Effect, change: &dyn Fn(&mut Expression)) {
    match effect {
        Effect::And(parts) => parts.iter_mut().for_each(|part| walk_effect(part, change)),
        Effect::ForAll(_, inner) => walk_effect(inner, change),
        Effect::When(condition, inner) => {
            walk_condition(condition, change);
            walk_effect(inner, change);
        }
        Effect::Assign(_, _, expression, _) => walk_expression(expression, change),
        Effect::Add(_) | Effect::Delete(_) => {}
    }
}
