//! Graph of all cheapest plans: the states through which these plans pass, and the steps between the states.
//!
//! A cheapest plan reaches each of its states at the minimum cost of reaching this state. So paths that reach
//! a state at a higher cost are omitted, and every path from the initial state to a goal state is a cheapest
//! plan. K\* and related algorithms represent top-k plans in this way \[1\].
//!
//! If many states differ only in resources, expanding all of them is too much work. A label-setting search
//! therefore comes first. Each of its labels (nodes) represents all states that differ from it only in resources,
//! cost at least as much, and have at most as much of each resource. If no path in the label graph leads from a
//! label to the goal, no cheapest plan passes through a state that the label represents. The second search
//! distinguishes all states and expands only those that the first search does not exclude.
//!
//! \[1\] J. Lee, M. Katz, S. Sohrabi: On K* search for top-k planning, 2023; H. Aljazzar, S. Leue:
//! K*: a heuristic search algorithm for finding the k shortest paths, Artificial Intelligence 175,
//! 2011.

use std::cell::OnceCell;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rustc_hash::FxHashMap;

use search::bounds::Bounds;
use search::search::design_combinations::{CostedCombinations, pareto_optimal_combinations};
use search::search::successor_generator::SuccessorGenerator;
use search::search::{Polarity, directions, is_monotone};
use task::context::Context;
use task::limits::Interrupted;
use task::number::{Int, dense};
use task::plan::ground::GroundStep;
use task::task::number::TaskNumber;
use task::task::{OperatorId, State, Task};

const MAX_CHOICES: usize = 20_000;

#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    pub(super) from: u32,
    pub(super) to: u32,
    pub(super) step: u32,
}

/// Graph of labels and the steps between them. A label (node) represents a state or, in the first of the two
/// searches (see the head of this file), all states that are no better in resources and cost.
pub(super) struct Graph {
    /// Edges in ascending order of [`Edge::from`], and then of their steps.
    pub(super) edges: Vec<Edge>,
    pub(super) steps: Vec<GroundStep>,
    pub(super) goals: Vec<bool>,
    /// For each label (node): whether a goal label can be reached from it.
    pub(super) alive: Vec<bool>,
    /// `false` if the search was cut short, or states were dropped because a number overflowed. If
    /// the graph is complete and exact, every cheapest plan is one of its paths.
    pub(super) is_complete: bool,
    /// `true` if every path to a goal label is a plan, because each label represents a single state.
    pub(super) is_exact: bool,
}

pub(super) const ROOT: u32 = 0;

pub(super) type IsEnough<'e> = dyn FnMut(&Graph) -> bool + 'e;

/// Builds the graph of all plans with cost `cost`, which must be the cost of a cheapest plan. At a limit, or
/// once `is_enough` returns `true`, the graph is incomplete (see [`Graph::is_complete`]). Returns `None` if
/// an operator has too many combinations of designs, or a negative cost.
pub(super) fn cheapest(
    context: Context<'_>,
    bounds: &Bounds,
    cost: Int,
    is_enough: &mut IsEnough<'_>,
) -> Option<Graph> {
    let search = Search::new(context, bounds, cost)?;
    let guide = Labels::comparing(context.task);
    let (guide, graph) = search.explore(guide, None, &mut |_| false)?;
    // The second search would probably reach the limit as well.
    if !graph.is_complete {
        return Some(graph);
    }
    let labels = Labels::exact(context.task);
    let (_, graph) = search.explore(labels, Some((&guide, &graph.alive)), is_enough)?;
    Some(graph)
}

/// Key under which labels (nodes) are grouped: the values of the basic (not derived) variables, and the
/// numbers that are not compared. Only labels with equal keys are compared with each other.
type Place = (Box<[u32]>, Box<[Int]>);

struct Labels {
    all: Vec<(State, Int)>,
    places: FxHashMap<Place, Vec<u32>>,
    /// Numeric variables for which a label also represents worse values, with the directions in
    /// which values are compared. All other numbers are part of the [`Place`].
    compared: Vec<(usize, Polarity)>,
    basic: usize,
}

enum Known {
    /// Another label costs less and is no worse in any compared number.
    Beaten,
    /// This other label has equal cost and is no worse in any compared number.
    Covered(u32),
    New,
}

impl Labels {
    /// Creates an empty set of labels. Each label will also represent all states that are no better in any
    /// compared number.
    fn comparing(task: &Task) -> Self {
        let asked = directions(task).into_iter().enumerate();
        Self::new(task, asked.filter(|(_, asked)| !(asked.up && asked.down)).collect())
    }

    fn exact(task: &Task) -> Self {
        Self::new(task, Vec::new())
    }

    fn new(task: &Task, compared: Vec<(usize, Polarity)>) -> Self {
        Self { all: Vec::new(), places: FxHashMap::default(), compared, basic: task.basic }
    }

    fn place(&self, state: &State) -> Place {
        let is_compared = |position: usize| self.compared.iter().any(|(compared, _)| *compared == position);
        let numbers = state.numbers.iter().enumerate().filter(|(position, _)| !is_compared(*position));
        (state.values[..self.basic].into(), numbers.map(|(_, number)| *number).collect())
    }

    fn is_no_worse(&self, first: &State, second: &State) -> bool {
        self.compared.iter().all(|(position, asked)| {
            let (first, second) = (first.numbers[*position], second.numbers[*position]);
            (!asked.up || first >= second) && (!asked.down || first <= second)
        })
    }

    /// Returns the labels at `place` that cost at most `cost` and are no worse than `state` in any
    /// compared number. The flag is `true` if the label costs less than `cost`.
    fn no_worse<'l>(
        &'l self,
        place: &Place,
        state: &'l State,
        cost: Int,
    ) -> impl Iterator<Item = (u32, bool)> + 'l {
        let labels = self.places.get(place).into_iter().flatten();
        labels.filter_map(move |id| {
            let (label, paid) = &self.all[*id as usize];
            (*paid <= cost && self.is_no_worse(label, state)).then_some((*id, *paid < cost))
        })
    }

    fn known(&self, place: &Place, state: &State, cost: Int) -> Known {
        let mut relation = Known::New;
        for (id, is_cheaper) in self.no_worse(place, state, cost) {
            if is_cheaper {
                return Known::Beaten;
            }
            relation = Known::Covered(id);
        }
        relation
    }

    fn add(&mut self, place: Place, state: State, cost: Int) -> u32 {
        let id = dense(self.all.len());
        self.places.entry(place).or_default().push(id);
        self.all.push((state, cost));
        id
    }
}

/// Computed at first use; `None` if there are too many combinations.
type Choices = OnceCell<Option<CostedCombinations<Int>>>;

struct Search<'a> {
    context: Context<'a>,
    bounds: &'a Bounds,
    cost: Int,
    index: SuccessorGenerator,
    monotone: bool,
    best: Vec<Choices>,
    all: Vec<Choices>,
}

enum Stopped {
    TooMany,
    AtLimit,
}

impl From<Interrupted> for Stopped {
    fn from(_: Interrupted) -> Self {
        Self::AtLimit
    }
}

struct Growth {
    labels: Labels,
    edges: Vec<Edge>,
    steps: Vec<GroundStep>,
    numbers: FxHashMap<GroundStep, u32>,
    goals: Vec<bool>,
    /// Estimated cost of the whole plan (0 in the second search), cost of the path, and index of
    /// the label. The label with the least estimate is expanded first; of equal estimates, the
    /// greatest cost.
    open: BinaryHeap<Reverse<(Int, Reverse<Int>, u32)>>,
    is_complete: bool,
}

impl Growth {
    fn step(&mut self, step: GroundStep) -> u32 {
        let next = dense(self.steps.len());
        let Self { steps, numbers, .. } = self;
        *numbers.entry(step).or_insert_with_key(|step| {
            steps.push(step.clone());
            next
        })
    }

    fn graph(&self, is_exact: bool) -> Graph {
        let mut edges = self.edges.clone();
        edges.sort_unstable_by_key(|edge| {
            let GroundStep { operator, choice } = &self.steps[edge.step as usize];
            (edge.from, *operator, choice)
        });
        edges.dedup_by_key(|edge| (edge.from, edge.to, edge.step));
        let alive = alive(&edges, &self.goals);
        let (steps, goals) = (self.steps.clone(), self.goals.clone());
        Graph { edges, steps, goals, alive, is_complete: self.is_complete, is_exact }
    }

    fn bytes(&self) -> usize {
        let label = self.labels.all.first().map_or(0, |(state, _)| {
            let words = state.values.len().saturating_mul(8);
            words.saturating_add(state.numbers.len().saturating_mul(32)).saturating_add(200)
        });
        let edges = self.edges.len().saturating_mul(size_of::<Edge>());
        self.labels.all.len().saturating_mul(label).saturating_add(edges)
    }
}

fn alive(edges: &[Edge], goals: &[bool]) -> Vec<bool> {
    let mut before: Vec<u32> = (0..dense(edges.len())).collect();
    before.sort_by_key(|position| edges[*position as usize].to);
    let mut alive = goals.to_vec();
    let labels = (0..).zip(goals);
    let mut open: Vec<u32> = labels.filter(|(_, is_goal)| **is_goal).map(|(id, _)| id).collect();
    while let Some(to) = open.pop() {
        let first = before.partition_point(|position| edges[*position as usize].to < to);
        let into = before[first..].iter().map(|position| edges[*position as usize]);
        for edge in into.take_while(|edge| edge.to == to) {
            if !std::mem::replace(&mut alive[edge.from as usize], true) {
                open.push(edge.from);
            }
        }
    }
    alive
}

impl<'a> Search<'a> {
    fn new(context: Context<'a>, bounds: &'a Bounds, cost: Int) -> Option<Self> {
        let task = context.task;
        if task.operators.iter().any(|operator| operator.cost.minimum() < 0) {
            return None;
        }
        let choices = || task.operators.iter().map(|_| OnceCell::new()).collect();
        let (index, monotone) = (SuccessorGenerator::new(task), is_monotone(task));
        Some(Self { context, bounds, cost, index, monotone, best: choices(), all: choices() })
    }

    /// Builds a graph from the initial state until it is complete, a time or memory limit is
    /// reached, or `is_enough` returns `true`. Returns `None` if an operator has too many
    /// combinations of designs. The second search has a `guide`: the labels of the first search,
    /// and whether a goal can be reached from each of them. States that the guide excludes are
    /// omitted. `is_enough` is called only with a guide.
    fn explore(
        &self,
        labels: Labels,
        guide: Option<(&Labels, &[bool])>,
        is_enough: &mut IsEnough<'_>,
    ) -> Option<(Labels, Graph)> {
        let Context { task, limits } = self.context;
        let mut growth = Growth {
            labels,
            edges: Vec::new(),
            steps: Vec::new(),
            numbers: FxHashMap::default(),
            goals: Vec::new(),
            open: BinaryHeap::new(),
            is_complete: true,
        };
        let is_exact = guide.is_some();
        self.reach(&mut growth, task.initial.clone(), 0, guide);
        let mut pulse = limits.pulse();
        let mut next_look = self.context.limits.thresholds().alternatives;
        while let Some(Reverse((_, _, id))) = growth.open.pop() {
            let expanded =
                pulse.beat().map_err(Stopped::from).and_then(|()| self.expand(&mut growth, id, guide));
            match expanded {
                Ok(()) => {}
                Err(Stopped::TooMany) => return None,
                Err(Stopped::AtLimit) => {
                    growth.is_complete = false;
                    break;
                }
            }
            if growth.bytes() > limits.room() {
                growth.is_complete = false;
                break;
            }
            if is_exact && growth.labels.all.len() >= next_look {
                next_look = next_look.saturating_mul(2);
                let graph = Graph { is_complete: false, ..growth.graph(is_exact) };
                if is_enough(&graph) {
                    return Some((growth.labels, graph));
                }
            }
        }
        let graph = growth.graph(is_exact);
        Some((growth.labels, graph))
    }

    fn choices(&self, id: OperatorId, is_exact: bool) -> Result<&CostedCombinations<Int>, Stopped> {
        let Context { task, limits } = self.context;
        let operator = &task.operators[id.index()];
        let cell = if is_exact { &self.all[id.index()] } else { &self.best[id.index()] };
        if cell.get().is_none() {
            let combinations = if is_exact {
                let count = operator.sizes().into_iter().try_fold(1_usize, usize::checked_mul);
                let priced = |choice: Vec<u32>| (operator.cost_of(&choice), choice);
                count.filter(|count| *count <= MAX_CHOICES).map(|_| {
                    let mut priced_choices: Vec<(Int, Vec<u32>)> =
                        operator.admitted_combinations().map(priced).collect();
                    priced_choices.sort();
                    priced_choices.into_iter().map(|(cost, choice)| (choice, cost)).collect()
                })
            } else {
                pareto_optimal_combinations(operator, self.monotone, false, limits)?
            };
            // The cell is empty, so setting it cannot fail.
            let _ = cell.set(combinations);
        }
        cell.get().and_then(Option::as_ref).ok_or(Stopped::TooMany)
    }

    fn expand(&self, growth: &mut Growth, id: u32, guide: Option<(&Labels, &[bool])>) -> Result<(), Stopped> {
        let task = self.context.task;
        let (state, cost) = growth.labels.all[id as usize].clone();
        let mut pulse = self.context.limits.pulse();
        for operator_id in self.index.applicable(task, &state) {
            let operator = &task.operators[operator_id.index()];
            let sizes = operator.sizes();
            for (choice, step_cost) in self.choices(operator_id, guide.is_some())? {
                pulse.beat()?;
                let Some(cost) = cost.checked_add(*step_cost).filter(|cost| *cost <= self.cost) else {
                    continue;
                };
                if !operator.condition.holds_numerically(&state.numbers, choice, &sizes) {
                    continue;
                }
                let Some(next) = task.successor(operator, &state, choice) else {
                    growth.is_complete = false;
                    continue;
                };
                if let Some(to) = self.reach(growth, next, cost, guide) {
                    let step = GroundStep { operator: operator_id, choice: choice.clone() };
                    let step = growth.step(step);
                    growth.edges.push(Edge { from: id, to, step });
                }
            }
        }
        Ok(())
    }

    /// Returns the label of a state that was reached at this cost, after adding it if it is new. Returns `None`
    /// if no cheapest plan reaches the state at this cost.
    fn reach(
        &self,
        growth: &mut Growth,
        state: State,
        cost: Int,
        guide: Option<(&Labels, &[bool])>,
    ) -> Option<u32> {
        let place = growth.labels.place(&state);
        match growth.labels.known(&place, &state, cost) {
            Known::Beaten => return None,
            Known::Covered(id) => return Some(id),
            Known::New => {}
        }
        let estimate = cost.plus(&self.bounds.estimate(&state)?)?;
        if estimate > self.cost || guide.is_some_and(|guide| is_ruled_out(guide, &state, cost)) {
            return None;
        }
        growth.goals.push(cost == self.cost && self.context.task.is_goal(&state));
        let id = growth.labels.add(place, state, cost);
        // The second search expands states with high cost first, so that it soon reaches goal states.
        let first = if guide.is_some() { 0 } else { estimate };
        growth.open.push(Reverse((first, Reverse(cost), id)));
        Some(id)
    }
}

/// Returns `true` if the first search proves that no cheapest plan reaches the state at this cost.
fn is_ruled_out((labels, alive): (&Labels, &[bool]), state: &State, cost: Int) -> bool {
    let place = labels.place(state);
    labels.no_worse(&place, state, cost).any(|(id, is_cheaper)| is_cheaper || !alive[id as usize])
}
