//! Clauses for operators: their order, conditions and effects (notation: head of `encode`).
//!
//! - sequence: at most one operator per step in sequential semantics. `busy@t` means that an operator is
//!   executed at step t, and idle steps come last: `o@t → busy@t`, `busy@t → ⋁ o@t`, `busy@t+1 → busy@t`;
//! - condition: `o@t → p@t` for each fact p in the condition of o, `o@t → ⋁ l@t` for each clause with the
//!   literals l;
//! - effect: `o@t → e@t+1` for each fact e that o sets, unless a conditional effect of o prevails.

use task::number::dense;

use crate::encode::builder::Builder;
use crate::encode::conditional::FiredEffects;
use crate::encode::formula::{Family, Formula, VariableMeaning};

/// Adds the sequence clauses of a step: no operator after an idle step and, if `is_alone`, at most
/// one operator.
pub(super) fn sequence(builder: &mut Builder<'_>, step: usize, is_alone: bool) {
    let literals: Vec<_> = builder.variables.operators[step].iter().map(|(_, literal)| *literal).collect();
    let busy = match literals[..] {
        [] => !Formula::truth(),
        [only] => only,
        _ => {
            let busy = builder.formula.fresh(VariableMeaning::Busy { step: dense(step) });
            for literal in &literals {
                builder.formula.add(Family::Sequence, [!*literal, busy]);
            }
            builder.formula.add(Family::Sequence, literals.iter().copied().chain([!busy]));
            if is_alone {
                builder.formula.at_most_one(Family::Sequence, &literals);
            }
            busy
        }
    };
    if let Some(before) = builder.variables.busy.last() {
        builder.formula.add(Family::Sequence, [!busy, *before]);
    }
    builder.variables.busy.push(busy);
}

pub(super) fn conditions(builder: &mut Builder<'_>, step: usize) {
    for index in 0..builder.variables.operators[step].len() {
        let (id, literal) = builder.variables.operators[step][index];
        let condition = &builder.task.operators[id.index()].condition;
        for fact in &condition.facts {
            let fact = builder.variables.fact(*fact, step);
            builder.formula.add(Family::Condition, [!literal, fact]);
        }
        for clause in &condition.clauses {
            let literals: Vec<_> = clause.iter().map(|part| builder.variables.literal(*part, step)).collect();
            builder.formula.add(Family::Condition, std::iter::once(!literal).chain(literals));
        }
    }
}

/// Adds clauses for the unconditional effects of the operators at a step, except effects on numbers.
/// `fires` contains the conditional effects, which prevail over unconditional ones.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "steps are fewer than the horizon, whose formula is in memory"
)]
pub(super) fn effects(builder: &mut Builder<'_>, step: usize, fires: &FiredEffects) {
    for index in 0..builder.variables.operators[step].len() {
        let (id, literal) = builder.variables.operators[step][index];
        for effect in &builder.task.operators[id.index()].effects {
            let fact = builder.variables.fact(*effect, step + 1);
            let overriding: Vec<_> = fires.prevailing(id, 0, *effect).collect();
            builder.formula.add(Family::Effect, overriding.into_iter().chain([!literal, fact]));
        }
    }
}
