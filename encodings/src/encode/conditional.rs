//! Conditional effects.
//!
//! - `f@t ↔ o@t ∧ ⋀ l@t` for an effect of operator o whose condition is the literals l;
//! - `f@t → e@t+1` for each fact that it sets, unless an effect after it sets the variable to something else.

use crate::encode::Encoding;
use crate::encode::formula::{Family, Formula, Meaning};
use crate::number::dense;
use crate::sat::Lit;
use crate::task::{Fact, OperatorId};

/// A conditional effect at a step.
pub(super) struct Fires {
    operator: OperatorId,
    position: usize,
    pub(super) literal: Lit,
    pub(super) effects: Vec<Fact>,
}

impl Encoding<'_> {
    /// The variables of the conditional effects at a step, and what they set.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "steps are fewer than the horizon, whose formula is in memory"
    )]
    pub(super) fn conditional(&mut self, step: usize) {
        let mut all = Vec::new();
        for index in 0..self.operators[step].len() {
            let (id, operator) = self.operators[step][index];
            for (effect, position) in self.task.operators[id.index()].conditional.iter().zip(0..) {
                let mut premises = vec![operator];
                premises.extend(effect.condition.iter().map(|part| self.literal(*part, step)));
                let literal = if premises.contains(&!Formula::truth()) {
                    !Formula::truth()
                } else {
                    let meaning = Meaning::Fires { operator: id.0, effect: position, step: dense(step) };
                    self.equivalent(meaning, &premises, Family::Conditional)
                };
                let effects = effect.effects.clone();
                all.push(Fires { operator: id, position: position as usize, literal, effects });
            }
        }
        self.fires.push(all);
        for index in 0..self.fires[step].len() {
            let fires = &self.fires[step][index];
            let (operator, position, literal) = (fires.operator, fires.position, fires.literal);
            for effect in fires.effects.clone() {
                let fact = self.fact(effect, step + 1);
                let others: Vec<_> = self.prevailing(step, operator, position + 1, effect).collect();
                self.formula.add(Family::Conditional, others.into_iter().chain([!literal, fact]));
            }
        }
    }

    /// A literal that is true exactly if all premises are.
    pub(super) fn equivalent(&mut self, meaning: Meaning, premises: &[Lit], family: Family) -> Lit {
        let premises: Vec<_> = premises.iter().copied().filter(|l| *l != Formula::truth()).collect();
        match premises[..] {
            [] => Formula::truth(),
            [only] => only,
            _ => {
                let literal = self.formula.fresh(meaning);
                for premise in &premises {
                    self.formula.add(family, [!literal, *premise]);
                }
                self.formula.add(family, premises.iter().map(|premise| !*premise).chain([literal]));
                literal
            }
        }
    }

    /// The conditional effects of an operator, from a position on, that set the variable of a fact to something else.
    pub(super) fn prevailing(
        &self,
        step: usize,
        operator: OperatorId,
        from: usize,
        fact: Fact,
    ) -> impl Iterator<Item = Lit> + '_ {
        let all = &self.fires[step];
        let start = all.partition_point(|fires| (fires.operator, fires.position) < (operator, from));
        all[start..].iter().take_while(move |fires| fires.operator == operator).filter_map(move |fires| {
            let other = |effect: &Fact| effect.variable == fact.variable && effect.value != fact.value;
            fires.effects.iter().any(other).then_some(fires.literal)
        })
    }
}
