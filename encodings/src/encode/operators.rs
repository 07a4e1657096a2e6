//! Operators: their order, conditions and effects.
//!
//! - sequence: at most one operator a step, unless several may stand there; `o@t → busy@t`, `busy@t → ⋁ o@t`, `busy@t+1 → busy@t`;
//! - condition: `o@t → p@t` for each fact, `o@t → ⋁ l@t` for each clause;
//! - effect: `o@t → e@t+1`, unless a conditional effect of the operator prevails.

use crate::encode::Encoding;
use crate::encode::formula::{Family, Formula, Meaning};
use crate::number::dense;

impl Encoding<'_> {
    /// One operator at most, where operators stand alone, and none after an idle step.
    pub(super) fn sequence(&mut self, step: usize) {
        let literals: Vec<_> = self.operators[step].iter().map(|(_, literal)| *literal).collect();
        let busy = match literals[..] {
            [] => !Formula::truth(),
            [only] => only,
            _ => {
                let busy = self.formula.fresh(Meaning::Busy { step: dense(step) });
                for literal in &literals {
                    self.formula.add(Family::Sequence, [!*literal, busy]);
                }
                self.formula.add(Family::Sequence, literals.iter().copied().chain([!busy]));
                if self.interference.is_none() {
                    self.formula.at_most_one(Family::Sequence, &literals);
                }
                busy
            }
        };
        if let Some(before) = self.busy.last() {
            self.formula.add(Family::Sequence, [!busy, *before]);
        }
        self.busy.push(busy);
    }

    /// What operators need, apart from numbers and designs.
    pub(super) fn conditions(&mut self, step: usize) {
        for index in 0..self.operators[step].len() {
            let (id, literal) = self.operators[step][index];
            let condition = &self.task.operators[id.index()].condition;
            for fact in &condition.facts {
                let fact = self.fact(*fact, step);
                self.formula.add(Family::Condition, [!literal, fact]);
            }
            for clause in &condition.clauses {
                let literals: Vec<_> = clause.iter().map(|part| self.literal(*part, step)).collect();
                self.formula.add(Family::Condition, std::iter::once(!literal).chain(literals));
            }
        }
    }

    /// What operators change, apart from numbers.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "steps are fewer than the horizon, whose formula is in memory"
    )]
    pub(super) fn effects(&mut self, step: usize) {
        for index in 0..self.operators[step].len() {
            let (id, literal) = self.operators[step][index];
            for effect in &self.task.operators[id.index()].effects {
                let fact = self.fact(*effect, step + 1);
                let others: Vec<_> = self.prevailing(step, id, 0, *effect).collect();
                self.formula.add(Family::Effect, others.into_iter().chain([!literal, fact]));
            }
        }
    }
}
