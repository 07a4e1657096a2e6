//! Extracts a strongly connected component of a process, and computes its end components.

use std::collections::VecDeque;

use crate::graph::components;
use crate::mdp::dense;
use crate::number::Number;
use crate::solve::chain::Rows;
use crate::solve::users::{Users, owners};

pub use crate::solve::chain::NONE;

/// The choices of some states. Local numbers count these states and choices from 0.
#[derive(Debug, Clone)]
pub struct Local<N> {
    /// Global numbers of the states.
    pub states: Vec<u32>,
    /// First local choice of each state, and the end.
    pub first: Vec<u32>,
    /// Global numbers of the choices.
    pub choices: Vec<u32>,
    /// One row per choice; columns are local states.
    pub rows: Rows<N>,
    /// `true` for choices with a positive reward.
    pub paid: Vec<bool>,
    /// Greatest number of transitions of a choice, inside and outside.
    pub widest: usize,
    /// `true` if a product is so small that doubles lose digits.
    pub tiny: bool,
}

impl<N: Number> Local<N> {
    /// Creates an empty component.
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

    /// Removes the contents, but keeps the memory.
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

    /// Returns the local choices of a local state.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the start of the next one is there, because the end is listed, too"
    )]
    pub fn range(&self, state: usize) -> std::ops::Range<usize> {
        self.first[state] as usize..self.first[state + 1] as usize
    }

    /// Returns `true` if a choice stays in the component with probability 1.
    pub fn is_closed(&self, choice: usize) -> bool {
        self.rows.leaving[choice].is_zero()
    }

    /// Returns the local state of each choice.
    pub fn owners(&self) -> Vec<u32> {
        owners(&self.first)
    }
}

/// The maximal end components of the eligible choices.
#[derive(Debug, Clone)]
pub struct EndComponents {
    /// Block of each local state; a state outside end components is a block by itself.
    pub block: Vec<u32>,
    /// Number of blocks.
    pub blocks: usize,
    /// `true` for states in an end component.
    pub inside: Vec<bool>,
    /// `true` for choices of an end component.
    pub alive: Vec<bool>,
}

/// Computes the maximal end components of the closed choices that `eligible` accepts (de Alfaro 1997): decomposes the
/// graph into components and removes the choices that leave one, until no choice is removed. Choices into dead ends are
/// removed first; without end components, these are all choices.
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

/// Removes choices that lead to states without remaining choices.
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

/// Returns the whole component if it is one end component, the frequent case of free reconfiguration. At most 64 states.
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
    // Strongly connected: all states are reachable from state 0, forwards and backwards.
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

/// Computes the states from which the component can be left with probability 1, and a policy that does so: the greatest
/// set of states that have a choice that stays in the set or leaves the component, and from which leaving is reachable by
/// such choices.
///
/// `fits` returns `true` for choices with acceptable successors outside.
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
