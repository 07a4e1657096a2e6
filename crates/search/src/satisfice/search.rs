//! Lazy greedy best-first search with preferred operators, and weighted A\* with a fixed weight.
//!
//! A state is evaluated when it is expanded, and its successors are queued with its heuristic values \[1\].
//! The two heuristics are the cost of the relaxed plan and the number of required landmarks; their open lists
//! alternate. The first search of a sequence uses unit costs, and later searches use operator costs with
//! decreasing weights \[2\]. A state without a relaxed plan is a dead end. If the open lists are empty and
//! `incomplete` is `false`, all reachable states were visited, except those behind dead ends and those that
//! the h² mutexes prove useless.
//!
//! If the relaxed plan applies an operator several times, the search also jumps over the states between \[3\].
//!
//! - \[1\] M. Helmert: The Fast Downward planning system, JAIR 26, 2006, section 5.
//! - \[2\] S. Richter, M. Westphal: The LAMA planner, JAIR 39, 2010, section 6.
//! - \[3\] E. Scala, A. Saetti, I. Serina, A. E. Gerevini: Search-guidance mechanisms for numeric planning through
//!   subgoaling relaxation, ICAPS 2020.

use std::sync::Arc;

use task::limits::{Interrupted, LimitPoll, Limits};
use task::plan::ground::{GroundPlan, GroundStep, cost};
use task::task::number::TaskNumber;
use task::task::{OperatorId, State, Task};

use crate::satisfice::alternating_open_list::AlternatingOpenList;
use crate::satisfice::delete_relaxation::Proposition;
use crate::satisfice::search_context::{GENERATION_COST, SearchContext, USELESS_OPERATOR_COST};
use crate::satisfice::segment_goal::SegmentGoal;
use crate::satisfice::store::Store;
use crate::search::SearchStatistics;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum HeuristicWeight {
    /// The heuristic value only (greedy best-first search).
    Greedy,
    /// The path cost plus this multiple of the heuristic value (weighted A\*).
    Times(u64),
}

/// Start and goal of a search.
pub(super) enum SearchGoal<N> {
    /// Search from the initial state to the goal of the task. Landmarks guide it.
    Task,
    /// Search from a state of a plan to the goal of a segment.
    Segment(State<N>, SegmentGoal),
}

struct Node<N> {
    parent: u32,
    /// Index of the step (operator with designs) that leads from the parent to this node.
    step: u32,
    cost: N,
    /// Path cost as the sum of the scaled operator costs.
    price: u64,
    /// `true` if the state was reached within a jump and is not evaluated yet.
    is_pending: bool,
}

pub(super) enum Outcome<N> {
    Plan(GroundPlan<N>),
    /// The open lists are empty. No plan exists, unless `Search::incomplete` is `true`.
    Exhausted,
    Paused,
}

pub(super) struct Search<N> {
    weight: HeuristicWeight,
    /// Goal of the search, if it is not the goal of the task.
    segment: Option<SegmentGoal>,
    /// Propositions of the goal.
    targets: Vec<Proposition>,
    prices: Arc<[u32]>,
    /// Mean scaled operator cost, without useless operators. Converts a number of landmarks to a cost.
    mean: u32,
    store: Store<N>,
    nodes: Vec<Node<N>>,
    /// Reached landmarks of each state, as a bitset of `stride` words.
    reached: Vec<u64>,
    /// Number of words of a bitset of landmarks: 0 in a segment.
    stride: usize,
    open: AlternatingOpenList<u64>,
    /// Number of states of jumps whose work is not charged yet.
    jumped: u64,
    /// Lowest value of each heuristic among the evaluated states.
    best: [u32; 2],
    /// `true` if states were pruned because a number overflowed or their path cost reached the limit.
    pub(super) incomplete: bool,
}

impl<N: TaskNumber> Search<N> {
    pub(super) fn new(
        context: &mut SearchContext<'_, N>,
        weight: HeuristicWeight,
        prices: Arc<[u32]>,
        goal: SearchGoal<N>,
    ) -> Self {
        let (initial, segment) = match goal {
            SearchGoal::Task => (context.task.initial.clone(), None),
            SearchGoal::Segment(initial, goal) => (initial, Some(goal)),
        };
        let has_landmarks = segment.is_none() && !context.status.is_empty();
        let estimates = if has_landmarks { 2 } else { 1 };
        let targets = match &segment {
            None => vec![context.relaxation.goal],
            Some(goal) => goal.facts.iter().map(|fact| context.relaxation.fact(*fact)).collect(),
        };
        let useful = prices.iter().filter(|price| **price < USELESS_OPERATOR_COST);
        let sum: u64 = useful.clone().map(|price| u64::from(*price)).sum();
        let mean = sum.checked_div(useful.count() as u64).unwrap_or(1);
        let mut search = Self {
            mean: u32::try_from(mean).unwrap_or(u32::MAX).max(1),
            weight,
            segment,
            targets,
            prices,
            stride: if has_landmarks { context.status.stride() } else { 0 },
            store: Store::new(context.task),
            nodes: Vec::new(),
            reached: Vec::new(),
            open: AlternatingOpenList::new([false, true].repeat(estimates)),
            jumped: 0,
            best: [u32::MAX; 2],
            incomplete: false,
        };
        let reached = if has_landmarks {
            context.status.initially(&context.relaxation, &initial)
        } else {
            context.status.request_none();
            Vec::new()
        };
        search.store.insert(&initial);
        search.nodes.push(Node { parent: 0, step: 0, cost: N::zero(), price: 0, is_pending: false });
        search.reached.extend(&reached);
        search.look(context, 0, &initial, &reached);
        search
    }

    /// Returns the approximate memory use in 64-bit words.
    pub(super) fn size(&self) -> usize {
        self.store.size().saturating_add(self.reached.len()).saturating_add(self.open.size())
    }

    /// Searches for a plan that costs less than `limit` (for any plan if `None`), with about `work` work
    /// units.
    pub(super) fn run(
        &mut self,
        context: &mut SearchContext<'_, N>,
        limit: Option<&N>,
        mut work: u64,
        limits: &Limits,
        figures: &mut SearchStatistics,
    ) -> Result<Outcome<N>, Interrupted> {
        let mut pulse: LimitPoll<'_> = limits.pulse();
        let evaluation_work = context.size();
        if self.stride == 0 {
            context.status.request_none();
        }
        while work > 0 {
            pulse.beat()?;
            let Some((parent, step)) = self.open.pop() else { return Ok(Outcome::Exhausted) };
            let generated = std::mem::take(&mut self.jumped).saturating_add(1);
            work = work.saturating_sub(GENERATION_COST.saturating_mul(generated));
            figures.generated = figures.generated.saturating_add(generated);
            let (operator, choice, cost) = context.step(step);
            if context.pairs.as_ref().is_some_and(|pairs| pairs.is_operator_useless(operator)) {
                continue;
            }
            let (total, price) = {
                let parent = &self.nodes[parent as usize];
                let Some(total) = parent.cost.plus(cost).filter(N::is_moderate) else {
                    self.incomplete = true;
                    continue;
                };
                (total, parent.price.saturating_add(self.prices[operator.index()].into()))
            };
            if limit.is_some_and(|limit| total >= *limit) {
                self.incomplete = true;
                continue;
            }
            let before = self.store.get(parent);
            let Some(state) =
                context.task.successor(&context.task.operators[operator.index()], &before, choice)
            else {
                self.incomplete = true;
                continue;
            };
            if context.pairs.as_ref().is_some_and(|pairs| pairs.is_dead_end(&before.values, &state.values)) {
                continue;
            }
            let (id, is_new) = self.store.insert(&state);
            let is_cheaper = is_new || total < self.nodes[id as usize].cost;
            let is_pending = !is_new && std::mem::take(&mut self.nodes[id as usize].is_pending);
            // Greedy search ignores path costs, so it does not reopen states.
            let reopens = is_cheaper && self.weight != HeuristicWeight::Greedy;
            if !is_new && !is_pending && !reopens {
                continue;
            }
            let mut reached = self.reach(context, parent, &state);
            let node = Node { parent, step, cost: total, price, is_pending: false };
            if is_new {
                self.nodes.push(node);
                self.reached.extend(&reached);
            } else {
                if is_cheaper {
                    self.nodes[id as usize] = node;
                }
                let start = (id as usize).saturating_mul(self.stride);
                // A landmark counts as reached only if it was reached on each path that was the cheapest one to
                // the state when it was found.
                for (new, old) in reached.iter_mut().zip(&mut self.reached[start..]) {
                    *new &= *old;
                    *old = *new;
                }
            }
            work = work.saturating_sub(evaluation_work);
            figures.evaluated = figures.evaluated.saturating_add(1);
            figures.expanded = figures.expanded.saturating_add(1);
            if self.is_goal(context.task, &state) {
                return Ok(Outcome::Plan(self.plan(context, id)));
            }
            self.look(context, id, &state, &reached);
        }
        Ok(Outcome::Paused)
    }

    fn is_goal(&self, task: &Task<N>, state: &State<N>) -> bool {
        self.segment.as_ref().map_or_else(|| task.is_goal(state), |goal| goal.holds(task, state))
    }

    /// Returns the bitset of the landmarks that are reached in `state`, a successor of the state `parent`.
    fn reach(&self, context: &mut SearchContext<'_, N>, parent: u32, state: &State<N>) -> Vec<u64> {
        if self.stride == 0 {
            return Vec::new();
        }
        let start = (parent as usize).saturating_mul(self.stride);
        let before = &self.reached[start..start.saturating_add(self.stride)];
        context.status.progress(&context.relaxation, before, state)
    }

    /// Evaluates a state and adds its applicable steps to the open lists. A state without a relaxed plan is a
    /// dead end, so none of its steps are added.
    fn look(&mut self, context: &mut SearchContext<'_, N>, id: u32, state: &State<N>, reached: &[u64]) {
        let SearchContext { explorer, relaxation, .. } = context;
        let Some(ff_value) = explorer.estimate(relaxation, &self.prices, state, &self.targets) else {
            return;
        };
        let has_landmarks = self.stride > 0;
        let landmark_count = if has_landmarks { context.status.remaining(reached) } else { 0 };
        let mut progress = false;
        for (best, value) in self.best.iter_mut().zip([ff_value, landmark_count]) {
            if value < *best {
                *best = value;
                progress = true;
            }
        }
        // After progress, preferred operators get priority (boosting).
        if progress {
            self.open.boost();
        }
        if has_landmarks {
            context.status.request_landmark(reached);
        }
        let (steps, preferred) = context.steps(state);
        let value = |estimate: u32| match self.weight {
            HeuristicWeight::Greedy => estimate.into(),
            HeuristicWeight::Times(weight) => {
                weight.saturating_mul(estimate.into()).saturating_add(self.nodes[id as usize].price)
            }
        };
        let landmarks = landmark_count.saturating_mul(self.mean);
        let (ff_value, landmarks) = (value(ff_value), value(landmarks));
        for (operator, times) in std::mem::take(&mut context.explorer.repeated) {
            let step = preferred.iter().find(|step| context.step(**step).0.0 == operator);
            if let Some(step) = step {
                let last = self.jump(context, id, state, *step, times);
                if last != id {
                    self.open.push(last, [ff_value, ff_value, landmarks, landmarks], &[*step], &[*step]);
                }
            }
        }
        self.open.push(id, [ff_value, ff_value, landmarks, landmarks], &steps, &preferred);
    }

    /// Applies a step up to `times - 1` times, while it stays applicable, and returns the node of the last state.
    /// The states between are stored but not evaluated [3]. They are evaluated when another path reaches them.
    fn jump(
        &mut self,
        context: &mut SearchContext<'_, N>,
        from: u32,
        state: &State<N>,
        step: u32,
        times: u32,
    ) -> u32 {
        let mut node = from;
        let mut state = state.clone();
        for _ in 1..times {
            let (operator, choice, cost) = context.step(step);
            let schema = &context.task.operators[operator.index()];
            let Some(next) = context.task.successor(schema, &state, choice) else { break };
            let Some(total) = self.nodes[node as usize].cost.plus(cost).filter(N::is_moderate) else { break };
            if !schema.applicable(&next, choice) {
                break;
            }
            self.jumped = self.jumped.saturating_add(1);
            let price = self.nodes[node as usize].price.saturating_add(self.prices[operator.index()].into());
            let (id, is_new) = self.store.insert(&next);
            if is_new {
                let reached = self.reach(context, node, &next);
                self.nodes.push(Node { parent: node, step, cost: total, price, is_pending: true });
                self.reached.extend(reached);
            }
            (node, state) = (id, next);
        }
        node
    }

    fn plan(&self, context: &SearchContext<'_, N>, goal: u32) -> GroundPlan<N> {
        let mut steps = Vec::new();
        let mut at = goal;
        while at != 0 {
            let node = &self.nodes[at as usize];
            let (operator, choice, _): (OperatorId, &[u32], &N) = context.step(node.step);
            steps.push(GroundStep { operator, choice: choice.to_vec() });
            at = node.parent;
        }
        steps.reverse();
        // A cheaper path to a node of the plan may have been found since the goal was reached.
        let cost = cost(context.task, &steps).unwrap_or_else(|| self.nodes[goal as usize].cost.clone());
        GroundPlan { steps, cost }
    }
}
