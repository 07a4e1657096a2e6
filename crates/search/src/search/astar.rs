//! A\* with Pareto dominance over numeric variables. Among the cheapest plans it returns one with the fewest steps.
//!
//! States with equal finite-domain variables are compared by cost and by numeric variables. Where a higher
//! value is never worse (a battery), a state is dominated by another one that costs no more and has at least
//! as much of everything. This is label setting for resource-constrained shortest paths \[1\]. The answer is
//! exact if the search ends before its limits.
//!
//! The open list is sorted by cost plus heuristic value. Ties are broken by the fewest estimated steps to the
//! goal, then by depth. A plan is optimal once no open node can be cheaper, or as cheap with fewer steps.
//!
//! \[1\] M. Desrochers, F. Soumis: A generalized permanent labelling algorithm for the shortest path problem
//! with time windows, INFOR 26(3), 1988.

use std::sync::Arc;

use task::context::Context;
use task::limits::{Interrupted, LimitPoll, Limits};
use task::number::Int;
use task::plan::ground::GroundPlan;
use task::task::number::TaskNumber;
use task::task::{Fact, OperatorId, State, Task};

use crate::search::heuristic::{Heuristic, LazyHeuristic};
use crate::search::open_list::OpenList;
use crate::search::search_task::SearchTask;
use crate::search::state_registry::{NONE, ParentLink, StateRegistry};
use crate::search::statistics::SearchStatistics;
use crate::search::stubborn_sets::StubbornSetPruning;
use crate::search::symmetry::Orbits;

/// What it takes to take a state and to see what can be done in it, in steps of a computer…
const EXPANSION_COST: u64 = 2_000;
/// … and to make a state after it, and to look it up.
const GENERATION_COST: u64 = 600;
/// What it takes to see which other operators an operator makes worth looking at, too.
const STUBBORN_SET_COST: u64 = 10;

/// What the search found.
#[derive(Debug)]
pub enum SearchOutcome<N = Int> {
    /// A cheapest plan.
    Optimal(GroundPlan<N>),
    /// There is no plan: every reachable state was visited, or is dominated by one that was.
    None,
    /// A limit was reached first; the best plan so far.
    Unknown(Option<GroundPlan<N>>),
}

/// What a search goes through, and by which estimates.
pub struct SearchProblem<'a, N, E> {
    pub context: Context<'a, N>,
    pub bounds: &'a E,
    pub prepared: &'a SearchTask<N>,
    /// Set if states that interchangeable objects tell apart count as one.
    pub orbits: Option<Arc<Orbits>>,
}

/// Which node comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OpenListOrder {
    /// That with the least sum of cost and estimate, then with the fewest steps in all: the plan has fewest steps of the cheapest.
    Fewest,
    /// Of equal sums that with the fewest steps to go: the plan is cheapest.
    Nearest,
    /// That with the least estimate, whatever was paid.
    Greedy,
}

/// What becomes of a search that cannot come to the end with the memory that there is, if it goes on as it did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OutOfMemoryPolicy {
    /// It ends.
    None,
    /// It would go on.
    Some,
    /// It goes on.
    Needed,
}

/// The cost and the steps that count, and then what is further.
type NodeKey<N> = (N, u32, u32);

/// What is further comes first.
fn later(steps: u32) -> u32 {
    u32::MAX.saturating_sub(steps)
}

/// A search that can be gone on with.
pub struct AStar<'a, N, E> {
    task: &'a Task<N>,
    limits: &'a Limits,
    bounds: &'a E,
    prepared: &'a SearchTask<N>,
    pub(super) store: StateRegistry<N>,
    open: OpenList<NodeKey<N>>,
    /// Whether states were left out because their numbers do not fit.
    states_dropped: bool,
    order: OpenListOrder,
    /// Looked at, too, when a state is to be expanded.
    pub(super) lazy_heuristic: Option<Box<dyn LazyHeuristic<N>>>,
    /// Set if not all operators are applied that can be.
    pub(super) pruning: Option<StubbornSetPruning>,
    /// What it took so far apart from that, in steps of a computer.
    own_work: u64,
    /// Among how many searches memory is divided.
    sharing: usize,
    /// The lower bound so far.
    bound: Option<N>,
    is_interrupted: bool,
    pub(super) patience: OutOfMemoryPolicy,
    /// The best goal state so far.
    best: Option<u32>,
    /// What a known plan costs, if there is one: nothing dearer is looked at.
    limit: Option<N>,
    /// Whether that plan is none of this search.
    incumbent_is_external: bool,
    /// How many steps it has, if that counts: nothing as dear with as many is looked at.
    fewest: Option<u32>,
    /// Number of stored states at which the search first compares its progress with its memory.
    first_look: usize,
    /// How far the search was whenever the number of its states had doubled.
    progress: Vec<N>,
    pub(crate) statistics: SearchStatistics,
    /// The state that is expanded, and the one that it leads to.
    state: State<N>,
    next: State<N>,
}

/// Hears, while a search goes on, what the best plan so far costs, if there is one, and what none costs less than.
pub type ProgressCallback<'a, N> = &'a mut dyn FnMut(Option<&N>, &N);

impl<'a, N: TaskNumber, E: Heuristic<N>> AStar<'a, N, E> {
    pub(super) fn new(
        space: &SearchProblem<'a, N, E>,
        initial: &State<N>,
        order: OpenListOrder,
        limit: Option<N>,
    ) -> Self {
        let SearchProblem { context: Context { task, limits }, bounds, prepared, ref orbits } = *space;
        let mut search = AStar {
            task,
            limits,
            bounds,
            prepared,
            store: StateRegistry::new(task, orbits.clone(), limits.thresholds().front),
            open: OpenList::new(),
            states_dropped: false,
            order,
            lazy_heuristic: None,
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

    /// None if there are more states than `most` before anything is known; it may be called again.
    pub(super) fn run_until_states(
        &mut self,
        most: usize,
        hear: ProgressCallback<'_, N>,
    ) -> Option<SearchOutcome<N>> {
        self.resume(most, u64::MAX, hear)
    }

    /// None if there was more work than that before anything is known; it may be called again.
    pub(super) fn run_for_work(
        &mut self,
        work: u64,
        hear: ProgressCallback<'_, N>,
    ) -> Option<SearchOutcome<N>> {
        let found = self.resume(usize::MAX, work, hear);
        if found.is_none() && !self.has_memory() {
            Some(SearchOutcome::Unknown(self.best_plan()))
        } else {
            found
        }
    }

    fn resume(&mut self, most: usize, work: u64, hear: ProgressCallback<'_, N>) -> Option<SearchOutcome<N>> {
        let mut pulse = self.limits.pulse();
        let mut told: Option<(Option<N>, N)> = None;
        while self.store.len() <= most && self.has_memory() && self.work() <= work {
            let Some((key, id)) = self.open.pop() else { return Some(self.outcome_when_exhausted()) };
            if self.store.is_dominated(id) {
                continue;
            }
            let (total, least, _) = &key;
            if self.can_stop_at(total, *least) {
                return Some(self.outcome_when_exhausted());
            }
            let is_told = |(limit, bound): &(Option<N>, N)| *limit == self.limit && *bound == *total;
            if !self.states_dropped && !told.as_ref().is_some_and(is_told) {
                hear(self.limit.as_ref(), total);
                told = Some((self.limit.clone(), total.clone()));
            }
            if self.bound.as_ref().is_none_or(|bound| bound < total) {
                self.bound = Some(total.clone());
            }
            if self.proves_upper_bound() {
                return Some(SearchOutcome::Unknown(None));
            }
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
            let Some((total, ..)) = self.reevaluate(id, key) else { continue };
            if self.expand(id, &total, &mut pulse).is_err() {
                self.is_interrupted = true;
                return Some(SearchOutcome::Unknown(self.best_plan()));
            }
        }
        None
    }

    /// Looks closer at the state that is to be expanded; none if it has to wait, or to go.
    fn reevaluate(&mut self, id: u32, key: NodeKey<N>) -> Option<NodeKey<N>> {
        let Some(sharper) = &mut self.lazy_heuristic else { return Some(key) };
        if !self.store.mark_reevaluated(id) {
            return Some(key);
        }
        let estimate = sharper.estimate(&self.state)?;
        let total = self.store.cost(id).plus(&estimate)?;
        if total <= key.0 {
            return Some(key);
        }
        let steps = self.store.origin(id).steps;
        let to_go = self.prepared.steps_at_least(&estimate);
        let least = steps.saturating_add(to_go);
        if !self.exceeds_upper_bound(&total) && !self.is_dominated_by_incumbent(&total, least) {
            let rank = if self.order == OpenListOrder::Nearest { to_go } else { key.1.max(least) };
            self.open.push((total, rank, key.2), id);
        }
        None
    }

    /// What it took so far, in steps of a computer.
    pub(super) fn work(&self) -> u64 {
        self.own_work.saturating_add(self.lazy_heuristic.as_ref().map_or(0, |sharper| sharper.work()))
    }

    /// Whether nothing that comes with such a cost and so many steps, or later, is better than the plan that is known.
    fn can_stop_at(&self, cost: &N, steps: u32) -> bool {
        if self.order == OpenListOrder::Greedy {
            return self.best.is_some();
        }
        let (Some(limit), Some(fewest)) = (&self.limit, self.fewest) else { return false };
        (limit, if self.order == OpenListOrder::Nearest { 0 } else { fewest }) <= (cost, steps)
    }

    /// What a known plan costs.
    pub(super) fn upper_bound(&self) -> Option<&N> {
        self.limit.as_ref()
    }

    /// A plan that costs this much is known; one as cheap is looked for all the same.
    pub(super) fn set_upper_bound_inclusive(&mut self, cost: &N) {
        if self.limit.as_ref().is_none_or(|limit| cost < limit) {
            self.limit = Some(cost.clone());
        }
    }

    /// A plan that costs this much is known: nothing dearer is looked at, and it ends once no plan can be cheaper.
    pub(crate) fn set_upper_bound(&mut self, cost: N) {
        if self.limit.as_ref().is_none_or(|limit| cost < *limit) {
            self.limit = Some(cost);
            self.fewest = None;
            self.best = None;
            self.incumbent_is_external = true;
        }
    }

    /// Whether no plan costs less than the one that it was told of.
    pub(super) fn proves_upper_bound(&self) -> bool {
        self.incumbent_is_external && self.limit == self.bound
    }

    /// Whether a limit of time ended it.
    pub(super) fn is_interrupted(&self) -> bool {
        self.is_interrupted
    }

    /// Memory is divided among so many searches.
    pub(super) fn set_memory_share(&mut self, count: usize) {
        self.sharing = count.max(1);
    }

    /// What no plan costs less than.
    pub(super) fn bound(&self) -> Option<&N> {
        self.bound.as_ref()
    }

    /// What that may be once there are twice as many states so many times, if it goes on as it did.
    #[expect(clippy::arithmetic_side_effects, reason = "sums of costs that fit")]
    pub(super) fn forecast_lower_bound(&self, times: u32) -> Option<N> {
        let [.., before, now] = &self.progress[..] else { return None };
        let step = now.clone() + -before.clone();
        (0..times).try_fold(self.bound.clone()?, |bound, _| bound.plus(&step))
    }

    fn room(&self) -> usize {
        self.limits.room().checked_div(self.sharing).unwrap_or(0)
    }

    /// Whether memory is left.
    fn has_memory(&self) -> bool {
        self.store.bytes().saturating_add(self.open.bytes()) <= self.room()
    }

    /// Whether the search can come to the cost of the best plan known before memory is full, if it goes on as it did while the number of its
    /// states doubled last.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of costs that fit, and less than what is limited by memory"
    )]
    fn expects_to_finish(&self) -> bool {
        let (Some(limit), [.., before, now]) = (&self.limit, &self.progress[..]) else { return true };
        let (step, left) = (now.clone() + -before.clone(), limit.clone() + -now.clone());
        // Where costs do not grow, states say nothing of what is left.
        if left <= N::zero() || step <= N::zero() {
            return true;
        }
        let bytes = self.store.bytes().saturating_add(self.open.bytes());
        let doublings = self.room().checked_div(bytes).map_or(0, usize::ilog2);
        let enough = (0..=doublings).try_fold(N::zero(), |sum: N, _| sum.plus(&step));
        enough.is_none_or(|enough| enough >= left)
    }

    /// The answer if nothing that is left can be better.
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

    /// The operators whose propositional condition holds in the state, ascending; those that are enough.
    fn applicable(&mut self) -> Vec<OperatorId> {
        let mut applicable = self.prepared.index.applicable(self.task, &self.state);
        if let Some(choosing) = &mut self.pruning {
            let size = choosing.prune_operators(self.task, &self.state.values, &mut applicable);
            self.own_work = self.own_work.saturating_add(size.saturating_mul(STUBBORN_SET_COST));
            if choosing.prunes_too_little() {
                self.pruning = None;
            }
        }
        applicable
    }

    /// Adds all that can be reached by one step from a node, whose state is unpacked. A node whose expansion is interrupted is not expanded, so that the
    /// search must end there.
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

    /// Adds the next state, whose derived variables have no values yet, unless it is no good. No plan through it costs less than
    /// `through`, as one through the state before does.
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

    /// Whether a known plan is no worse than one with this cost and so many steps.
    fn is_dominated_by_incumbent(&self, cost: &N, steps: u32) -> bool {
        let (Some(limit), Some(fewest)) = (&self.limit, self.fewest) else { return false };
        (limit, fewest) <= (cost, steps)
    }

    /// Whether the next state satisfies the goal.
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
