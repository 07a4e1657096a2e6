//! Relaxed-plan heuristic of temporal states, with preferred happenings.
//!
//! Costs are added over the conditions of a rule \[1\], and the cheapest rule of each proposition
//! forms the relaxed plan \[2\]. Its goals are those of the task and the ends of all running
//! actions.
//!
//! \[1\] B. Bonet, H. Geffner: Planning as heuristic search, Artificial Intelligence 129, 2001.
//! \[2\] J. Hoffmann, B. Nebel: The FF planning system, JAIR 14, 2001; E. Keyder, H. Geffner: Heuristics for
//! planning with action costs revisited, ECAI 2008.

use std::cmp::Reverse;

use search::satisfice::bucket_queue::Queue;
use task::number::Int;
use task::task::OperatorId;
use task::task::quantity::Linear;

use crate::concurrent::rule::Proposition;
use crate::concurrent::successors::TemporalState;
use crate::concurrent::temporal_relaxation::TemporalRelaxation;
use crate::concurrent::time_number::TimeNumber;

const UNREACHABLE: u32 = u32::MAX;
const MAX_COST: u32 = 1 << 30;
const MAX_REPETITIONS: u32 = 1 << 20;

#[derive(Debug, Clone)]
pub(super) struct HeuristicValue {
    /// Cost of the relaxed plan: sum over its happenings of weight times number of applications.
    pub(super) left: u64,
    /// Happenings of the relaxed plan without unsatisfied conditions, ascending.
    pub(super) preferred: Vec<OperatorId>,
}

pub(super) struct RelaxedPlanHeuristic<'a> {
    relaxed: &'a TemporalRelaxation,
    costs: Vec<u32>,
    /// For each proposition: cheapest rule that adds it, and number of its applications.
    supporters: Vec<Option<(u32, u32)>>,
    unmet: Vec<u32>,
    sums: Vec<u32>,
    marked: Vec<bool>,
    /// Per numeric condition: amount that is missing. `None` if the expression can have any value, so
    /// that the condition counts as satisfied.
    missing: Vec<Option<Int>>,
    open: Queue,
    targets: Vec<Proposition>,
}

impl<'a> RelaxedPlanHeuristic<'a> {
    pub(super) fn new(relaxed: &'a TemporalRelaxation) -> Self {
        let (propositions, rules) = (relaxed.propositions, relaxed.unmet.len());
        Self {
            relaxed,
            costs: vec![UNREACHABLE; propositions],
            supporters: vec![None; propositions],
            unmet: vec![0; rules],
            sums: vec![0; rules],
            marked: vec![false; rules],
            missing: vec![None; relaxed.numeric.len()],
            open: Queue::default(),
            targets: Vec::new(),
        }
    }

    /// Returns the cost and the preferred happenings of a relaxed plan from a state. Returns `None` if the
    /// goal or the end of a running action is unreachable even in the relaxation.
    pub(super) fn guide<T: TimeNumber>(
        &mut self,
        TemporalState { state, clocks, .. }: &TemporalState<T>,
    ) -> Option<HeuristicValue> {
        let value = |linear: &Linear<Int>| linear.value(&state.numbers, &[], &[]);
        self.guide_from(&state.values, clocks.opens().iter().map(|open| open.instance), &value)
    }

    /// Like [`Self::guide`], given the values of variables, the running instances, and upper bounds
    /// on linear expressions. A bound of `None` means that the expression can have any value.
    pub(super) fn guide_from(
        &mut self,
        values: &[u32],
        instances: impl Iterator<Item = u32>,
        upper_bound: &dyn Fn(&Linear<Int>) -> Option<Int>,
    ) -> Option<HeuristicValue> {
        let relaxed = self.relaxed;
        let ends: Vec<u32> = instances.map(|instance| relaxed.ends[instance as usize]).collect();
        self.targets.clone_from(&relaxed.goal);
        self.targets.extend(ends.iter().flat_map(|end| relaxed.needs.of(*end)));
        self.reach(values, upper_bound);
        let is_reached = |target: &Proposition| self.costs[*target as usize] < UNREACHABLE;
        self.targets.iter().all(is_reached).then(|| self.extract(&ends))
    }

    /// Dijkstra's algorithm over propositions, until all targets are reached at their final costs.
    #[expect(clippy::arithmetic_side_effects, reason = "values of variables are held in memory")]
    fn reach(&mut self, values: &[u32], upper_bound: &dyn Fn(&Linear<Int>) -> Option<Int>) {
        let relaxed = self.relaxed;
        self.costs.fill(UNREACHABLE);
        self.supporters.fill(None);
        self.sums.fill(0);
        self.unmet.copy_from_slice(&relaxed.unmet);
        self.open.clear();
        for (missing, numeric) in self.missing.iter_mut().zip(&relaxed.numeric) {
            // A value that overflows counts as unbounded.
            *missing = upper_bound(&numeric.linear).map(Int::saturating_neg);
        }
        for (first, value) in relaxed.first.iter().zip(values) {
            self.improve(first + value, 0, None);
        }
        for default in &relaxed.defaults {
            self.improve(*default, 0, None);
        }
        for position in 0..relaxed.numeric.len() {
            if self.missing[position].is_none_or(|missing| missing <= 0) {
                self.improve(relaxed.numeric[position].proposition, 0, None);
            }
        }
        for [conjunction, first, second] in &relaxed.conjunctions {
            if self.costs[*first as usize] == 0 && self.costs[*second as usize] == 0 {
                self.improve(*conjunction, 0, None);
            }
        }
        for rule in &relaxed.free {
            self.fire(*rule);
        }
        let mut level = 0;
        while let Some((cost, proposition)) = self.open.pop_first() {
            if cost > self.costs[proposition as usize] {
                continue;
            }
            if cost > level {
                level = cost;
                if self.targets.iter().all(|target| self.costs[*target as usize] <= level) {
                    return;
                }
            }
            for rule in relaxed.needing.of(proposition) {
                let sum = &mut self.sums[*rule as usize];
                *sum = sum.saturating_add(cost);
                let unmet = &mut self.unmet[*rule as usize];
                *unmet -= 1;
                if *unmet == 0 {
                    self.fire(*rule);
                }
            }
        }
    }

    fn improve(&mut self, proposition: Proposition, cost: u32, by: Option<(u32, u32)>) {
        let current = &mut self.costs[proposition as usize];
        if cost < *current {
            *current = cost;
            self.supporters[proposition as usize] = by;
            self.open.push(cost, proposition);
        }
    }

    fn fire(&mut self, rule: u32) {
        let relaxed = self.relaxed;
        let (weight, sum) = (relaxed.weights[rule as usize], self.sums[rule as usize]);
        let cost = sum.saturating_add(weight).min(MAX_COST);
        for add in relaxed.adds.of(rule) {
            self.improve(*add, cost, Some((rule, 1)));
        }
        for (position, by) in &relaxed.raises[rule as usize] {
            let times = repetitions(self.missing[*position as usize], *by);
            let cost = sum.saturating_add(weight.saturating_mul(times)).min(MAX_COST);
            let proposition = relaxed.numeric[*position as usize].proposition;
            self.improve(proposition, cost, Some((rule, times)));
        }
    }

    fn extract(&mut self, ends: &[u32]) -> HeuristicValue {
        let relaxed = self.relaxed;
        self.marked.fill(false);
        let mut used: Vec<(OperatorId, u64)> = Vec::new();
        let mut preferred = Vec::new();
        let mut stack = relaxed.goal.clone();
        let mut rules: Vec<(u32, u32)> = ends.iter().map(|end| (*end, 1)).collect();
        loop {
            while let Some((rule, times)) = rules.pop() {
                let (index, origin) = (rule as usize, relaxed.origins[rule as usize]);
                if let Some(origin) = origin {
                    used.push((origin, u64::from(times).saturating_mul(relaxed.weights[index].into())));
                }
                if std::mem::replace(&mut self.marked[index], true) {
                    continue;
                }
                let needs = relaxed.needs.of(rule);
                stack.extend(needs);
                if needs.iter().all(|need| self.costs[*need as usize] == 0) {
                    preferred.extend(origin);
                }
            }
            let Some(proposition) = stack.pop() else { break };
            rules.extend(self.supporters[proposition as usize].take());
        }
        // Of several rules of an operator, only the largest cost counts.
        used.sort_unstable_by_key(|(origin, times)| (*origin, Reverse(*times)));
        used.dedup_by_key(|(origin, _)| *origin);
        preferred.sort_unstable();
        preferred.dedup();
        HeuristicValue { left: used.iter().fold(0, |sum, (_, times)| times.saturating_add(sum)), preferred }
    }
}

/// Number of applications that add the missing amount, from 1 to [`MAX_REPETITIONS`]; 1 if an
/// amount is unknown.
pub(super) fn repetitions(missing: Option<Int>, by: Option<Int>) -> u32 {
    let (Some(missing), Some(by)) = (missing, by) else { return 1 };
    let times = missing.checked_add(by.saturating_sub(1)).and_then(|sum| sum.checked_div(by));
    times.and_then(|times| u32::try_from(times).ok()).unwrap_or(MAX_REPETITIONS).clamp(1, MAX_REPETITIONS)
}
