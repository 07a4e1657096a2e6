//! Data that all satisficing searches of a task share.

use std::sync::Arc;

use num_traits::ToPrimitive as _;
use task::context::Context;
use task::limits::Interrupted;
use task::number::dense;
use task::task::number::TaskNumber;
use task::task::{OperatorId, State, Task};

use crate::satisfice::delete_relaxation::Relaxation;
use crate::satisfice::ff_heuristic::FfHeuristic;
use crate::satisfice::landmark_status::LandmarkStatus;
use crate::satisfice::landmarks::Landmarks;
use crate::search::design_combinations::pareto_optimal_combinations;
use crate::search::{MutexPairs, SearchStatistics, is_monotone};

/// A search ends if `Search::size` exceeds the memory limit in bytes divided by this number. `Search::size` counts
/// words of 8 bytes, and a search may use at most half of the memory limit.
pub(super) const MEMORY_SHARE: usize = 16;
/// Work units charged for generating a successor and looking it up in the store.
pub(super) const GENERATION_COST: u64 = 200;
pub(super) const USELESS_OPERATOR_COST: u32 = 1 << 20;

struct Step<N> {
    operator: OperatorId,
    choice: Vec<u32>,
    cost: N,
}

pub(super) struct SearchContext<'a, N> {
    pub(super) task: &'a Task<N>,
    pub(super) relaxation: Relaxation<N>,
    pub(super) explorer: FfHeuristic,
    pub(super) status: LandmarkStatus,
    /// The h² mutexes; `None` if they are not computed yet, or their computation exceeded its limits.
    pub(super) pairs: Option<MutexPairs>,
    /// Results of [`SearchContext::prices`], for unit costs and for scaled costs, once computed.
    prices: [Option<Arc<[u32]>>; 2],
    steps: Vec<Step<N>>,
    /// Index of the first step of each operator, followed by the number of steps.
    first: Vec<u32>,
}

impl<'a, N: TaskNumber> SearchContext<'a, N> {
    /// Prepares the data of a task. Returns `None` if an operator has too many combinations of designs.
    pub(super) fn new(context: Context<'a, N>) -> Result<Option<Self>, Interrupted> {
        let Context { task, limits } = context;
        let monotone = is_monotone(task);
        let (mut steps, mut first) = (Vec::new(), Vec::new());
        for item in limits.watch(task.operators.iter().zip(OperatorId::all(task.operators.len()))) {
            let (schema, operator) = item?;
            first.push(dense(steps.len()));
            let Some(choices) = pareto_optimal_combinations(schema, monotone, false, limits)? else {
                return Ok(None);
            };
            steps.extend(choices.into_iter().map(|(choice, cost)| Step { operator, choice, cost }));
        }
        first.push(dense(steps.len()));
        let relaxation = Relaxation::new(task, limits)?;
        let explorer = FfHeuristic::new(&relaxation, task.operators.len());
        let status = LandmarkStatus::new(Landmarks::new(task, &relaxation, limits)?, &relaxation);
        Ok(Some(Self { task, relaxation, explorer, status, pairs: None, prices: [None, None], steps, first }))
    }

    /// Sets the h² mutexes. They change the operator costs, which are computed again.
    pub(super) fn set_pairs(&mut self, pairs: Option<MutexPairs>) {
        self.pairs = pairs;
        self.prices = [None, None];
    }

    /// Returns the operator costs of a search: the scaled costs if `priced`, otherwise 1 each. Useless
    /// operators have the cost [`USELESS_OPERATOR_COST`].
    pub(super) fn prices(&mut self, priced: bool) -> Arc<[u32]> {
        if let Some(prices) = &self.prices[usize::from(priced)] {
            return Arc::clone(prices);
        }
        let mut prices = if priced { self.operator_costs() } else { vec![1; self.task.operators.len()] };
        if let Some(pairs) = &self.pairs {
            let useless = prices.iter_mut().zip(OperatorId::all(self.task.operators.len()));
            let useless = useless.filter(|(_, id)| pairs.is_operator_useless(*id));
            useless.for_each(|(price, _)| *price = USELESS_OPERATOR_COST);
        }
        Arc::clone(self.prices[usize::from(priced)].insert(prices.into()))
    }

    pub(super) fn size(&self) -> u64 {
        self.relaxation.propositions.saturating_add(self.relaxation.operators.len()) as u64
    }

    pub(super) fn work(&self, before: SearchStatistics, after: SearchStatistics) -> u64 {
        let evaluated = after.evaluated.saturating_sub(before.evaluated);
        let generated = after.generated.saturating_sub(before.generated);
        evaluated.saturating_mul(self.size()).saturating_add(generated.saturating_mul(GENERATION_COST))
    }

    pub(super) fn step(&self, step: u32) -> (OperatorId, &[u32], &N) {
        let Step { operator, choice, cost } = &self.steps[step as usize];
        (*operator, choice, cost)
    }

    /// Returns the applicable steps of `state`, and the preferred steps among them: those of operators that
    /// belong to the relaxed plan or achieve a wanted landmark. `state` must be the state that was evaluated
    /// last.
    pub(super) fn steps(&mut self, state: &State<N>) -> (Vec<u32>, Vec<u32>) {
        self.explorer.applicable.sort_unstable();
        self.explorer.preferred.sort_unstable();
        let (mut steps, mut preferred) = (Vec::new(), Vec::new());
        for operator in &self.explorer.applicable {
            let schema = &self.task.operators[*operator as usize];
            // The relaxation is more permissive than the task, for example for derived variables that must be
            // false. Conditions are therefore checked here.
            if !schema.condition.holds_propositionally(&state.values) {
                continue;
            }
            let is_preferred =
                self.explorer.preferred.binary_search(operator).is_ok() || self.brings_landmark(*operator);
            let sizes = schema.sizes();
            let next = (*operator as usize).saturating_add(1);
            for step in self.first[*operator as usize]..self.first[next] {
                if schema.condition.holds_numerically(
                    &state.numbers,
                    &self.steps[step as usize].choice,
                    &sizes,
                ) {
                    steps.push(step);
                    if is_preferred {
                        preferred.push(step);
                    }
                }
            }
        }
        (steps, preferred)
    }

    fn brings_landmark(&self, operator: u32) -> bool {
        let effects = &self.task.operators[operator as usize].effects;
        effects.iter().any(|fact| self.status.is_wanted(self.relaxation.fact(*fact)))
    }

    /// Returns operator costs (with the cheapest designs) scaled to integers: positive costs are scaled to a
    /// mean of about 10 and capped at 100,000, and 1 is added to every cost.
    pub(super) fn operator_costs(&self) -> Vec<u32> {
        let costs: Vec<f64> =
            self.task.operators.iter().map(|operator| operator.cost.minimum().approximate()).collect();
        let positive: Vec<f64> = costs.iter().copied().filter(|cost| *cost > 0.0).collect();
        let count = positive.len().to_f64().unwrap_or(1.0).max(1.0);
        let mean = positive.iter().sum::<f64>() / count;
        let price = |cost: &f64| {
            let scaled = if *cost > 0.0 { (10.0 * cost / mean).round().min(100_000.0) } else { 0.0 };
            scaled.to_u32().unwrap_or(0).saturating_add(1)
        };
        costs.iter().map(price).collect()
    }
}
