//! Variables of a formula for each step: operators, values of state variables, and designs.
//!
//! A value that is unreachable at a step, or the only reachable value of its variable, is a constant instead.

use task::context::Context;
use task::limits::Interrupted;
use task::number::dense;
use task::task::{Fact, Literal, OperatorId, Task};

use crate::encode::formula::{Formula, VariableMeaning};
use crate::sat::Lit;

#[derive(Default)]
pub(super) struct Variables {
    /// For each step: the possible operators in ascending order, each with its variable.
    pub(super) operators: Vec<Vec<(OperatorId, Lit)>>,
    pub(super) busy: Vec<Lit>,
    /// `values[step][variable][value]`: literal that is true if the state variable has the value
    /// before the step.
    pub(super) values: Vec<Vec<Vec<Lit>>>,
    /// `designs[step][slot][design]`: literal that is true if the slot is filled with the design at
    /// the step.
    pub(super) designs: Vec<Vec<Vec<Lit>>>,
}

impl Variables {
    /// Creates the variables. `allowed[step][operator]` is `true` if the operator may occur at the step.
    /// Operators whose required facts cannot hold before the step are omitted.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "steps are fewer than the horizon, whose formula is in memory"
    )]
    pub(super) fn declare(
        context: Context<'_>,
        formula: &mut Formula,
        allowed: &[Vec<bool>],
    ) -> Result<Self, Interrupted> {
        let Context { task, limits } = context;
        let mut declared = Self::default();
        let mut possible: Vec<Vec<bool>> =
            task.variables.iter().map(|v| vec![false; v.values.len()]).collect();
        for (variable, value) in task.initial.values.iter().enumerate() {
            possible[variable][*value as usize] = true;
        }
        // A derived variable that has a rule is evaluated again at every step, so both values are possible at
        // every step.
        for values in &mut possible[task.basic..] {
            values[1] = true;
        }
        for rule in task.axioms.iter().flat_map(|layer| &layer.rules) {
            possible[rule.head.variable.index()][rule.head.value as usize] = true;
        }
        declared.values.push(values(formula, &possible, 0));
        for (step, allowed) in allowed.iter().enumerate() {
            let mut present = Vec::new();
            for item in limits.watch(task.operators.iter().zip(OperatorId::all(task.operators.len()))) {
                let (operator, id) = item?;
                let is_possible = |fact: &Fact| possible[fact.variable.index()][fact.value as usize];
                if allowed[id.index()] && operator.condition.facts.iter().all(is_possible) {
                    let meaning = VariableMeaning::Operator { operator: id.0, step: dense(step) };
                    present.push((id, formula.fresh(meaning)));
                }
            }
            for (id, _) in &present {
                let operator = &task.operators[id.index()];
                let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
                for effect in operator.effects.iter().chain(conditional) {
                    possible[effect.variable.index()][effect.value as usize] = true;
                }
            }
            declared.designs.push(designs(task, formula, &present, step));
            declared.operators.push(present);
            declared.values.push(values(formula, &possible, step + 1));
        }
        Ok(declared)
    }

    pub(super) fn horizon(&self) -> usize {
        self.operators.len()
    }

    /// Returns the literal of a fact before a step (or after the last step, if `step` is the horizon).
    pub(super) fn fact(&self, fact: Fact, step: usize) -> Lit {
        self.values[step][fact.variable.index()][fact.value as usize]
    }

    pub(super) fn literal(&self, literal: Literal, step: usize) -> Lit {
        let fact = self.fact(literal.fact, step);
        if literal.positive { fact } else { !fact }
    }

    pub(super) fn operator(&self, step: usize, id: OperatorId) -> Option<Lit> {
        let candidates = &self.operators[step];
        candidates.binary_search_by_key(&id, |(id, _)| *id).ok().map(|index| candidates[index].1)
    }
}

fn values(formula: &mut Formula, possible: &[Vec<bool>], step: usize) -> Vec<Vec<Lit>> {
    let mut literals_by_variable = Vec::with_capacity(possible.len());
    for (variable, values) in possible.iter().enumerate() {
        // A value that is the only possible one is a constant and needs no variable.
        let single = values.iter().filter(|possible| **possible).count() == 1;
        let mut literals = Vec::with_capacity(values.len());
        for (value, possible) in values.iter().enumerate() {
            literals.push(match (possible, single) {
                (false, _) => !Formula::truth(),
                (true, true) => Formula::truth(),
                (true, false) => {
                    let (variable, value, step) = (dense(variable), dense(value), dense(step));
                    formula.fresh(VariableMeaning::Value { variable, value, step })
                }
            });
        }
        literals_by_variable.push(literals);
    }
    literals_by_variable
}

fn designs(task: &Task, formula: &mut Formula, present: &[(OperatorId, Lit)], step: usize) -> Vec<Vec<Lit>> {
    let mut used: Vec<Vec<bool>> = task.slots.iter().map(|slot| vec![false; slot.designs.len()]).collect();
    for slot in present.iter().flat_map(|(id, _)| task.operators[id.index()].slots.iter()) {
        for design in &slot.designs {
            used[slot.slot.index()][*design as usize] = true;
        }
    }
    let mut literals_by_slot = Vec::with_capacity(used.len());
    for (slot, used) in used.into_iter().enumerate() {
        let mut literals = Vec::with_capacity(used.len());
        for (design, used) in used.into_iter().enumerate() {
            let meaning =
                VariableMeaning::Design { slot: dense(slot), design: dense(design), step: dense(step) };
            literals.push(if used { formula.fresh(meaning) } else { !Formula::truth() });
        }
        literals_by_slot.push(literals);
    }
    literals_by_slot
}
