//! A set of states extracted from a process, usually a strongly connected component, and its end
//! components.

use std::collections::VecDeque;

use crate::graph::components;
use crate::mdp::dense;
use crate::number::Number;
use crate::solve::chain::Rows;
use crate::solve::users::{Users, owners};

pub use crate::solve::chain::NONE;

/// A set of extracted states with their choices. Local numbers count the states and choices of this
/// set from 0.
#[derive(Debug, Clone)]
pub struct Local<N> {
    /// The number of each local state in the process.
    pub states: Vec<u32>,
    /// First local choice of each state, followed by the number of choices.
    pub first: Vec<u32>,
    /// The number of each local choice in the process.
    pub choices: Vec<u32>,
    /// The equations, one row per choice; columns are local states.
    pub rows: Rows<N>,
    /// For each choice, whether its reward is positive.
    pub paid: Vec<bool>,
    /// Greatest number of transitions of a choice, including those that leave the set.
    pub widest: usize,
    /// Whether the product of a probability and the value of a successor outside the set was so small that
    /// doubles lose digits.
    pub tiny: bool,
}

impl<N: Number> Local<N> {
    pub fn new() -> Self {
        Self {
            states: vec![],
            first: vec![0],
            choices: vec![],
            rows: Rows::new(),
            paid: vec![],
            widest: 0,
            tiny: false,
        }
    }

    pub fn clear(&mut self) {
        self.states.clear();
        self.first.truncate(1);
        self.choices.clear();
        self.paid.clear();
        self.rows.first.truncate(1);
        self.rows.columns.clear();
        self.rows.probabilities.clear();
        self.rows.constants.clear();
        self.rows.leaving.clear();
        (self.widest, self.tiny) = (0, false);
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the start of the next one is there, because the end is listed, too"
    )]
    pub fn range(&self, state: usize) -> std::ops::Range<usize> {
        self.first[state] as usize..self.first[state + 1] as usize
    }

    /// Returns `true` if all successors of a choice are states of the set.
    pub fn is_closed(&self, choice: usize) -> bool {
        self.rows.leaving[choice].is_zero()
    }

    pub fn owners(&self) -> Vec<u32> {
        owners(&self.first)
    }
}

/// The maximal end components that consist of eligible choices, and the partition of the states
/// into blocks.
#[derive(Debug, Clone)]
pub struct EndComponents {
    /// Block of each local state. The states of an end component form a block; each other state is
    /// a block by itself.
    pub block: Vec<u32>,
    pub blocks: usize,
    /// For each local state, whether it belongs to an end component.
    pub inside: Vec<bool>,
    /// For each local choice, whether it belongs to an end component.
    pub alive: Vec<bool>,
}

/// Computes the maximal end components (de Alfaro 1997) that consist of choices that `eligible` accepts. Only
/// closed choices count, i.e. those whose targets are all in `local`. The graph of these choices is decomposed
/// into strongly connected components, and choices that leave their component are removed, until no choice is
/// removed.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "the start of the next one is there, because the end is listed, too"
)]
pub fn end_components<N: Number>(local: &Local<N>, eligible: impl Fn(usize) -> bool) -> EndComponents {
    let n = local.states.len();
    let mut alive: Vec<bool> =
        (0..local.choices.len()).map(|choice| local.is_closed(choice) && eligible(choice)).collect();
    if !alive.contains(&true) {
        return EndComponents { block: (0..dense(n)).collect(), blocks: n, inside: vec![false; n], alive };
    }
    if let Some(whole) = whole(local, &alive) {
        return whole;
    }
    remove_dead_ends(local, &mut alive);
    if !alive.contains(&true) {
        return EndComponents { block: (0..dense(n)).collect(), blocks: n, inside: vec![false; n], alive };
    }
    let mut block = vec![0_u32; n];
    loop {
        let (mut starts, mut edges) = (vec![0_u32], Vec::new());
        for state in 0..n {
            for choice in local.range(state).filter(|choice| alive[*choice]) {
                edges.extend_from_slice(&local.rows.columns[local.rows.range(choice)]);
            }
            starts.push(dense(edges.len()));
        }
        let parts = components(n, |s| &edges[starts[s as usize] as usize..starts[s as usize + 1] as usize]);
        for (number, component) in parts.iter().enumerate() {
            for state in component {
                block[*state as usize] = dense(number);
            }
        }
        let mut changed = false;
        for state in 0..n {
            for choice in local.range(state) {
                let targets = &local.rows.columns[local.rows.range(choice)];
                if alive[choice] && targets.iter().any(|t| block[*t as usize] != block[state]) {
                    alive[choice] = false;
                    changed = true;
                }
            }
        }
        if !changed {
            let inside = (0..n).map(|state| local.range(state).any(|choice| alive[choice])).collect();
            return EndComponents { block, blocks: parts.len(), inside, alive };
        }
    }
}

fn remove_dead_ends<N: Number>(local: &Local<N>, alive: &mut [bool]) {
    let (owners, users) = (local.owners(), Users::new(&local.rows, local.states.len()));
    let mut remaining = vec![0_u32; local.states.len()];
    for (choice, owner) in owners.iter().enumerate() {
        remaining[*owner as usize] = remaining[*owner as usize].saturating_add(u32::from(alive[choice]));
    }
    let mut dead: Vec<u32> =
        (0..dense(remaining.len())).filter(|state| remaining[*state as usize] == 0).collect();
    while let Some(state) = dead.pop() {
        for choice in users.of(state) {
            if std::mem::replace(&mut alive[*choice as usize], false) {
                let owner = owners[*choice as usize];
                let remaining = &mut remaining[owner as usize];
                *remaining = remaining.saturating_sub(1);
                if *remaining == 0 {
                    dead.push(owner);
                }
            }
        }
    }
}

/// Fast path for the frequent case that all states form a single end component, as in models in which
/// every reconfiguration is possible and costs nothing. Returns `None` in other cases, and for more
/// than 64 states.
fn whole<N: Number>(local: &Local<N>, alive: &[bool]) -> Option<EndComponents> {
    let n = local.states.len();
    if n > 64 {
        return None;
    }
    let (mut forward, mut backward) = ([0_u64; 64], [0_u64; 64]);
    for (state, out) in forward.iter_mut().enumerate().take(n) {
        for choice in local.range(state).filter(|choice| alive[*choice]) {
            for target in &local.rows.columns[local.rows.range(choice)] {
                *out |= 1 << target;
                backward[*target as usize] |= 1 << state;
            }
        }
    }
    let all_states = (0..n).fold(0_u64, |all_states, state| all_states | 1 << state);
    // Strong connectivity: all states are reachable from state 0, forwards and backwards.
    let covers = |edges: &[u64; 64]| {
        let (mut visited, mut open) = (1_u64, 1_u64);
        while open != 0 {
            let state = open.trailing_zeros() as usize;
            open ^= 1 << state;
            let new = edges[state] & !visited;
            visited |= new;
            open |= new;
        }
        visited == all_states
    };
    (covers(&forward) && covers(&backward)).then(|| EndComponents {
        block: vec![0; n],
        blocks: 1,
        inside: vec![true; n],
        alive: alive.to_vec(),
    })
}

/// Computes the states from which some policy leaves the component with probability 1, and such a policy.
///
/// Only choices that `fits` accepts are used; it rejects choices with unacceptable successors outside the
/// component.
pub fn attractor<N: Number>(local: &Local<N>, fits: impl Fn(usize) -> bool) -> (Vec<bool>, Vec<u32>) {
    let n = local.states.len();
    let owners = local.owners();
    let users = Users::new(&local.rows, n);
    let mut usable: Vec<bool> = (0..local.choices.len()).map(&fits).collect();
    let mut candidate = vec![true; n];
    loop {
        let (mut reached, mut policy) = (vec![false; n], vec![NONE; n]);
        let mut queue: VecDeque<u32> = VecDeque::new();
        for choice in 0..local.choices.len() {
            let owner = owners[choice] as usize;
            if usable[choice] && !local.is_closed(choice) && !reached[owner] && candidate[owner] {
                reached[owner] = true;
                policy[owner] = dense(choice);
                queue.push_back(dense(owner));
            }
        }
        while let Some(state) = queue.pop_front() {
            for choice in users.of(state) {
                let owner = owners[*choice as usize] as usize;
                if usable[*choice as usize] && !reached[owner] && candidate[owner] {
                    reached[owner] = true;
                    policy[owner] = *choice;
                    queue.push_back(dense(owner));
                }
            }
        }
        if reached == candidate {
            return (reached, policy);
        }
        for (choice, usable) in usable.iter_mut().enumerate() {
            let targets = &local.rows.columns[local.rows.range(choice)];
            *usable = *usable && targets.iter().all(|target| reached[*target as usize]);
        }
        candidate = reached;
    }
}
