//! A* over sequences of happenings.
//!
//! A node consists of a state, the running actions and a simple temporal network. A node is dominated by another
//! one with the same state and running actions if every continuation of the first is possible for the second, no
//! later, at no higher cost and with no less of any resource. Orders of happenings that do not interfere have
//! the same network, so one of them is searched. Actions can start at any time, not only when others end;
//! planners that consider no other times are incomplete \[1\].
//!
//! \[1\] W. Cushing, S. Kambhampati, Mausam, D. Weld: When is temporal planning really temporal?, IJCAI 2007.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use search::bounds::Bounds;
use search::search::{SearchStatistics, is_monotone};
use task::limits::Limits;
use task::number::{GROWTH_LIMIT, Int, Rational};
use task::plan::solution::PlannerPart;
use task::task::OperatorId;

use crate::concurrent::makespan_heuristic::Estimate;
use crate::concurrent::search_log::Record;
use crate::concurrent::store::{Origin, Store};
use crate::concurrent::successors::{DeadEnd, Expansion, TemporalState};
use crate::concurrent::temporal_task::TemporalTask;

/// So many comparisons of situations are as much work as looking at one.
const COMPARED: usize = 4;

/// A plan as the search finds it.
#[derive(Debug, Clone)]
pub(super) struct Sequence {
    /// The metric in integers, then the makespan.
    pub(super) value: (Int, Int),
    pub(super) happenings: Vec<OperatorId>,
    /// Which of them take place at the time of the one before.
    pub(super) together: Vec<bool>,
}

impl Sequence {
    /// Tells the record of a better plan, and of what none can get below.
    pub(super) fn tell(&self, lower: Int, part: PlannerPart, record: &mut Record<'_>) {
        let [value, lower] = [self.value.0, lower].map(Rational::from_integer);
        record.improve(&value, self.happenings.len(), lower, part);
    }
}

/// How a search ended.
pub(super) enum SearchEnd {
    /// Nothing is left that could be better than the incumbent.
    Exhausted,
    /// At a limit: no plan that is not known has a lower metric than this, in integers.
    Stopped(Int),
}

/// The metric, the makespan, the sum of what is left, the depth, and the number of the node.
type Priority = (Int, Int, Int, u32, u32);

pub(super) struct Search<'a> {
    concurrent: &'a TemporalTask,
    estimate: &'a Estimate,
    /// Lower bounds on costs, and on resources; none if nothing costs.
    bounds: Option<&'a Bounds>,
    expansion: &'a Expansion<'a>,
    store: Store<'a>,
    open: BinaryHeap<Reverse<Priority>>,
    pub(super) incumbent: Option<Sequence>,
    /// What was left out because its numbers do not fit: no plan of it has a lower metric than this, in integers.
    left_out: Option<Int>,
    figures: SearchStatistics,
}

impl<'a> Search<'a> {
    pub(super) fn new(
        concurrent: &'a TemporalTask,
        expansion: &'a Expansion<'a>,
        estimate: &'a Estimate,
        bounds: Option<&'a Bounds>,
    ) -> Self {
        // A duration is not a resource, and of what a preference reads less may be better.
        let monotone = is_monotone(&concurrent.task)
            && concurrent.violations.is_empty()
            && concurrent.instances.iter().all(|own| own.timer.is_none());
        let mut search = Self {
            concurrent,
            estimate,
            bounds,
            expansion,
            store: Store::new(concurrent, monotone),
            open: BinaryHeap::new(),
            incumbent: None,
            left_out: None,
            figures: SearchStatistics::default(),
        };
        // Costs and times are not negative.
        search.push(&expansion.root(), None, 0);
        search
    }

    /// Searches until nothing better is left, `most` situations were looked at, or a limit is reached. It can go on then. `search_log` hears of each better plan and of what none can get below.
    pub(super) fn run(&mut self, limits: &Limits, most: usize, record: &mut Record<'_>) -> SearchEnd {
        let before = self.figures;
        let ended = self.go_on(limits, most, record);
        self.figures.add_to(before, &mut record.statistics);
        ended
    }

    #[expect(clippy::arithmetic_side_effects, reason = "what was looked at is counted by 64 bits")]
    fn go_on(&mut self, limits: &Limits, most: usize, record: &mut Record<'_>) -> SearchEnd {
        let mut looked_at = 0;
        let mut pulse = limits.pulse();
        while let Some(Reverse(priority)) = self.open.pop() {
            let id = priority.4;
            let value = (priority.0, priority.1);
            if self.store.is_dominated(id) || !self.is_better(value) {
                continue;
            }
            let situation = self.store.situation(id);
            if self.expansion.is_goal(&situation) {
                match self.sequence(id, &situation) {
                    Some(sequence) if self.is_better(sequence.value) => {
                        sequence.tell(self.known(value.0), PlannerPart::Search, record);
                        self.incumbent = Some(sequence);
                    }
                    Some(_) => {}
                    None => self.leave_out(value.0),
                }
                // Where preferences are violated in the end, or something is missed, a longer plan may be better.
                if self.concurrent.violations.is_empty() && self.concurrent.deadlines.is_empty() {
                    continue;
                }
            }
            if looked_at >= most || self.is_full(limits) || pulse.beat().is_err() {
                self.open.push(Reverse(priority));
                return SearchEnd::Stopped(self.lower());
            }
            record.report_lower_bound(Rational::from_integer(self.known(value.0)));
            looked_at += self.expand(id, &situation, value.0);
        }
        self.left_out
            .filter(|lower| self.may_be_better(*lower))
            .map_or(SearchEnd::Exhausted, SearchEnd::Stopped)
    }

    /// Whether something that was left out, of which nothing has a lower metric than this, may be better than the incumbent: as good, and over sooner, if
    /// the metric is not the time.
    fn may_be_better(&self, lower: Int) -> bool {
        let TemporalTask { task, measure, .. } = self.concurrent;
        let is_time = || measure.time > 0 && task.operators.iter().all(|operator| operator.cost.is_zero());
        let value = self.incumbent.as_ref().map(|incumbent| incumbent.value.0);
        value.is_none_or(|value| lower < value || lower == value && !is_time())
    }

    /// Whether there is nothing left to expand.
    pub(super) fn is_over(&self) -> bool {
        self.open.is_empty()
    }

    /// Whether it takes half of the room that there is.
    pub(super) fn is_full(&self, limits: &Limits) -> bool {
        let open = self.open.len().saturating_mul(size_of::<Priority>());
        self.store.bytes().saturating_add(open) > limits.room() / 2
    }

    /// No plan that is not known has a lower metric than this, in integers.
    pub(super) fn lower(&self) -> Int {
        self.known(self.open.peek().map_or(0, |Reverse(priority)| priority.0))
    }

    /// What no plan can get below if none that goes on from what is open can get below `open`.
    fn known(&self, open: Int) -> Int {
        self.left_out.map_or(open, |left_out| left_out.min(open))
    }

    /// Leaves out something below a node in which no plan has a lower metric than `lower`.
    fn leave_out(&mut self, lower: Int) {
        self.left_out = Some(self.left_out.map_or(lower, |known| known.min(lower)));
    }

    fn is_better(&self, value: (Int, Int)) -> bool {
        self.incumbent.as_ref().is_none_or(|incumbent| value < incumbent.value)
    }

    /// Adds what can follow a node in which no plan has a lower metric than `lower`. Returns how much that is.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "a node is no deeper than twice as many as there are nodes; what is done is counted by 64 bits"
    )]
    fn expand(&mut self, id: u32, situation: &TemporalState, lower: Int) -> usize {
        let candidates = self.expansion.candidates(situation);
        let count = candidates.len();
        let compared = self.store.compared;
        self.figures.expanded += 1;
        self.figures.generated += count as u64;
        let depth = self.store.origin(id).map_or(0, |origin| origin.depth);
        for operator in candidates {
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
        count + 1 + (self.store.compared - compared) / COMPARED
    }

    /// Adds a situation, below a node in which no plan has a lower metric than `lower`.
    fn push(&mut self, situation: &TemporalState, origin: Option<Origin>, lower: Int) {
        let TemporalState { state, clocks, cost } = situation;
        self.figures.evaluated = self.figures.evaluated.saturating_add(1);
        let Some(left) = self.estimate.left(state, clocks) else { return };
        let costs = match self.bounds {
            Some(bounds) => match bounds.estimate(state) {
                Some(costs) => costs,
                None => return,
            },
            None => 0,
        };
        let total =
            cost.checked_add(costs).and_then(|cost| self.concurrent.measure.total(left.makespan, cost));
        let Some(total) = total.filter(|total| *total < GROWTH_LIMIT) else {
            self.leave_out(lower);
            return;
        };
        let value = (total, left.makespan);
        if !self.is_better(value) {
            return;
        }
        let depth = origin.map_or(0, |origin| origin.depth);
        if let Some(id) = self.store.add(situation, origin) {
            self.open.push(Reverse((value.0, value.1, left.sum, depth, id)));
        }
    }

    /// The sequence that leads to a goal; none if its metric does not fit, or it does not keep what it has to.
    fn sequence(&self, goal: u32, situation: &TemporalState) -> Option<Sequence> {
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
