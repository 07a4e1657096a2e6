//! The order of searches: a first plan, an optimal plan, and the closed states that prove it.
//!
//! A\* with pattern databases runs first. If it does not finish soon, greedy best-first search finds some plan.
//! Then two searches run interleaved with equal work: one with pattern databases only, one with LM-cut as well.
//! The first to finish has the answer, so the total work is at most twice that of the better search. Work is
//! counted in units, not in time, so the result is deterministic.

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
use crate::search::search_task::SearchTask;
use crate::search::statistics::SearchStatistics;
use crate::search::stubborn_sets::{Stubborn, StubbornSetPruning};

/// How many states are stored at most where an answer is wanted at once, or is written down.
pub const STATE_LIMIT: usize = 400_000;
/// The greedy search stores at least so many states.
const LEAST: usize = 100;
/// The work that is worth as much as a state, in steps of a computer.
const WORK_PER_STATE: u64 = 2_500;
/// After so much work the search that is clearly behind is given up.
const ABANDON_WORK: u64 = 100_000_000_000;

/// Searches a task whose operators all cost at least 0, as long as there is memory and hope to come to the end with it.
pub fn search(context: Context<'_>, bounds: &Bounds) -> SearchOutcome {
    let Ok(Some(prepared)) = SearchTask::new(context) else { return SearchOutcome::Unknown(None) };
    let space = || SearchProblem { context, bounds, prepared: &prepared, orbits: None };
    let mut duo = InterleavedSearch::new(space(), &context.task.initial);
    let mut some: Option<GroundPlan> = None;
    let soon = context.limits.thresholds().states.max(1);
    let mut most = soon;
    loop {
        match duo.run(most, &mut |_, _| {}) {
            Some(SearchOutcome::Unknown(plan)) => {
                let is_met = |plan: &GroundPlan| duo.bound.as_ref() == Some(&plan.cost);
                return match cheaper(plan, some) {
                    Some(plan) if is_met(&plan) => SearchOutcome::Optimal(plan),
                    plan => SearchOutcome::Unknown(plan),
                };
            }
            Some(found) => return found,
            None => {}
        }
        if most == soon && duo.best_plan().is_none() {
            some = greedy_best_first(&space(), &context.task.initial, usize::MAX);
            if let Some(plan) = &some {
                duo.set_upper_bound(&plan.cost);
            }
        }
        most = most.saturating_mul(2);
    }
}

/// Searches it, storing at most so many states.
pub fn search_states<N: TaskNumber>(
    context: Context<'_, N>,
    bounds: &impl Heuristic<N>,
    most: usize,
) -> SearchOutcome<N> {
    match SearchTask::new(context) {
        Ok(Some(prepared)) => {
            let space = SearchProblem { context, bounds, prepared: &prepared, orbits: None };
            search_within(&space, &context.task.initial, None, most, &mut |_, _| {})
        }
        Ok(None) | Err(Interrupted) => SearchOutcome::Unknown(None),
    }
}

/// Searches it from a state of its own, storing at most so many states, for a plan that costs at most `limit`: what a known one
/// costs, or `Int::MAX`.
pub fn search_from(
    space: &SearchProblem<'_, Int, Bounds>,
    initial: &State,
    limit: Int,
    most: usize,
    hear: ProgressCallback<'_, Int>,
) -> SearchOutcome {
    let limit = (limit < Int::MAX).then_some(limit);
    search_within(space, initial, limit, most, hear)
}

fn search_within<N: TaskNumber, E: Heuristic<N>>(
    space: &SearchProblem<'_, N, E>,
    initial: &State<N>,
    limit: Option<N>,
    most: usize,
    hear: ProgressCallback<'_, N>,
) -> SearchOutcome<N> {
    let is_known = limit.is_some();
    let mut search = AStar::new(space, initial, OpenListOrder::Fewest, limit);
    if let Some(found) = search.run_until_states(space.context.limits.thresholds().states.min(most), hear) {
        return found;
    }
    let mut some = None;
    if search.best_plan().is_none() && !is_known {
        some = greedy_best_first(space, initial, most);
        if let Some(plan) = &some {
            search.set_upper_bound_inclusive(&plan.cost);
        }
    }
    match search.run_until_states(most, hear) {
        Some(SearchOutcome::Unknown(plan)) => SearchOutcome::Unknown(cheaper(plan, some)),
        Some(found) => found,
        None => SearchOutcome::Unknown(cheaper(search.best_plan(), some)),
    }
}

/// Some plan, by a search that looks at estimates only.
fn greedy_best_first<N: TaskNumber, E: Heuristic<N>>(
    space: &SearchProblem<'_, N, E>,
    initial: &State<N>,
    most: usize,
) -> Option<GroundPlan<N>> {
    let mut greedy = AStar::new(space, initial, OpenListOrder::Greedy, None);
    let states = space.context.limits.thresholds().states.max(LEAST);
    greedy.run_until_states(states.min(most), &mut |_, _| {});
    greedy.best_plan()
}

/// Two searches of the same task that take turns, until one has an answer: first one with projections alone, then this one and one that looks at
/// landmarks, too.
pub struct InterleavedSearch<'a, N, E> {
    space: SearchProblem<'a, N, E>,
    initial: State<N>,
    searches: Vec<AStar<'a, N, E>>,
    has_begun: bool,
    /// Whether searches go on without hope.
    is_patient: bool,
    /// What no plan costs less than.
    bound: Option<N>,
    /// The best plan of searches that were given up, and what they have done.
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
            is_patient: false,
            bound: None,
            best: None,
            figures: SearchStatistics::default(),
        }
    }

    /// Searches go on, with half of the work, where they seem to have no hope to come to the end with the memory that there is.
    #[must_use]
    pub fn continue_without_forecast(self) -> Self {
        Self { is_patient: true, ..self }
    }

    /// Whether some search may come to the end with the memory that there is, if it goes on as it did.
    pub fn may_finish(&self) -> bool {
        self.searches.iter().any(|search| search.patience != OutOfMemoryPolicy::Needed)
    }

    /// A plan that costs this much is known: nothing dearer is looked at, and it ends once no plan can be cheaper.
    pub fn set_upper_bound(&mut self, cost: &N) {
        self.searches.iter_mut().for_each(|search| search.set_upper_bound(cost.clone()));
    }

    /// What all searches have done.
    pub fn figures(&self) -> SearchStatistics {
        self.searches.iter().fold(self.figures, |sum, search| sum.plus(search.statistics))
    }

    pub fn best_plan(&self) -> Option<GroundPlan<N>> {
        let own = self.searches.iter().filter_map(AStar::best_plan);
        own.fold(self.best.clone(), |best, plan| cheaper(best, Some(plan)))
    }

    /// Goes on until each search has done as much work as so many states are worth (a quarter of that with landmarks, where these are
    /// few); the first time, until there are so many states.
    /// None if nothing is known then. That no plan is cheaper than one that it was told of is an unknown plan.
    pub fn run(&mut self, most: usize, hear: ProgressCallback<'_, N>) -> Option<SearchOutcome<N>> {
        if !self.has_begun {
            let found = self.searches[0].run_until_states(most, hear);
            if found.is_none() {
                self.begin();
            }
            return found;
        }
        let until = WORK_PER_STATE.saturating_mul(most as u64);
        let count = self.searches.len();
        let mut ended = Vec::new();
        let thresholds = self.space.context.limits.thresholds();
        let behind = if until >= thresholds.behind { lagging_search(&self.searches) } else { None };
        for position in 0..count {
            let bound = &mut self.bound;
            let mut told = |cost: Option<&N>, own: &N| {
                if bound.as_ref().is_none_or(|bound| own > bound) {
                    *bound = Some(own.clone());
                    hear(cost, own);
                }
            };
            let search = &mut self.searches[position];
            search.set_memory_share(count);
            // Most of what is proved at all is proved soon, and without landmarks.
            let is_soon = search.lazy_heuristic.is_some() && most <= STATE_LIMIT;
            let is_doubtful = behind == Some(position) || search.patience == OutOfMemoryPolicy::Needed;
            let parts = match (is_soon, is_doubtful) {
                (true, _) => 4,
                (false, true) => 2,
                (false, false) => 1,
            };
            let found = search.run_for_work(until.checked_div(parts).unwrap_or(until), &mut told);
            let (is_met, is_interrupted) = (search.proves_upper_bound(), search.is_interrupted());
            let best = self.best_plan();
            match found {
                None => {}
                Some(SearchOutcome::Unknown(_)) if is_met => {
                    let own = best.filter(|plan| self.bound.as_ref() == Some(&plan.cost));
                    return Some(own.map_or(SearchOutcome::Unknown(None), SearchOutcome::Optimal));
                }
                Some(SearchOutcome::Unknown(_)) if is_interrupted => {
                    return Some(SearchOutcome::Unknown(best));
                }
                Some(SearchOutcome::Unknown(_)) => ended.push(position),
                Some(found) => return Some(found),
            }
            if let Some(plan) = best {
                let others = self.searches.iter_mut().enumerate().filter(|(own, _)| *own != position);
                others.for_each(|(_, other)| other.set_upper_bound(plan.cost.clone()));
            }
        }
        if ended.is_empty() && until >= ABANDON_WORK {
            ended.extend(behind);
        }
        for position in ended.into_iter().rev() {
            let search = self.searches.remove(position);
            self.figures = self.figures.plus(search.statistics);
            self.best = cheaper(self.best.take(), search.best_plan());
        }
        self.searches.is_empty().then(|| SearchOutcome::Unknown(self.best.clone()))
    }

    /// Lets the other search begin, leaves out operators that are not needed, and counts states once that interchangeable objects tell
    /// apart.
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
        if let Some(sharper) = bounds.sharper(context.task) {
            let mut other = AStar::new(&self.space, &self.initial, OpenListOrder::Nearest, limit);
            other.lazy_heuristic = Some(sharper);
            self.searches.push(other);
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

/// The search whose lower bound is less than that of the other by more than it rose while its states doubled twice.
fn lagging_search<N: TaskNumber, E: Heuristic<N>>(left: &[AStar<'_, N, E>]) -> Option<usize> {
    let [one, other] = left else { return None };
    let is_behind = |own: &AStar<'_, N, E>, other: &AStar<'_, N, E>| {
        own.forecast_lower_bound(2).zip(other.bound()).is_some_and(|(then, bound)| then < *bound)
    };
    if is_behind(one, other) { Some(0) } else { is_behind(other, one).then_some(1) }
}

fn cheaper<N: Ord>(one: Option<GroundPlan<N>>, other: Option<GroundPlan<N>>) -> Option<GroundPlan<N>> {
    one.into_iter().chain(other).min_by(|a, b| (&a.cost, a.steps.len()).cmp(&(&b.cost, b.steps.len())))
}

/// A state's basic values and numbers, and what was paid on the way to it.
pub type ClosedEntry<N> = (Vec<u32>, Vec<N>, N);

/// The states that a search for a plan cheaper than `cost` has to go through (than any, if there is none) until there is
/// nothing left; none if there is a cheaper plan, or if a limit comes first.
pub fn closed_labels<N: TaskNumber>(
    context: Context<'_, N>,
    bounds: &impl Heuristic<N>,
    cost: Option<&N>,
) -> Option<Vec<ClosedEntry<N>>> {
    let prepared = SearchTask::new(context).ok()??;
    let task = context.task;
    let space = SearchProblem { context, bounds, prepared: &prepared, orbits: None };
    let mut search = AStar::new(&space, &task.initial, OpenListOrder::Fewest, None);
    match (search.run_until_states(STATE_LIMIT, &mut |_, _| {})?, cost) {
        (SearchOutcome::Optimal(plan), Some(cost)) if plan.cost >= *cost => {}
        (SearchOutcome::None, None) => {}
        _ => return None,
    }
    let store = &search.store;
    let mut state = task.initial.clone();
    let label = |id: u32| {
        store.unpack(id, &mut state);
        let own = store.cost(id);
        let total = bounds.estimate(&state).and_then(|more| own.plus(&more))?;
        let is_below = cost.is_none_or(|cost| total < *cost);
        is_below.then(|| (state.values[..task.basic].to_vec(), state.numbers.clone(), own.clone()))
    };
    let nodes = (0..dense(store.len())).filter(|id| !store.is_dominated(*id));
    Some(nodes.filter_map(label).collect())
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

    /// The cost and the number of steps of a plan that a search finds, with or without the sharper bound, the exchange of objects, and
    /// stubborn sets.
    fn found(
        task: &Task,
        order: OpenListOrder,
        [sharp, exchanged, chosen]: [bool; 3],
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
        search.pruning = stubborn.map(|stubborn| StubbornSetPruning::new(Arc::new(stubborn), 1_000));
        match search.run_until_states(usize::MAX, &mut |_, _| {}) {
            Some(SearchOutcome::Optimal(plan)) => Some((plan.cost, plan.steps.len())),
            Some(SearchOutcome::None) => None,
            other => panic!("{other:?}"),
        }
    }

    /// Both searches find the optimum of Dijkstra's algorithm, and landmarks never say more than is true of a state.
    fn check(text: &(String, String)) -> bool {
        let task = ground_text(text.clone());
        if task.unreachable.is_some() {
            return false;
        }
        let cheapest = optimum(&task);
        let plain = found(&task, OpenListOrder::Fewest, [false; 3]);
        assert_eq!(plain.map(|(cost, _)| cost), cheapest, "{text:?}");
        for ways in (1..8).map(|ways| [ways & 1, ways & 2, ways & 4].map(|way| way > 0)) {
            let fewest = found(&task, OpenListOrder::Fewest, ways);
            assert_eq!(fewest, plain, "{ways:?}: {text:?}");
            let nearest = found(&task, OpenListOrder::Nearest, ways);
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
