//! Encodes a task as the propositional formula "some plan of at most T steps costs less than the
//! claim".

use crate::clausal::formula::Formula;
use crate::clausal::sums::Sums;
use crate::clausal::timeline::Timeline;
use crate::integer::Integer;
use crate::model::Model;

/// Encodes that some plan of at most `steps` steps costs less than `cost`. Returns an error if the
/// task has an unsupported construct, `cost` is not positive, or the formula exceeds `limit`
/// literals.
pub(super) fn encode(model: &Model, cost: &Integer, steps: usize, limit: usize) -> Result<Formula, String> {
    // The initial values of derived variables are not checked, even if no rule derives them.
    if !model.axioms.is_empty() || model.basic < model.variables.len() {
        return Err("derived predicates are not covered".into());
    }
    if model.operators.iter().any(|operator| !operator.conditional.is_empty()) {
        return Err("conditional effects are not covered".into());
    }
    if !cost.is_positive() {
        return Err("no plan costs less than nothing".into());
    }
    let mut formula = Formula::new(limit);
    let mut timeline = Timeline::new(model, &mut formula);
    let mut sums = Sums::new(model, &mut formula, cost, steps)?;
    formula.has_number(sums.widest());
    for step in 0..steps {
        timeline.advance(model, &mut formula, step);
        sums.advance(model, &mut formula, &timeline, step)?;
        formula.within_limit()?;
    }
    timeline.goal(model, &mut formula);
    sums.goal(model, &mut formula)?;
    formula.within_limit()?;
    Ok(formula)
}
