//! A* with Pareto dominance over numeric variables. Among the cheapest plans it finds one with fewest steps.
//!
//! States that agree on all finite-domain variables are compared by cost and by numeric variables; where a higher value
//! never hurts (a battery), a state that costs no less and has no more of anything is dropped. That is the label-setting
//! search of resource-constrained shortest paths [1]. If it ends before its limits, its answer is exact. If it does not end
//! soon, a greedy search, which looks at estimates only, finds some plan meanwhile.
//!
//! Of states with equal sums of cost and estimate, those come first from which fewer steps can lead to the goal, and of these the
//! ones that are further: a plan that is found is cheapest once nothing that is left can be cheaper, or as cheap with fewer steps.
//!
//! [1] M. Desrochers, F. Soumis: A generalized permanent labelling algorithm for the shortest path problem with time
//! windows, INFOR 26(3), 1988.

use crate::bounds::Bounds;
use crate::context::Context;
use crate::limits::{Interrupted, Limits, Pulse};
use crate::number::{Int, dense};
use crate::plan::ground::{GroundPlan, GroundStep};
use crate::search::directions::is_monotone;
use crate::search::generator::OperatorIndex;
use crate::search::open::Open;
use crate::search::store::{NONE, Origin, Store};
use crate::search::successors::{Priced, undominated};
use crate::task::number::TaskNumber;
use crate::task::{Fact, OperatorId, State, Task};

/// How many states are stored at most where an answer is wanted at once, or is written down.
pub(crate) const STATE_LIMIT: usize = 400_000;
/// After so many states without a plan the greedy search has its turn, with as many.
const SOON: usize = 20_000;

/// What the search found.
#[derive(Debug)]
pub(crate) enum Found<N = Int> {
    /// A cheapest plan.
    Optimal(GroundPlan<N>),
    /// There is no plan: every reachable state was visited, or is dominated by one that was.
    None,
    /// A limit was reached first; the best plan so far.
    Unknown(Option<GroundPlan<N>>),
}

/// What a search needs to know of a task, whatever state it begins in.
pub(crate) struct Prepared<N = Int> {
    /// For each operator its combinations of designs that no other one dominates, with their costs.
    choices: Vec<Priced<N>>,
    /// For each operator the number of its first combination; at the end, how many there are.
    numbers: Vec<u32>,
    index: OperatorIndex,
    /// What the dearest combination costs.
    dearest: N,
}

impl<N: TaskNumber> Prepared<N> {
    /// None if some operator has too many combinations of designs.
    pub(crate) fn new(context: Context<'_, N>) -> Result<Option<Self>, Interrupted> {
        let Context { task, limits } = context;
        let monotone = is_monotone(task);
        let mut choices = Vec::with_capacity(task.operators.len());
        for operator in limits.watch(&task.operators) {
            let Some(own) = undominated(operator?, monotone, false, limits)? else { return Ok(None) };
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
        Ok(Some(Self { choices, numbers, index: OperatorIndex::new(task), dearest }))
    }

    /// The operator of a combination, by number.
    fn step(&self, number: u32) -> GroundStep {
        let operator = self.numbers.partition_point(|first| *first <= number).saturating_sub(1);
        let choice = number.saturating_sub(self.numbers[operator]);
        let choice = self.choices[operator][choice as usize].0.clone();
        GroundStep { operator: OperatorId(dense(operator)), choice }
    }

    /// The fewest steps that can cost so much.
    fn steps_at_least(&self, cost: &N) -> u32 {
        if self.dearest > N::zero() { cost.times_at_least(&self.dearest) } else { 0 }
    }
}

/// A lower bound on the cost from a state to the goal.
pub(crate) trait Estimate<N> {
    /// None if the goal cannot be reached.
    fn estimate(&self, state: &State<N>) -> Option<N>;
}

impl Estimate<Int> for Bounds {
    fn estimate(&self, state: &State) -> Option<Int> {
        self.estimate(state)
    }
}

/// What a search goes through, and by which estimates.
pub(crate) struct Space<'a, N, E> {
    pub(crate) context: Context<'a, N>,
    pub(crate) bounds: &'a E,
    pub(crate) prepared: &'a Prepared<N>,
}

/// What comes first: the sum of cost and estimate, the steps that this takes at least, and then what is further.
type Key<N> = (N, u32, u32);

/// A search that can be gone on with.
pub(crate) struct Search<'a, N, E> {
    task: &'a Task<N>,
    limits: &'a Limits,
    bounds: &'a E,
    prepared: &'a Prepared<N>,
    store: Store<N>,
    open: Open<Key<N>>,
    /// Whether states were left out because their numbers do not fit.
    incomplete: bool,
    /// Whether only estimates decide what comes next.
    greedy: bool,
    /// The cheapest goal state so far, with fewest steps of those, and their number.
    best: Option<(u32, u32)>,
    /// What a known plan costs, if there is one: nothing dearer is looked at.
    limit: Option<N>,
    /// Whether that plan is none of this search.
    is_told: bool,
    /// How far the search was whenever the number of its states had doubled.
    progress: Vec<N>,
    /// The state that is expanded, and the one that it leads to.
    state: State<N>,
    next: State<N>,
}

/// Searches a task whose operators all cost at least 0, as long as there is memory and hope to come to the end with it.
pub(crate) fn search(context: Context<'_>, bounds: &Bounds) -> Found {
    search_states(context, bounds, usize::MAX)
}

/// Searches it, storing at most so many states.
pub(crate) fn search_states<N: TaskNumber>(
    context: Context<'_, N>,
    bounds: &impl Estimate<N>,
    most: usize,
) -> Found<N> {
    match Prepared::new(context) {
        Ok(Some(prepared)) => {
            let space = Space { context, bounds, prepared: &prepared };
            search_within(&space, &context.task.initial, None, most, &mut |_, _| {})
        }
        Ok(None) | Err(Interrupted) => Found::Unknown(None),
    }
}

/// Hears, while a search goes on, what the best plan so far costs, if there is one, and what none costs less than.
pub(crate) type Hear<'a, N> = &'a mut dyn FnMut(Option<&N>, &N);

/// Searches it from a state of its own, storing at most so many states, for a plan that costs at most `limit`: what a known one
/// costs, or `Int::MAX`.
pub(crate) fn search_from(
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
    let known = limit.is_some();
    let mut search = Search::new(space, initial, false, limit);
    if let Some(found) = search.run(SOON.min(most), hear) {
        return found;
    }
    let mut some = None;
    if search.best.is_none() && !known {
        let mut greedy = Search::new(space, initial, true, None);
        greedy.run(SOON.min(most), &mut |_, _| {});
        some = greedy.best_plan();
        search.limit = some.as_ref().map(|plan| plan.cost.clone());
    }
    match search.run(most, hear) {
        Some(Found::Unknown(plan)) => Found::Unknown(cheaper(plan, some)),
        Some(found) => found,
        None => Found::Unknown(cheaper(search.best_plan(), some)),
    }
}

fn cheaper<N: Ord>(one: Option<GroundPlan<N>>, other: Option<GroundPlan<N>>) -> Option<GroundPlan<N>> {
    one.into_iter().chain(other).min_by(|a, b| (&a.cost, a.steps.len()).cmp(&(&b.cost, b.steps.len())))
}

/// A state's basic values and numbers, and what was paid on the way to it.
pub(crate) type ClosedLabel<N> = (Vec<u32>, Vec<N>, N);

/// The states that a search for a plan cheaper than `cost` has to go through (than any, if there is none) until there is
/// nothing left; none if there is a cheaper plan, or if a limit comes first.
pub(crate) fn closed_labels<N: TaskNumber>(
    context: Context<'_, N>,
    bounds: &impl Estimate<N>,
    cost: Option<&N>,
) -> Option<Vec<ClosedLabel<N>>> {
    let prepared = Prepared::new(context).ok()??;
    let task = context.task;
    let mut search = Search::new(&Space { context, bounds, prepared: &prepared }, &task.initial, false, None);
    match (search.run(STATE_LIMIT, &mut |_, _| {})?, cost) {
        (Found::Optimal(plan), Some(cost)) if plan.cost >= *cost => {}
        (Found::None, None) => {}
        _ => return None,
    }
    let mut state = task.initial.clone();
    let label = |id: u32| {
        search.store.unpack(id, &mut state);
        let own = search.store.cost(id);
        let total = bounds.estimate(&state).and_then(|more| own.plus(&more))?;
        let is_below = cost.is_none_or(|cost| total < *cost);
        is_below.then(|| (state.values[..task.basic].to_vec(), state.numbers.clone(), own.clone()))
    };
    let nodes = (0..dense(search.store.len())).filter(|id| !search.store.is_dominated(*id));
    Some(nodes.filter_map(label).collect())
}

impl<'a, N: TaskNumber, E: Estimate<N>> Search<'a, N, E> {
    pub(crate) fn new(space: &Space<'a, N, E>, initial: &State<N>, greedy: bool, limit: Option<N>) -> Self {
        let Space { context: Context { task, limits }, bounds, prepared } = *space;
        let mut search = Search {
            task,
            limits,
            bounds,
            prepared,
            store: Store::new(task),
            open: Open::new(),
            incomplete: false,
            greedy,
            best: None,
            limit,
            is_told: false,
            progress: Vec::new(),
            state: initial.clone(),
            next: initial.clone(),
        };
        search.push(N::zero(), Origin { parent: NONE, step: NONE, steps: 0 });
        search
    }

    /// A plan that costs this much is known: nothing dearer is looked at, and it ends once no plan can be cheaper.
    pub(crate) fn know(&mut self, cost: N) {
        if self.limit.as_ref().is_none_or(|limit| cost < *limit) {
            self.limit = Some(cost);
            self.best = None;
            self.is_told = true;
        }
    }

    /// None if there are more states than `most` before anything is known; it may be called again.
    pub(crate) fn run(&mut self, most: usize, hear: Hear<'_, N>) -> Option<Found<N>> {
        let mut pulse = self.limits.pulse();
        let mut told: Option<(Option<N>, N)> = None;
        while self.store.len() <= most && self.has_room() {
            let Some(((total, least, _), id)) = self.open.pop() else {
                return Some(self.ended());
            };
            if self.store.is_dominated(id) {
                continue;
            }
            let is_best = |(_, steps): (u32, u32)| {
                self.greedy || self.limit.as_ref().is_some_and(|cost| (cost, steps) <= (&total, least))
            };
            if self.best.is_some_and(is_best) {
                return Some(self.ended());
            }
            let is_told = |(limit, bound): &(Option<N>, N)| *limit == self.limit && *bound == total;
            if !self.incomplete && !told.as_ref().is_some_and(is_told) {
                hear(self.limit.as_ref(), &total);
                told = Some((self.limit.clone(), total.clone()));
            }
            if self.is_told && self.limit.as_ref() == Some(&total) {
                return Some(Found::Unknown(None));
            }
            if self.store.len() >> self.progress.len() >= STATE_LIMIT / 2 {
                self.progress.push(total);
                if !self.is_hopeful() {
                    return Some(Found::Unknown(self.best_plan()));
                }
            }
            if self.expand(id, &mut pulse).is_err() {
                return Some(Found::Unknown(self.best_plan()));
            }
        }
        None
    }

    /// Whether memory is left.
    fn has_room(&self) -> bool {
        self.store.bytes().saturating_add(self.open.bytes()) <= self.limits.room()
    }

    /// Whether the search can come to the cost of the best plan known before memory is full, if it goes on as it did while the number of its
    /// states doubled last.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of costs that fit, and less than what is limited by memory"
    )]
    fn is_hopeful(&self) -> bool {
        let (Some(limit), [.., before, now]) = (&self.limit, &self.progress[..]) else { return true };
        let (step, left) = (now.clone() + -before.clone(), limit.clone() + -now.clone());
        if left <= N::zero() {
            return true;
        }
        let bytes = self.store.bytes().saturating_add(self.open.bytes());
        let doublings = self.limits.room().checked_div(bytes).map_or(0, usize::ilog2);
        let enough = (0..=doublings).try_fold(N::zero(), |sum: N, _| sum.plus(&step));
        enough.is_none_or(|enough| enough >= left)
    }

    /// The answer if nothing that is left can be better.
    fn ended(&self) -> Found<N> {
        match self.best_plan() {
            plan if self.incomplete || self.greedy => Found::Unknown(plan),
            Some(plan) => Found::Optimal(plan),
            None => Found::None,
        }
    }

    pub(crate) fn best_plan(&self) -> Option<GroundPlan<N>> {
        self.best.map(|(goal, _)| self.plan(goal))
    }

    /// Adds all that can be reached from a node by one step. A node whose expansion is interrupted is not expanded, so that the
    /// search must end there.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "steps are fewer than nodes, combinations are numbered"
    )]
    fn expand(&mut self, id: u32, pulse: &mut Pulse<'_>) -> Result<(), Interrupted> {
        let (task, prepared) = (self.task, self.prepared);
        self.store.unpack(id, &mut self.state);
        task.close(&mut self.state);
        let cost = self.store.cost(id).clone();
        let steps = self.store.origin(id).steps + 1;
        for operator_id in prepared.index.applicable(task, &self.state) {
            let operator = &task.operators[operator_id.index()];
            let sizes = operator.sizes();
            let first = prepared.numbers[operator_id.index()];
            for ((choice, step), number) in prepared.choices[operator_id.index()].iter().zip(first..) {
                pulse.beat()?;
                if operator.condition.holds_numerically(&self.state.numbers, choice, &sizes) {
                    self.next.clone_from(&self.state);
                    let applied = operator.apply(&self.state, choice, &mut self.next);
                    match (applied, cost.plus(step)) {
                        (Some(()), Some(cost)) => self.push(cost, Origin { parent: id, step: number, steps }),
                        _ => self.incomplete = true,
                    }
                }
            }
        }
        Ok(())
    }

    /// Adds the next state, whose derived variables have no values yet, unless it is no good.
    fn push(&mut self, cost: N, origin: Origin) {
        if self.is_beyond(&cost) {
            return;
        }
        let Some(vacancy) = self.store.look_up(&self.next, &cost, origin.steps) else { return };
        let Some(estimate) = self.bounds.estimate(&self.next) else { return };
        let Some(total) = cost.plus(&estimate).filter(N::is_moderate) else {
            self.incomplete = true;
            return;
        };
        let least = origin.steps.saturating_add(self.prepared.steps_at_least(&estimate));
        if self.is_beyond(&total) || self.is_no_better(&total, least) {
            return;
        }
        let id = self.store.insert(&vacancy, origin);
        if self.is_goal() {
            self.best = Some((id, origin.steps));
            self.limit = Some(cost);
            self.is_told = false;
        }
        let key = if self.greedy {
            (estimate, 0, 0)
        } else {
            (total, least, u32::MAX.saturating_sub(origin.steps))
        };
        self.open.push(key, id);
    }

    fn is_beyond(&self, cost: &N) -> bool {
        self.limit.as_ref().is_some_and(|limit| cost > limit)
    }

    /// Whether the best plan so far is no worse than one with this cost and so many steps.
    fn is_no_better(&self, cost: &N, steps: u32) -> bool {
        let (Some((_, own)), Some(limit)) = (self.best, &self.limit) else { return false };
        (limit, own) <= (cost, steps)
    }

    /// Whether the next state satisfies the goal.
    fn is_goal(&mut self) -> bool {
        let values = &self.next.values[..self.task.basic];
        let is_basic = |fact: &&Fact| fact.variable.index() < values.len();
        if !self.task.goal.facts.iter().filter(is_basic).all(|fact| fact.holds(values)) {
            return false;
        }
        self.task.close(&mut self.next);
        self.task.is_goal(&self.next)
    }

    fn plan(&self, goal: u32) -> GroundPlan<N> {
        let mut steps = Vec::new();
        let mut at = goal;
        while let Origin { parent, step, .. } = self.store.origin(at)
            && parent != NONE
        {
            steps.push(self.prepared.step(step));
            at = parent;
        }
        steps.reverse();
        GroundPlan { steps, cost: self.store.cost(goal).clone() }
    }
}
