//! A\* with Pareto dominance over numeric variables. Returns a cheapest plan, and among these a plan with the
//! fewest steps if the open list has the order `Fewest`. The same code runs the greedy best-first search.
//!
//! States with equal finite-domain variables are compared by cost and by numeric variables. If a higher value
//! of a numeric variable is never worse (for example battery charge), a state dominates another state that
//! costs more, or as much with at least as many steps, and has no higher values. This is label setting for
//! resource-constrained shortest paths \[1\]. The result is exact if the search ends before its limits and no
//! number overflows.
//!
//! The open list of A\* is sorted by path cost plus heuristic value. Ties are broken by a lower bound on the
//! number of steps, then by depth. A plan is optimal once no open node can lead to a cheaper plan. With the
//! order `Fewest`, the search continues until no open node can lead to a plan of equal cost with fewer steps
//! either.
//!
//! \[1\] M. Desrochers, F. Soumis: A generalized permanent labelling algorithm for the shortest path problem
//! with time windows, INFOR 26(3), 1988.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use task::context::Context;
use task::limits::{Interrupted, LimitPoll, Limits};
use task::number::Int;
use task::plan::ground::GroundPlan;
use task::task::number::TaskNumber;
use task::task::{Fact, OperatorId, State, Task};

use crate::search::heuristic::{Heuristic, LazyHeuristic};
use crate::search::monotonicity::{Polarity, directions};
use crate::search::open_list::OpenList;
use crate::search::search_task::SearchTask;
use crate::search::state_registry::{MAX_NODES, NONE, ParentLink, StateRegistry};
use crate::search::statistics::SearchStatistics;
use crate::search::stubborn_sets::StubbornSetPruning;
use crate::search::symmetry::Orbits;

/// Work units charged for an expansion: popping the node and finding the applicable operators.
const EXPANSION_COST: u64 = 2_000;
/// Work units charged for each combination of designs of an applicable operator: applying it and looking up the
/// successor.
const GENERATION_COST: u64 = 600;
/// Length of a trial in evaluations. After each trial, the improving heuristic is dropped if it raised too few f values.
const IMPROVING_TRIAL: u64 = 5_000;
/// Divisor: the improving heuristic must raise at least 1/25 of the f values that it evaluates in a trial.
const IMPROVING_SHARE: u64 = 25;
/// Work units charged for each operator in the stubborn set.
const STUBBORN_SET_COST: u64 = 10;

/// Outcome of a search for an optimal plan.
#[derive(Debug)]
pub enum SearchOutcome<N = Int> {
    /// A cheapest plan. If a single A\* search with the order `OpenListOrder::Fewest` found it, also the
    /// shortest among the cheapest plans.
    Optimal(GroundPlan<N>),
    /// Proof that no plan exists (within the cost limit of the search, if it has one): no open node remains,
    /// and pruning never removes all cheapest plans.
    None,
    /// No proof, for example because a limit on time, memory or states was reached, a number overflowed, or
    /// the search was greedy. Contains the best plan found. Contains `None` if no plan was found, or if the
    /// search proved that no plan is cheaper than a plan of another component.
    Unknown(Option<GroundPlan<N>>),
}

/// A search problem: the task, the heuristic and precomputed operator data.
pub struct SearchProblem<'a, N, E> {
    pub context: Context<'a, N>,
    pub bounds: &'a E,
    pub prepared: &'a SearchTask<N>,
    /// Symmetries of interchangeable objects. If set, states with the same canonical state count as equal.
    pub orbits: Option<Arc<Orbits>>,
}

/// Sort order of the open list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OpenListOrder {
    /// By f value (path cost plus heuristic value), then by a lower bound on the length of the plan. Finds a
    /// cheapest plan with the fewest steps.
    Fewest,
    /// By f value (path cost plus heuristic value), then by a lower bound on the steps to the goal. Finds a
    /// cheapest plan of any length.
    Nearest,
    /// By heuristic value only, ignoring the path cost (greedy best-first search).
    Greedy,
}

/// Reaction to a forecast that the search will run out of memory before it can finish.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OutOfMemoryPolicy {
    None,
    /// Ignore forecasts; the last forecast was favourable, or nothing was forecast.
    Some,
    /// Ignore forecasts; the last forecast was unfavourable.
    Needed,
}

/// Sort key of an open node: f value (heuristic value in greedy search), lower bound on steps (of the plan or
/// to the goal, see `OpenListOrder`; 0 in greedy search), and a tie-breaker that prefers deep nodes.
type NodeKey<N> = (N, u32, u32);

fn later(steps: u32) -> u32 {
    u32::MAX.saturating_sub(steps)
}

/// A resumable A\* search, or greedy best-first search with the order `OpenListOrder::Greedy`.
pub struct AStar<'a, N, E> {
    task: &'a Task<N>,
    limits: &'a Limits,
    bounds: &'a E,
    prepared: &'a SearchTask<N>,
    pub(super) store: StateRegistry<N>,
    open: OpenList<NodeKey<N>>,
    /// `true` if states were dropped because a number overflowed. The search then proves nothing.
    states_dropped: bool,
    order: OpenListOrder,
    /// Slower heuristic that is usually more accurate. It is evaluated only when a node is about to be
    /// expanded (lazy A\*).
    pub(super) lazy_heuristic: Option<Box<dyn LazyHeuristic<N>>>,
    /// Heuristic that improves during the search, shared with other searches. It is evaluated whenever a node is
    /// about to be expanded, before the lazy heuristic.
    pub(super) improving_heuristic: Option<SharedHeuristic<N>>,
    /// Numbers of evaluations of the improving heuristic, and of raised f values, in the current trial.
    trial: (u64, u64),
    pub(super) pruning: Option<StubbornSetPruning>,
    /// Work units without those of the lazy heuristic.
    own_work: u64,
    sharing: usize,
    /// Lower bound on the cost of every plan, or the upper bound if this is lower. `None` until a node was taken
    /// from the open list. Not a bound in greedy search, or if `states_dropped` is `true`.
    bound: Option<N>,
    is_interrupted: bool,
    pub(super) patience: OutOfMemoryPolicy,
    best: Option<u32>,
    /// Cost of the best known plan (the incumbent), or a cost limit set by the caller. More expensive nodes
    /// are pruned.
    limit: Option<N>,
    incumbent_is_external: bool,
    /// Number of steps of the incumbent if this search found it. Nodes of equal cost must lead to shorter
    /// plans.
    fewest: Option<u32>,
    /// Number of stored states at which the first sample for the memory forecast is taken.
    first_look: usize,
    /// Lower bound on the plan cost at each doubling of the number of stored states.
    progress: Vec<N>,
    pub(crate) statistics: SearchStatistics,
    state: State<N>,
    next: State<N>,
}

/// A heuristic that several searches of a task evaluate in turns.
pub(super) type SharedHeuristic<N> = Rc<RefCell<Box<dyn LazyHeuristic<N>>>>;

/// Progress callback. Receives the upper bound on the plan cost, if any (the cost of the best known plan, or
/// a limit set by the caller), and the lower bound on the cost of every plan.
pub type ProgressCallback<'a, N> = &'a mut dyn FnMut(Option<&N>, &N);

impl<'a, N: TaskNumber, E: Heuristic<N>> AStar<'a, N, E> {
    pub(super) fn new(
        space: &SearchProblem<'a, N, E>,
        initial: &State<N>,
        order: OpenListOrder,
        limit: Option<N>,
    ) -> Self {
        Self::with_polarities(space, initial, order, limit, directions(space.context.task))
    }

    pub(super) fn with_polarities(
        space: &SearchProblem<'a, N, E>,
        initial: &State<N>,
        order: OpenListOrder,
        limit: Option<N>,
        polarities: Vec<Polarity>,
    ) -> Self {
        let SearchProblem { context: Context { task, limits }, bounds, prepared, ref orbits } = *space;
        let mut search = AStar {
            task,
            limits,
            bounds,
            prepared,
            store: StateRegistry::new(task, polarities, orbits.clone(), limits.thresholds().front),
            open: OpenList::new(),
            states_dropped: false,
            order,
            lazy_heuristic: None,
            improving_heuristic: None,
            trial: (0, 0),
            pruning: None,
            own_work: 0,
            sharing: 1,
            bound: None,
            is_interrupted: false,
            patience: OutOfMemoryPolicy::None,
            best: None,
            limit,
            incumbent_is_external: false,
            fewest: None,
            first_look: limits.thresholds().progress.max(1),
            progress: Vec::new(),
            statistics: SearchStatistics::default(),
            state: initial.clone(),
            next: initial.clone(),
        };
        search.push(N::zero(), &N::zero(), ParentLink { parent: NONE, step: NONE, steps: 0 });
        search
    }

    /// Runs the search to its end. Returns `None` if the search first stores more than `max_states` states or
    /// reaches the memory limit.
    pub(super) fn run_until_states(
        &mut self,
        max_states: usize,
        hear: ProgressCallback<'_, N>,
    ) -> Option<SearchOutcome<N>> {
        self.resume(max_states, u64::MAX, hear)
    }

    /// Searches until the total work exceeds `work` units. Returns `None` if the search can be resumed. If the
    /// memory limit is reached, the outcome is `Unknown` with the best plan.
    pub(super) fn run_for_work(
        &mut self,
        work: u64,
        hear: ProgressCallback<'_, N>,
    ) -> Option<SearchOutcome<N>> {
        let outcome = self.resume(usize::MAX, work, hear);
        if outcome.is_none() && !self.has_memory() {
            Some(SearchOutcome::Unknown(self.best_plan()))
        } else {
            outcome
        }
    }

    fn resume(
        &mut self,
        max_states: usize,
        work: u64,
        hear: ProgressCallback<'_, N>,
    ) -> Option<SearchOutcome<N>> {
        let mut pulse = self.limits.pulse();
        let mut reported: Option<(Option<N>, N)> = None;
        while self.store.len() <= max_states && self.has_memory() && self.work() <= work {
            let Some((key, id)) = self.open.pop() else { return Some(self.outcome_when_exhausted()) };
            if self.store.is_dominated(id) {
                continue;
            }
            // No open node has a smaller key, so the first node that cannot improve the incumbent ends the
            // search.
            let (total, least, _) = &key;
            if self.can_stop_at(total, *least) {
                return Some(self.outcome_when_exhausted());
            }
            // Within a call of this method, the callback is called again only if a value has changed.
            let is_reported = |(limit, bound): &(Option<N>, N)| *limit == self.limit && *bound == *total;
            if !self.states_dropped && !reported.as_ref().is_some_and(is_reported) {
                hear(self.limit.as_ref(), total);
                reported = Some((self.limit.clone(), total.clone()));
            }
            if self.bound.as_ref().is_none_or(|bound| bound < total) {
                self.bound = Some(total.clone());
            }
            if self.proves_upper_bound() {
                return Some(SearchOutcome::Unknown(None));
            }
            // The shift by the number of samples yields one sample for each doubling of the number of states.
            if self.store.len() >> self.progress.len() >= self.first_look {
                self.progress.extend(self.bound.clone());
                let is_hopeful = self.expects_to_finish();
                if self.patience != OutOfMemoryPolicy::None {
                    self.patience =
                        if is_hopeful { OutOfMemoryPolicy::Some } else { OutOfMemoryPolicy::Needed };
                } else if !is_hopeful {
                    return Some(SearchOutcome::Unknown(self.best_plan()));
                }
            }
            self.store.unpack(id, &mut self.state);
            let Some((total, ..)) = self.reevaluate(id, key) else {
                // Many nodes may be raised in a row, without an expansion that polls the limits.
                if pulse.beat().is_err() {
                    self.is_interrupted = true;
                    return Some(SearchOutcome::Unknown(self.best_plan()));
                }
                continue;
            };
            if self.expand(id, &total, &mut pulse).is_err() {
                self.is_interrupted = true;
                return Some(SearchOutcome::Unknown(self.best_plan()));
            }
        }
        None
    }

    /// Evaluates the improving and the lazy heuristic for a node that is about to be expanded. Returns its key,
    /// or `None` if the node was pruned or reinserted with a higher key.
    fn reevaluate(&mut self, id: u32, key: NodeKey<N>) -> Option<NodeKey<N>> {
        if let Some(improving) = &self.improving_heuristic {
            let mut heuristic = improving.borrow_mut();
            let before = heuristic.work();
            let estimate = heuristic.estimate(&self.state);
            let work = heuristic.work().saturating_sub(before);
            drop(heuristic);
            self.own_work = self.own_work.saturating_add(work);
            let is_raised = estimate.is_none_or(|estimate| self.is_raised(id, &key, &estimate));
            self.end_trial(is_raised);
            if is_raised {
                return None;
            }
        }
        let Some(sharper) = &mut self.lazy_heuristic else { return Some(key) };
        if !self.store.mark_reevaluated(id) {
            return Some(key);
        }
        let estimate = sharper.estimate(&self.state)?;
        if self.is_raised(id, &key, &estimate) { None } else { Some(key) }
    }

    /// Counts an evaluation of the improving heuristic. Stops using the heuristic if it raised too few f values,
    /// because evaluations cost time.
    #[expect(clippy::arithmetic_side_effects, reason = "counters that are reset after `IMPROVING_TRIAL`")]
    fn end_trial(&mut self, is_raised: bool) {
        let (evaluations, raised) = &mut self.trial;
        *evaluations += 1;
        *raised += u64::from(is_raised);
        if *evaluations == IMPROVING_TRIAL {
            if *raised < IMPROVING_TRIAL / IMPROVING_SHARE {
                self.improving_heuristic = None;
            }
            self.trial = (0, 0);
        }
    }

    /// Returns `true` if a heuristic value raises the f value of a node, or the f value overflows. A raised node is
    /// inserted again with a higher key, unless it cannot improve the incumbent.
    fn is_raised(&mut self, id: u32, key: &NodeKey<N>, estimate: &N) -> bool {
        let Some(total) = self.store.cost(id).plus(estimate) else {
            self.states_dropped = true;
            return true;
        };
        if total <= key.0 {
            return false;
        }
        let steps = self.store.origin(id).steps;
        let to_go = self.prepared.steps_at_least(estimate);
        let least = steps.saturating_add(to_go);
        if !self.exceeds_upper_bound(&total) && !self.is_dominated_by_incumbent(&total, least) {
            let rank = if self.order == OpenListOrder::Nearest { to_go } else { key.1.max(least) };
            self.open.push((total, rank, key.2), id);
        }
        true
    }

    pub(super) fn work(&self) -> u64 {
        self.own_work.saturating_add(self.lazy_heuristic.as_ref().map_or(0, |sharper| sharper.work()))
    }

    /// Returns `true` if neither a node with this f value and this lower bound on the number of
    /// steps nor any later node can improve the plan that this search has found. A greedy search
    /// stops at its first plan.
    fn can_stop_at(&self, cost: &N, steps: u32) -> bool {
        if self.order == OpenListOrder::Greedy {
            return self.best.is_some();
        }
        let (Some(limit), Some(fewest)) = (&self.limit, self.fewest) else { return false };
        (limit, if self.order == OpenListOrder::Nearest { 0 } else { fewest }) <= (cost, steps)
    }

    pub(super) fn upper_bound(&self) -> Option<&N> {
        self.limit.as_ref()
    }

    /// Lowers the upper bound on the plan cost to `cost`, unless it is already lower. Plans with exactly this
    /// cost are not pruned. The search must not have found a plan.
    pub(super) fn set_upper_bound_inclusive(&mut self, cost: &N) {
        if self.limit.as_ref().is_none_or(|limit| cost < limit) {
            self.limit = Some(cost.clone());
        }
    }

    /// Sets the cost of an incumbent that another component found, if it is below the upper bound.
    /// The plan of this search is then discarded. The search ends once the lower bound reaches the
    /// cost.
    pub(crate) fn set_upper_bound(&mut self, cost: N) {
        if self.limit.as_ref().is_none_or(|limit| cost < *limit) {
            self.limit = Some(cost);
            self.fewest = None;
            self.best = None;
            self.incumbent_is_external = true;
        }
    }

    pub(super) fn proves_upper_bound(&self) -> bool {
        self.incumbent_is_external && self.limit == self.bound
    }

    /// Returns `true` if no state was dropped because a number overflowed.
    pub(super) fn is_complete(&self) -> bool {
        !self.states_dropped
    }

    pub(super) fn is_interrupted(&self) -> bool {
        self.is_interrupted
    }

    pub(super) fn set_memory_share(&mut self, count: usize) {
        self.sharing = count.max(1);
    }

    pub(super) fn bound(&self) -> Option<&N> {
        self.bound.as_ref()
    }

    /// Returns the expected lower bound after `times` further doublings of the number of states, if
    /// each of them raises the bound as much as the last doubling did. Returns `None` before the
    /// second sample, or if a sum overflows.
    #[expect(clippy::arithmetic_side_effects, reason = "sums of costs that fit")]
    pub(super) fn forecast_lower_bound(&self, times: u32) -> Option<N> {
        let [.., before, now] = &self.progress[..] else { return None };
        let step = now.clone() + -before.clone();
        (0..times).try_fold(self.bound.clone()?, |bound, _| bound.plus(&step))
    }

    fn room(&self) -> usize {
        self.limits.room().checked_div(self.sharing).unwrap_or(0)
    }

    fn has_memory(&self) -> bool {
        let improving = self.improving_heuristic.as_ref();
        let shared = improving.map_or(0, |heuristic| heuristic.borrow().bytes());
        let bytes = self.store.bytes().saturating_add(self.open.bytes()).saturating_add(shared);
        bytes <= self.room() && self.store.len() < MAX_NODES
    }

    /// Returns `false` if the lower bound is not expected to reach the upper bound on the plan cost
    /// before the memory limit is reached. The forecast assumes that each doubling of the number of
    /// states raises the lower bound as much as the last doubling did. There is no forecast without
    /// an upper bound or two samples, or if the lower bound does not rise.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of costs that fit, and less than what is limited by memory"
    )]
    fn expects_to_finish(&self) -> bool {
        let (Some(limit), [.., before, now]) = (&self.limit, &self.progress[..]) else { return true };
        let (step, remaining) = (now.clone() + -before.clone(), limit.clone() + -now.clone());
        // If the bound does not rise, the number of states does not predict the remaining work.
        if remaining <= N::zero() || step <= N::zero() {
            return true;
        }
        let bytes = self.store.bytes().saturating_add(self.open.bytes());
        let doublings = self.room().checked_div(bytes).map_or(0, usize::ilog2);
        let reachable_rise = (0..=doublings).try_fold(N::zero(), |sum: N, _| sum.plus(&step));
        reachable_rise.is_none_or(|reachable_rise| reachable_rise >= remaining)
    }

    fn outcome_when_exhausted(&self) -> SearchOutcome<N> {
        match self.best_plan() {
            plan if self.states_dropped || self.order == OpenListOrder::Greedy => {
                SearchOutcome::Unknown(plan)
            }
            Some(plan) => SearchOutcome::Optimal(plan),
            None => SearchOutcome::None,
        }
    }

    pub(super) fn best_plan(&self) -> Option<GroundPlan<N>> {
        self.best.map(|goal| self.plan(goal))
    }

    fn applicable(&mut self) -> Vec<OperatorId> {
        let mut applicable = self.prepared.index.applicable(self.task, &self.state);
        if let Some(choosing) = &mut self.pruning {
            let size = choosing.prune_operators(self.task, &self.state.values, &mut applicable);
            self.own_work = self.own_work.saturating_add(size.saturating_mul(STUBBORN_SET_COST));
            // Computing stubborn sets costs time, so pruning is disabled if it removes too few operators.
            if choosing.prunes_too_little() {
                self.pruning = None;
            }
        }
        applicable
    }

    /// Generates the successors of a node, whose state is in `self.state`, with the combinations of designs
    /// that are not dominated. Operators that stubborn sets exclude are skipped. If interrupted, some
    /// successors are missing, and the search must end.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "steps are fewer than nodes, combinations are numbered"
    )]
    fn expand(&mut self, id: u32, total: &N, pulse: &mut LimitPoll<'_>) -> Result<(), Interrupted> {
        let (task, prepared) = (self.task, self.prepared);
        task.evaluate_axioms(&mut self.state);
        self.own_work += EXPANSION_COST;
        let cost = self.store.cost(id).clone();
        let steps = self.store.origin(id).steps + 1;
        self.statistics.expanded += 1;
        for operator_id in self.applicable() {
            let operator = &task.operators[operator_id.index()];
            let sizes = operator.sizes();
            let first = prepared.numbers[operator_id.index()];
            for ((choice, step), number) in prepared.choices[operator_id.index()].iter().zip(first..) {
                pulse.beat()?;
                self.own_work += GENERATION_COST;
                if operator.condition.holds_numerically(&self.state.numbers, choice, &sizes) {
                    self.next.clone_from(&self.state);
                    let applied = operator.apply(&self.state, choice, &mut self.next);
                    match (applied, cost.plus(step)) {
                        (Some(()), Some(cost)) => {
                            self.push(cost, total, ParentLink { parent: id, step: number, steps });
                        }
                        _ => self.states_dropped = true,
                    }
                }
            }
        }
        Ok(())
    }

    /// Adds the state `self.next` to the registry and the open list, unless it is dominated, a dead end, or cannot
    /// improve the incumbent, or its f value overflows. A stored goal state becomes the incumbent. The derived
    /// variables of the state need not be evaluated. `through` is the f value of the parent.
    fn push(&mut self, cost: N, through: &N, origin: ParentLink) {
        self.statistics.generated = self.statistics.generated.saturating_add(1);
        if self.exceeds_upper_bound(&cost) {
            return;
        }
        let Some(vacancy) = self.store.look_up(&self.next, &cost, origin.steps) else { return };
        self.statistics.evaluated = self.statistics.evaluated.saturating_add(1);
        let Some(estimate) = self.bounds.estimate(&self.next) else { return };
        let Some(total) = cost.plus(&estimate).filter(N::is_moderate) else {
            self.states_dropped = true;
            return;
        };
        // The f value is at least that of the parent, so f never decreases along a path (pathmax), even if
        // the heuristic is inconsistent.
        let total = if self.order == OpenListOrder::Greedy { total } else { total.max(through.clone()) };
        let least = origin.steps.saturating_add(self.prepared.steps_at_least(&estimate));
        if self.exceeds_upper_bound(&total) || self.is_dominated_by_incumbent(&total, least) {
            return;
        }
        let id = self.store.insert(&vacancy, origin);
        if self.is_goal() {
            self.best = Some(id);
            self.fewest = Some(origin.steps);
            self.limit = Some(cost);
            self.incumbent_is_external = false;
        }
        let key = match self.order {
            OpenListOrder::Greedy => (estimate, 0, 0),
            OpenListOrder::Nearest => (total, least.saturating_sub(origin.steps), later(origin.steps)),
            OpenListOrder::Fewest => (total, least, later(origin.steps)),
        };
        self.open.push(key, id);
    }

    fn exceeds_upper_bound(&self, cost: &N) -> bool {
        self.limit.as_ref().is_some_and(|limit| cost > limit)
    }

    /// Returns `true` if this search found the incumbent, and no plan with at least this cost and number of
    /// steps is better.
    fn is_dominated_by_incumbent(&self, cost: &N, steps: u32) -> bool {
        let (Some(limit), Some(fewest)) = (&self.limit, self.fewest) else { return false };
        (limit, fewest) <= (cost, steps)
    }

    /// Returns `true` if `self.next` is a goal state. Evaluates its derived variables if necessary.
    fn is_goal(&mut self) -> bool {
        let values = &self.next.values[..self.task.basic];
        let is_basic = |fact: &&Fact| fact.variable.index() < values.len();
        if !self.task.goal.facts.iter().filter(is_basic).all(|fact| fact.holds(values)) {
            return false;
        }
        self.task.evaluate_axioms(&mut self.next);
        self.task.is_goal(&self.next)
    }

    fn plan(&self, goal: u32) -> GroundPlan<N> {
        let mut steps = Vec::new();
        let mut at = goal;
        while let ParentLink { parent, step, .. } = self.store.origin(at)
            && parent != NONE
        {
            steps.push(self.prepared.step(step));
            at = parent;
        }
        steps.reverse();
        GroundPlan { steps, cost: self.store.cost(goal).clone() }
    }
}
