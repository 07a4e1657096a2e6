//! Precomputed operator data of a search, independent of the initial state: an index for finding applicable
//! operators, and the designs and costs of each operator.

use task::context::Context;
use task::limits::Interrupted;
use task::number::{Int, dense};
use task::plan::ground::GroundStep;
use task::task::OperatorId;
use task::task::number::TaskNumber;

use crate::search::design_combinations::{CostedCombinations, pareto_optimal_combinations};
use crate::search::monotonicity::is_monotone;
use crate::search::successor_generator::SuccessorGenerator;

/// Precomputed operator data of a task, independent of the initial state.
pub struct SearchTask<N = Int> {
    pub(super) choices: Vec<CostedCombinations<N>>,
    /// For each operator: the index of its first combination among all combinations. The last
    /// element is the number of combinations.
    pub(super) numbers: Vec<u32>,
    pub(super) index: SuccessorGenerator,
    dearest: N,
}

impl<N: TaskNumber> SearchTask<N> {
    /// Precomputes the data. Returns `None` if an operator has too many combinations of designs, or their
    /// total number exceeds `u32`.
    ///
    /// # Errors
    /// Fails if the deadline has passed or the interrupt flag is set.
    pub fn new(context: Context<'_, N>) -> Result<Option<Self>, Interrupted> {
        let Context { task, limits } = context;
        let monotone = is_monotone(task);
        let mut choices = Vec::with_capacity(task.operators.len());
        for operator in limits.watch(&task.operators) {
            let Some(combinations) = pareto_optimal_combinations(operator?, monotone, false, limits)? else {
                return Ok(None);
            };
            choices.push(combinations);
        }
        let mut numbers = vec![0_u32];
        let mut total = 0_u32;
        for combinations in &choices {
            let Some(next) = total.checked_add(dense(combinations.len())) else { return Ok(None) };
            numbers.push(next);
            total = next;
        }
        let max_cost = choices.iter().flatten().map(|(_, cost)| cost).max().cloned();
        let max_cost = max_cost.unwrap_or_else(N::zero);
        Ok(Some(Self { choices, numbers, index: SuccessorGenerator::new(task), dearest: max_cost }))
    }

    pub(super) fn step(&self, number: u32) -> GroundStep {
        let operator = self.numbers.partition_point(|first| *first <= number).saturating_sub(1);
        let choice = number.saturating_sub(self.numbers[operator]);
        let choice = self.choices[operator][choice as usize].0.clone();
        GroundStep { operator: OperatorId(dense(operator)), choice }
    }

    /// Lower bound on the number of steps whose costs add up to at least `cost`; 0 if no operator has a positive
    /// cost.
    pub(super) fn steps_at_least(&self, cost: &N) -> u32 {
        if self.dearest > N::zero() { cost.times_at_least(&self.dearest) } else { 0 }
    }
}
