//! State variables: their domains at every step, and the frame axioms.
//!
//! - domain: `⋁_d v=d@t`, and at most one of them;
//! - frame (explanatory, after Haas [1]): `v=d@t+1 → v=d@t ∨ ⋁ {o@t : o sets v to d}`. With the domain
//!   constraints on both sides this also keeps what nothing changes.
//!
//! A value that no sequence of allowed operators can produce by a step gets no variable there.
//!
//! [1] A. Haas: The case for domain-specific frame axioms, The Frame Problem in AI, 1987.

use crate::encode::Encoding;
use crate::encode::formula::{Family, Formula, Meaning};
use crate::limits::{Interrupted, Limits};
use crate::number::dense;
use crate::task::{Fact, OperatorId, VariableId};

impl Encoding<'_> {
    /// Makes the variables for operators, values and designs.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "steps are fewer than the horizon, whose formula is in memory"
    )]
    pub(super) fn declare(&mut self, allowed: &[Vec<bool>], limits: &Limits) -> Result<(), Interrupted> {
        let task = self.task;
        let mut possible: Vec<Vec<bool>> =
            task.variables.iter().map(|v| vec![false; v.values.len()]).collect();
        for (variable, value) in task.initial.values.iter().enumerate() {
            possible[variable][*value as usize] = true;
        }
        // What derived variables hold follows from the others at every step.
        for values in &mut possible[task.basic..] {
            values[1] = true;
        }
        for rule in task.axioms.iter().flat_map(|layer| &layer.rules) {
            possible[rule.head.variable.index()][rule.head.value as usize] = true;
        }
        self.declare_values(&possible, 0);
        for (step, allowed) in allowed.iter().enumerate() {
            let mut present = Vec::new();
            for item in limits.watch(task.operators.iter().zip(OperatorId::all(task.operators.len()))) {
                let (operator, id) = item?;
                let is_possible = |fact: &Fact| possible[fact.variable.index()][fact.value as usize];
                if allowed[id.index()] && operator.condition.facts.iter().all(is_possible) {
                    let meaning = Meaning::Operator { operator: id.0, step: dense(step) };
                    present.push((id, self.formula.fresh(meaning)));
                }
            }
            for (id, _) in &present {
                let operator = &task.operators[id.index()];
                let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
                for effect in operator.effects.iter().chain(conditional) {
                    possible[effect.variable.index()][effect.value as usize] = true;
                }
            }
            self.operators.push(present);
            self.declare_designs(step);
            self.declare_values(&possible, step + 1);
        }
        Ok(())
    }

    fn declare_values(&mut self, possible: &[Vec<bool>], step: usize) {
        let mut all = Vec::with_capacity(possible.len());
        for (variable, values) in possible.iter().enumerate() {
            let single = values.iter().filter(|possible| **possible).count() == 1;
            let mut literals = Vec::with_capacity(values.len());
            for (value, possible) in values.iter().enumerate() {
                literals.push(match (possible, single) {
                    (false, _) => !Formula::truth(),
                    (true, true) => Formula::truth(),
                    (true, false) => {
                        let (variable, value, step) = (dense(variable), dense(value), dense(step));
                        self.formula.fresh(Meaning::Value { variable, value, step })
                    }
                });
            }
            all.push(literals);
        }
        self.values.push(all);
    }

    fn declare_designs(&mut self, step: usize) {
        let mut used: Vec<Vec<bool>> =
            self.task.slots.iter().map(|slot| vec![false; slot.designs.len()]).collect();
        for slot in
            self.operators[step].iter().flat_map(|(id, _)| self.task.operators[id.index()].slots.iter())
        {
            for design in &slot.designs {
                used[slot.slot.index()][*design as usize] = true;
            }
        }
        let mut all = Vec::with_capacity(used.len());
        for (slot, used) in used.into_iter().enumerate() {
            let mut literals = Vec::with_capacity(used.len());
            for (design, used) in used.into_iter().enumerate() {
                let meaning = Meaning::Design { slot: dense(slot), design: dense(design), step: dense(step) };
                literals.push(if used { self.formula.fresh(meaning) } else { !Formula::truth() });
            }
            all.push(literals);
        }
        self.designs.push(all);
    }

    /// Every variable has exactly one value before the step.
    pub(super) fn domain(&mut self, step: usize) {
        for variable in 0..self.task.variables.len() {
            let falsum = !Formula::truth();
            let literals: Vec<_> =
                self.values[step][variable].iter().copied().filter(|l| *l != falsum).collect();
            if literals.len() > 1 {
                self.formula.add(Family::Domain, literals.iter().copied());
                self.formula.at_most_one(Family::Domain, &literals);
            }
        }
    }

    /// A value that holds after the step held before it, or an operator at the step has brought it.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "steps are fewer than the horizon, whose formula is in memory"
    )]
    pub(super) fn frame(&mut self, step: usize) {
        let mut producers: Vec<Vec<Vec<crate::sat::Lit>>> =
            self.task.variables.iter().map(|variable| vec![Vec::new(); variable.values.len()]).collect();
        for (id, literal) in &self.operators[step] {
            for effect in &self.task.operators[id.index()].effects {
                producers[effect.variable.index()][effect.value as usize].push(*literal);
            }
        }
        for fires in &self.fires[step] {
            for effect in &fires.effects {
                producers[effect.variable.index()][effect.value as usize].push(fires.literal);
            }
        }
        for (variable, producers) in producers.iter().enumerate().take(self.task.basic) {
            for (value, producers) in producers.iter().enumerate() {
                let fact = Fact { variable: VariableId::of(variable), value: dense(value) };
                let (before, after) = (self.fact(fact, step), self.fact(fact, step + 1));
                if after != !Formula::truth() {
                    let clause = [!after, before].into_iter().chain(producers.iter().copied());
                    self.formula.add(Family::Frame, clause);
                }
            }
        }
    }
}
