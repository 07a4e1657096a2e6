//! Scheduling of searches: a first plan, an optimal plan, and the closed states that prove its optimality.
//!
//! `search` alternates several searches. `search_states` and `search_from` run a single A\* search; if this
//! search finds no plan soon and has no cost limit, a greedy search provides an upper bound.
//!
//! In `search`, A\* with pattern databases runs first. If it finds no plan soon, a greedy best-first search
//! provides an upper bound. Then two A\* searches alternate: both use pattern databases, the second also LM-cut.
//! After some work, they share online cost partitioning; computing its abstractions earlier would take longer
//! than most proofs. The LM-cut search first gets a quarter of the other's work, and later the same work. After
//! much work, a search whose lower bound lags behind that of the other gets half of the work, and is finally
//! abandoned. The result of the search that finishes first is returned. Work is counted in units instead of
//! time, so the result without a time limit is deterministic.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use task::context::Context;
use task::limits::Interrupted;
use task::number::{Int, dense};
use task::plan::ground::GroundPlan;
use task::task::State;
use task::task::number::TaskNumber;

use crate::bounds::Bounds;
use crate::search::astar::{
    AStar, OpenListOrder, OutOfMemoryPolicy, ProgressCallback, SearchOutcome, SearchProblem,
};
use crate::search::heuristic::Heuristic;
use crate::search::monotonicity::uniform_directions;
use crate::search::search_task::SearchTask;
use crate::search::statistics::SearchStatistics;
use crate::search::stubborn_sets::{Stubborn, StubbornSetPruning};

/// Maximum number of stored states of a search that must answer quickly or whose closed states are written to a
/// certificate. Also the number of states up to which the LM-cut search gets only a quarter of the work.
pub const STATE_LIMIT: usize = 400_000;
/// The greedy best-first search may store at least this number of states, unless `max_states` is lower.
const LEAST: usize = 100;
/// Number of work units that correspond to one stored state in the budgets of alternating searches.
const WORK_PER_STATE: u64 = 2_500;
/// Work units of each alternating search, counted from its start, from which on a lagging search is abandoned.
const ABANDON_WORK: u64 = 100_000_000_000;

/// Searches for an optimal plan. All operators must have non-negative costs. Ends without a proof, for example,
/// if memory does not suffice (by a forecast or in fact), if the deadline passes, or if there are too many
/// combinations of designs.
pub fn search(context: Context<'_>, bounds: &Bounds) -> SearchOutcome {
    let Ok(Some(prepared)) = SearchTask::new(context) else { return SearchOutcome::Unknown(None) };
    let space = || SearchProblem { context, bounds, prepared: &prepared, orbits: None };
    let mut searches = InterleavedSearch::new(space(), &context.task.initial);
    let mut greedy_plan: Option<GroundPlan> = None;
    let soon = context.limits.thresholds().states.max(1);
    let mut max_states = soon;
    loop {
        match searches.run(max_states, &mut |_, _| {}) {
            Some(SearchOutcome::Unknown(plan)) => {
                // A plan of the greedy search is optimal if its cost equals the proved lower bound.
                let is_met = |plan: &GroundPlan| searches.bound.as_ref() == Some(&plan.cost);
                return match cheaper(plan, greedy_plan) {
                    Some(plan) if is_met(&plan) => SearchOutcome::Optimal(plan),
                    plan => SearchOutcome::Unknown(plan),
                };
            }
            Some(outcome) => return outcome,
            None => {}
        }
        // A long A\* run without a plan has no upper bound for pruning. The cost of a greedy plan provides
        // one.
        if max_states == soon && searches.best_plan().is_none() {
            greedy_plan = greedy_best_first(&space(), &context.task.initial, usize::MAX);
            if let Some(plan) = &greedy_plan {
                searches.set_upper_bound(&plan.cost);
            }
        }
        max_states = max_states.saturating_mul(2);
    }
}

/// Searches for an optimal plan with A\* from the initial state. Ends without a proof, with the best plan
/// found, once A\* has stored more than `max_states` states. If A\* finds no plan soon, a greedy search
/// provides an upper bound.
pub fn search_states<N: TaskNumber>(
    context: Context<'_, N>,
    bounds: &impl Heuristic<N>,
    max_states: usize,
) -> SearchOutcome<N> {
    match SearchTask::new(context) {
        Ok(Some(prepared)) => {
            let space = SearchProblem { context, bounds, prepared: &prepared, orbits: None };
            search_within(&space, &context.task.initial, None, max_states, &mut |_, _| {})
        }
        Ok(None) | Err(Interrupted) => SearchOutcome::Unknown(None),
    }
}

/// Searches with A\* from the state `initial` for an optimal plan with a cost of at most `limit`; `Int::MAX`
/// means no limit. Ends without a proof, with the best plan found, once A\* has stored more than `max_states`
/// states. If A\* finds no plan soon and there is no limit, a greedy search provides an upper bound.
pub fn search_from(
    space: &SearchProblem<'_, Int, Bounds>,
    initial: &State,
    limit: Int,
    max_states: usize,
    hear: ProgressCallback<'_, Int>,
) -> SearchOutcome {
    let limit = (limit < Int::MAX).then_some(limit);
    search_within(space, initial, limit, max_states, hear)
}

fn search_within<N: TaskNumber, E: Heuristic<N>>(
    space: &SearchProblem<'_, N, E>,
    initial: &State<N>,
    limit: Option<N>,
    max_states: usize,
    hear: ProgressCallback<'_, N>,
) -> SearchOutcome<N> {
    let has_incumbent = limit.is_some();
    let mut search = AStar::new(space, initial, OpenListOrder::Fewest, limit);
    if let Some(outcome) =
        search.run_until_states(space.context.limits.thresholds().states.min(max_states), hear)
    {
        return outcome;
    }
    let mut greedy_plan = None;
    if search.best_plan().is_none() && !has_incumbent {
        greedy_plan = greedy_best_first(space, initial, max_states);
        if let Some(plan) = &greedy_plan {
            search.set_upper_bound_inclusive(&plan.cost);
        }
    }
    match search.run_until_states(max_states, hear) {
        Some(SearchOutcome::Unknown(plan)) => SearchOutcome::Unknown(cheaper(plan, greedy_plan)),
        Some(outcome) => outcome,
        None => SearchOutcome::Unknown(cheaper(search.best_plan(), greedy_plan)),
    }
}

/// Searches greedily for a plan. Stores at most as many states as the threshold `states` (but at least
/// [`LEAST`]) and `max_states` allow.
fn greedy_best_first<N: TaskNumber, E: Heuristic<N>>(
    space: &SearchProblem<'_, N, E>,
    initial: &State<N>,
    max_states: usize,
) -> Option<GroundPlan<N>> {
    let mut greedy = AStar::new(space, initial, OpenListOrder::Greedy, None);
    let states = space.context.limits.thresholds().states.max(LEAST);
    greedy.run_until_states(states.min(max_states), &mut |_, _| {});
    greedy.best_plan()
}

/// Two A\* searches of a task that alternate. Both use pattern databases, and later a shared heuristic that
/// improves. The second search also evaluates LM-cut lazily; it is added if the first call of `run` does not
/// finish and LM-cut is available.
pub struct InterleavedSearch<'a, N, E> {
    space: SearchProblem<'a, N, E>,
    initial: State<N>,
    searches: Vec<AStar<'a, N, E>>,
    has_begun: bool,
    /// `true` if the improving heuristic was computed, or is not available.
    has_improving: bool,
    /// `true` if searches continue although memory is forecast to run out.
    is_patient: bool,
    bound: Option<N>,
    best: Option<GroundPlan<N>>,
    figures: SearchStatistics,
}

impl<'a, N: TaskNumber, E: Heuristic<N>> InterleavedSearch<'a, N, E> {
    pub fn new(space: SearchProblem<'a, N, E>, initial: &State<N>) -> Self {
        let searches = vec![AStar::new(&space, initial, OpenListOrder::Fewest, None)];
        Self {
            space,
            initial: initial.clone(),
            searches,
            has_begun: false,
            has_improving: false,
            is_patient: false,
            bound: None,
            best: None,
            figures: SearchStatistics::default(),
        }
    }

    /// Makes a search continue if memory is forecast to run out before it finishes. Without this setting,
    /// such a search ends. While its last forecast is unfavourable, a search does at most half of the work
    /// that [`Self::run`] otherwise allows for `max_states`. The first call of [`Self::run`] ignores this
    /// setting.
    #[must_use]
    pub fn continue_without_forecast(self) -> Self {
        Self { is_patient: true, ..self }
    }

    /// Returns `true` unless memory is forecast to run out in every search. Searches without a forecast count
    /// as hopeful.
    pub fn may_finish(&self) -> bool {
        self.searches.iter().any(|search| search.patience != OutOfMemoryPolicy::Needed)
    }

    /// Sets the cost of a plan that another component found. More expensive nodes are pruned, and a search that
    /// is already running ends once its lower bound reaches this cost.
    pub fn set_upper_bound(&mut self, cost: &N) {
        self.searches.iter_mut().for_each(|search| search.set_upper_bound(cost.clone()));
    }

    /// Returns the statistics summed over all searches, including abandoned searches.
    pub fn figures(&self) -> SearchStatistics {
        self.searches.iter().fold(self.figures, |sum, search| sum.plus(search.statistics))
    }

    /// Returns the best plan of all searches, including abandoned searches. A running search discards its plan
    /// when an upper bound below its cost is set.
    pub fn best_plan(&self) -> Option<GroundPlan<N>> {
        let plans = self.searches.iter().filter_map(AStar::best_plan);
        plans.fold(self.best.clone(), |best, plan| cheaper(best, Some(plan)))
    }

    /// Resumes all searches until each has done the work of `max_states` states. The first call
    /// runs a single search until it has stored `max_states` states. While `max_states` is at most
    /// `STATE_LIMIT`, the LM-cut search gets a quarter of the work. In all other cases, a search
    /// gets half if it lags behind or is forecast to run out of memory.
    ///
    /// Returns `None` if the searches are not finished. `SearchOutcome::Unknown(None)` alone proves nothing. This
    /// outcome is also returned if a search reaches the cost set by `set_upper_bound`; the proof is then the lower
    /// bound that `hear` has received.
    pub fn run(&mut self, max_states: usize, hear: ProgressCallback<'_, N>) -> Option<SearchOutcome<N>> {
        if !self.has_begun {
            let outcome = self.searches[0].run_until_states(max_states, hear);
            if outcome.is_none() {
                self.begin();
            }
            return outcome;
        }
        let until = WORK_PER_STATE.saturating_mul(max_states as u64);
        let count = self.searches.len();
        let mut ended = Vec::new();
        let thresholds = self.space.context.limits.thresholds();
        if !self.has_improving && until >= thresholds.partitioning {
            self.add_improving_heuristic(until);
        }
        let behind = if until >= thresholds.behind { lagging_search(&self.searches) } else { None };
        for position in 0..count {
            let bound = &mut self.bound;
            let mut report = |cost: Option<&N>, lower_bound: &N| {
                if bound.as_ref().is_none_or(|bound| lower_bound > bound) {
                    *bound = Some(lower_bound.clone());
                    hear(cost, lower_bound);
                }
            };
            let search = &mut self.searches[position];
            search.set_memory_share(count);
            // Most successful proofs are found early, and without LM-cut.
            let is_soon = search.lazy_heuristic.is_some() && max_states <= STATE_LIMIT;
            let is_doubtful = behind == Some(position) || search.patience == OutOfMemoryPolicy::Needed;
            let parts = match (is_soon, is_doubtful) {
                (true, _) => 4,
                (false, true) => 2,
                (false, false) => 1,
            };
            let outcome = search.run_for_work(until.checked_div(parts).unwrap_or(until), &mut report);
            let (is_met, is_interrupted) = (search.proves_upper_bound(), search.is_interrupted());
            let best = self.best_plan();
            match outcome {
                None => {}
                Some(SearchOutcome::Unknown(_)) if is_met => {
                    let optimal = best.filter(|plan| self.bound.as_ref() == Some(&plan.cost));
                    return Some(optimal.map_or(SearchOutcome::Unknown(None), SearchOutcome::Optimal));
                }
                Some(SearchOutcome::Unknown(_)) if is_interrupted => {
                    return Some(SearchOutcome::Unknown(best));
                }
                Some(SearchOutcome::Unknown(_)) => ended.push(position),
                Some(outcome) => return Some(outcome),
            }
            if let Some(plan) = best {
                let peers = self.searches.iter_mut().enumerate().filter(|(index, _)| *index != position);
                peers.for_each(|(_, peer)| peer.set_upper_bound(plan.cost.clone()));
            }
        }
        if ended.is_empty() && until >= ABANDON_WORK {
            ended.extend(behind);
        }
        // Positions are removed in descending order, so the other positions remain valid.
        for position in ended.into_iter().rev() {
            let search = self.searches.remove(position);
            self.figures = self.figures.plus(search.statistics);
            self.best = cheaper(self.best.take(), search.best_plan());
        }
        // No search can be resumed, so the result is the best plan without a proof.
        self.searches.is_empty().then(|| SearchOutcome::Unknown(self.best.clone()))
    }

    /// Adds the heuristic that improves during the search to all searches. The work for its abstractions is limited to
    /// about `work`.
    fn add_improving_heuristic(&mut self, work: u64) {
        self.has_improving = true;
        let SearchProblem { context, bounds, .. } = self.space;
        let Some(improving) = bounds.improving(context, work / 2) else { return };
        let shared = Rc::new(RefCell::new(improving));
        for search in &mut self.searches {
            search.improving_heuristic = Some(Rc::clone(&shared));
        }
    }

    /// Adds the LM-cut search, symmetry reduction and stubborn sets, as far as they are available.
    /// If there are symmetries, the first search restarts, because its stored states are not
    /// canonical.
    fn begin(&mut self) {
        self.has_begun = true;
        let SearchProblem { context, bounds, .. } = self.space;
        self.space.orbits = bounds.orbits(context).map(Arc::new);
        let limit = self.searches[0].upper_bound().cloned();
        if self.space.orbits.is_some() {
            self.best = self.best_plan();
            self.figures = self.figures();
            self.searches =
                vec![AStar::new(&self.space, &self.initial, OpenListOrder::Fewest, limit.clone())];
        }
        if let Some(lm_cut) = bounds.sharper(context.task) {
            let mut lm_cut_search = AStar::new(&self.space, &self.initial, OpenListOrder::Nearest, limit);
            lm_cut_search.lazy_heuristic = Some(lm_cut);
            self.searches.push(lm_cut_search);
        }
        let patience = if self.is_patient { OutOfMemoryPolicy::Some } else { OutOfMemoryPolicy::None };
        self.searches.iter_mut().for_each(|search| search.patience = patience);
        if let Some(stubborn) = Stubborn::new(context.task).map(Arc::new) {
            let trial = context.limits.thresholds().stubborn;
            for search in &mut self.searches {
                search.pruning = Some(StubbornSetPruning::new(Arc::clone(&stubborn), trial));
            }
        }
    }
}

/// Returns the index of the search that lags behind: its lower bound, extrapolated over two
/// doublings of its states, stays below the current lower bound of the other search. Returns `None`
/// if no search lags behind, or if there is only one search.
fn lagging_search<N: TaskNumber, E: Heuristic<N>>(searches: &[AStar<'_, N, E>]) -> Option<usize> {
    let [first, second] = searches else { return None };
    let is_behind = |search: &AStar<'_, N, E>, other: &AStar<'_, N, E>| {
        search.forecast_lower_bound(2).zip(other.bound()).is_some_and(|(then, bound)| then < *bound)
    };
    if is_behind(first, second) { Some(0) } else { is_behind(second, first).then_some(1) }
}

fn cheaper<N: Ord>(first: Option<GroundPlan<N>>, second: Option<GroundPlan<N>>) -> Option<GroundPlan<N>> {
    first.into_iter().chain(second).min_by(|a, b| (&a.cost, a.steps.len()).cmp(&(&b.cost, b.steps.len())))
}

/// A closed state: values of the basic variables, values of the numeric variables, and path cost.
pub type ClosedEntry<N> = (Vec<u32>, Vec<N>, N);

/// Reason why [`closed_labels`] has no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoLabels {
    /// A limit on time or memory was reached, or the run was interrupted.
    Limit,
    /// The search has stored more than [`STATE_LIMIT`] states.
    States,
    /// An operator, or all operators together, have too many combinations of designs.
    Combinations,
    /// The search has not confirmed the given cost, for example because a number became too large.
    Inconclusive,
}

/// Runs an A\* search and returns the closed states whose f value (path cost plus heuristic value) is below
/// `cost`, which must not exceed the cost of an optimal plan. If `cost` is `None`, there must be no plan, and
/// all closed states are returned.
///
/// The search ends at the first state whose f value is `cost`: the states on this plateau are no labels.
///
/// # Errors
/// Fails if a condition on `cost` does not hold, or if the search ends without a proof, see [`NoLabels`].
pub fn closed_labels<N: TaskNumber>(
    context: Context<'_, N>,
    bounds: &impl Heuristic<N>,
    cost: Option<&N>,
) -> Result<Vec<ClosedEntry<N>>, NoLabels> {
    let prepared = SearchTask::new(context).map_err(|Interrupted| NoLabels::Limit)?;
    let prepared = prepared.ok_or(NoLabels::Combinations)?;
    let task = context.task;
    let space = SearchProblem { context, bounds, prepared: &prepared, orbits: None };
    let polarities = uniform_directions(task);
    let mut search = AStar::with_polarities(&space, &task.initial, OpenListOrder::Nearest, None, polarities);
    if let Some(cost) = cost {
        search.set_upper_bound(cost.clone());
        // With this bound, the search would forecast its memory, and could give up.
        search.patience = OutOfMemoryPolicy::Some;
    }
    match (search.run_until_states(STATE_LIMIT, &mut |_, _| {}), cost) {
        (Some(SearchOutcome::Optimal(plan)), Some(cost)) if plan.cost >= *cost => {}
        (Some(SearchOutcome::None), _) => {}
        (Some(SearchOutcome::Unknown(None)), Some(_))
            if search.proves_upper_bound() && search.is_complete() => {}
        (None, _) if search.store.len() > STATE_LIMIT => return Err(NoLabels::States),
        (None, _) => return Err(NoLabels::Limit),
        _ if search.is_interrupted() => return Err(NoLabels::Limit),
        _ => return Err(NoLabels::Inconclusive),
    }
    let store = &search.store;
    let mut state = task.initial.clone();
    let label = |id: u32| {
        store.unpack(id, &mut state);
        let path_cost = store.cost(id);
        let total = bounds.estimate(&state).and_then(|more| path_cost.plus(&more))?;
        let is_below = cost.is_none_or(|cost| total < *cost);
        is_below.then(|| (state.values[..task.basic].to_vec(), state.numbers.clone(), path_cost.clone()))
    };
    let nodes = (0..dense(store.len())).filter(|id| !store.is_dominated(*id));
    Ok(nodes.filter_map(label).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use task::limits::Limits;
    use task::task::Task;
    use testing::adl::Generator;
    use testing::missions::Mission;
    use testing::random::Random;
    use testing::{depot, fleet, ground_text, optimum, successors};

    fn solve(
        task: &Task,
        order: OpenListOrder,
        [sharp, exchanged, chosen, improving]: [bool; 4],
    ) -> Option<(Int, usize)> {
        let limits = Limits::none();
        let context = Context::new(task, &limits);
        let bounds = Bounds::new(context).expect("no limit");
        let prepared = SearchTask::new(context).expect("no limit").expect("few choices");
        let orbits = if exchanged { bounds.orbits(context).map(Arc::new) } else { None };
        let space = SearchProblem { context, bounds: &bounds, prepared: &prepared, orbits };
        let mut search = AStar::new(&space, &task.initial, order, None);
        search.lazy_heuristic = if sharp { bounds.sharper(task) } else { None };
        let stubborn = if chosen { Stubborn::new(task) } else { None };
        if improving {
            let improving = bounds.improving(context, 100_000);
            search.improving_heuristic = improving.map(|improving| Rc::new(RefCell::new(improving)));
        }
        search.pruning = stubborn.map(|stubborn| StubbornSetPruning::new(Arc::new(stubborn), 1_000));
        match search.run_until_states(usize::MAX, &mut |_, _| {}) {
            Some(SearchOutcome::Optimal(plan)) => Some((plan.cost, plan.steps.len())),
            Some(SearchOutcome::None) => None,
            other => panic!("{other:?}"),
        }
    }

    /// Checks that every variant of the search finds the optimum of Dijkstra's algorithm, and that LM-cut
    /// never overestimates. Returns `true` if the optimum is positive.
    fn check(text: &(String, String)) -> bool {
        let task = ground_text(text.clone());
        if task.unreachable.is_some() {
            return false;
        }
        let cheapest = optimum(&task);
        let plain = solve(&task, OpenListOrder::Fewest, [false; 4]);
        assert_eq!(plain.map(|(cost, _)| cost), cheapest, "{text:?}");
        for ways in (1..16).map(|ways| [1, 2, 4, 8].map(|way| ways & way > 0)) {
            let fewest = solve(&task, OpenListOrder::Fewest, ways);
            assert_eq!(fewest, plain, "{ways:?}: {text:?}");
            let nearest = solve(&task, OpenListOrder::Nearest, ways);
            assert_eq!(nearest.map(|(cost, _)| cost), cheapest, "{ways:?}: {text:?}");
        }
        let mut cut = crate::bounds::LandmarkCut::new(&task).expect("small costs");
        let mut at = task.clone();
        for step in 0..12 {
            let (estimate, exact) = (cut.lm_cut_value(&at.initial.values).map(Int::from), optimum(&at));
            assert!(exact.is_none_or(|exact| estimate.is_some_and(|own| own <= exact)), "{step}: {text:?}");
            let next = successors(&at, &at.initial);
            let Some((state, _)) = next.into_iter().cycle().nth(step * 5).filter(|_| exact.is_some()) else {
                break;
            };
            at.initial = state;
        }
        cheapest.is_some_and(|cost| cost > 0)
    }

    fn check_all(seeds: std::ops::Range<u64>) {
        let (mut conditional, mut resources) = (0, 0);
        for seed in seeds {
            let mut random = Generator(Random(seed));
            conditional += usize::from(check(&(random.domain(), random.problem())));
            let mission = Mission::random(seed);
            resources += usize::from(check(&(mission.domain(), mission.problem())));
            if seed % 4 == 0 {
                check(&fleet(seed));
                check(&depot(seed));
            }
        }
        assert!(conditional > 2 && resources > 2, "{conditional} and {resources} with a plan");
    }

    #[test]
    fn searches_with_and_without_landmarks_find_the_optimum() {
        check_all(0..60);
    }

    #[test]
    #[ignore = "takes minutes"]
    fn searches_with_and_without_landmarks_find_the_optimum_of_many() {
        check_all(60..1_000);
    }
}
