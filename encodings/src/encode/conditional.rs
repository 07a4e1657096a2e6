//! Conditional effects.
//!
//! - `f@t ↔ o@t ∧ ⋀ l@t` for an effect of operator o whose condition is the literals l;
//! - `f@t → e@t+1` for each fact that it sets, unless a later effect sets the variable to another
//!   value.

use task::number::dense;
use task::task::{Fact, OperatorId};

use crate::encode::builder::Builder;
use crate::encode::formula::{Family, Formula, VariableMeaning};
use crate::sat::Lit;

/// A conditional effect at a step, with its variable.
pub(super) struct ConditionalEffectVar<'a> {
    operator: OperatorId,
    position: usize,
    /// Literal that is true if the effect takes place.
    pub(super) literal: Lit,
    pub(super) effects: &'a [Fact],
}

/// Conditional effects of the operators at a step.
pub(super) struct FiredEffects<'a>(Vec<ConditionalEffectVar<'a>>);

impl<'a> FiredEffects<'a> {
    /// Creates the variables of the conditional effects at a step, and adds clauses for their
    /// effects.
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

    /// Conditional effects of an operator, from an index on, that set the variable of a fact to
    /// another value.
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
