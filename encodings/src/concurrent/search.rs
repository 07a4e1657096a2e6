//! A* over sequences of happenings.
//!
//! A node is a state, the actions under way, and the clocks. Of two nodes with the same state and the same actions under way one
//! is dropped if whatever can follow it can follow the other one, no later, at no higher cost, and with no less of any
//! resource. Orders of happenings that do not interfere have the same clocks, so only one of them is pursued. Actions can start at any
//! time, not only when others end: planners that know no other times are incomplete [1].
//!
//! [1] W. Cushing, S. Kambhampati, Mausam, D. Weld: When is temporal planning really temporal?, IJCAI 2007.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::collections::hash_map::Entry;

use rustc_hash::FxHashMap;

use crate::bounds::Bounds;
use crate::concurrent::compile::Concurrent;
use crate::concurrent::estimate::Estimate;
use crate::concurrent::expansion::{Expansion, Nowhere, Situation};
use crate::limits::Limits;
use crate::number::{GROWTH_LIMIT, Int, dense, words};
use crate::search::is_monotone;
use crate::task::OperatorId;

/// A plan as the search finds it.
#[derive(Debug, Clone)]
pub(super) struct Sequence {
    /// The metric in integers, then the makespan.
    pub(super) value: (Int, Int),
    pub(super) happenings: Vec<OperatorId>,
    /// Which of them take place at the time of the one before.
    pub(super) together: Vec<bool>,
}

/// How a search ended.
pub(super) enum Ended {
    /// Nothing is left that could be better than the incumbent.
    Exhausted,
    /// At a limit: no plan that is not known has a lower metric than this, in integers.
    Stopped(Int),
}

struct Node {
    situation: Situation,
    /// How many happenings lead here.
    depth: Int,
    /// The node before, what happened then, and whether its action has ended as well.
    parent: Option<(u32, OperatorId, bool)>,
    dominated: bool,
}

/// The metric, the makespan, the sum of what is left, the depth, and the number of the node.
type Priority = (Int, Int, Int, Int, u32);

pub(super) struct Search<'a> {
    concurrent: &'a Concurrent,
    estimate: &'a Estimate,
    /// Lower bounds on costs, and on resources; none if nothing costs.
    bounds: Option<&'a Bounds>,
    expansion: &'a Expansion<'a>,
    monotone: bool,
    nodes: Vec<Node>,
    seen: FxHashMap<Box<[u32]>, Vec<u32>>,
    open: BinaryHeap<Reverse<Priority>>,
    pub(super) incumbent: Option<Sequence>,
    /// What was left out because its numbers do not fit: no plan of it has a lower metric than this, in integers.
    left_out: Option<Int>,
}

impl<'a> Search<'a> {
    pub(super) fn new(
        concurrent: &'a Concurrent,
        expansion: &'a Expansion<'a>,
        estimate: &'a Estimate,
        bounds: Option<&'a Bounds>,
    ) -> Self {
        let situation = expansion.root();
        let mut search = Self {
            concurrent,
            estimate,
            bounds,
            expansion,
            monotone: is_monotone(&concurrent.task),
            nodes: Vec::new(),
            seen: FxHashMap::default(),
            open: BinaryHeap::new(),
            incumbent: None,
            left_out: None,
        };
        // Costs and times are not negative.
        search.push(Node { situation, depth: 0, parent: None, dominated: false }, 0);
        search
    }

    /// Searches until nothing better is left, `most` nodes are expanded, or a limit is reached. It can go on then. `report` hears of each better plan and of what none can get below.
    #[expect(clippy::arithmetic_side_effects, reason = "nodes are counted by 32 bits")]
    pub(super) fn run(
        &mut self,
        limits: &Limits,
        most: usize,
        report: &mut dyn FnMut(&Sequence, Int),
    ) -> Ended {
        let mut expanded = 0;
        while let Some(Reverse(priority)) = self.open.pop() {
            let id = priority.4;
            let value = (priority.0, priority.1);
            if self.nodes[id as usize].dominated || !self.is_better(value) {
                continue;
            }
            if self.expansion.is_goal(&self.nodes[id as usize].situation) {
                let sequence = self.sequence(id);
                report(&sequence, value.0);
                self.incumbent = Some(sequence);
                continue;
            }
            if expanded == most || (expanded.is_multiple_of(64) && limits.reached()) {
                self.open.push(Reverse(priority));
                return Ended::Stopped(self.lower());
            }
            expanded += 1;
            self.expand(id, value.0);
        }
        self.left_out.map_or(Ended::Exhausted, Ended::Stopped)
    }

    /// Whether there is nothing left to expand.
    pub(super) fn is_over(&self) -> bool {
        self.open.is_empty()
    }

    /// No plan that is not known has a lower metric than this, in integers.
    pub(super) fn lower(&self) -> Int {
        let open = self.open.peek().map_or(0, |Reverse(priority)| priority.0);
        self.left_out.map_or(open, |left_out| left_out.min(open))
    }

    /// Leaves out something below a node in which no plan has a lower metric than `lower`.
    fn leave_out(&mut self, lower: Int) {
        self.left_out = Some(self.left_out.map_or(lower, |known| known.min(lower)));
    }

    fn is_better(&self, value: (Int, Int)) -> bool {
        self.incumbent.as_ref().is_none_or(|incumbent| value < incumbent.value)
    }

    /// Adds what can follow a node in which no plan has a lower metric than `lower`.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "a node is no deeper than twice as many as there are nodes"
    )]
    fn expand(&mut self, id: u32, lower: Int) {
        for operator in self.expansion.candidates(&self.nodes[id as usize].situation) {
            let Node { situation, depth, .. } = &self.nodes[id as usize];
            match self.expansion.after(situation, operator, true) {
                Ok((situation, compressed)) => {
                    let depth = depth + 1 + Int::from(compressed);
                    let parent = Some((id, operator, compressed));
                    self.push(Node { situation, depth, parent, dominated: false }, lower);
                }
                Err(Nowhere::Impossible | Nowhere::TooLate) => {}
                Err(Nowhere::Unfit) => self.leave_out(lower),
            }
        }
    }

    /// Adds a node, below one in which no plan has a lower metric than `lower`.
    fn push(&mut self, node: Node, lower: Int) {
        let concurrent = self.concurrent;
        let Situation { state, clocks, cost } = &node.situation;
        let Some(left) = self.estimate.left(concurrent, state, clocks) else { return };
        let costs = match self.bounds {
            Some(bounds) => match bounds.estimate(state) {
                Some(costs) => costs,
                None => return,
            },
            None => 0,
        };
        let total = cost.checked_add(costs).and_then(|cost| concurrent.measure.total(left.makespan, cost));
        let Some(total) = total.filter(|total| *total < GROWTH_LIMIT) else {
            self.leave_out(lower);
            return;
        };
        let value = (total, left.makespan);
        if !self.is_better(value) {
            return;
        }
        let mut key = state.values[..concurrent.task.basic].to_vec();
        clocks.signature(&mut key);
        if !self.monotone {
            key.extend(state.numbers.iter().flat_map(|number| words(*number)));
        }
        let id = dense(self.nodes.len());
        let (guards, separation) = (&concurrent.guards, concurrent.separation);
        let dominates = |own: &Node, other: &Node| {
            let (own, other) = (&own.situation, &other.situation);
            own.cost <= other.cost
                && own.state.numbers.iter().zip(&other.state.numbers).all(|(own, other)| own >= other)
                && own.clocks.no_later(&other.clocks, guards, separation)
        };
        match self.seen.entry(key.into_boxed_slice()) {
            Entry::Vacant(entry) => {
                entry.insert(vec![id]);
            }
            Entry::Occupied(mut entry) => {
                let (front, nodes) = (entry.get_mut(), &mut self.nodes);
                if front.iter().any(|known| dominates(&nodes[*known as usize], &node)) {
                    return;
                }
                front.retain(|known| {
                    let known = &mut nodes[*known as usize];
                    known.dominated = dominates(&node, known);
                    !known.dominated
                });
                front.push(id);
            }
        }
        let depth = node.depth;
        self.nodes.push(node);
        self.open.push(Reverse((value.0, value.1, left.sum, depth, id)));
    }

    fn sequence(&self, goal: u32) -> Sequence {
        let situation = |id: u32| &self.nodes[id as usize].situation;
        let Situation { clocks, cost, .. } = situation(goal);
        let latest = clocks.latest();
        let total = self.concurrent.measure.total(latest, *cost);
        let value = (total.expect("invariant: what is on the way to a goal was measured"), latest);
        let (mut happenings, mut together) = (Vec::new(), Vec::new());
        let mut at = goal;
        while let Some((parent, operator, compressed)) = self.nodes[at as usize].parent {
            if compressed {
                happenings.push(self.concurrent.end_of(operator));
                together.push(false);
            }
            happenings.push(operator);
            together.push(situation(parent).clocks.unsettled());
            at = parent;
        }
        happenings.reverse();
        together.reverse();
        Sequence { value, happenings, together }
    }
}
