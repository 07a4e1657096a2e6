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
use crate::concurrent::access::Accesses;
use crate::concurrent::clocks::{self, Clocks, Kind};
use crate::concurrent::compile::Concurrent;
use crate::concurrent::estimate::Estimate;
use crate::concurrent::happening::Role;
use crate::limits::Limits;
use crate::number::{GROWTH_LIMIT, Int, dense, words};
use crate::search::is_monotone;
use crate::search::successors::OperatorIndex;
use crate::task::{OperatorId, State};

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
    state: State,
    clocks: Clocks,
    cost: Int,
    /// How many happenings lead here.
    depth: Int,
    parent: Option<(u32, OperatorId)>,
    dominated: bool,
}

/// The metric, the makespan, the sum of what is left, and the number of the node; greedily, the sum and the depth come
/// first.
type Priority = (Int, Int, Int, Int, u32);

pub(super) struct Search<'a> {
    concurrent: &'a Concurrent,
    estimate: &'a Estimate,
    /// Lower bounds on costs, and on resources; none if nothing costs.
    bounds: Option<&'a Bounds>,
    index: OperatorIndex,
    greedy: bool,
    monotone: bool,
    nodes: Vec<Node>,
    seen: FxHashMap<Box<[u32]>, Vec<u32>>,
    open: BinaryHeap<Reverse<Priority>>,
    pub(super) incumbent: Option<Sequence>,
    /// What was left out because its numbers do not fit: no plan of it has a lower metric than this, in integers.
    left_out: Option<Int>,
}

/// Numbers of a node do not fit their type.
struct Unfit;

impl<'a> Search<'a> {
    pub(super) fn new(
        concurrent: &'a Concurrent,
        estimate: &'a Estimate,
        bounds: Option<&'a Bounds>,
        greedy: bool,
        incumbent: Option<Sequence>,
    ) -> Self {
        let begins = |id: &OperatorId| {
            matches!(concurrent.happenings[id.index()].role, Role::Start(_) | Role::Whole | Role::Timed(_))
        };
        let operators = (0..dense(concurrent.task.operators.len())).map(OperatorId).filter(begins);
        let mut search = Self {
            concurrent,
            estimate,
            bounds,
            index: OperatorIndex::over(&concurrent.task, operators),
            greedy,
            monotone: is_monotone(&concurrent.task),
            nodes: Vec::new(),
            seen: FxHashMap::default(),
            open: BinaryHeap::new(),
            incumbent,
            left_out: None,
        };
        let state = concurrent.task.initial.clone();
        // Costs and times are not negative.
        let root = Node { state, clocks: Clocks::new(), cost: 0, depth: 0, parent: None, dominated: false };
        search.push(root, 0);
        search
    }

    /// Searches until nothing better is left, `most` nodes are expanded, or a limit is reached; greedily, until a plan is
    /// found. `report` hears of each better plan and of what none can get below.
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
            let value = if self.greedy { (priority.2, priority.3) } else { (priority.0, priority.1) };
            if self.nodes[id as usize].dominated || !self.is_better(value) {
                continue;
            }
            if self.is_goal(id) {
                let sequence = self.sequence(id);
                report(&sequence, value.0);
                self.incumbent = Some(sequence);
                if self.greedy {
                    return Ended::Stopped(0);
                }
                continue;
            }
            if expanded == most || (expanded.is_multiple_of(64) && limits.reached()) {
                // Greedily, others that are still open may be better.
                let lower = if self.greedy { 0 } else { value.0 };
                return Ended::Stopped(self.left_out.map_or(lower, |left_out| left_out.min(lower)));
            }
            expanded += 1;
            self.expand(id, value.0);
        }
        self.left_out.map_or(Ended::Exhausted, Ended::Stopped)
    }

    /// Leaves out something below a node in which no plan has a lower metric than `lower`.
    fn leave_out(&mut self, lower: Int) {
        self.left_out = Some(self.left_out.map_or(lower, |known| known.min(lower)));
    }

    fn is_better(&self, value: (Int, Int)) -> bool {
        self.incumbent.as_ref().is_none_or(|incumbent| value < incumbent.value)
    }

    fn is_goal(&self, id: u32) -> bool {
        let Node { state, clocks, .. } = &self.nodes[id as usize];
        let concurrent = self.concurrent;
        // What happens by itself up to the end has taken place, and nothing after the end; what comes soon after keeps apart.
        let mut to_come = concurrent.events.iter().filter(|(time, _)| *time > clocks.floor());
        let is_apart = |(time, event): &(Int, OperatorId)| {
            let after = &concurrent.happenings[event.index()].accesses.after;
            *time > clocks.latest() && clocks.are_apart(*time, after)
        };
        clocks.opens().is_empty()
            && !clocks.unsettled()
            && !clocks.waits()
            && concurrent.task.is_goal(state)
            && to_come.all(is_apart)
    }

    /// Adds what can follow a node in which no plan has a lower metric than `lower`.
    fn expand(&mut self, id: u32, lower: Int) {
        let concurrent = self.concurrent;
        let Node { state, clocks, .. } = &self.nodes[id as usize];
        let mut next = self.index.applicable(&concurrent.task, state);
        next.extend(clocks.opens().iter().map(|open| concurrent.instances[open.instance as usize].end));
        for operator in next {
            match self.successor(id, operator) {
                Ok(Some(node)) => self.push(node, lower),
                Ok(None) => {}
                Err(Unfit) => self.leave_out(lower),
            }
        }
    }

    /// The node after a happening; none if it cannot happen here.
    #[expect(clippy::arithmetic_side_effects, reason = "a node is no deeper than there are nodes")]
    fn successor(&self, id: u32, operator_id: OperatorId) -> Result<Option<Node>, Unfit> {
        let concurrent = self.concurrent;
        let Node { state, clocks, cost, depth, .. } = &self.nodes[id as usize];
        let (operator, happening) =
            (&concurrent.task.operators[operator_id.index()], &concurrent.happenings[operator_id.index()]);
        if !operator.applicable(state, &[]) {
            return Ok(None);
        }
        let (kind, instance) = match happening.role {
            Role::Start(instance) => (Kind::Start, instance),
            Role::End(instance) => (Kind::End, instance),
            // Those that happen by themselves are told apart below.
            Role::Whole | Role::Timed(_) => (Kind::Whole, u32::MAX),
            Role::Never => return Ok(None),
        };
        if kind == Kind::Start && clocks.is_open(instance) || self.clashes(clocks, happening) {
            return Ok(None);
        }
        let after = concurrent.task.successor(operator, state, &[]).ok_or(Unfit)?;
        let open = clocks.opens().iter().map(|open| open.instance);
        let going_on = open.filter(|open| kind != Kind::End || *open != instance);
        let mut going_on = going_on.chain((kind == Kind::Start).then_some(instance));
        let settled = going_on.all(|instance| concurrent.holds_over_all(instance, &after));
        let sets = happening.sets.iter().copied();
        let changes: Vec<u32> = sets
            .filter(|variable| state.values[*variable as usize] != after.values[*variable as usize])
            .collect();
        let clocks = if let Role::Timed(time) = happening.role {
            let Accesses { after, marks } = &happening.accesses;
            clocks.timed(&clocks::Event { time, after, marks, changes: &changes, settled })
        } else {
            let own = concurrent.instances.get(instance as usize);
            clocks.after(&clocks::Happening {
                kind,
                instance,
                duration: own.map_or(0, |own| own.duration),
                after: &happening.accesses.after,
                marks: &happening.accesses.marks,
                joint: own.is_some_and(|own| !own.joint.is_empty()),
                touches: &|instance| concurrent.touches(operator_id, instance),
                changes: &changes,
                settled,
            })
        };
        let Some(mut clocks) = clocks else { return Ok(None) };
        clocks.forget(&concurrent.guards, concurrent.separation);
        let cost = cost.checked_add(operator.cost.constant).ok_or(Unfit)?;
        let parent = Some((id, operator_id));
        Ok(Some(Node { state: after, clocks, cost, depth: depth + 1, parent, dominated: false }))
    }

    /// Whether an action under way uses a function with another design.
    fn clashes(&self, clocks: &Clocks, happening: &crate::concurrent::happening::Happening) -> bool {
        happening.designs.iter().any(|(function, design)| {
            clocks.opens().iter().any(|open| {
                let other = &self.concurrent.instances[open.instance as usize].designs;
                other.iter().any(|(own, used)| own == function && used != design)
            })
        })
    }

    /// Adds a node, below one in which no plan has a lower metric than `lower`.
    fn push(&mut self, node: Node, lower: Int) {
        let concurrent = self.concurrent;
        let Some(left) = self.estimate.left(concurrent, &node.state, &node.clocks) else { return };
        let costs = match self.bounds {
            Some(bounds) => match bounds.estimate(&node.state) {
                Some(costs) => costs,
                None => return,
            },
            None => 0,
        };
        let total =
            node.cost.checked_add(costs).and_then(|cost| concurrent.measure.total(left.makespan, cost));
        let Some(total) = total.filter(|total| *total < GROWTH_LIMIT) else {
            self.leave_out(lower);
            return;
        };
        let value = (total, left.makespan);
        if !self.is_better(value) {
            return;
        }
        let mut key = node.state.values[..concurrent.task.basic].to_vec();
        node.clocks.signature(&mut key);
        if !self.monotone {
            key.extend(node.state.numbers.iter().flat_map(|number| words(*number)));
        }
        let id = dense(self.nodes.len());
        let (guards, separation) = (&concurrent.guards, concurrent.separation);
        let dominates = |own: &Node, other: &Node| {
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
        self.open.push(Reverse(if self.greedy {
            (left.sum, depth, value.0, value.1, id)
        } else {
            (value.0, value.1, left.sum, depth, id)
        }));
    }

    fn sequence(&self, goal: u32) -> Sequence {
        let node = &self.nodes[goal as usize];
        let latest = node.clocks.latest();
        let total = self.concurrent.measure.total(latest, node.cost);
        let value = (total.expect("invariant: what is on the way to a goal was measured"), latest);
        let (mut happenings, mut together) = (Vec::new(), Vec::new());
        let mut at = goal;
        while let Some((parent, operator)) = self.nodes[at as usize].parent {
            happenings.push(operator);
            together.push(self.nodes[parent as usize].clocks.unsettled());
            at = parent;
        }
        happenings.reverse();
        together.reverse();
        Sequence { value, happenings, together }
    }
}
