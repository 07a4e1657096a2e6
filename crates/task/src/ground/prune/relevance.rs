//! Relevance analysis: removes effects on atoms and numbers that nothing reads, and then operators that neither
//! change the state nor reduce the cost.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::operator::GroundOperator;
use crate::ground::vocabulary::task::GroundTask;
use crate::lifted::Rational;
use crate::limits::Interrupted;
use crate::task::quantity::{NumericId, Quantity};

/// Removes effects on numeric variables that no condition reads and whose final values are not part of an objective.
/// A variable is also read if the new value of a read variable depends on it. Operator costs must already have been
/// computed.
pub(super) fn drop_unread_numerics(task: &mut GroundTask<'_>) -> Result<(), Interrupted> {
    let limits = task.world.limits;
    let conditions = task.operators.iter().map(|operator| &operator.condition).chain(&task.goal);
    let bodies = task.axioms.iter().map(|axiom| &axiom.body);
    let comparisons = conditions.chain(bodies).flat_map(|condition| &condition.comparisons);
    let mut read: FxHashSet<NumericId> = comparisons
        .flat_map(|(linear, _)| linear.coefficients.iter().map(|(variable, _)| *variable))
        .collect();
    read.extend(
        task.objectives.iter().flat_map(|objective| objective.rest.iter().map(|(variable, _)| *variable)),
    );
    // For each variable, the variables from which an operator computes its new value.
    let mut sources: FxHashMap<NumericId, Vec<NumericId>> = FxHashMap::default();
    for operator in limits.watch(&task.operators) {
        for (variable, value) in operator?.numeric_effects.iter() {
            let inputs = value.coefficients.iter().map(|(source, _)| *source);
            sources.entry(*variable).or_default().extend(inputs.filter(|source| source != variable));
        }
    }
    let mut open: Vec<NumericId> = read.iter().copied().collect();
    while let Some(variable) = open.pop() {
        open.extend(sources.remove(&variable).into_iter().flatten().filter(|source| read.insert(*source)));
    }
    for operator in &mut task.operators {
        operator.numeric_effects.retain(&|variable| read.contains(&variable));
    }
    Ok(())
}

/// Removes irrelevant rules, effects and operators until no more operators can be removed.
pub(super) fn backward(task: &mut GroundTask<'_>) -> Result<(), Interrupted> {
    // A removed operator reads no atoms, so further effects may become unread.
    loop {
        task.world.limits.check()?;
        let read = task.read_atoms();
        let before = task.operators.len();
        task.axioms.retain(|axiom| read.contains(&axiom.head));
        for operator in &mut task.operators {
            operator.adds.retain(|atom| read.contains(atom));
            operator.deletes.retain(|atom| read.contains(atom));
            for effect in &mut operator.conditional {
                effect.adds.retain(|atom| read.contains(atom));
                effect.deletes.retain(|atom| read.contains(atom));
            }
            operator.conditional.retain(|effect| !effect.adds.is_empty() || !effect.deletes.is_empty());
        }
        task.operators.retain(|operator| !is_idle(operator));
        if task.operators.len() == before {
            return Ok(());
        }
    }
}

/// Returns `true` if the operator certainly never changes the state and never has a negative cost.
fn is_idle(operator: &GroundOperator) -> bool {
    let is_required =
        |atom: AtomId, value: bool| operator.condition.literals.binary_search(&(atom, value)).is_ok();
    let lowest = |cost: &Quantity<Rational>| {
        let tables = cost.tables.iter().filter_map(|table| table.values.iter().min());
        tables.fold(cost.constant.clone(), |sum, value| sum + value)
    };
    operator.adds.iter().all(|atom| is_required(*atom, true))
        && operator.deletes.iter().all(|atom| is_required(*atom, false))
        && operator.conditional.is_empty()
        && operator.numeric_effects.iter().all(|(variable, value)| {
            value.quantity.is_zero() && value.coefficients[..] == [(*variable, Rational::from_integer(1))]
        })
        && operator.costs.iter().all(|cost| lowest(cost) >= Rational::from_integer(0))
}
