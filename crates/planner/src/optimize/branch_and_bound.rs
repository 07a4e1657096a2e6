//! Branch and bound for metrics that depend on the state, by A\* with exact costs of paths.
//!
//! The portfolio for constant costs finds a first plan. Then a satisficing search for the task with lower bounds as
//! costs runs in turns with A\*, and its plans are upper bounds. A path dominates another one if it costs no more and
//! its state has the same facts and no worse numbers. Less of a number is never worse if no condition, cost or other
//! number benefits from more of it (and vice versa). With a horizon, longer paths are pruned, and a path dominates only
//! paths that are at least as long.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::hash::BuildHasher;
use std::sync::atomic::Ordering;
use std::time::Instant;

use rustc_hash::{FxBuildHasher, FxHashMap};
use search::bounds::Bounds;
use search::satisfice::{Satisficer, StepResult};
use search::search::successor_generator::SuccessorGenerator;
use task::context::Context;
use task::limits::{Interrupted, Limits};
use task::number::{Int, dense};
use task::plan::decode;
use task::plan::ground::{GroundPlan, GroundStep, cost};
use task::plan::solution::{Improvement, Moment, PlannerPart, Proof, Solution, Statistics, Status};
use task::task::number::TaskNumber as _;
use task::task::{State, Task};
use tracing::info_span;

use crate::optimize::config::{Config, Engine};
use crate::optimize::optimizer_run::Run;
use crate::optimize::solve::solve;
use crate::optimize::state_dependent_costs::StateDependentCosts;

/// Maximum number of nodes. Without it, the search may not end, as numbers can grow without bound at no cost.
const MAX_NODES: usize = 2_000_000;
const MAX_COMBINATIONS: usize = 200_000;
/// Maximum number of nodes that A\* takes from the open list in its first turn. The number doubles in each further
/// turn.
const TURN: usize = 5_000;
/// Work units of a turn of the satisficing search, for each node of the preceding turn of A\*.
const WORK: u64 = 1_000;
/// Approximate memory use of a node in bytes, without the numbers and values of its state.
const OVERHEAD: usize = size_of::<Node>() + 80;

/// Minimises a metric that depends on the state. Returns `None` if the method is not applicable: for example, with the
/// SAT solver only, if an operator may improve the metric, or if operators have too many combinations of designs. Also
/// returns `None` if a limit is reached before the search begins. With a horizon, also returns `None` if no plan within
/// it was found, unless the search for a first plan proves unsolvability.
pub(super) fn minimise(
    task: &Task,
    config: &Config,
    report: &mut dyn FnMut(Improvement),
) -> Option<Solution> {
    let is_open = task.unreachable.is_none() && config.engine != Engine::Sat;
    if !is_open || task.objective.rest.is_empty() {
        return None;
    }
    let horizon = config.horizon;
    let config = &config.clone().with_horizon(None);
    let _span = info_span!("optimize", operators = task.operators.len()).entered();
    let statistics = Statistics { operators: task.operators.len(), ..Statistics::default() };
    let started = Instant::now();
    let limits = &config.limits;
    let costs = StateDependentCosts::new(task, limits).ok()??;
    let choices = choices(task)?;
    let bounds = Bounds::new(Context::new(&costs.priced, limits)).ok()?;
    let mut search = Search::new(task, &costs, &bounds, choices, horizon);
    let (mut statistics, mut priced_cost) = (statistics, None);
    if let Some(first) = first_plan(task, config) {
        if first.status == Status::Unsolvable {
            return Some(first);
        }
        statistics = Statistics { history: Vec::new(), ..first.statistics };
        if let Some(plan) = first.ground {
            priced_cost = cost(&costs.priced, &plan.steps);
            search.offer(plan.steps);
        }
    }
    let part = statistics.found_by.unwrap_or(PlannerPart::Search);
    let mut satisficer = Satisficer::new(Context::new(&costs.priced, limits)).ok().flatten();
    let mut progress = Progress { started, statistics, report };
    progress.note(&search, part);
    let mut turn = TURN;
    let end = loop {
        let end = search.run(limits, turn, &mut progress.statistics);
        progress.note(&search, PlannerPart::Search);
        if let Some(end) = end {
            break end;
        }
        if let Some(running) = &mut satisficer {
            let _span = info_span!("satisfice").entered();
            let figures = running.figures;
            let step = running.run(priced_cost.as_ref(), WORK.saturating_mul(turn as u64));
            running.figures.add_to(figures, &mut progress.statistics);
            match step {
                Ok(StepResult::Plan(plan)) => {
                    priced_cost = Some(plan.cost);
                    search.offer(plan.steps);
                }
                Ok(StepResult::Paused) => {}
                // A\* proves unsolvability.
                Ok(StepResult::Unsolvable | StepResult::Ended) | Err(Interrupted) => satisficer = None,
            }
            progress.note(&search, PlannerPart::Satisficing);
        }
        turn = turn.saturating_mul(2);
    };
    let is_found = search.best.is_some();
    (is_found || horizon.is_none()).then(|| progress.solution(search, end, limits))
}

/// Searches with the portfolio until a plan is reported, for the part of the metric that operator costs represent.
/// Returns `None` if an operator may reduce this part.
fn first_plan(task: &Task, config: &Config) -> Option<Solution> {
    if task.operators.iter().any(|operator| operator.cost.minimum() < 0) {
        return None;
    }
    let config = config.clone().with_limits(config.limits.with_own_interrupt());
    let interrupt = config.limits.interrupt();
    let mut stop = |_: Improvement| interrupt.store(true, Ordering::Relaxed);
    Some(solve(Run::new(task, &config, &mut stop)))
}

fn choices(task: &Task) -> Option<Vec<Vec<Vec<u32>>>> {
    let mut remaining = MAX_COMBINATIONS;
    let mut choices = Vec::with_capacity(task.operators.len());
    for operator in &task.operators {
        let combinations: Vec<_> =
            operator.admitted_combinations().take(remaining.saturating_add(1)).collect();
        remaining = remaining.checked_sub(combinations.len())?;
        choices.push(combinations);
    }
    Some(choices)
}

struct Progress<'p> {
    started: Instant,
    statistics: Statistics,
    report: &'p mut dyn FnMut(Improvement),
}

impl Progress<'_> {
    fn note(&mut self, search: &Search<'_>, part: PlannerPart) {
        let Some((total, plan)) = &search.best else { return };
        let cost = search.costs.metric(search.task, *total);
        let history = &mut self.statistics.history;
        if history.last().is_some_and(|moment| moment.cost.as_ref() == Some(&cost)) {
            return;
        }
        let lower_bound = search.costs.metric(search.task, search.lower().unwrap_or(*total));
        let moment = Moment {
            time: self.started.elapsed(),
            cost: Some(cost.clone()),
            lower_bound: lower_bound.clone(),
        };
        history.push(moment);
        self.statistics.found_by = Some(part);
        (self.report)(Improvement { cost, lower_bound, horizon: plan.steps.len() });
    }

    fn solution(mut self, search: Search<'_>, end: End, limits: &Limits) -> Solution {
        self.statistics.search = self.started.elapsed();
        let lower = search.lower().map(|lower| search.costs.metric(search.task, lower));
        let plan = search.best.map(|(_, plan)| plan);
        let (status, proof) = match (plan.is_some(), end) {
            (true, End::Exhausted) => (Status::Optimal, Some(Proof::Search)),
            (false, End::Exhausted) => (Status::Unsolvable, Some(Proof::Search)),
            (true, End::Stopped) => (Status::Feasible, None),
            (false, End::Stopped) => (Status::Unknown, None),
        };
        if proof.is_some() {
            // The proof does not depend on the search for the first plan.
            self.statistics.unchecked = None;
        }
        let horizon = plan.as_ref().filter(|_| proof.is_some()).map_or(0, |plan| plan.steps.len());
        Solution {
            status,
            plan: plan.as_ref().map(|plan| decode(Context::new(search.task, limits), plan)),
            ground: plan,
            lower_bound: lower.filter(|_| status != Status::Unsolvable),
            horizon,
            proof,
            unbounded: None,
            statistics: self.statistics,
        }
    }
}

#[derive(Clone, Copy)]
enum End {
    /// All nodes are expanded, except those that cannot lead to a plan better than the best one.
    Exhausted,
    /// A limit was reached, or nodes were dropped because their numbers overflow, or because they are beyond the horizon
    /// and may lead to a better plan.
    Stopped,
}

struct Node {
    state: State,
    /// Sum of the operator costs of the path, in the unit of `total`.
    paid: Int,
    /// Cost of the path, including the weighted values of the measured fluents in its last state.
    total: Int,
    steps: usize,
    origin: Option<(u32, GroundStep)>,
    is_dominated: bool,
}

impl Node {
    fn path(&self) -> Path<'_> {
        Path { state: &self.state, total: self.total, steps: self.steps }
    }
}

#[derive(Clone, Copy)]
struct Path<'n> {
    state: &'n State,
    total: Int,
    steps: usize,
}

/// Lower bound on the cost of plans through the node, estimate of the remaining cost, and index of
/// the node.
type Priority = (Int, Int, Reverse<u32>);

struct Search<'a> {
    task: &'a Task,
    costs: &'a StateDependentCosts,
    bounds: &'a Bounds,
    choices: Vec<Vec<Vec<u32>>>,
    horizon: Option<usize>,
    generator: SuccessorGenerator,
    nodes: Vec<Node>,
    /// Nodes that no other node dominates, by the hash of the parts of their states that must be equal.
    table: FxHashMap<u64, Vec<u32>>,
    open: BinaryHeap<Reverse<Priority>>,
    best: Option<(Int, GroundPlan)>,
    /// Lower bound on the cost of plans through nodes that were dropped because numbers overflow.
    left_out: Option<Int>,
    /// Lower bound on the cost of plans through nodes beyond the horizon.
    beyond: Option<Int>,
    bytes: usize,
}

impl<'a> Search<'a> {
    fn new(
        task: &'a Task,
        costs: &'a StateDependentCosts,
        bounds: &'a Bounds,
        choices: Vec<Vec<Vec<u32>>>,
        horizon: Option<usize>,
    ) -> Self {
        let mut search = Self {
            task,
            costs,
            bounds,
            choices,
            horizon,
            generator: SuccessorGenerator::new(task),
            nodes: Vec::new(),
            table: FxHashMap::default(),
            open: BinaryHeap::new(),
            best: None,
            left_out: None,
            beyond: None,
            bytes: 0,
        };
        match costs.measured(&task.initial) {
            Some(total) => search.add(task.initial.clone(), (0, total), None),
            None => search.left_out = Some(Int::MIN),
        }
        search
    }

    /// Lower bound on the cost of every plan, of any length. `None` if no bound is known or no plan exists.
    fn lower(&self) -> Option<Int> {
        let open = self.open.peek().map(|Reverse(priority)| priority.0);
        let best = self.best.as_ref().map(|(total, _)| *total);
        let lower = open.into_iter().chain(self.left_out).chain(self.beyond).chain(best).min();
        lower.filter(|lower| *lower > Int::MIN)
    }

    /// Expands nodes until the search ends. Returns `None` after `max_nodes` nodes of the open list; the search can
    /// then be resumed.
    fn run(&mut self, limits: &Limits, max_nodes: usize, statistics: &mut Statistics) -> Option<End> {
        let _span = info_span!("search").entered();
        let mut pulse = limits.pulse();
        for _ in 0..max_nodes {
            let Some(Reverse(priority)) = self.open.pop() else {
                let is_longer_better = self.beyond.is_some_and(|bound| self.is_better(bound));
                let is_complete = self.left_out.is_none() && !is_longer_better;
                return Some(if is_complete { End::Exhausted } else { End::Stopped });
            };
            let (bound, _, Reverse(id)) = priority;
            if self.nodes[id as usize].is_dominated || !self.is_better(bound) {
                continue;
            }
            statistics.expanded = statistics.expanded.saturating_add(1);
            let state = self.nodes[id as usize].state.clone();
            for operator in self.generator.applicable(self.task, &state) {
                for position in 0..self.choices[operator.index()].len() {
                    if pulse.beat().is_err() || self.is_full(limits) {
                        // The node is not completely expanded, so it stays open and counts for the lower bound.
                        self.open.push(Reverse(priority));
                        return Some(End::Stopped);
                    }
                    statistics.generated = statistics.generated.saturating_add(1);
                    let choice = self.choices[operator.index()][position].clone();
                    if self.task.operators[operator.index()].applicable(&state, &choice) {
                        self.extend(id, &state, GroundStep { operator, choice });
                    }
                }
            }
        }
        None
    }

    fn extend(&mut self, id: u32, state: &State, step: GroundStep) {
        let Node { paid, total, .. } = self.nodes[id as usize];
        let operator = &self.task.operators[step.operator.index()];
        let next = self.task.successor(operator, state, &step.choice);
        let next = next.and_then(|next| {
            let paid = self.costs.paid(operator, &step.choice)?.checked_add(paid)?;
            let total = self.costs.measured(&next)?.checked_add(paid).filter(Int::is_moderate)?;
            Some((next, (paid, total)))
        });
        match next {
            Some((next, cost)) => self.add(next, cost, Some((id, step))),
            // No step reduces the cost, so the cost of the path is a lower bound.
            None => self.left_out = Some(self.left_out.map_or(total, |bound| bound.min(total))),
        }
    }

    /// Adds a node, unless another path dominates the path to the node, or the node cannot lead to a better plan within
    /// the horizon. If the node is a goal, its path becomes the best plan.
    fn add(&mut self, state: State, (paid, total): (Int, Int), origin: Option<(u32, GroundStep)>) {
        let Some(estimate) = self.bounds.estimate(&state) else { return };
        let bound = total.saturating_add(estimate);
        let parent = origin.as_ref().map(|(parent, _)| &self.nodes[*parent as usize]);
        let steps = parent.map_or(0, |parent| parent.steps.saturating_add(1));
        if !self.is_better(bound) {
            return;
        }
        if self.exceeds_horizon(steps) {
            self.beyond = Some(self.beyond.map_or(bound, |other| other.min(bound)));
            return;
        }
        let id = dense(self.nodes.len());
        let hash = self.hash(&state);
        let mut front = self.table.remove(&hash).unwrap_or_default();
        let path = Path { state: &state, total, steps };
        let is_dominated = front.iter().any(|id| self.dominates(self.nodes[*id as usize].path(), path));
        if !is_dominated {
            let worse = front.extract_if(.., |id| self.dominates(path, self.nodes[*id as usize].path()));
            let worse: Vec<u32> = worse.collect();
            for id in worse {
                self.nodes[id as usize].is_dominated = true;
            }
            front.push(id);
        }
        self.table.insert(hash, front);
        if is_dominated {
            return;
        }
        let size = size_of_val(&*state.values).saturating_add(size_of_val(&*state.numbers));
        self.bytes = self.bytes.saturating_add(size).saturating_add(OVERHEAD);
        let is_goal = self.task.is_goal(&state);
        self.nodes.push(Node { state, paid, total, steps, origin, is_dominated: false });
        if is_goal {
            // No continuation of the plan is cheaper.
            self.adopt(id);
        } else {
            self.open.push(Reverse((bound, estimate, Reverse(id))));
        }
    }

    fn is_full(&self, limits: &Limits) -> bool {
        self.bytes.saturating_mul(4) / 3 > limits.room() || self.nodes.len() >= MAX_NODES
    }

    fn exceeds_horizon(&self, steps: usize) -> bool {
        self.horizon.is_some_and(|horizon| steps > horizon)
    }

    fn is_better(&self, bound: Int) -> bool {
        self.best.as_ref().is_none_or(|(total, _)| bound < *total)
    }

    fn adopt(&mut self, goal: u32) {
        let mut steps = Vec::new();
        let mut at = goal;
        while let Some((parent, step)) = &self.nodes[at as usize].origin {
            steps.push(step.clone());
            at = *parent;
        }
        steps.reverse();
        self.offer(steps);
    }

    fn offer(&mut self, steps: Vec<GroundStep>) {
        if self.exceeds_horizon(steps.len()) {
            return;
        }
        let Some(cost) = cost(self.task, &steps) else { return };
        let plan = GroundPlan { steps, cost };
        if let Some(total) = self.costs.total(self.task, &plan).filter(|total| self.is_better(*total)) {
            self.best = Some((total, plan));
        }
    }

    /// Values of the numbers for which neither less nor more is known to be at least as good. Dominance requires these
    /// values to be equal.
    fn key_numbers<'s>(&self, state: &'s State) -> impl Iterator<Item = Int> + use<'s, '_> {
        let numbers = state.numbers.iter().zip(&self.costs.preferences);
        numbers.filter(|(_, preference)| !preference.less && !preference.more).map(|(number, _)| *number)
    }

    fn hash(&self, state: &State) -> u64 {
        let numbers: Vec<Int> = self.key_numbers(state).collect();
        FxBuildHasher.hash_one((&state.values, numbers))
    }

    /// Returns `true` if it is certain that every continuation of the path `other` within the horizon is also
    /// possible after `path`, within the horizon and at no higher cost.
    fn dominates(&self, path: Path<'_>, other: Path<'_>) -> bool {
        let numbers = path.state.numbers.iter().zip(&other.state.numbers);
        let mut numbers = numbers.zip(&self.costs.preferences);
        path.total <= other.total
            && (self.horizon.is_none() || path.steps <= other.steps)
            && path.state.values == other.state.values
            && numbers.all(|((first, second), preference)| {
                first == second || preference.less && first <= second || preference.more && first >= second
            })
    }
}
