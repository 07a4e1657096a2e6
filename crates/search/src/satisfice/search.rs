//! Lazy greedy best-first search with preferred operators, then weighted A\* with decreasing weights.
//!
//! A state is evaluated when it is expanded, and its successors are queued with its values \[1\]: the cost of the
//! relaxed plan and the number of required landmarks, in turns. The first search counts steps, the next ones
//! costs, with smaller and smaller weights \[2\]. A search that ends without a plan is exhaustive, except for
//! states without a relaxed plan.
//!
//! - \[1\] M. Helmert: The Fast Downward planning system, JAIR 26, 2006, section 5.
//! - \[2\] S. Richter, M. Westphal: The LAMA planner, JAIR 39, 2010, section 6.

use task::limits::{Interrupted, LimitPoll, Limits};
use task::plan::ground::{GroundPlan, GroundStep, cost};
use task::task::number::TaskNumber;
use task::task::{OperatorId, State};

use crate::satisfice::alternating_open_list::AlternatingOpenList;
use crate::satisfice::search_context::{SearchContext, USELESS_OPERATOR_COST};
use crate::satisfice::store::Store;
use crate::search::SearchStatistics;

/// What it takes to make the next state and to see whether it is new, in nodes and propositions of a relaxed task.
const GENERATION_COST: u64 = 200;

/// How states are ordered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum HeuristicWeight {
    /// By estimates alone.
    Greedy,
    /// By the cost so far and so many times the estimate.
    Times(u64),
}

struct Node<N> {
    parent: u32,
    /// The step from the parent, by number.
    step: u32,
    cost: N,
    /// The same in prices.
    price: u64,
}

/// What became of a search.
pub(super) enum Outcome<N> {
    /// A plan that is cheaper than the limit.
    Plan(GroundPlan<N>),
    /// Nothing is left: there is no such plan, unless something was left out.
    Exhausted,
    /// It may go on.
    Paused,
}

/// A search that can be gone on with.
pub(super) struct Search<N> {
    weight: HeuristicWeight,
    prices: Vec<u32>,
    /// What a step costs on average.
    mean: u32,
    store: Store<N>,
    nodes: Vec<Node<N>>,
    /// Which landmarks were reached, so many words for each state.
    reached: Vec<u64>,
    open: AlternatingOpenList<u64>,
    /// The best value by each estimate.
    best: [u32; 2],
    /// Whether states were left out because their numbers do not fit, or because they are too dear.
    pub(super) incomplete: bool,
}

impl<N: TaskNumber> Search<N> {
    pub(super) fn new(known: &mut SearchContext<'_, N>, weight: HeuristicWeight, prices: Vec<u32>) -> Self {
        let estimates = if known.status.is_empty() { 1 } else { 2 };
        let useful = prices.iter().filter(|price| **price < USELESS_OPERATOR_COST);
        let sum: u64 = useful.clone().map(|price| u64::from(*price)).sum();
        let mean = sum.checked_div(useful.count() as u64).unwrap_or(1);
        let mut search = Self {
            mean: u32::try_from(mean).unwrap_or(u32::MAX).max(1),
            weight,
            prices,
            store: Store::new(known.task),
            nodes: Vec::new(),
            reached: Vec::new(),
            open: AlternatingOpenList::new([false, true].repeat(estimates)),
            best: [u32::MAX; 2],
            incomplete: false,
        };
        let initial = known.task.initial.clone();
        let reached = known.status.initially(&known.relaxation, &initial);
        search.store.insert(&initial);
        search.nodes.push(Node { parent: 0, step: 0, cost: N::zero(), price: 0 });
        search.reached.extend(&reached);
        search.look(known, 0, &initial, &reached);
        search
    }

    /// Words that the search occupies, about.
    pub(super) fn size(&self) -> usize {
        self.store.size().saturating_add(self.reached.len()).saturating_add(self.open.size())
    }

    /// Looks for a plan that costs less than `limit` until so much work is done, in nodes and propositions.
    pub(super) fn run(
        &mut self,
        known: &mut SearchContext<'_, N>,
        limit: Option<&N>,
        mut work: u64,
        limits: &Limits,
        figures: &mut SearchStatistics,
    ) -> Result<Outcome<N>, Interrupted> {
        let mut pulse: LimitPoll<'_> = limits.pulse();
        let look = known.size();
        while work > 0 {
            pulse.beat()?;
            let Some((parent, step)) = self.open.pop() else { return Ok(Outcome::Exhausted) };
            work = work.saturating_sub(GENERATION_COST);
            figures.generated = figures.generated.saturating_add(1);
            let (operator, choice, cost) = known.step(step);
            if known.pairs.as_ref().is_some_and(|pairs| pairs.is_operator_useless(operator)) {
                continue;
            }
            let (total, price) = {
                let parent = &self.nodes[parent as usize];
                let Some(total) = parent.cost.plus(cost).filter(N::is_moderate) else {
                    self.incomplete = true;
                    continue;
                };
                (total, parent.price.saturating_add(self.prices[operator.index()].into()))
            };
            if limit.is_some_and(|limit| total >= *limit) {
                self.incomplete = true;
                continue;
            }
            let before = self.store.get(parent);
            let Some(state) = known.task.successor(&known.task.operators[operator.index()], &before, choice)
            else {
                self.incomplete = true;
                continue;
            };
            if known.pairs.as_ref().is_some_and(|pairs| pairs.is_dead_end(&before.values, &state.values)) {
                continue;
            }
            let (id, is_new) = self.store.insert(&state);
            if !is_new && (self.weight == HeuristicWeight::Greedy || total >= self.nodes[id as usize].cost) {
                continue;
            }
            let stride = known.status.stride();
            let start = (parent as usize).saturating_mul(stride);
            let before = self.reached[start..start.saturating_add(stride)].to_vec();
            let mut reached = known.status.progress(&known.relaxation, &before, &state);
            let node = Node { parent, step, cost: total, price };
            if is_new {
                self.nodes.push(node);
                self.reached.extend(&reached);
            } else {
                self.nodes[id as usize] = node;
                let start = (id as usize).saturating_mul(stride);
                for (new, old) in reached.iter_mut().zip(&mut self.reached[start..]) {
                    *new &= *old;
                    *old = *new;
                }
            }
            work = work.saturating_sub(look);
            figures.evaluated = figures.evaluated.saturating_add(1);
            figures.expanded = figures.expanded.saturating_add(1);
            if known.task.is_goal(&state) {
                return Ok(Outcome::Plan(self.plan(known, id)));
            }
            self.look(known, id, &state, &reached);
        }
        Ok(Outcome::Paused)
    }

    /// Estimates a state and notes its steps.
    fn look(&mut self, known: &mut SearchContext<'_, N>, id: u32, state: &State<N>, reached: &[u64]) {
        let Some(relaxed) = known.explorer.estimate(&known.relaxation, &self.prices, state) else { return };
        let left = known.status.remaining(reached);
        let mut progress = false;
        for (best, value) in self.best.iter_mut().zip([relaxed, left]) {
            if value < *best {
                *best = value;
                progress = true;
            }
        }
        if progress {
            self.open.boost();
        }
        known.status.request_landmark(reached);
        let (steps, preferred) = known.steps(state);
        let value = |estimate: u32| match self.weight {
            HeuristicWeight::Greedy => estimate.into(),
            HeuristicWeight::Times(weight) => {
                weight.saturating_mul(estimate.into()).saturating_add(self.nodes[id as usize].price)
            }
        };
        let landmarks = left.saturating_mul(self.mean);
        let (relaxed, landmarks) = (value(relaxed), value(landmarks));
        self.open.push(id, [relaxed, relaxed, landmarks, landmarks], &steps, &preferred);
    }

    fn plan(&self, known: &SearchContext<'_, N>, goal: u32) -> GroundPlan<N> {
        let mut steps = Vec::new();
        let mut at = goal;
        while at != 0 {
            let node = &self.nodes[at as usize];
            let (operator, choice, _): (OperatorId, &[u32], &N) = known.step(node.step);
            steps.push(GroundStep { operator, choice: choice.to_vec() });
            at = node.parent;
        }
        steps.reverse();
        // States on the way may have become cheaper since.
        let cost = cost(known.task, &steps).unwrap_or_else(|| self.nodes[goal as usize].cost.clone());
        GroundPlan { steps, cost }
    }
}
