//! Preprocessed task of a search, independent of the initial state: applicable operators and their costs.

use task::context::Context;
use task::limits::Interrupted;
use task::number::{Int, dense};
use task::plan::ground::GroundStep;
use task::task::OperatorId;
use task::task::number::TaskNumber;

use crate::search::design_combinations::{CostedCombinations, pareto_optimal_combinations};
use crate::search::monotonicity::is_monotone;
use crate::search::successor_generator::SuccessorGenerator;

/// What a search needs to know of a task, whatever state it begins in.
pub struct SearchTask<N = Int> {
    /// For each operator its combinations of designs that no other one dominates, with their costs.
    pub(super) choices: Vec<CostedCombinations<N>>,
    /// For each operator the number of its first combination; at the end, how many there are.
    pub(super) numbers: Vec<u32>,
    pub(super) index: SuccessorGenerator,
    /// What the dearest combination costs.
    dearest: N,
}

impl<N: TaskNumber> SearchTask<N> {
    /// None if some operator has too many combinations of designs.
    ///
    /// # Errors
    /// Fails when a limit is reached.
    pub fn new(context: Context<'_, N>) -> Result<Option<Self>, Interrupted> {
        let Context { task, limits } = context;
        let monotone = is_monotone(task);
        let mut choices = Vec::with_capacity(task.operators.len());
        for operator in limits.watch(&task.operators) {
            let Some(own) = pareto_optimal_combinations(operator?, monotone, false, limits)? else {
                return Ok(None);
            };
            choices.push(own);
        }
        let mut numbers = vec![0_u32];
        let mut all = 0_u32;
        for own in &choices {
            let Some(next) = all.checked_add(dense(own.len())) else { return Ok(None) };
            numbers.push(next);
            all = next;
        }
        let dearest = choices.iter().flatten().map(|(_, cost)| cost).max().cloned();
        let dearest = dearest.unwrap_or_else(N::zero);
        Ok(Some(Self { choices, numbers, index: SuccessorGenerator::new(task), dearest }))
    }

    /// The operator of a combination, by number.
    pub(super) fn step(&self, number: u32) -> GroundStep {
        let operator = self.numbers.partition_point(|first| *first <= number).saturating_sub(1);
        let choice = number.saturating_sub(self.numbers[operator]);
        let choice = self.choices[operator][choice as usize].0.clone();
        GroundStep { operator: OperatorId(dense(operator)), choice }
    }

    /// The fewest steps that can cost so much.
    pub(super) fn steps_at_least(&self, cost: &N) -> u32 {
        if self.dearest > N::zero() { cost.times_at_least(&self.dearest) } else { 0 }
    }
}
