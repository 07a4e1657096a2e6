//! A* over sequences of happenings.
//!
//! A node consists of a state, the running actions and a simple temporal network. A node is dominated by
//! another node with the same facts and the same running actions if every continuation of the former is
//! possible from the latter, no later and at no higher cost. The numbers of both nodes must be equal or, if
//! larger numbers are never worse, those of the latter no smaller. Orders of happenings that do not interfere
//! lead to the same network, so only one of these orders is continued. Actions can start at any time, not
//! only when others end; planners that consider no other times are incomplete \[1\].
//!
//! \[1\] W. Cushing, S. Kambhampati, Mausam, D. Weld: When is temporal planning really temporal?, IJCAI 2007.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use search::bounds::Bounds;
use search::search::{SearchStatistics, is_monotone};
use task::limits::{Interrupted, LimitPoll, Limits};
use task::number::Int;
use task::plan::solution::PlannerPart;
use task::task::OperatorId;

use crate::concurrent::critical_path::CriticalPath;
use crate::concurrent::makespan_heuristic::Estimate;
use crate::concurrent::search_log::Record;
use crate::concurrent::store::{Origin, Store};
use crate::concurrent::successors::{DeadEnd, Expansion, TemporalState};
use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;

/// Number of comparisons of nodes that count as one expanded node.
const COMPARED: usize = 4;
/// Work of the critical-path heuristic that counts as one expanded node.
const EVALUATED: usize = 100;

#[derive(Debug, Clone)]
pub(super) struct Sequence<T: TimeNumber = Int> {
    /// Metric (scaled to an integer) and makespan (in internal time units).
    pub(super) value: (T, T),
    pub(super) happenings: Vec<OperatorId>,
    pub(super) together: Vec<bool>,
}

impl<T: TimeNumber> Sequence<T> {
    /// Reports this plan as an improvement. `lower` is a lower bound on the metric of plans not found yet.
    pub(super) fn tell(&self, lower: T, part: PlannerPart, record: &mut Record<'_, T>) {
        let [value, lower] = [self.value.0, lower].map(T::to_rational);
        record.improve(&value, self.happenings.len(), lower, part);
    }
}

pub(super) enum SearchEnd<T: TimeNumber = Int> {
    /// No open or dropped node can lead to a better plan than the incumbent, or the incumbent
    /// reaches a lower bound on the metric.
    Exhausted,
    /// Stopped at a limit, or nodes were dropped. The value is a lower bound on the metric of plans not found
    /// yet, scaled to an integer.
    Stopped(T),
}

/// Sort key of an open node: lower bounds on metric and makespan, sum of remaining times, depth,
/// node id, and whether the critical path of the node was evaluated.
type Priority<T> = (T, T, T, u32, u32, bool);

pub(super) struct Search<'a, T: TimeNumber = Int> {
    concurrent: &'a TemporalTask<T>,
    estimate: &'a Estimate<T>,
    /// Critical-path heuristic; `None` if its bound for the initial state is no better than that of
    /// `estimate`.
    critical_path: Option<CriticalPath<'a, T>>,
    /// Lower bounds on costs and resources; `None` if they are not needed or could not be computed.
    bounds: Option<&'a Bounds>,
    expansion: &'a Expansion<'a, T>,
    store: Store<'a, T>,
    open: BinaryHeap<Reverse<Priority<T>>>,
    pub(super) incumbent: Option<Sequence<T>>,
    /// Lower bound on the metric of plans through dropped nodes, e.g. nodes in which a number
    /// overflowed. `None` if no node was dropped.
    left_out: Option<T>,
    floor: T,
    figures: SearchStatistics,
}

impl<'a, T: TimeNumber> Search<'a, T> {
    pub(super) fn new(
        concurrent: &'a TemporalTask<T>,
        expansion: &'a Expansion<'a, T>,
        estimate: &'a Estimate<T>,
        bounds: Option<&'a Bounds>,
    ) -> Self {
        // A duration is not a resource, and for a number read by a preference less may be better.
        let monotone = is_monotone(&concurrent.task)
            && concurrent.violations.is_empty()
            && concurrent.instances.iter().all(|instance| instance.timer.is_none());
        let mut search = Self {
            concurrent,
            estimate,
            critical_path: None,
            bounds,
            expansion,
            store: Store::new(concurrent, monotone),
            open: BinaryHeap::new(),
            incumbent: None,
            left_out: None,
            floor: T::ZERO,
            figures: SearchStatistics::default(),
        };
        let root = expansion.root();
        let estimated = estimate.left(&root.state, &root.clocks).map(|remaining| remaining.makespan);
        let mut critical_path = CriticalPath::new(concurrent);
        let makespan = critical_path.makespan(&root);
        if makespan.is_none_or(|makespan| Some(makespan) > estimated) {
            search.critical_path = Some(critical_path);
            search.floor = makespan.filter(|_| concurrent.is_bounded).unwrap_or(T::ZERO);
        }
        // Costs and times are not negative, so 0 is a lower bound.
        search.push(&root, None, T::ZERO);
        search
    }

    pub(super) fn raise_floor(&mut self, makespan: T) {
        self.floor = self.floor.max(makespan);
    }

    pub(super) fn floor(&self) -> T {
        self.floor
    }

    fn at_least(&self, (total, makespan): (T, T)) -> (T, T) {
        // Costs are not negative.
        let floor = self.concurrent.measure.total(self.floor, 0).unwrap_or(T::ZERO);
        (total.max(floor), makespan.max(self.floor))
    }

    /// Searches until the open list is empty, `max_nodes` units of work are done, or a limit is
    /// reached. The work is about the number of expanded and generated nodes. The search can be
    /// resumed. Better plans and lower bounds are reported to `record`.
    pub(super) fn run(
        &mut self,
        limits: &Limits,
        max_nodes: usize,
        record: &mut Record<'_, T>,
    ) -> SearchEnd<T> {
        let before = self.figures;
        let search_end = self.go_on(limits, max_nodes, record);
        self.figures.add_to(before, &mut record.statistics);
        search_end
    }

    #[expect(clippy::arithmetic_side_effects, reason = "what was looked at is counted by 64 bits")]
    fn go_on(&mut self, limits: &Limits, max_nodes: usize, record: &mut Record<'_, T>) -> SearchEnd<T> {
        let mut expanded = 0;
        let mut pulse = limits.pulse();
        while let Some(Reverse(priority)) = self.open.pop() {
            let id = priority.4;
            let value = self.at_least((priority.0, priority.1));
            if self.store.is_dominated(id) || !self.is_better(value) {
                continue;
            }
            if expanded >= max_nodes || self.is_full(limits) || pulse.beat().is_err() {
                self.open.push(Reverse(priority));
                return SearchEnd::Stopped(self.lower());
            }
            let situation = self.store.situation(id);
            if !priority.5 {
                let (evaluated, work) = self.evaluate(priority, &situation);
                expanded += work;
                self.open.extend(evaluated.map(Reverse));
                continue;
            }
            if self.expansion.is_goal(&situation) {
                match self.sequence(id, &situation) {
                    Some(sequence) if self.is_better(sequence.value) => {
                        sequence.tell(self.known(value.0), PlannerPart::Search, record);
                        self.incumbent = Some(sequence);
                    }
                    Some(_) => {}
                    None => self.leave_out(value.0),
                }
                // With preferences or deadlines, a longer plan that passes through this goal state
                // may be better.
                if self.concurrent.violations.is_empty() && self.concurrent.deadlines.is_empty() {
                    continue;
                }
            }
            record.report_lower_bound(self.known(value.0).to_rational());
            let Ok(work) = self.expand((id, value.0), &situation, &mut pulse) else {
                // The next run expands the node again. Successors that are stored already dominate
                // their copies.
                self.open.push(Reverse(priority));
                return SearchEnd::Stopped(self.lower());
            };
            expanded += work;
        }
        self.left_out
            .map(|lower| self.at_least((lower, T::ZERO)).0)
            .filter(|lower| self.may_be_better(*lower))
            .map_or(SearchEnd::Exhausted, SearchEnd::Stopped)
    }

    /// Returns `true` if a dropped node with this lower bound may lead to a better plan than the
    /// incumbent: a lower metric, or the same metric and a lower makespan if the metric is not the
    /// makespan itself.
    fn may_be_better(&self, lower: T) -> bool {
        let TemporalTask { task, measure, .. } = self.concurrent;
        let is_time =
            || measure.time > T::ZERO && task.operators.iter().all(|operator| operator.cost.is_zero());
        let value = self.incumbent.as_ref().map(|incumbent| incumbent.value.0);
        value.is_none_or(|value| lower < value || lower == value && !is_time())
    }

    pub(super) fn is_over(&self) -> bool {
        self.open.is_empty()
    }

    pub(super) fn is_full(&self, limits: &Limits) -> bool {
        let open = self.open.len().saturating_mul(size_of::<Priority<T>>());
        self.store.bytes().saturating_add(open) > limits.room() / 2
    }

    /// Lower bound on the metric of plans not found yet, scaled to an integer.
    pub(super) fn lower(&self) -> T {
        self.known(self.open.peek().map_or(T::ZERO, |Reverse(priority)| priority.0))
    }

    /// Lower bound on the metric of plans not found yet, given the bound `open` of the open nodes.
    fn known(&self, open: T) -> T {
        let bound = self.left_out.map_or(open, |left_out| left_out.min(open));
        self.at_least((bound, T::ZERO)).0
    }

    fn leave_out(&mut self, lower: T) {
        self.left_out = Some(self.left_out.map_or(lower, |bound| bound.min(lower)));
    }

    fn is_better(&self, value: (T, T)) -> bool {
        self.incumbent.as_ref().is_none_or(|incumbent| value < incumbent.value)
    }

    /// Expands a node with the given lower bound on the metric. Returns the work: the number of
    /// candidate happenings, plus 1, plus one unit per [`COMPARED`] comparisons of nodes.
    ///
    /// # Errors
    /// [`Interrupted`] if a limit was reached before the last successor. A node can have tens of
    /// thousands of successors.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "a node is no deeper than twice as many as there are nodes; what is done is counted by 64 bits"
    )]
    fn expand(
        &mut self,
        (id, lower): (u32, T),
        situation: &TemporalState<T>,
        pulse: &mut LimitPoll<'_>,
    ) -> Result<usize, Interrupted> {
        let candidates = self.expansion.candidates(situation);
        let count = candidates.len();
        let compared = self.store.compared;
        self.figures.expanded += 1;
        self.figures.generated += count as u64;
        let depth = self.store.origin(id).map_or(0, |origin| origin.depth);
        for operator in candidates {
            pulse.beat()?;
            match self.expansion.after(situation, operator, true) {
                Ok((next, compressed)) => {
                    let depth = depth + 1 + u32::from(compressed);
                    let together = situation.clocks.unsettled();
                    let origin = Origin { parent: id, operator, compressed, together, depth };
                    self.push(&next, Some(origin), lower);
                }
                Err(DeadEnd::Impossible | DeadEnd::TooLate) => {}
                Err(DeadEnd::Unfit) => self.leave_out(lower),
            }
        }
        Ok(count + 1 + (self.store.compared - compared) / COMPARED)
    }

    /// Adds a node, unless it is a dead end, dominated, or no better than the incumbent. If its metric
    /// overflows, the node is dropped, and the lower bound `lower` of its parent is recorded.
    fn push(&mut self, situation: &TemporalState<T>, origin: Option<Origin>, lower: T) {
        let TemporalState { state, clocks, cost } = situation;
        self.figures.evaluated = self.figures.evaluated.saturating_add(1);
        let Some(remaining) = self.estimate.left(state, clocks) else { return };
        let costs = match self.bounds {
            Some(bounds) => match bounds.estimate(state) {
                Some(costs) => costs,
                None => return,
            },
            None => 0,
        };
        let makespan = remaining.makespan.max(self.floor);
        let total = cost.checked_add(costs).and_then(|cost| self.concurrent.measure.total(makespan, cost));
        let Some(total) = total.filter(|total| total.is_moderate()) else {
            self.leave_out(lower);
            return;
        };
        let value = (total, makespan);
        if !self.is_better(value) {
            return;
        }
        let depth = origin.map_or(0, |origin| origin.depth);
        if let Some(id) = self.store.add(situation, origin) {
            // The critical-path bound is the most expensive one to compute, so it is computed only when the
            // node would be expanded.
            let is_evaluated = self.critical_path.is_none();
            self.open.push(Reverse((value.0, value.1, remaining.sum, depth, id, is_evaluated)));
        }
    }

    /// Evaluates the critical path of a node, and returns its sort key with the raised lower bounds
    /// on metric and makespan. Also returns the work. The key is `None` if no plan through the node
    /// is better than the incumbent.
    #[expect(clippy::arithmetic_side_effects, reason = "the makespan is at most the bound")]
    fn evaluate(
        &mut self,
        priority: Priority<T>,
        situation: &TemporalState<T>,
    ) -> (Option<Priority<T>>, usize) {
        let (total, makespan, sum, depth, id, _) = priority;
        let Some(critical_path) = &mut self.critical_path else { return (Some(priority), 0) };
        let before = critical_path.work;
        let bound = critical_path.makespan(situation);
        let work = critical_path.work.saturating_sub(before) / EVALUATED;
        let Some(bound) = bound else { return (None, work) };
        let bound = bound.max(makespan);
        // The metric is linear in the makespan. A metric that overflows is not a bound.
        let raised = self.concurrent.measure.total(bound - makespan, 0).and_then(|by| total.checked_add(by));
        let value =
            raised.filter(|raised| raised.is_moderate()).map_or((total, makespan), |raised| (raised, bound));
        let is_better = self.is_better(value);
        (is_better.then_some((value.0, value.1, sum, depth, id, true)), work)
    }

    fn sequence(&self, goal: u32, situation: &TemporalState<T>) -> Option<Sequence<T>> {
        let value = self.concurrent.value(situation)?;
        let (mut happenings, mut together) = (Vec::new(), Vec::new());
        let mut at = goal;
        while let Some(origin) = self.store.origin(at) {
            if origin.compressed {
                happenings.push(self.concurrent.end_of(origin.operator));
                together.push(false);
            }
            happenings.push(origin.operator);
            together.push(origin.together);
            at = origin.parent;
        }
        happenings.reverse();
        together.reverse();
        self.concurrent.judge(Sequence { value, happenings, together }, situation.cost)
    }
}
