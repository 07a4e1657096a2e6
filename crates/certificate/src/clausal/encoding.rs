//! Encodes a task as the propositional formula "some plan of at most T steps costs less than the
//! claim".

use crate::clausal::formula::Formula;
use crate::clausal::sums::Sums;
use crate::clausal::timeline::Timeline;
use crate::integer::Integer;
use crate::model::Model;

/// Encodes that some plan of at most `steps` steps costs less than `cost`. Returns an error if the
/// task has an unsupported construct, `cost` is not positive, or the formula exceeds `limit`
/// literals, or `stop` returns `true`.
pub(super) fn encode(
    model: &Model,
    cost: &Integer,
    steps: usize,
    limit: usize,
    stop: &dyn Fn() -> bool,
) -> Result<Formula, String> {
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
        if stop() {
            return Err("the encoding was stopped before its end".into());
        }
        let before = formula.literals();
        timeline.advance(model, &mut formula, step);
        sums.advance(model, &mut formula, &timeline, step)?;
        // No later step has fewer literals than the first one.
        let later = if step == 0 { steps.saturating_sub(1) } else { 0 };
        formula.within_limit(formula.literals().saturating_sub(before).saturating_mul(later))?;
    }
    timeline.goal(model, &mut formula);
    sums.goal(model, &mut formula)?;
    formula.within_limit(0)?;
    Ok(formula)
}
