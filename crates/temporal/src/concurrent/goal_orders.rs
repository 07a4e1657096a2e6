//! Iterated local search over goal orders, for plans with a smaller makespan.
//!
//! An order of the goals is decoded to a plan: goal after goal, a short plan achieves the next goal
//! as soon as it can and keeps the earlier ones, and its actions are scheduled at their earliest
//! times. Actions that do not interfere overlap, and a timed relaxed plan selects the objects that
//! are free first. With the goals that take longest in front, this is list scheduling by longest
//! processing time \[1\]. Local search then swaps and moves goals \[2\]; decoding a sequence of
//! intermediate goals by a simple planner is the scheme of \[3\].
//!
//! The greedy search (`greedy`) usually expands each state only once, regardless of its times. It
//! therefore rarely changes how actions are distributed among interchangeable objects. The search over
//! goal orders proves nothing: it only yields plans, each of which was executed happening by happening.
//!
//! A short plan results from executing the executable actions of a relaxed plan, as in \[4\],
//! repeatedly. If this leads to a visited state, or no action is executable, best-first search by the
//! size of the relaxed plan continues \[5\].
//!
//! \[1\] R. Graham: Bounds on multiprocessing timing anomalies, SIAM Journal on Applied Mathematics
//! 17, 1969.
//! \[2\] H. Lourenço, O. Martin, T. Stützle: Iterated local search, Handbook of Metaheuristics, 2003.
//! \[3\] J. Bibaï, P. Savéant, M. Schoenauer, V. Vidal: An evolutionary metaheuristic based on state
//! decomposition for domain-independent satisficing planning, ICAPS 2010.
//! \[4\] V. Vidal: A lookahead strategy for heuristic search planning, ICAPS 2004.
//! \[5\] J. Hoffmann, B. Nebel: The FF planning system, JAIR 14, 2001.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::hash::{Hash, Hasher};

use rustc_hash::{FxHashSet, FxHasher};
use search::random::Random;
use search::search::SearchStatistics;
use task::limits::{LimitPoll, Limits};
use task::number::{Int, dense};
use task::task::{Fact, OperatorId};

use crate::concurrent::greedy::{Links, Mode};

use crate::concurrent::rule::Proposition;
use crate::concurrent::search::Sequence;
use crate::concurrent::successors::{Expansion, TemporalState};
use crate::concurrent::temporal_relaxation::TemporalRelaxation;
use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;
use crate::concurrent::timed_relaxed_plan::{TimedRelaxation, TimedRelaxedPlan};

/// Upper limit, per goal, on the number of relaxed plans whose actions are executed.
const MAX_ROUNDS: usize = 60;
/// Upper limit on the number of states that one best-first search evaluates.
const MAX_ESCAPE: usize = 100;
/// Upper limit on the number of best-first searches per goal. An order that needs more is dropped. Otherwise,
/// this search would take too much time from the other searches on tasks with conflicting goals.
const MAX_ESCAPES: usize = 3;
/// Number of failed orders after which the search ends if it has found no plan.
const MAX_FAILURES: usize = 12;
/// Work (see `GoalOrders::work`) without a better plan after which the search ends.
const MAX_STALE: u64 = 200_000;
/// Number of neighbouring orders, per goal, without a better plan after which the best order is
/// perturbed.
const NEIGHBOURS: usize = 12;
const KICK: usize = 3;
/// The states of the stored orders may take at most 1/`MEMORY_FRACTION` of the memory limit.
const MEMORY_FRACTION: usize = 8;

type Link = (OperatorId, bool);

type Achieved<T> = (TemporalState<T>, Vec<Link>);

/// Temporal state before a goal of an order is achieved, and the number of happenings up to there.
#[derive(Clone)]
struct Stage<T: TimeNumber = Int> {
    situation: TemporalState<T>,
    happenings: usize,
}

#[derive(Clone)]
struct Decoded<T: TimeNumber = Int> {
    order: Vec<usize>,
    stages: Vec<Stage<T>>,
    links: Vec<Link>,
    value: (T, T),
}

enum Decoding<T: TimeNumber = Int> {
    Plan(Box<Decoded<T>>, Sequence<T>),
    Failed,
    Interrupted,
}

pub(super) struct GoalOrders<'a, T: TimeNumber = Int> {
    concurrent: &'a TemporalTask<T>,
    expansion: &'a Expansion<'a, T>,
    relaxation: TimedRelaxation<'a, T>,
    relaxed: &'a TemporalRelaxation,
    goals: Vec<Fact>,
    /// Orders that are decoded before further neighbours, last one first.
    initial: Vec<Vec<usize>>,
    /// Metric and makespan of the last plan whose order of goals was added to `initial`, or of the last plan
    /// that this search returned.
    seen: Option<(T, T)>,
    current: Option<Decoded<T>>,
    best: Option<Decoded<T>>,
    /// Number of neighbours tried since the last perturbation or the last best plan.
    rejected: usize,
    failures: usize,
    improved_at: u64,
    decoded: u64,
    random: Random,
    pub(super) figures: SearchStatistics,
}

impl<'a, T: TimeNumber> GoalOrders<'a, T> {
    /// Prepares the search with three initial orders of the goals: by increasing time, by index, and by
    /// decreasing time, where the time of a goal is that of a timed relaxed plan for this goal alone. `seed`
    /// selects the perturbations. Returns `None` if there is no goal fact to order, a goal is unreachable, the
    /// metric does not depend on the makespan, the states would take too much memory, or a limit is reached.
    pub(super) fn new(
        concurrent: &'a TemporalTask<T>,
        expansion: &'a Expansion<'a, T>,
        relaxed: &'a TemporalRelaxation,
        seed: u64,
        limits: &Limits,
    ) -> Option<Self> {
        let task = &concurrent.task;
        let basic = |fact: &&Fact| fact.variable.index() < task.basic;
        let goals: Vec<Fact> = task.goal.facts.iter().filter(basic).copied().collect();
        let bytes = task.variables.len().saturating_mul(16).saturating_add(1_000);
        let is_small = bytes.saturating_mul(goals.len()).saturating_mul(3) < limits.room() / MEMORY_FRACTION;
        if goals.is_empty() || concurrent.measure.time == T::ZERO || !is_small {
            return None;
        }
        let mut relaxation = TimedRelaxation::new(concurrent, relaxed);
        let root = expansion.root();
        let mut keyed = Vec::new();
        for (index, goal) in goals.iter().enumerate() {
            limits.check().ok()?;
            let finish = relaxation.plan(&root, &[proposition(relaxed, *goal)])?.finish;
            // Goals that hold at the beginning may have to be restored at the end.
            keyed.push((goal.holds(&root.state.values), Reverse(finish), index));
        }
        let by_index: Vec<usize> = (0..goals.len()).collect();
        keyed.sort_unstable();
        let longest_first: Vec<usize> = keyed.iter().map(|(_, _, index)| *index).collect();
        keyed.sort_unstable_by_key(|(is_initial, Reverse(finish), index)| (*is_initial, *finish, *index));
        let shortest_first = keyed.iter().map(|(_, _, index)| *index).collect();
        Some(Self {
            concurrent,
            expansion,
            relaxation,
            relaxed,
            goals,
            initial: vec![shortest_first, by_index, longest_first],
            seen: None,
            current: None,
            best: None,
            rejected: 0,
            failures: 0,
            improved_at: 0,
            decoded: 0,
            random: Random(seed),
            figures: SearchStatistics::default(),
        })
    }

    pub(super) fn is_over(&self) -> bool {
        self.best.is_none() && self.failures >= MAX_FAILURES
            || self.best.is_some() && self.goals.len() < 2 && self.initial.is_empty()
            || self.work().saturating_sub(self.improved_at) >= MAX_STALE
    }

    /// Work up to now: one unit per evaluated state and per order. An order may need no evaluation.
    pub(super) fn work(&self) -> u64 {
        self.figures.evaluated.saturating_add(self.decoded)
    }

    /// Decodes orders until a plan is better than the incumbent, `work` units were spent, a limit is reached,
    /// or the search has ended. Returns the better plan.
    pub(super) fn run(
        &mut self,
        incumbent: Option<&Sequence<T>>,
        limits: &Limits,
        work: usize,
    ) -> Option<Sequence<T>> {
        let end = self.work().saturating_add(work as u64);
        let mut pulse = limits.pulse();
        if let Some(incumbent) =
            incumbent.filter(|sequence| self.seen.is_none_or(|seen| sequence.value < seen))
        {
            self.seen = Some(incumbent.value);
            self.initial.push(self.order_of(incumbent));
        }
        while self.work() < end && !self.is_over() && pulse.beat().is_ok() {
            self.decoded = self.decoded.saturating_add(1);
            let is_initial = !self.initial.is_empty();
            let (order, from, limit) = self.next_order();
            let base = if is_initial { None } else { self.current.take() };
            let decoding = self.decode(&order, base.as_ref().map(|base| (base, from)), limit, &mut pulse);
            self.current = base.or_else(|| self.current.take());
            match decoding {
                Decoding::Plan(decoded, sequence) => {
                    self.failures = 0;
                    let is_best = self.best.as_ref().is_none_or(|best| decoded.value < best.value);
                    if is_best {
                        self.improved_at = self.work();
                        self.rejected = 0;
                        self.best = Some((*decoded).clone());
                    }
                    if !is_initial || is_best {
                        self.current = Some(*decoded);
                    }
                    if incumbent.is_none_or(|incumbent| sequence.value < incumbent.value) {
                        self.seen = Some(sequence.value);
                        return Some(sequence);
                    }
                }
                Decoding::Failed => self.failures = self.failures.saturating_add(1),
                Decoding::Interrupted => break,
            }
        }
        None
    }

    /// Order in which a plan finally achieves the goals; goals that it never makes true come last.
    fn order_of(&self, sequence: &Sequence<T>) -> Vec<usize> {
        let task = &self.concurrent.task;
        let mut state = task.initial.clone();
        let mut achieved = vec![usize::MAX; self.goals.len()];
        for (position, id) in sequence.happenings.iter().enumerate() {
            let Some(next) = task.successor(&task.operators[id.index()], &state, &[]) else { break };
            for (goal, achieved) in self.goals.iter().zip(&mut achieved) {
                if goal.holds(&next.values) && !goal.holds(&state.values) {
                    *achieved = position;
                }
            }
            state = next;
        }
        let mut order: Vec<usize> = (0..self.goals.len()).collect();
        order.sort_by_key(|index| achieved[*index]);
        order
    }

    /// Next order, its first position that may differ from the current order, and the worst
    /// acceptable value (`None` if any value is acceptable).
    fn next_order(&mut self) -> (Vec<usize>, usize, Option<(T, T)>) {
        if let Some(order) = self.initial.pop() {
            return (order, 0, None);
        }
        let count = self.goals.len();
        let Some(best) = &self.best else {
            let mut order: Vec<usize> = (0..count).collect();
            for position in (1..count).rev() {
                order.swap(position, self.random.below(position.saturating_add(1)));
            }
            return (order, 0, None);
        };
        if self.rejected >= NEIGHBOURS.saturating_mul(count) {
            self.rejected = 0;
            let mut order = best.order.clone();
            let from = (0..KICK).map(|_| change(&mut self.random, &mut order)).min().unwrap_or(0);
            self.current = self.best.clone();
            return (order, from, None);
        }
        self.rejected = self.rejected.saturating_add(1);
        let current = self.current.as_ref().unwrap_or(best);
        let (mut order, limit) = (current.order.clone(), current.value);
        let from = change(&mut self.random, &mut order);
        (order, from, Some(limit))
    }

    /// Decodes an order. `base` is a decoded order with the same goals before the given position, so decoding
    /// begins at this position. Fails if a goal is not achieved, a hard deadline is missed, or the value overflows
    /// or exceeds `limit`.
    fn decode(
        &mut self,
        order: &[usize],
        base: Option<(&Decoded<T>, usize)>,
        limit: Option<(T, T)>,
        pulse: &mut LimitPoll<'_>,
    ) -> Decoding<T> {
        let first = Stage { situation: self.expansion.root(), happenings: 0 };
        let (mut stages, mut links, from) = match base {
            Some((base, from)) if from < base.stages.len() => {
                let stages = base.stages[..=from].to_vec();
                let links = base.links[..stages[from].happenings].to_vec();
                (stages, links, from)
            }
            _ => (vec![first], Vec::new(), 0),
        };
        let Some(stage) = stages.pop() else { return Decoding::Failed };
        let mut situation = stage.situation.clone();
        stages.push(stage);
        let mut targets: Vec<Proposition> =
            order[..from].iter().map(|goal| proposition(self.relaxed, self.goals[*goal])).collect();
        let is_too_late = |situation: &TemporalState<T>| {
            let value = self.concurrent.measure.total(situation.clocks.latest(), situation.cost);
            limit.is_some_and(|limit| value.is_none_or(|value| value > limit.0))
        };
        let mut facts: Vec<Fact> = order[..from].iter().map(|goal| self.goals[*goal]).collect();
        for (position, goal) in order.iter().enumerate().skip(from) {
            if position > from {
                stages.push(Stage { situation: situation.clone(), happenings: links.len() });
            }
            facts.push(self.goals[*goal]);
            targets.push(proposition(self.relaxed, self.goals[*goal]));
            let is_reached = |at: &TemporalState<T>| facts.iter().all(|fact| fact.holds(&at.state.values));
            match achieve(
                &mut self.relaxation,
                (self.concurrent, self.expansion),
                &mut self.figures,
                Goal { targets: &targets, is_reached: &is_reached },
                situation,
                &mut links,
                pulse,
            ) {
                Ok(Some(next)) if !is_too_late(&next) => situation = next,
                Ok(_) => return Decoding::Failed,
                Err(Stopped) => return Decoding::Interrupted,
            }
        }
        // The other parts of the goal (numeric goals, disjunctions and derived facts) are achieved last.
        let (expansion, relaxed) = (self.expansion, self.relaxed);
        let is_reached = |at: &TemporalState<T>| expansion.is_goal(at);
        let goal = Goal { targets: &relaxed.goal, is_reached: &is_reached };
        let achieved = achieve(
            &mut self.relaxation,
            (self.concurrent, self.expansion),
            &mut self.figures,
            goal,
            situation,
            &mut links,
            pulse,
        );
        match achieved {
            Ok(Some(last)) => situation = last,
            Ok(None) => return Decoding::Failed,
            Err(Stopped) => return Decoding::Interrupted,
        }
        let Some(value) = self.concurrent.value(&situation) else { return Decoding::Failed };
        let (happenings, together) = links.iter().copied().unzip();
        let sequence = self.concurrent.judge(Sequence { value, happenings, together }, situation.cost);
        match sequence.filter(|sequence| limit.is_none_or(|limit| sequence.value <= limit)) {
            Some(sequence) => {
                let value = sequence.value;
                Decoding::Plan(Box::new(Decoded { order: order.to_vec(), stages, links, value }), sequence)
            }
            None => Decoding::Failed,
        }
    }
}

/// Moves one goal or swaps two. Returns the first position that may change.
fn change(random: &mut Random, order: &mut Vec<usize>) -> usize {
    let [first, second] = [random.below(order.len()), random.below(order.len())];
    if random.below(2) == 0 {
        order.swap(first, second);
    } else {
        let goal = order.remove(first);
        order.insert(second, goal);
    }
    first.min(second)
}

fn proposition(relaxed: &TemporalRelaxation, fact: Fact) -> Proposition {
    relaxed.first[fact.variable.index()].saturating_add(fact.value)
}

#[derive(Clone, Copy)]
struct Goal<'g, T: TimeNumber> {
    targets: &'g [Proposition],
    is_reached: &'g dyn Fn(&TemporalState<T>) -> bool,
}

struct Stopped;

/// Hash of a state and the timed initial literals that have taken place. A collision only loses a
/// state.
fn key<T: TimeNumber>(TemporalState { state, clocks, .. }: &TemporalState<T>) -> u64 {
    let mut hasher = FxHasher::default();
    (&state.values, &state.numbers, clocks.floor()).hash(&mut hasher);
    hasher.finish()
}

/// Extends a sequence of happenings until a goal is reached: by executable parts of relaxed plans, or by
/// best-first search if they make no progress. Returns `None` if the goal is not reached within the limits.
fn achieve<T: TimeNumber>(
    relaxation: &mut TimedRelaxation<'_, T>,
    (concurrent, expansion): (&TemporalTask<T>, &Expansion<'_, T>),
    figures: &mut SearchStatistics,
    goal: Goal<'_, T>,
    mut situation: TemporalState<T>,
    links: &mut Vec<Link>,
    pulse: &mut LimitPoll<'_>,
) -> Result<Option<TemporalState<T>>, Stopped> {
    let mut visited: FxHashSet<u64> = FxHashSet::default();
    let mut escapes = 0;
    for _ in 0..MAX_ROUNDS {
        if (goal.is_reached)(&situation) {
            return Ok(Some(situation));
        }
        pulse.beat().map_err(|_| Stopped)?;
        figures.evaluated = figures.evaluated.saturating_add(1);
        let Some(plan) = relaxation.plan(&situation, goal.targets) else { return Ok(None) };
        visited.insert(key(&situation));
        let before = links.len();
        let next = execute((concurrent, expansion), &situation, &plan, links);
        figures.generated = figures.generated.saturating_add(plan.happenings.len() as u64);
        match next {
            Some(next) if !visited.contains(&key(&next)) || (goal.is_reached)(&next) => situation = next,
            _ if escapes == MAX_ESCAPES => return Ok(None),
            _ => {
                escapes = escapes.saturating_add(1);
                links.truncate(before);
                let size = plan.happenings.len();
                let successor = escape(
                    relaxation,
                    (concurrent, expansion),
                    figures,
                    goal,
                    (&situation, size),
                    &mut visited,
                    pulse,
                )?;
                let Some((next, further)) = successor else { return Ok(None) };
                links.extend(further);
                situation = next;
            }
        }
    }
    Ok(None)
}

/// Executes the actions of a relaxed plan that can be executed, in several passes over the plan.
/// Returns `None` if no action can be executed.
fn execute<T: TimeNumber>(
    context: (&TemporalTask<T>, &Expansion<'_, T>),
    situation: &TemporalState<T>,
    plan: &TimedRelaxedPlan,
    links: &mut Vec<Link>,
) -> Option<TemporalState<T>> {
    let mut current: Option<TemporalState<T>> = None;
    let mut pending = plan.happenings.clone();
    loop {
        let before = pending.len();
        pending.retain(|operator| {
            let at = current.as_ref().unwrap_or(situation);
            match act(context, at, *operator) {
                Some((next, action_links)) => {
                    links.extend(action_links);
                    current = Some(next);
                    false
                }
                None => true,
            }
        });
        if pending.is_empty() || pending.len() == before {
            return current;
        }
    }
}

fn act<T: TimeNumber>(
    (concurrent, expansion): (&TemporalTask<T>, &Expansion<'_, T>),
    situation: &TemporalState<T>,
    operator: OperatorId,
) -> Option<(TemporalState<T>, Links)> {
    if !concurrent.task.operators[operator.index()].applicable(&situation.state, &[]) {
        return None;
    }
    let mut links = Links::new();
    let mut next =
        Mode::Sequential.apply_happening(concurrent, expansion, situation, operator, &mut links)?;
    if !next.clocks.opens().is_empty() {
        let end = concurrent.end_of(operator);
        next = Mode::Sequential.apply_happening(concurrent, expansion, &next, end, &mut links)?;
    }
    Some((next, links))
}

/// Best-first search for a state that reaches the goal, or whose relaxed plan has fewer happenings than
/// `size`. Returns the state and the happenings that lead to it. Returns `None` after [`MAX_ESCAPE`]
/// evaluations, or if the open list is empty.
fn escape<T: TimeNumber>(
    relaxation: &mut TimedRelaxation<'_, T>,
    context: (&TemporalTask<T>, &Expansion<'_, T>),
    figures: &mut SearchStatistics,
    goal: Goal<'_, T>,
    (situation, size): (&TemporalState<T>, usize),
    visited: &mut FxHashSet<u64>,
    pulse: &mut LimitPoll<'_>,
) -> Result<Option<Achieved<T>>, Stopped> {
    let mut nodes: Vec<(TemporalState<T>, Vec<Link>)> = vec![(situation.clone(), Vec::new())];
    let mut queue = BinaryHeap::from([Reverse((size, 0_i64, 0_u32))]);
    let mut budget = MAX_ESCAPE;
    while let Some(Reverse((_, _, node))) = queue.pop() {
        let (from, path) = nodes[node as usize].clone();
        for operator in context.1.starts(&from.state) {
            pulse.beat().map_err(|_| Stopped)?;
            let Some((next, links)) = act(context, &from, operator) else { continue };
            if !visited.insert(key(&next)) {
                continue;
            }
            let path: Vec<Link> = path.iter().chain(&links).copied().collect();
            if (goal.is_reached)(&next) {
                return Ok(Some((next, path)));
            }
            if budget == 0 {
                return Ok(None);
            }
            budget = budget.saturating_sub(1);
            figures.evaluated = figures.evaluated.saturating_add(1);
            let Some(plan) = relaxation.plan(&next, goal.targets) else { continue };
            if plan.happenings.len() < size {
                return Ok(Some((next, path)));
            }
            queue.push(Reverse((plan.happenings.len(), plan.finish, dense(nodes.len()))));
            nodes.push((next, path));
        }
    }
    Ok(None)
}
