//! LM-cut \[1\]: an admissible heuristic that sums the costs of disjunctive action landmarks.
//!
//! The h^max values determine the supporter of each rule of the delete relaxation, i.e. its most expensive
//! condition. The goal zone contains the facts from which the goal can be reached at no cost. Rules that lead
//! from outside into the goal zone form a landmark: every plan uses one of their operators. The minimum cost
//! of these operators is added to the heuristic value and subtracted from the cost of each of them. This is
//! repeated until the goal costs nothing. The rules of an operator with conditional effects share a single
//! cost, so no cost is counted twice.
//!
//! \[1\] M. Helmert, C. Domshlak: Landmarks, critical paths and abstractions: what's the difference
//! anyway?, ICAPS 2009.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use task::limits::Limits;
use task::number::dense;
use task::task::Task;

use crate::bounds::delete_relaxation::{ALWAYS, DeleteRelaxation, GOAL};

/// Work units after which [`landmark_cut_bound`] ends and returns the sum over the landmarks found
/// until then.
const MAX_WORK: u64 = 100_000_000;
const WORK_PER_VISIT: u64 = 8;
const UNREACHABLE: u64 = u64::MAX;
const NONE: u32 = u32::MAX;

/// Returns the LM-cut value of the initial state. Returns `None` if an operator costs more than 2^40 or the
/// goal is unreachable in the delete relaxation. If a limit is reached, returns the sum over the landmarks
/// that were found, which is also a lower bound.
pub fn landmark_cut_bound(task: &Task, limits: &Limits) -> Option<u64> {
    let mut cut = LandmarkCut::new(task)?;
    let stops = |work| work > MAX_WORK || limits.reached();
    cut.lm_cut_value_until(&task.initial.values, &stops)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum CutSide {
    Open,
    /// In the goal zone: the goal is reachable from the fact at no cost.
    Goal,
    /// Reachable from the state without entering the goal zone.
    Before,
}

/// The LM-cut heuristic of a task, with scratch buffers for evaluating states.
pub struct LandmarkCut {
    relaxed: DeleteRelaxation,
    costs: Vec<u64>,
    values: Vec<u64>,
    zones: Vec<CutSide>,
    lengths: Vec<u32>,
    /// For each rule: the number of its unreached conditions.
    left: Vec<u32>,
    supporters: Vec<u32>,
    supports: Vec<u64>,
    queue: BinaryHeap<Reverse<(u64, u32)>>,
    stack: Vec<u32>,
    cut: Vec<u32>,
    in_cut: Vec<bool>,
    work: u64,
}

#[expect(
    clippy::arithmetic_side_effects,
    reason = "costs are below 2^40, and cuts are fewer than steps of a computer"
)]
impl LandmarkCut {
    /// Creates the heuristic. Returns `None` if an operator costs more than 2^40.
    pub(crate) fn new(task: &Task) -> Option<Self> {
        let relaxed = DeleteRelaxation::new(task)?;
        let (facts, rules) = (relaxed.facts(), relaxed.payers.len());
        let length = |rule: u32| dense(relaxed.required.of(rule).len());
        let lengths: Vec<u32> = (0..dense(rules)).map(length).collect();
        Some(Self {
            costs: relaxed.costs.clone(),
            values: vec![UNREACHABLE; facts],
            zones: vec![CutSide::Open; facts],
            left: lengths.clone(),
            lengths,
            supporters: vec![NONE; rules],
            supports: vec![0; rules],
            queue: BinaryHeap::new(),
            stack: Vec::new(),
            cut: Vec::new(),
            in_cut: vec![false; relaxed.costs.len()],
            work: 0,
            relaxed,
        })
    }

    pub(crate) fn work(&self) -> u64 {
        self.work.saturating_mul(WORK_PER_VISIT)
    }

    /// Returns the LM-cut value of a state, which is a lower bound on its goal distance. Returns `None` if
    /// the goal is unreachable in the delete relaxation, and thus in the task.
    pub(crate) fn lm_cut_value(&mut self, values: &[u32]) -> Option<u64> {
        self.lm_cut_value_until(values, &|_| false)
    }

    /// Like [`Self::lm_cut_value`], but ends with the landmarks found until then when `stops` returns
    /// `true` for the work units done.
    fn lm_cut_value_until(&mut self, values: &[u32], stops: &dyn Fn(u64) -> bool) -> Option<u64> {
        self.costs.clone_from(&self.relaxed.costs);
        self.reach(values);
        let mut sum = 0;
        while self.values[GOAL as usize] > 0 {
            if self.values[GOAL as usize] == UNREACHABLE {
                return None;
            }
            if stops(self.work()) {
                break;
            }
            self.mark_goal_zone();
            sum += self.cross(values);
            self.lower();
            self.zones.fill(CutSide::Open);
        }
        Some(sum)
    }

    /// Computes the h^max values of all facts, and the supporter of each reached rule.
    fn reach(&mut self, values: &[u32]) {
        self.values.fill(UNREACHABLE);
        self.supporters.fill(NONE);
        self.left.clone_from(&self.lengths);
        self.work += (self.left.len() + self.values.len()) as u64 / 4;
        for fact in self.relaxed.state(values) {
            self.values[fact as usize] = 0;
            self.queue.push(Reverse((0, fact)));
        }
        while let Some(Reverse((value, fact))) = self.queue.pop() {
            if value > self.values[fact as usize] {
                continue;
            }
            let rules = self.relaxed.required_by.of(fact);
            self.work += 2 + rules.len() as u64;
            for rule in rules {
                let unreached = &mut self.left[*rule as usize];
                *unreached -= 1;
                if *unreached == 0 {
                    // Facts are popped by increasing value, so the condition that is reached last is the most
                    // expensive.
                    self.supporters[*rule as usize] = fact;
                    self.supports[*rule as usize] = value;
                    let total = value + self.costs[self.relaxed.payers[*rule as usize] as usize];
                    offer(self.relaxed.given.of(*rule), total, &mut self.values, &mut self.queue);
                }
            }
        }
    }

    fn mark_goal_zone(&mut self) {
        self.zones[GOAL as usize] = CutSide::Goal;
        self.stack.push(GOAL);
        while let Some(fact) = self.stack.pop() {
            let rules = self.relaxed.given_by.of(fact);
            self.work += rules.len() as u64;
            for rule in rules {
                let supporter = self.supporters[*rule as usize];
                if supporter != NONE
                    && self.costs[self.relaxed.payers[*rule as usize] as usize] == 0
                    && self.zones[supporter as usize] != CutSide::Goal
                {
                    self.zones[supporter as usize] = CutSide::Goal;
                    self.stack.push(supporter);
                }
            }
        }
    }

    /// Finds the payers of the rules that lead into the goal zone from facts that are reachable outside it.
    /// Subtracts the minimum of their costs from each of these costs, and returns the minimum.
    fn cross(&mut self, values: &[u32]) -> u64 {
        for payer in self.cut.drain(..) {
            self.in_cut[payer as usize] = false;
        }
        for fact in self.relaxed.state(values) {
            self.zones[fact as usize] = CutSide::Before;
            self.stack.push(fact);
        }
        while let Some(fact) = self.stack.pop() {
            let rules = self.relaxed.required_by.of(fact);
            self.work += rules.len() as u64;
            for rule in rules {
                if self.supporters[*rule as usize] != fact {
                    continue;
                }
                let given = self.relaxed.given.of(*rule);
                if given.iter().any(|fact| self.zones[*fact as usize] == CutSide::Goal) {
                    let payer = self.relaxed.payers[*rule as usize];
                    if !std::mem::replace(&mut self.in_cut[payer as usize], true) {
                        self.cut.push(payer);
                    }
                    continue;
                }
                for fact in given {
                    if self.zones[*fact as usize] == CutSide::Open {
                        self.zones[*fact as usize] = CutSide::Before;
                        self.stack.push(*fact);
                    }
                }
            }
        }
        let costs = &mut self.costs;
        let cut_cost = self.cut.iter().map(|payer| costs[*payer as usize]).min().unwrap_or(0);
        for payer in &self.cut {
            costs[*payer as usize] -= cut_cost;
        }
        cut_cost
    }

    /// Updates the h^max values incrementally after the costs of the cut have decreased.
    fn lower(&mut self) {
        for payer in &self.cut {
            for rule in self.relaxed.rules_of.of(*payer) {
                if self.supporters[*rule as usize] != NONE {
                    let total = self.supports[*rule as usize] + self.costs[*payer as usize];
                    offer(self.relaxed.given.of(*rule), total, &mut self.values, &mut self.queue);
                }
            }
        }
        while let Some(Reverse((value, fact))) = self.queue.pop() {
            if value > self.values[fact as usize] {
                continue;
            }
            let rules = self.relaxed.required_by.of(fact);
            self.work += 2 + rules.len() as u64;
            for rule in rules {
                // Only rules whose supporter became cheaper can change.
                if self.supporters[*rule as usize] != fact || self.supports[*rule as usize] <= value {
                    continue;
                }
                let required = self.relaxed.required.of(*rule);
                let values = &self.values;
                let costliest = required.iter().copied().max_by_key(|fact| values[*fact as usize]);
                let supporter = costliest.unwrap_or(ALWAYS);
                let before =
                    std::mem::replace(&mut self.supports[*rule as usize], values[supporter as usize]);
                self.supporters[*rule as usize] = supporter;
                if values[supporter as usize] < before {
                    let cost = self.costs[self.relaxed.payers[*rule as usize] as usize];
                    let total = values[supporter as usize] + cost;
                    offer(self.relaxed.given.of(*rule), total, &mut self.values, &mut self.queue);
                }
            }
        }
    }
}

fn offer(facts: &[u32], total: u64, values: &mut [u64], queue: &mut BinaryHeap<Reverse<(u64, u32)>>) {
    for fact in facts {
        let value = &mut values[*fact as usize];
        if total < *value {
            *value = total;
            queue.push(Reverse((total, *fact)));
        }
    }
}
