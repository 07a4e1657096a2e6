//! Finds expressions of effects in which reconfigurations cannot be counted.

use pddl::ast::{Assignment, Effect, Expression, Name};

pub(super) fn mentions(expression: &Expression, wanted: &dyn Fn(&Name) -> bool) -> bool {
    let mut is_mentioned = false;
    expression.walk_fluents(&mut |fluent| is_mentioned |= wanted(&fluent.predicate.name));
    is_mentioned
}

/// Calls `see` for the expressions of an effect in which reconfigurations cannot be counted: all except the amounts
/// of `increase` and `decrease` effects outside of `when` and `forall`.
pub(super) fn walk_uncounted(effect: Effect, see: &dyn Fn(&mut Expression)) {
    match effect {
        Effect::And(parts) => parts.into_iter().for_each(|part| walk_uncounted(part, see)),
        Effect::Assign(Assignment::Increase | Assignment::Decrease, ..) => {}
        mut other => other.change_leaves(&mut |leaf| see(leaf)),
    }
}
