//! Search over sequences of happenings with durations from linear programs: greedy and exhaustive.
//!
//! Both searches are lazy: a sequence is evaluated, and its linear program solved, when it is
//! expanded. The greedy search is guided by relaxed plans in which a number takes the best value
//! that the bounds of durations allow. It detects duplicates by values, running actions and ranges
//! of numbers, and keeps the sequence with the least metric. The exhaustive search takes the sequence whose
//! parent has the program with the least optimum first, and keeps one sequence per Mazurkiewicz trace.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::hash::{Hash, Hasher};

use num_traits::ToPrimitive;
use rustc_hash::{FxHashMap, FxHashSet, FxHasher};
use search::search::SearchStatistics;
use task::limits::{Interrupted, Limits};
use task::number::{Int, Rational, dense};
use task::task::OperatorId;
use task::task::quantity::Linear;

use crate::concurrent::flexible_durations::affine::Affine;
use crate::concurrent::flexible_durations::answer::{Answer, answer};
use crate::concurrent::flexible_durations::mazurkiewicz_trace::Traces;
use crate::concurrent::flexible_durations::partial_plan_lp::Course;
use crate::concurrent::relaxed_plan_heuristic::{HeuristicValue, RelaxedPlanHeuristic};
use crate::concurrent::successors::Expansion;
use crate::concurrent::temporal_task::TemporalTask;

/// Number of extra turns for the queue of preferred happenings after each improvement of the
/// heuristic value.
const BOOST: i64 = 1_000;

/// Mark of sequences with happenings that must be simultaneous.
const SIMULTANEOUS: (OperatorId, u32) = (OperatorId(u32::MAX), u32::MAX);

/// Queue entry: of the parent node, the heuristic value, the lower bound on the metric, and the depth (deepest
/// first); insertion order; the parent node; and the happening with the index of the action's run that it ends (0
/// for a start).
type QueueEntry = Reverse<(u64, Rational, Reverse<u32>, u32, u32, (OperatorId, u32))>;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    Found,
    Exhausted,
    Stopped,
}

enum Kind<'a> {
    Greedy { guidance: Box<RelaxedPlanHeuristic<'a>>, seen: FxHashMap<u64, Rational> },
    Exhaustive { traces: Traces<'a>, seen: FxHashSet<Vec<(OperatorId, u32)>> },
}

pub(super) struct Search<'a> {
    concurrent: &'a TemporalTask,
    expansion: &'a Expansion<'a>,
    kind: Kind<'a>,
    nodes: Vec<Course>,
    queues: [BinaryHeap<QueueEntry>; 2],
    priorities: [i64; 2],
    order: u32,
    nearest: u64,
    bytes: usize,
    /// Least metric of all plans found, before durations are rounded to decimals.
    reached: Option<Rational>,
    pub(super) figures: SearchStatistics,
}

impl<'a> Search<'a> {
    /// Greedy search guided by relaxed plans. The search may miss plans and proves nothing.
    pub(super) fn greedy(
        concurrent: &'a TemporalTask,
        expansion: &'a Expansion<'a>,
        guidance: RelaxedPlanHeuristic<'a>,
    ) -> Self {
        let kind = Kind::Greedy { guidance: Box::new(guidance), seen: FxHashMap::default() };
        Self::new(concurrent, expansion, kind)
    }

    pub(super) fn exhaustive(concurrent: &'a TemporalTask, expansion: &'a Expansion<'a>) -> Self {
        let kind = Kind::Exhaustive { traces: Traces::new(concurrent), seen: FxHashSet::default() };
        Self::new(concurrent, expansion, kind)
    }

    fn new(concurrent: &'a TemporalTask, expansion: &'a Expansion<'a>, kind: Kind<'a>) -> Self {
        Self {
            concurrent,
            expansion,
            kind,
            nodes: Vec::new(),
            queues: Default::default(),
            priorities: [0; 2],
            order: 0,
            nearest: u64::MAX,
            bytes: 0,
            reached: None,
            figures: SearchStatistics::default(),
        }
    }

    /// Lower bound on the metric of every plan, before durations are rounded. Valid only if the search is
    /// exhaustive. Returns `None` if no bound is known.
    pub(super) fn lower(&self) -> Option<Rational> {
        let open = self.queues[0].peek().map(|Reverse((_, least, ..))| least);
        open.into_iter().chain(&self.reached).min().cloned()
    }

    pub(super) fn is_full(&self, limits: &Limits) -> bool {
        let queued = self.queues.iter().map(BinaryHeap::len).fold(0, usize::saturating_add);
        let queued = queued.saturating_mul(size_of::<QueueEntry>());
        self.bytes.saturating_add(queued) > limits.room() / 4
    }

    /// Searches for a plan that is better than the incumbent `best`, which it replaces. Takes at most
    /// `work` entries from the queues.
    pub(super) fn run(&mut self, best: &mut Option<Answer>, limits: &Limits, work: u64) -> Outcome {
        if self.nodes.is_empty() {
            match self.take_up(Course::new(self.concurrent), best, limits) {
                Ok(None) => {}
                Ok(Some(outcome)) => return outcome,
                Err(Interrupted) => return Outcome::Stopped,
            }
        }
        let mut pulse = limits.pulse();
        for _ in 0..work {
            if pulse.beat().is_err() || self.is_full(limits) {
                return Outcome::Stopped;
            }
            let Some(entry) = self.pop() else { return Outcome::Exhausted };
            let Reverse((_, least, _, _, parent, operator)) = &entry;
            if best.as_ref().is_some_and(|best| is_lost(self.concurrent, least, best)) {
                continue;
            }
            let course = self.nodes[*parent as usize].after(self.concurrent, *operator, limits);
            match course
                .and_then(|course| course.map_or(Ok(None), |course| self.take_up(course, best, limits)))
            {
                Ok(None) => {}
                Ok(Some(outcome)) => return outcome,
                Err(Interrupted) => {
                    // The entry still counts for the lower bound.
                    self.queues[0].push(entry);
                    return Outcome::Stopped;
                }
            }
        }
        Outcome::Stopped
    }

    /// Evaluates a sequence and queues its successors, unless it is a duplicate, a dead end or no better than
    /// the incumbent `best`. Returns `Found` if the sequence is a plan that is better than `best`, which is
    /// then replaced.
    fn take_up(
        &mut self,
        course: Course,
        best: &mut Option<Answer>,
        limits: &Limits,
    ) -> Result<Option<Outcome>, Interrupted> {
        self.figures.evaluated = self.figures.evaluated.saturating_add(1);
        let least = course.least(self.concurrent);
        if best.as_ref().is_some_and(|best| is_lost(self.concurrent, &least, best)) {
            return Ok(None);
        }
        let Some(HeuristicValue { left, preferred }) = self.judge(&course, &least) else { return Ok(None) };
        let mut outcome = None;
        if course.is_goal(self.concurrent)
            && let Some(candidate) = answer(self.concurrent, &course, limits)?
        {
            self.note_reached(&candidate.least);
            if best.as_ref().is_none_or(|best| candidate.value < best.value) {
                *best = Some(candidate);
                outcome = Some(Outcome::Found);
            }
        }
        if left < self.nearest {
            self.nearest = left;
            self.priorities[1] = self.priorities[1].saturating_sub(BOOST);
        }
        let starts =
            self.expansion.starts(&course.state(self.concurrent)).into_iter().map(|start| (start, 0));
        let candidates: Vec<(OperatorId, u32)> = starts.chain(course.ends(self.concurrent)).collect();
        let counts = SearchStatistics { expanded: 1, generated: candidates.len() as u64, evaluated: 0 };
        self.figures = self.figures.plus(counts);
        let (id, depth) = (dense(self.nodes.len()), dense(course.passed.len()));
        for operator in candidates {
            self.order = self.order.wrapping_add(1);
            let entrance = Reverse((left, least.clone(), Reverse(depth), self.order, id, operator));
            if preferred.binary_search(&operator.0).is_ok() {
                self.queues[1].push(entrance.clone());
            }
            self.queues[0].push(entrance);
        }
        self.bytes = self.bytes.saturating_add(course.bytes());
        self.nodes.push(course);
        Ok(outcome)
    }

    fn note_reached(&mut self, least: &Rational) {
        if self.reached.as_ref().is_none_or(|reached| least < reached) {
            self.reached = Some(least.clone());
        }
    }

    /// Heuristic value of a sequence (0 in the exhaustive search). Returns `None` if the sequence is a
    /// duplicate or a dead end.
    fn judge(&mut self, course: &Course, least: &Rational) -> Option<HeuristicValue> {
        match &mut self.kind {
            Kind::Exhaustive { traces, seen } => {
                let sequence: Vec<_> =
                    course.passed.iter().map(|passed| (passed.operator, passed.run)).collect();
                // Simultaneity depends on the order of the happenings, so such a sequence represents
                // only itself. The mark distinguishes it from the first sequence of a trace.
                let key = if course.has_simultaneous {
                    [&sequence[..], &[SIMULTANEOUS]].concat()
                } else {
                    traces.first(&sequence)
                };
                let is_new = seen.insert(key);
                is_new.then(|| HeuristicValue { left: 0, preferred: Vec::new() })
            }
            Kind::Greedy { guidance, seen } => {
                let entry = seen.entry(signature(course));
                let mut is_new = false;
                let sooner = entry.or_insert_with(|| {
                    is_new = true;
                    least.clone()
                });
                if !is_new && *least >= *sooner {
                    return None;
                }
                sooner.clone_from(least);
                let upper_bound = |linear: &Linear<Int>| {
                    course.highest(&course.value(linear))?.to_big().floor().to_integer().to_i128()
                };
                guidance.guide_from(&course.values, course.instances(), &upper_bound)
            }
        }
    }

    fn pop(&mut self) -> Option<QueueEntry> {
        let filled = (0..self.queues.len()).filter(|queue| !self.queues[*queue].is_empty());
        let queue = filled.min_by_key(|queue| self.priorities[*queue])?;
        self.priorities[queue] = self.priorities[queue].saturating_add(1);
        self.queues[queue].pop()
    }
}

fn is_lost(concurrent: &TemporalTask, least: &Rational, best: &Answer) -> bool {
    concurrent.is_whole && *least >= best.value
}

/// Hash of the search state for duplicate detection in the greedy search: values, running actions
/// and ranges of numbers. A hash collision only loses a sequence, which is harmless because this
/// search proves nothing.
fn signature(course: &Course) -> u64 {
    let mut hasher = FxHasher::default();
    course.values.hash(&mut hasher);
    course.instances().for_each(|instance| instance.hash(&mut hasher));
    course.is_settled().hash(&mut hasher);
    for number in &course.numbers {
        course.highest(number).hash(&mut hasher);
        if number.known().is_none() {
            course.highest(&Affine::default().minus(number)).hash(&mut hasher);
        }
    }
    hasher.finish()
}
