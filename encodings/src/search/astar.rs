//! A quick search for a first plan: A* with Pareto dominance over numeric variables. Among the cheapest plans it
//! finds one with fewest steps.
//!
//! States that agree on all finite-domain variables are compared by cost and by numeric variables; where a higher value
//! never hurts (a battery), a state that costs no less and has no more of anything is dropped. That is the label-setting
//! search of resource-constrained shortest paths [1]. If it ends before its limits, its answer is exact. If it does not end
//! soon, a greedy search, which looks at estimates only, finds some plan meanwhile.
//!
//! [1] M. Desrochers, F. Soumis: A generalized permanent labelling algorithm for the shortest path problem with time
//! windows, INFOR 26(3), 1988.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::collections::hash_map::Entry;

use rustc_hash::FxHashMap;

use crate::bounds::Bounds;
use crate::context::Context;
use crate::limits::{Interrupted, Limits, Pulse};
use crate::number::{Int, dense};
use crate::plan::ground::{GroundPlan, GroundStep};
use crate::search::successors::{OperatorIndex, Priced, undominated};
use crate::task::number::TaskNumber;
use crate::task::{Condition, Fact, OperatorId, State, Task};

/// How many states are stored at most.
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

struct Node<N> {
    state: State<N>,
    cost: N,
    steps: u32,
    parent: Option<(u32, OperatorId, u32)>,
    dominated: bool,
}

/// What a search needs to know of a task, whatever state it begins in.
pub(crate) struct Prepared<N = Int> {
    /// For each operator its combinations of designs that no other one dominates, with their costs.
    choices: Vec<Priced<N>>,
    index: OperatorIndex,
    /// Whether more of any numeric variable never hurts.
    monotone: bool,
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
        Ok(Some(Self { choices, index: OperatorIndex::new(task), monotone }))
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

struct Search<'a, N, E> {
    task: &'a Task<N>,
    limits: &'a Limits,
    bounds: &'a E,
    prepared: &'a Prepared<N>,
    nodes: Vec<Node<N>>,
    seen: FxHashMap<Box<[u32]>, Vec<u32>>,
    open: BinaryHeap<Reverse<(N, u32, u32)>>,
    /// Whether states were left out because their numbers do not fit.
    incomplete: bool,
    /// Whether only estimates decide what comes next.
    greedy: bool,
    /// The cheapest goal state so far.
    best: Option<u32>,
    /// What a known plan costs, if there is one: nothing dearer is looked at.
    limit: Option<N>,
}

/// Searches a task whose operators all cost at least 0.
pub(crate) fn search(context: Context<'_>, bounds: &Bounds) -> Found {
    search_states(context, bounds, STATE_LIMIT)
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
    let mut search = Search::new(space, initial, false);
    search.limit = limit;
    if let Some(found) = search.run(SOON.min(most), hear) {
        return found;
    }
    let mut some = None;
    if search.best.is_none() && !known {
        let mut greedy = Search::new(space, initial, true);
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
    let mut search = Search::new(&Space { context, bounds, prepared: &prepared }, &task.initial, false);
    match (search.run(STATE_LIMIT, &mut |_, _| {})?, cost) {
        (Found::Optimal(plan), Some(cost)) if plan.cost >= *cost => {}
        (Found::None, None) => {}
        _ => return None,
    }
    let below = |node: &&Node<N>| {
        let total = bounds.estimate(&node.state).and_then(|more| node.cost.plus(&more));
        !node.dominated && total.is_some_and(|total| cost.is_none_or(|cost| total < *cost))
    };
    let label = |node: &Node<N>| {
        (node.state.values[..task.basic].to_vec(), node.state.numbers.clone(), node.cost.clone())
    };
    Some(search.nodes.iter().filter(below).map(label).collect())
}

impl<'a, N: TaskNumber, E: Estimate<N>> Search<'a, N, E> {
    fn new(space: &Space<'a, N, E>, initial: &State<N>, greedy: bool) -> Self {
        let Space { context: Context { task, limits }, bounds, prepared } = *space;
        let mut search = Search {
            task,
            limits,
            bounds,
            prepared,
            nodes: Vec::new(),
            seen: FxHashMap::default(),
            open: BinaryHeap::new(),
            incomplete: false,
            greedy,
            best: None,
            limit: None,
        };
        search.push(initial.clone(), N::zero(), 0, None);
        search
    }

    /// None if there are more states than `most` before anything is known; it may be called again.
    fn run(&mut self, most: usize, hear: Hear<'_, N>) -> Option<Found<N>> {
        let mut pulse = self.limits.pulse();
        let mut told: Option<(Option<N>, N)> = None;
        while self.nodes.len() <= most {
            let Some(Reverse((total, steps, id))) = self.open.pop() else {
                return Some(if self.incomplete { Found::Unknown(self.best_plan()) } else { Found::None });
            };
            if self.nodes[id as usize].dominated {
                continue;
            }
            if self.task.is_goal(&self.nodes[id as usize].state) {
                if self.incomplete {
                    return Some(Found::Unknown(self.best_plan()));
                }
                return Some(Found::Optimal(self.plan(id)));
            }
            let is_told = |(limit, bound): &(Option<N>, N)| *limit == self.limit && *bound == total;
            if !self.incomplete && !told.as_ref().is_some_and(is_told) {
                hear(self.limit.as_ref(), &total);
                told = Some((self.limit.clone(), total));
            }
            if self.expand(id, steps, &mut pulse).is_err() {
                return Some(Found::Unknown(self.best_plan()));
            }
        }
        None
    }

    fn best_plan(&self) -> Option<GroundPlan<N>> {
        self.best.map(|goal| self.plan(goal))
    }

    /// Adds all that can be reached from a node by one step. A node whose expansion is interrupted is not expanded, so that the
    /// search must end there.
    #[expect(clippy::arithmetic_side_effects, reason = "steps are fewer than nodes")]
    fn expand(&mut self, id: u32, steps: u32, pulse: &mut Pulse<'_>) -> Result<(), Interrupted> {
        let state = self.nodes[id as usize].state.clone();
        let cost = self.nodes[id as usize].cost.clone();
        let prepared = self.prepared;
        for operator_id in prepared.index.applicable(self.task, &state) {
            let operator = &self.task.operators[operator_id.index()];
            let sizes = operator.sizes();
            for (index, (choice, step)) in prepared.choices[operator_id.index()].iter().enumerate() {
                pulse.beat()?;
                if operator.condition.holds_numerically(&state.numbers, choice, &sizes) {
                    let parent = Some((id, operator_id, dense(index)));
                    match (self.task.successor(operator, &state, choice), cost.plus(step)) {
                        (Some(next), Some(cost)) => self.push(next, cost, steps + 1, parent),
                        _ => self.incomplete = true,
                    }
                }
            }
        }
        Ok(())
    }

    fn push(&mut self, state: State<N>, cost: N, steps: u32, parent: Option<(u32, OperatorId, u32)>) {
        let Some(estimate) = self.bounds.estimate(&state) else { return };
        let Some(total) = cost.plus(&estimate).filter(N::is_moderate) else {
            self.incomplete = true;
            return;
        };
        if self.limit.as_ref().is_some_and(|limit| total > *limit) {
            return;
        }
        let id = dense(self.nodes.len());
        match self.seen.entry(state.values[..self.task.basic].into()) {
            Entry::Vacant(entry) => {
                entry.insert(vec![id]);
            }
            Entry::Occupied(mut entry) => {
                let (nodes, monotone) = (&mut self.nodes, self.prepared.monotone);
                let at_least = |a: &[N], b: &[N]| {
                    if monotone { a.iter().zip(b).all(|(a, b)| a >= b) } else { a == b }
                };
                let known = |id: &u32| &nodes[*id as usize];
                let front = entry.get_mut();
                if front.iter().any(|id| {
                    (&known(id).cost, known(id).steps) <= (&cost, steps)
                        && at_least(&known(id).state.numbers, &state.numbers)
                }) {
                    return;
                }
                front.retain(|id| {
                    let node = &mut nodes[*id as usize];
                    node.dominated = (&cost, steps) <= (&node.cost, node.steps)
                        && at_least(&state.numbers, &node.state.numbers);
                    !node.dominated
                });
                front.push(id);
            }
        }
        let improves = self.best.is_none() || self.limit.as_ref().is_none_or(|limit| cost < *limit);
        if improves && self.task.is_goal(&state) {
            self.best = Some(id);
            self.limit = Some(cost.clone());
        }
        self.nodes.push(Node { state, cost, steps, parent, dominated: false });
        let priority = if self.greedy { estimate } else { total };
        self.open.push(Reverse((priority, steps, id)));
    }

    fn plan(&self, goal: u32) -> GroundPlan<N> {
        let mut steps = Vec::new();
        let mut at = goal;
        while let Some((parent, operator, choice)) = self.nodes[at as usize].parent {
            let choice = self.prepared.choices[operator.index()][choice as usize].0.clone();
            steps.push(GroundStep { operator, choice });
            at = parent;
        }
        steps.reverse();
        GroundPlan { steps, cost: self.nodes[goal as usize].cost.clone() }
    }
}

/// Whether more of any numeric variable can only help: it enters conditions and effects with factors ≥ 0, and
/// whether a derived variable holds that depends on numbers is asked only where it helps.
pub(crate) fn is_monotone<N: TaskNumber>(task: &Task<N>) -> bool {
    let conditions = task.operators.iter().map(|operator| &operator.condition).chain([&task.goal]);
    let rules = || task.axioms.iter().flat_map(|layer| &layer.rules);
    let conditions: Vec<_> = conditions.chain(rules().map(|rule| &rule.body)).collect();
    let mut numeric = vec![false; task.variables.len()];
    loop {
        let depends = |rule: &&crate::task::Axiom<N>| {
            let depends = |fact: &Fact| numeric[fact.variable.index()];
            !numeric[rule.head.variable.index()]
                && (rule.body.linears().next().is_some() || rule.body.facts.iter().any(depends))
        };
        let Some(rule) = rules().find(depends) else { break };
        numeric[rule.head.variable.index()] = true;
    }
    let helps =
        |fact: &Fact, positive: bool| !numeric[fact.variable.index()] || positive == (fact.value == 0);
    let asked = conditions.iter().all(|condition| {
        condition.facts.iter().all(|fact| helps(fact, true))
            && condition.clauses.iter().flatten().all(|literal| helps(&literal.fact, literal.positive))
    });
    let conditional = task.operators.iter().flat_map(|operator| &operator.conditional);
    let mut triggers = conditional.flat_map(|effect| &effect.condition);
    if !asked || triggers.any(|literal| numeric[literal.fact.variable.index()]) {
        return false;
    }
    let comparisons = conditions.into_iter().flat_map(Condition::linears);
    let effects =
        task.operators.iter().flat_map(|operator| &operator.numeric_effects).map(|effect| &effect.value);
    comparisons
        .chain(effects)
        .all(|linear| linear.coefficients.iter().all(|(_, factor)| *factor >= N::zero()))
}
