//! Order of the steps of a plan: which steps interfere, and random linear extensions of this partial order.
//!
//! Two steps interfere if one of them assigns a variable that the other reads or assigns \[1\]. Exchanging
//! neighbours that do not interfere changes neither the result nor the applicability. With derived variables,
//! or with more than `MAX_STEPS` steps, all steps count as interfering.
//!
//! \[1\] C. Bäckström: Computational aspects of reordering plans, JAIR 9, 1998.

use rustc_hash::FxHashMap;

use task::number::dense;
use task::plan::ground::GroundStep;
use task::task::Task;
use task::task::number::TaskNumber;

use crate::random::Random;

/// Longer plans keep their order, because the number of pairs grows with the square of the number of steps.
const MAX_STEPS: usize = 1_000;

pub(super) struct StepOrder {
    /// For each step: earlier steps that must stay before it, in ascending order. By transitivity, this
    /// orders all interfering steps. Empty if all steps keep their order.
    before: Vec<Vec<u32>>,
}

/// A variable of a task: whether it is numeric, and its index.
type VariableKey = (bool, u32);

impl StepOrder {
    pub(super) fn new<N: TaskNumber>(task: &Task<N>, steps: &[GroundStep]) -> Self {
        let count = steps.len();
        if !task.axioms.is_empty() || count > MAX_STEPS {
            return Self { before: Vec::new() };
        }
        let mut before = vec![Vec::new(); count];
        let mut last_write: FxHashMap<VariableKey, u32> = FxHashMap::default();
        let mut reads_since: FxHashMap<VariableKey, Vec<u32>> = FxHashMap::default();
        for (index, step) in (0_u32..).zip(steps) {
            let (reads, writes) = accesses(task, step);
            let earlier: &mut Vec<u32> = &mut before[index as usize];
            for variable in &reads {
                earlier.extend(last_write.get(variable));
            }
            for variable in &writes {
                earlier.extend(last_write.get(variable));
                earlier.extend(reads_since.get(variable).into_iter().flatten());
            }
            earlier.sort_unstable();
            earlier.dedup();
            earlier.retain(|other| *other != index);
            for variable in reads {
                reads_since.entry(variable).or_default().push(index);
            }
            for variable in writes {
                last_write.insert(variable, index);
                reads_since.remove(&variable);
            }
        }
        Self { before }
    }

    /// Returns the steps in a random order in which no two interfering steps are exchanged. A step often
    /// follows a step that it interferes with.
    pub(super) fn shuffle(&self, steps: &[GroundStep], random: &mut Random) -> Vec<GroundStep> {
        if self.before.len() != steps.len() {
            return steps.to_vec();
        }
        let mut after = vec![Vec::new(); steps.len()];
        let mut missing: Vec<usize> = Vec::with_capacity(steps.len());
        for (index, earlier) in (0_u32..).zip(&self.before) {
            missing.push(earlier.len());
            for other in earlier {
                after[*other as usize].push(index);
            }
        }
        let mut ready: Vec<u32> =
            (0..dense(steps.len())).filter(|index| missing[*index as usize] == 0).collect();
        let mut order = Vec::with_capacity(steps.len());
        // The last ready step was enabled last, so it usually interferes with the step before.
        while !ready.is_empty() {
            let position =
                if random.below(8) == 0 { random.below(ready.len()) } else { ready.len().saturating_sub(1) };
            let index = ready.remove(position);
            order.push(steps[index as usize].clone());
            let first = ready.len();
            for next in &after[index as usize] {
                let count = &mut missing[*next as usize];
                *count = count.saturating_sub(1);
                if *count == 0 {
                    ready.push(*next);
                }
            }
            let enabled = ready.len().saturating_sub(first);
            if enabled > 1 {
                ready[first..].rotate_left(random.below(enabled));
            }
        }
        order
    }
}

fn accesses<N: TaskNumber>(task: &Task<N>, step: &GroundStep) -> (Vec<VariableKey>, Vec<VariableKey>) {
    let operator = &task.operators[step.operator.index()];
    let condition = &operator.condition;
    let literals = condition.clauses.iter().flatten();
    let literals = literals.chain(operator.conditional.iter().flat_map(|effect| &effect.condition));
    let facts = condition.facts.iter().map(|fact| fact.variable);
    let mut reads: Vec<VariableKey> = facts
        .chain(literals.map(|literal| literal.fact.variable))
        .map(|variable| (false, variable.0))
        .collect();
    let values = operator.numeric_effects.iter().map(|effect| &effect.value);
    let terms = condition.linears().chain(values).flat_map(|linear| &linear.coefficients);
    reads.extend(terms.map(|(variable, _)| (true, variable.0)));
    let effects =
        operator.effects.iter().chain(operator.conditional.iter().flat_map(|effect| &effect.effects));
    let mut writes: Vec<VariableKey> = effects.map(|fact| (false, fact.variable.0)).collect();
    writes.extend(operator.numeric_effects.iter().map(|effect| (true, effect.variable.0)));
    (reads, writes)
}

#[cfg(test)]
mod tests {
    use task::limits::Limits;
    use task::plan::ground::pass;
    use testing::{depot, fleet, ground_text};

    use super::*;
    use crate::satisfice::{Satisficer, StepResult};

    const ORDERS: usize = 20;

    #[test]
    fn random_orders_of_a_plan_are_plans_with_the_same_result() {
        let limits = Limits::none();
        let mut changed = 0;
        for text in (0..20).map(fleet).chain((0..20).map(depot)) {
            let task = ground_text(text.clone());
            let context = task::context::Context::new(&task, &limits);
            let Some(mut satisficer) = Satisficer::new(context).expect("no limit") else { continue };
            let Ok(StepResult::Plan(plan)) = satisficer.run(None, 100_000_000) else { continue };
            let order = StepOrder::new(&task, &plan.steps);
            let mut random = Random(1);
            let end = |steps: &[GroundStep]| pass(&task, &task.initial, steps)?.pop();
            for _ in 0..ORDERS {
                let steps = order.shuffle(&plan.steps, &mut random);
                assert_eq!(end(&steps), end(&plan.steps), "{steps:?}: {text:?}");
                assert!(end(&steps).is_some() && steps.len() == plan.steps.len());
                changed += usize::from(steps != plan.steps);
            }
        }
        assert!(changed > ORDERS, "{changed} orders differ from the order of the plan");
    }
}
