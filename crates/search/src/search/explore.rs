//! The order of searches: for a first plan, for a best one, and for the states that prove it.
//!
//! A\* with projections comes first, as it is quick. If it does not end soon, a greedy search, which looks at estimates only, finds
//! some plan meanwhile. Then two searches take turns with equal work, one with projections alone and one that looks at landmarks,
//! too: whichever ends first has the answer, which therefore takes at most twice the work of the better one. Work is counted, so that the same
//! task is always answered in the same way.

use std::sync::Arc;

use task::context::Context;
use task::limits::Interrupted;
use task::number::{Int, dense};
use task::plan::ground::GroundPlan;
use task::task::State;
use task::task::number::TaskNumber;

use crate::bounds::Bounds;
use crate::search::astar::{Found, Hear, Order, Patience, Search, Space};
use crate::search::estimate::Estimate;
use crate::search::figures::Figures;
use crate::search::prepared::Prepared;
use crate::search::stubborn::{Choosing, Stubborn};

/// How many states are stored at most where an answer is wanted at once, or is written down.
pub const STATE_LIMIT: usize = 400_000;
/// The greedy search stores at least so many states.
const LEAST: usize = 100;
/// The work that is worth as much as a state, in steps of a computer.
const STATE: u64 = 2_500;
/// After so much work the search that is clearly behind is given up.
const TOO_LONG: u64 = 100_000_000_000;

/// Searches a task whose operators all cost at least 0, as long as there is memory and hope to come to the end with it.
pub fn search(context: Context<'_>, bounds: &Bounds) -> Found {
    let Ok(Some(prepared)) = Prepared::new(context) else { return Found::Unknown(None) };
    let space = || Space { context, bounds, prepared: &prepared, orbits: None };
    let mut duo = Duo::new(space(), &context.task.initial);
    let mut some: Option<GroundPlan> = None;
    let soon = context.limits.thresholds().states.max(1);
    let mut most = soon;
    loop {
        match duo.run(most, &mut |_, _| {}) {
            Some(Found::Unknown(plan)) => {
                let is_met = |plan: &GroundPlan| duo.bound.as_ref() == Some(&plan.cost);
                return match cheaper(plan, some) {
                    Some(plan) if is_met(&plan) => Found::Optimal(plan),
                    plan => Found::Unknown(plan),
                };
            }
            Some(found) => return found,
            None => {}
        }
        if most == soon && duo.best_plan().is_none() {
            some = greedily(&space(), &context.task.initial, usize::MAX);
            if let Some(plan) = &some {
                duo.know(&plan.cost);
            }
        }
        most = most.saturating_mul(2);
    }
}

/// Searches it, storing at most so many states.
pub fn search_states<N: TaskNumber>(
    context: Context<'_, N>,
    bounds: &impl Estimate<N>,
    most: usize,
) -> Found<N> {
    match Prepared::new(context) {
        Ok(Some(prepared)) => {
            let space = Space { context, bounds, prepared: &prepared, orbits: None };
            search_within(&space, &context.task.initial, None, most, &mut |_, _| {})
        }
        Ok(None) | Err(Interrupted) => Found::Unknown(None),
    }
}

/// Searches it from a state of its own, storing at most so many states, for a plan that costs at most `limit`: what a known one
/// costs, or `Int::MAX`.
pub fn search_from(
    space: &Space<'_, Int, Bounds>,
    initial: &State,
    limit: Int,
    most: usize,
    hear: Hear<'_, Int>,
) -> Found {
    let limit = (limit < Int::MAX).then_some(limit);
    search_within(space, initial, limit, most, hear)
}

fn search_within<N: TaskNumber, E: Estimate<N>>(
    space: &Space<'_, N, E>,
    initial: &State<N>,
    limit: Option<N>,
    most: usize,
    hear: Hear<'_, N>,
) -> Found<N> {
    let is_known = limit.is_some();
    let mut search = Search::new(space, initial, Order::Fewest, limit);
    if let Some(found) = search.run(space.context.limits.thresholds().states.min(most), hear) {
        return found;
    }
    let mut some = None;
    if search.best_plan().is_none() && !is_known {
        some = greedily(space, initial, most);
        if let Some(plan) = &some {
            search.limit_to(&plan.cost);
        }
    }
    match search.run(most, hear) {
        Some(Found::Unknown(plan)) => Found::Unknown(cheaper(plan, some)),
        Some(found) => found,
        None => Found::Unknown(cheaper(search.best_plan(), some)),
    }
}

/// Some plan, by a search that looks at estimates only.
fn greedily<N: TaskNumber, E: Estimate<N>>(
    space: &Space<'_, N, E>,
    initial: &State<N>,
    most: usize,
) -> Option<GroundPlan<N>> {
    let mut greedy = Search::new(space, initial, Order::Greedy, None);
    let states = space.context.limits.thresholds().states.max(LEAST);
    greedy.run(states.min(most), &mut |_, _| {});
    greedy.best_plan()
}

/// Two searches of the same task that take turns, until one has an answer: first one with projections alone, then this one and one that looks at
/// landmarks, too.
pub struct Duo<'a, N, E> {
    space: Space<'a, N, E>,
    initial: State<N>,
    searches: Vec<Search<'a, N, E>>,
    has_begun: bool,
    /// Whether searches go on without hope.
    is_patient: bool,
    /// What no plan costs less than.
    bound: Option<N>,
    /// The best plan of searches that were given up, and what they have done.
    best: Option<GroundPlan<N>>,
    figures: Figures,
}

impl<'a, N: TaskNumber, E: Estimate<N>> Duo<'a, N, E> {
    pub fn new(space: Space<'a, N, E>, initial: &State<N>) -> Self {
        let searches = vec![Search::new(&space, initial, Order::Fewest, None)];
        Self {
            space,
            initial: initial.clone(),
            searches,
            has_begun: false,
            is_patient: false,
            bound: None,
            best: None,
            figures: Figures::default(),
        }
    }

    /// Searches go on, with half of the work, where they seem to have no hope to come to the end with the memory that there is.
    #[must_use]
    pub fn patient(self) -> Self {
        Self { is_patient: true, ..self }
    }

    /// Whether some search may come to the end with the memory that there is, if it goes on as it did.
    pub fn has_hope(&self) -> bool {
        self.searches.iter().any(|search| search.patience != Patience::Needed)
    }

    /// A plan that costs this much is known: nothing dearer is looked at, and it ends once no plan can be cheaper.
    pub fn know(&mut self, cost: &N) {
        self.searches.iter_mut().for_each(|search| search.know(cost.clone()));
    }

    /// What all searches have done.
    pub fn figures(&self) -> Figures {
        self.searches.iter().fold(self.figures, |sum, search| sum.plus(search.figures))
    }

    pub fn best_plan(&self) -> Option<GroundPlan<N>> {
        let own = self.searches.iter().filter_map(Search::best_plan);
        own.fold(self.best.clone(), |best, plan| cheaper(best, Some(plan)))
    }

    /// Goes on until each search has done as much work as so many states are worth (a quarter of that with landmarks, where these are
    /// few); the first time, until there are so many states.
    /// None if nothing is known then. That no plan is cheaper than one that it was told of is an unknown plan.
    pub fn run(&mut self, most: usize, hear: Hear<'_, N>) -> Option<Found<N>> {
        if !self.has_begun {
            let found = self.searches[0].run(most, hear);
            if found.is_none() {
                self.begin();
            }
            return found;
        }
        let until = STATE.saturating_mul(most as u64);
        let count = self.searches.len();
        let mut ended = Vec::new();
        let thresholds = self.space.context.limits.thresholds();
        let behind = if until >= thresholds.behind { behind(&self.searches) } else { None };
        for position in 0..count {
            let bound = &mut self.bound;
            let mut told = |cost: Option<&N>, own: &N| {
                if bound.as_ref().is_none_or(|bound| own > bound) {
                    *bound = Some(own.clone());
                    hear(cost, own);
                }
            };
            let search = &mut self.searches[position];
            search.share_room(count);
            // Most of what is proved at all is proved soon, and without landmarks.
            let is_soon = search.sharper.is_some() && most <= STATE_LIMIT;
            let is_doubtful = behind == Some(position) || search.patience == Patience::Needed;
            let parts = match (is_soon, is_doubtful) {
                (true, _) => 4,
                (false, true) => 2,
                (false, false) => 1,
            };
            let found = search.run_until(until.checked_div(parts).unwrap_or(until), &mut told);
            let (is_met, is_interrupted) = (search.is_met(), search.is_interrupted());
            let best = self.best_plan();
            match found {
                None => {}
                Some(Found::Unknown(_)) if is_met => {
                    let own = best.filter(|plan| self.bound.as_ref() == Some(&plan.cost));
                    return Some(own.map_or(Found::Unknown(None), Found::Optimal));
                }
                Some(Found::Unknown(_)) if is_interrupted => return Some(Found::Unknown(best)),
                Some(Found::Unknown(_)) => ended.push(position),
                Some(found) => return Some(found),
            }
            if let Some(plan) = best {
                let others = self.searches.iter_mut().enumerate().filter(|(own, _)| *own != position);
                others.for_each(|(_, other)| other.know(plan.cost.clone()));
            }
        }
        if ended.is_empty() && until >= TOO_LONG {
            ended.extend(behind);
        }
        for position in ended.into_iter().rev() {
            let search = self.searches.remove(position);
            self.figures = self.figures.plus(search.figures);
            self.best = cheaper(self.best.take(), search.best_plan());
        }
        self.searches.is_empty().then(|| Found::Unknown(self.best.clone()))
    }

    /// Lets the other search begin, leaves out operators that are not needed, and counts states once that interchangeable objects tell
    /// apart.
    fn begin(&mut self) {
        self.has_begun = true;
        let Space { context, bounds, .. } = self.space;
        self.space.orbits = bounds.orbits(context).map(Arc::new);
        let limit = self.searches[0].limit().cloned();
        if self.space.orbits.is_some() {
            self.best = self.best_plan();
            self.figures = self.figures();
            self.searches = vec![Search::new(&self.space, &self.initial, Order::Fewest, limit.clone())];
        }
        if let Some(sharper) = bounds.sharper(context.task) {
            let mut other = Search::new(&self.space, &self.initial, Order::Nearest, limit);
            other.sharper = Some(sharper);
            self.searches.push(other);
        }
        let patience = if self.is_patient { Patience::Some } else { Patience::None };
        self.searches.iter_mut().for_each(|search| search.patience = patience);
        if let Some(stubborn) = Stubborn::new(context.task).map(Arc::new) {
            let trial = context.limits.thresholds().stubborn;
            for search in &mut self.searches {
                search.choosing = Some(Choosing::new(Arc::clone(&stubborn), trial));
            }
        }
    }
}

/// The search whose lower bound is less than that of the other by more than it rose while its states doubled twice.
fn behind<N: TaskNumber, E: Estimate<N>>(left: &[Search<'_, N, E>]) -> Option<usize> {
    let [one, other] = left else { return None };
    let is_behind = |own: &Search<'_, N, E>, other: &Search<'_, N, E>| {
        own.bound_after_doubling(2).zip(other.bound()).is_some_and(|(then, bound)| then < *bound)
    };
    if is_behind(one, other) { Some(0) } else { is_behind(other, one).then_some(1) }
}

fn cheaper<N: Ord>(one: Option<GroundPlan<N>>, other: Option<GroundPlan<N>>) -> Option<GroundPlan<N>> {
    one.into_iter().chain(other).min_by(|a, b| (&a.cost, a.steps.len()).cmp(&(&b.cost, b.steps.len())))
}

/// A state's basic values and numbers, and what was paid on the way to it.
pub type ClosedLabel<N> = (Vec<u32>, Vec<N>, N);

/// The states that a search for a plan cheaper than `cost` has to go through (than any, if there is none) until there is
/// nothing left; none if there is a cheaper plan, or if a limit comes first.
pub fn closed_labels<N: TaskNumber>(
    context: Context<'_, N>,
    bounds: &impl Estimate<N>,
    cost: Option<&N>,
) -> Option<Vec<ClosedLabel<N>>> {
    let prepared = Prepared::new(context).ok()??;
    let task = context.task;
    let space = Space { context, bounds, prepared: &prepared, orbits: None };
    let mut search = Search::new(&space, &task.initial, Order::Fewest, None);
    match (search.run(STATE_LIMIT, &mut |_, _| {})?, cost) {
        (Found::Optimal(plan), Some(cost)) if plan.cost >= *cost => {}
        (Found::None, None) => {}
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
    fn found(task: &Task, order: Order, [sharp, exchanged, chosen]: [bool; 3]) -> Option<(Int, usize)> {
        let limits = Limits::none();
        let context = Context::new(task, &limits);
        let bounds = Bounds::new(context).expect("no limit");
        let prepared = Prepared::new(context).expect("no limit").expect("few choices");
        let orbits = if exchanged { bounds.orbits(context).map(Arc::new) } else { None };
        let space = Space { context, bounds: &bounds, prepared: &prepared, orbits };
        let mut search = Search::new(&space, &task.initial, order, None);
        search.sharper = if sharp { bounds.sharper(task) } else { None };
        let stubborn = if chosen { Stubborn::new(task) } else { None };
        search.choosing = stubborn.map(|stubborn| Choosing::new(Arc::new(stubborn), 1_000));
        match search.run(usize::MAX, &mut |_, _| {}) {
            Some(Found::Optimal(plan)) => Some((plan.cost, plan.steps.len())),
            Some(Found::None) => None,
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
        let plain = found(&task, Order::Fewest, [false; 3]);
        assert_eq!(plain.map(|(cost, _)| cost), cheapest, "{text:?}");
        for ways in (1..8).map(|ways| [ways & 1, ways & 2, ways & 4].map(|way| way > 0)) {
            let fewest = found(&task, Order::Fewest, ways);
            assert_eq!(fewest, plain, "{ways:?}: {text:?}");
            let nearest = found(&task, Order::Nearest, ways);
            assert_eq!(nearest.map(|(cost, _)| cost), cheapest, "{ways:?}: {text:?}");
        }
        let mut cut = crate::bounds::LandmarkCut::new(&task).expect("small costs");
        let mut at = task.clone();
        for step in 0..12 {
            let (estimate, exact) = (cut.sum(&at.initial.values).map(Int::from), optimum(&at));
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
