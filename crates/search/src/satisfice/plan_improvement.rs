//! Large neighbourhood search for cheaper plans: replaces segments of a plan by cheaper sequences of steps.
//!
//! A pass visits segments of the same number of steps from the start to the end of the plan, each overlapping
//! the previous one by half. A lazy weighted A\* search looks for cheaper steps from the state before the
//! segment to the goal of the segment ([`SegmentGoal`]), with a limited number of evaluated states. A pass
//! without a success is followed by a pass with longer segments. After the longest segments, the limit on
//! evaluated states doubles, and the segments are short again. Between passes, steps that do not interfere
//! are exchanged at random, so that related steps meet in a segment. The steps of very long plans, and of all
//! plans of tasks with derived variables, keep their order.
//!
//! As in \[1\], which calls segments windows, but with random linear extensions of the plan instead of blocks
//! of a partial order.
//!
//! \[1\] F. H. Siddiqui, P. Haslum: Continuing plan quality optimisation, JAIR 54, 2015.

use std::hash::BuildHasher as _;

use rustc_hash::{FxBuildHasher, FxHashMap};

use task::limits::{Interrupted, Limits};
use task::plan::ground::{GroundPlan, GroundStep, cost, pass};
use task::task::State;
use task::task::number::TaskNumber;

use crate::random::Random;
use crate::satisfice::search::{HeuristicWeight, Outcome, Search, SearchGoal};
use crate::satisfice::search_context::{MEMORY_SHARE, SearchContext};
use crate::satisfice::segment_goal::SegmentGoal;
use crate::satisfice::step_order::StepOrder;
use crate::search::SearchStatistics;

const MIN_STEPS: usize = 4;
/// Initial limit on the number of states that the search of a segment evaluates.
const MIN_EVALUATIONS: u64 = 100;
const MAX_DOUBLINGS: u32 = 8;
/// Weight of the heuristic in every second pass. In the other passes it is 1.
const GREEDY_WEIGHT: u64 = 2;
const MAX_FAILURES: usize = 1 << 18;

pub(super) struct PlanImprovement<N> {
    plan: GroundPlan<N>,
    states: Vec<State<N>>,
    order: StepOrder,
    random: Random,
    /// Number of steps of the segments of the current pass.
    segment: usize,
    /// Index of the first step of the current or next segment.
    next: usize,
    doublings: u32,
    is_greedy: bool,
    has_improved: bool,
    current: Option<SegmentSearch<N>>,
    /// Unsuccessful searches, by the hash of first state, goal facts and weight: the number of times that the
    /// limit on evaluated states was doubled, or the maximum if the search was exhausted.
    failures: FxHashMap<u64, u32>,
}

struct SegmentSearch<N> {
    search: Search<N>,
    work: u64,
    end: usize,
    cost: N,
    key: u64,
}

impl<N: TaskNumber> PlanImprovement<N> {
    /// Prepares the search. Returns `None` if the steps are not a plan of the task.
    pub(super) fn new(context: &SearchContext<'_, N>, plan: &GroundPlan<N>) -> Option<Self> {
        let states = pass(context.task, &context.task.initial, &plan.steps)?;
        Some(Self {
            order: StepOrder::new(context.task, &plan.steps),
            plan: plan.clone(),
            states,
            random: Random(plan.steps.len() as u64),
            segment: MIN_STEPS,
            next: 0,
            doublings: 0,
            is_greedy: true,
            has_improved: false,
            current: None,
            failures: FxHashMap::default(),
        })
    }

    pub(super) fn cost(&self) -> &N {
        &self.plan.cost
    }

    pub(super) fn has_ended(&self) -> bool {
        self.doublings > MAX_DOUBLINGS
    }

    fn replace(&mut self, context: &SearchContext<'_, N>, plan: GroundPlan<N>, states: Vec<State<N>>) {
        self.order = StepOrder::new(context.task, &plan.steps);
        (self.plan, self.states, self.current) = (plan, states, None);
    }

    /// Searches with about `work` work units, and returns the first cheaper plan. Returns `Ok(None)` if the
    /// work is used up or the search has ended. Subtracts the work done from `work`.
    pub(super) fn run(
        &mut self,
        context: &mut SearchContext<'_, N>,
        work: &mut u64,
        limits: &Limits,
        figures: &mut SearchStatistics,
    ) -> Result<Option<GroundPlan<N>>, Interrupted> {
        while *work > 0 && !self.has_ended() {
            limits.check()?;
            let Some(segment) = &mut self.current else {
                *work = work.saturating_sub(context.size());
                self.begin_segment(context);
                continue;
            };
            let budget = segment.work.min(*work);
            let before = *figures;
            let outcome = segment.search.run(context, Some(&segment.cost), budget, limits, figures)?;
            let used = context.work(before, *figures).max(1);
            *work = work.saturating_sub(used);
            segment.work = segment.work.saturating_sub(used);
            let is_large = segment.search.size() > limits.room() / MEMORY_SHARE;
            match outcome {
                Outcome::Plan(part) => {
                    if let Some(plan) = self.adopt(context, &part.steps) {
                        return Ok(Some(plan));
                    }
                    // Another search of the segment would return the same steps.
                    self.end_segment(MAX_DOUBLINGS);
                }
                Outcome::Exhausted => self.end_segment(MAX_DOUBLINGS),
                Outcome::Paused if segment.work == 0 || is_large => self.end_segment(self.doublings),
                Outcome::Paused => {}
            }
        }
        Ok(None)
    }

    /// Replaces the steps of the current segment by `part`. Returns `None` if this is not a cheaper
    /// plan.
    fn adopt(&mut self, context: &SearchContext<'_, N>, part: &[GroundStep]) -> Option<GroundPlan<N>> {
        let segment = self.current.as_ref()?;
        let (before, after) = (&self.plan.steps[..self.next], &self.plan.steps[segment.end..]);
        let steps: Vec<GroundStep> = before.iter().chain(part).chain(after).cloned().collect();
        let states = pass(context.task, &context.task.initial, &steps)?;
        let cost = cost(context.task, &steps).filter(|cost| *cost < self.plan.cost)?;
        let plan = GroundPlan { steps, cost };
        self.has_improved = true;
        self.replace(context, plan.clone(), states);
        Some(plan)
    }

    fn end_segment(&mut self, doublings: u32) {
        if let Some(segment) = self.current.take() {
            if self.failures.len() < MAX_FAILURES {
                self.failures.insert(segment.key, doublings);
            }
            self.next = self.next.saturating_add((self.segment / 2).max(1));
        }
    }

    /// Starts the search of the next segment. Skips the segment if it costs nothing, or was already searched
    /// with at least the current limit. Ends the pass after the last segment.
    fn begin_segment(&mut self, context: &mut SearchContext<'_, N>) {
        let count = self.plan.steps.len();
        // The previous segment has already reached the end of the plan.
        let is_last = self.next > 0 && self.next.saturating_add(self.segment / 2) >= count;
        if is_last || self.next >= count {
            self.end_pass(context);
            return;
        }
        let end = self.next.saturating_add(self.segment).min(count);
        let (start, steps) = (&self.states[self.next], &self.plan.steps[self.next..end]);
        let goal = SegmentGoal::new(context.task, &self.states[end], &self.plan.steps[end..]);
        let weight = if self.is_greedy { GREEDY_WEIGHT } else { 1 };
        let key = FxBuildHasher.hash_one((start, &goal.facts, weight));
        let is_known = self.failures.get(&key).is_some_and(|doublings| *doublings >= self.doublings);
        match cost(context.task, steps).filter(|cost| *cost > N::zero() && !is_known) {
            Some(cost) => {
                let weight = HeuristicWeight::Times(weight);
                let prices = context.prices(true);
                let search = Search::new(context, weight, prices, SearchGoal::Segment(start.clone(), goal));
                let evaluations = MIN_EVALUATIONS << self.doublings;
                let work = evaluations.saturating_mul(context.size());
                self.current = Some(SegmentSearch { search, work, end, cost, key });
            }
            None => self.next = self.next.saturating_add((self.segment / 2).max(1)),
        }
    }

    fn end_pass(&mut self, context: &SearchContext<'_, N>) {
        let count = self.plan.steps.len();
        self.is_greedy = !self.is_greedy;
        if !self.has_improved {
            if self.segment >= count {
                self.segment = MIN_STEPS;
                self.doublings = self.doublings.saturating_add(1);
            } else {
                self.segment = self.segment.saturating_mul(3) / 2;
            }
        }
        (self.next, self.has_improved) = (0, false);
        let steps = self.order.shuffle(&self.plan.steps, &mut self.random);
        if let Some(states) = pass(context.task, &context.task.initial, &steps) {
            let plan = GroundPlan { steps, cost: self.plan.cost.clone() };
            self.replace(context, plan, states);
        }
    }
}
