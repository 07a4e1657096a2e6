//! Explicit abstraction of a task: a function from states to abstract states, and the abstract transitions.
//!
//! Projections and Cartesian abstractions are converted to this form for cost partitioning during the search.
//! Costs and goal distances are 32-bit numbers that are capped at [`MAX_DISTANCE`]. A capped distance is
//! still a consistent lower bound.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use task::limits::{Interrupted, LimitPoll};
use task::number::dense;
use task::task::VariableId;

use crate::bounds::pattern_database::Projection;

pub(super) const UNREACHABLE: u32 = u32::MAX;
/// Upper limit on goal distances, so that the sum over [`MAX_ABSTRACTIONS`] abstractions does not overflow.
pub(super) const MAX_DISTANCE: u32 = 1 << 23;
pub(super) const MAX_ABSTRACTIONS: usize = 256;

/// Inner node of a [`SplitTree`]: states in which `variable` has one of `values` belong to `children[1]`, all
/// other states to `children[0]`.
#[derive(Clone)]
pub(super) struct Split {
    pub(super) variable: u32,
    pub(super) values: Box<[u64]>,
    pub(super) children: [u32; 2],
}

#[derive(Clone)]
pub(super) enum SplitNode {
    Leaf(u32),
    Inner(Split),
}

/// Decision tree from states to the states of a Cartesian abstraction. The first node is the root.
pub(super) struct SplitTree(pub(super) Vec<SplitNode>);

impl SplitTree {
    #[expect(clippy::arithmetic_side_effects, reason = "the depth of a tree in memory")]
    fn state(&self, values: &[u32]) -> (u32, u32) {
        let (mut node, mut depth) = (0, 0);
        loop {
            depth += 1;
            match &self.0[node as usize] {
                SplitNode::Leaf(state) => return (*state, depth),
                SplitNode::Inner(split) => {
                    let value = values[split.variable as usize];
                    let is_in = split.values[value as usize / 64] >> (value % 64) & 1;
                    node = split.children[usize::from(is_in > 0)];
                }
            }
        }
    }
}

pub(super) enum StateMap {
    /// Projection to variables, each with the number of its values.
    Pattern(Vec<(u32, u32)>),
    Tree(SplitTree),
}

pub(super) struct Abstraction {
    map: StateMap,
    goals: Vec<u32>,
    /// For each abstract state: the end of its incoming transitions in `incoming`.
    ends: Vec<u32>,
    /// Sources and operators of the transitions, sorted by target.
    incoming: Vec<(u32, u32)>,
}

pub(super) struct Scratch {
    queue: BinaryHeap<Reverse<(u32, u32)>>,
    /// For each operator: its saturated cost. 0 between two computations.
    used: Vec<u32>,
    touched: Vec<u32>,
}

impl Scratch {
    pub(super) fn new(operators: usize) -> Self {
        Self { queue: BinaryHeap::new(), used: vec![0; operators], touched: Vec::new() }
    }
}

impl Abstraction {
    /// Creates an abstraction with `states` abstract states from its transitions (source, operator, target).
    /// Transitions from a state to itself are omitted, because they do not affect goal distances.
    pub(super) fn new(
        map: StateMap,
        states: usize,
        goals: Vec<u32>,
        mut transitions: Vec<(u32, u32, u32)>,
    ) -> Self {
        transitions.retain(|(source, _, target)| source != target);
        transitions.sort_unstable_by_key(|(source, operator, target)| (*target, *source, *operator));
        transitions.dedup();
        let mut ends = vec![0_u32; states];
        let mut incoming = Vec::with_capacity(transitions.len());
        for (source, operator, target) in transitions {
            incoming.push((source, operator));
            ends[target as usize] = dense(incoming.len());
        }
        // A state without incoming transitions ends where the previous state ends.
        let mut end = 0;
        for state_end in &mut ends {
            end = end.max(*state_end);
            *state_end = end;
        }
        Self { map, goals, ends, incoming }
    }

    pub(super) fn of_projection(projection: &Projection) -> Self {
        let map = StateMap::Pattern(projection.pattern_sizes().collect());
        let transitions = projection.all_transitions();
        let transitions = transitions.map(|(operator, t)| (t.source, dense(operator), t.target)).collect();
        Self::new(map, projection.size(), projection.goals().to_vec(), transitions)
    }

    pub(super) fn is_projection_to(&self, variables: &[VariableId]) -> bool {
        match &self.map {
            StateMap::Tree(_) => false,
            StateMap::Pattern(pattern) => {
                pattern.iter().map(|(variable, _)| *variable).eq(variables.iter().map(|variable| variable.0))
            }
        }
    }

    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    /// Number of abstract states plus the number of transitions: a measure of the work to compute goal
    /// distances.
    pub(super) fn size(&self) -> usize {
        self.ends.len().saturating_add(self.incoming.len())
    }

    /// Returns the abstract state of a state, and the number of steps to find it.
    #[expect(clippy::arithmetic_side_effects, reason = "an abstract state is below the number of them")]
    pub(super) fn state(&self, values: &[u32]) -> (u32, u32) {
        match &self.map {
            StateMap::Tree(tree) => tree.state(values),
            StateMap::Pattern(pattern) => {
                let index = |index, (variable, size): &(u32, u32)| index * size + values[*variable as usize];
                (pattern.iter().fold(0, index), dense(pattern.len()))
            }
        }
    }

    fn incoming(&self, state: u32) -> &[(u32, u32)] {
        let begin = state.checked_sub(1).map_or(0, |before| self.ends[before as usize]);
        &self.incoming[begin as usize..self.ends[state as usize] as usize]
    }

    /// Computes the goal distance of each abstract state by Dijkstra's algorithm, at most `MAX_DISTANCE`;
    /// [`UNREACHABLE`] if no goal state is reachable.
    pub(super) fn goal_distances(
        &self,
        costs: &[u32],
        distances: &mut Vec<u32>,
        scratch: &mut Scratch,
        pulse: &mut LimitPoll<'_>,
    ) -> Result<(), Interrupted> {
        distances.clear();
        distances.resize(self.len(), UNREACHABLE);
        scratch.queue.clear();
        for goal in &self.goals {
            distances[*goal as usize] = 0;
            scratch.queue.push(Reverse((0, *goal)));
        }
        while let Some(Reverse((distance, state))) = scratch.queue.pop() {
            pulse.beat()?;
            if distance > distances[state as usize] {
                continue;
            }
            for (source, operator) in self.incoming(state) {
                let through = distance.saturating_add(costs[*operator as usize]).min(MAX_DISTANCE);
                let best = &mut distances[*source as usize];
                if through < *best {
                    *best = through;
                    scratch.queue.push(Reverse((through, *source)));
                }
            }
        }
        Ok(())
    }

    /// Calls `visit` for each operator with a positive saturated cost: the minimum non-negative cost that
    /// preserves the given distances.
    pub(super) fn saturate(
        &self,
        distances: &[u32],
        scratch: &mut Scratch,
        mut visit: impl FnMut(usize, u32),
    ) {
        let Scratch { used, touched, .. } = scratch;
        let mut begin = 0;
        for (end, after) in self.ends.iter().zip(distances) {
            if *after != UNREACHABLE {
                for (source, operator) in &self.incoming[begin as usize..*end as usize] {
                    let before = distances[*source as usize];
                    if before > *after && before != UNREACHABLE {
                        let fall = before.saturating_sub(*after);
                        let used = &mut used[*operator as usize];
                        if *used == 0 {
                            touched.push(*operator);
                        }
                        *used = fall.max(*used);
                    }
                }
            }
            begin = *end;
        }
        for operator in touched.drain(..) {
            visit(operator as usize, std::mem::take(&mut used[operator as usize]));
        }
    }
}
