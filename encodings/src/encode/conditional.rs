//! Clauses for conditional effects (notation: head of `encode`).
//!
//! - `f@t ↔ o@t ∧ ⋀ l@t` for a conditional effect f of operator o with the literals l as condition:
//!   `f@t` means that f occurs at step t;
//! - `f@t → e@t+1` for each fact e that the effect sets, unless a later effect of the operator sets
//!   the same variable to another value.

use task::number::dense;
use task::task::{Fact, OperatorId};

use crate::encode::builder::Builder;
use crate::encode::formula::{Family, Formula, VariableMeaning};
use crate::sat::Lit;

pub(super) struct ConditionalEffectVar<'a> {
    operator: OperatorId,
    position: usize,
    pub(super) literal: Lit,
    pub(super) effects: &'a [Fact],
}

pub(super) struct FiredEffects<'a>(Vec<ConditionalEffectVar<'a>>);

impl<'a> FiredEffects<'a> {
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "steps are fewer than the horizon, whose formula is in memory"
    )]
    pub(super) fn new(builder: &mut Builder<'a>, step: usize) -> Self {
        let task = builder.task;
        let mut effect_variables = Vec::new();
        for (id, operator) in &builder.variables.operators[step] {
            for (effect, position) in task.operators[id.index()].conditional.iter().zip(0..) {
                let mut premises = vec![*operator];
                premises.extend(effect.condition.iter().map(|part| builder.variables.literal(*part, step)));
                let literal = if premises.contains(&!Formula::truth()) {
                    !Formula::truth()
                } else {
                    let meaning =
                        VariableMeaning::Fires { operator: id.0, effect: position, step: dense(step) };
                    builder.formula.equivalent(meaning, &premises, Family::Conditional)
                };
                let position = position as usize;
                effect_variables.push(ConditionalEffectVar {
                    operator: *id,
                    position,
                    literal,
                    effects: &effect.effects,
                });
            }
        }
        let fires = Self(effect_variables);
        for ConditionalEffectVar { operator, position, literal, effects } in fires.iter() {
            for effect in *effects {
                let fact = builder.variables.fact(*effect, step + 1);
                let overriding = fires.prevailing(*operator, position + 1, *effect);
                builder.formula.add(Family::Conditional, overriding.chain([!*literal, fact]));
            }
        }
        fires
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &ConditionalEffectVar<'a>> {
        self.0.iter()
    }

    /// Returns the literals of the operator's conditional effects, from index `from` on, that set
    /// the variable of `fact` to another value.
    pub(super) fn prevailing(
        &self,
        operator: OperatorId,
        from: usize,
        fact: Fact,
    ) -> impl Iterator<Item = Lit> + '_ {
        let start = self.0.partition_point(|fired| (fired.operator, fired.position) < (operator, from));
        self.0[start..].iter().take_while(move |fired| fired.operator == operator).filter_map(move |fired| {
            let overrides = |effect: &Fact| effect.variable == fact.variable && effect.value != fact.value;
            fired.effects.iter().any(overrides).then_some(fired.literal)
        })
    }
}
