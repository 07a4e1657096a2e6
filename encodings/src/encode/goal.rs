//! Clauses for the goal: conditions on the last state. Idle steps at the end preserve this state.

use crate::encode::arithmetic::Bits;
use crate::encode::builder::Builder;
use crate::encode::formula::Family;
use crate::encode::numeric::is_at_least_zero;

/// Adds the goal conditions on the last state. `numbers` has the bits of the numeric variables in
/// this state. Returns `None` if numbers can exceed the available bits.
pub(super) fn goal(builder: &mut Builder<'_>, numbers: &[Bits]) -> Option<()> {
    let task = builder.task;
    let last = builder.variables.horizon();
    for fact in &task.goal.facts {
        let literal = builder.variables.fact(*fact, last);
        builder.formula.add(Family::Goal, [literal]);
    }
    for clause in &task.goal.clauses {
        let literals = clause.iter().map(|literal| builder.variables.literal(*literal, last));
        builder.formula.add(Family::Goal, literals);
    }
    for comparison in &task.goal.comparisons {
        let holds = is_at_least_zero(&mut builder.formula, comparison, numbers, Family::Goal)?;
        builder.formula.add(Family::Goal, [holds]);
    }
    Some(())
}
