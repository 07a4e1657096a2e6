//! Finds expressions of effects in which reconfigurations cannot be counted.

use pddl::ast::{Arithmetic, Assignment, Effect, Expression, Name};

pub(super) fn mentions(expression: &Expression, wanted: &dyn Fn(&Name) -> bool) -> bool {
    let mut is_mentioned = false;
    expression.walk_fluents(&mut |fluent| is_mentioned |= wanted(&fluent.predicate.name));
    is_mentioned
}

/// Calls `see` for the expressions of an effect in which reconfigurations cannot be counted: all except the amounts
/// of `increase` and `decrease` effects outside of `when` and `forall` that are linear in the functions `is_counted`.
/// The amount is applied design by design, which adds up to the amount for the sum only if it is linear.
pub(super) fn walk_uncounted(
    effect: Effect,
    is_counted: &dyn Fn(&Name) -> bool,
    see: &dyn Fn(&mut Expression),
) {
    match effect {
        Effect::And(parts) => parts.into_iter().for_each(|part| walk_uncounted(part, is_counted, see)),
        Effect::Assign(Assignment::Increase | Assignment::Decrease, _, mut amount, _) => {
            if !is_linear(&amount, is_counted) {
                amount.change_leaves(&mut |leaf| see(leaf));
            }
        }
        mut other => other.change_leaves(&mut |leaf| see(leaf)),
    }
}

/// Returns `true` if the form of an expression shows that it is linear in the functions `is_counted`: no product has
/// two operands with such functions, and no divisor has one.
fn is_linear(expression: &Expression, is_counted: &dyn Fn(&Name) -> bool) -> bool {
    let Expression::Operation(operation, operands, _) = expression else { return true };
    let with_counted = operands.iter().map(|operand| mentions(operand, is_counted));
    let is_fitting = match operation {
        Arithmetic::Add | Arithmetic::Subtract => true,
        Arithmetic::Multiply => with_counted.filter(|has_counted| *has_counted).count() <= 1,
        Arithmetic::Divide => !with_counted.skip(1).any(|has_counted| has_counted),
    };
    is_fitting && operands.iter().all(|operand| is_linear(operand, is_counted))
}
