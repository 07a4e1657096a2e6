//! Solves a component with cycles: merges its end components, then applies policy iteration.

use std::cmp::Reverse;
use std::collections::VecDeque;

use crate::mdp::dense;
use crate::number::Number;
use crate::solve::chain::Rows;
use crate::solve::doubles;
use crate::solve::interval::Enclosed;
use crate::solve::iterate::{Iterated, iterate, leave};
use crate::solve::local::{EndComponents, Local, NONE, attractor, end_components};
use crate::solve::problem::{Direction, Run, UNDERFLOW_BOUND};
use crate::solve::quotient::Quotient;
use crate::solve::users::Users;

impl<N: Number> Run<'_, N> {
    /// Solves a strongly connected component of several states. Returns `None` if exact arithmetic
    /// exceeds its budget.
    pub fn component(&mut self, component: &[u32], local: &mut Local<N>) -> Option<()> {
        let outcome = self.solve_component(component, local);
        for state in component {
            self.position[*state as usize] = NONE;
        }
        outcome
    }

    fn solve_component(&mut self, component: &[u32], local: &mut Local<N>) -> Option<()> {
        // States are numbered locally from the last discovered one to the first: states discovered last are
        // usually near an exit, and neighbouring states have close numbers.
        let mut component = component.to_vec();
        component.sort_unstable_by_key(|state| Reverse(*state));
        self.cut(&component, local, |_, _| true);
        let states = component.len();
        drop(component);
        let members = self.sure_members(local);
        if self.problem.rewards.is_some() {
            for (state, sure) in local.states.iter().zip(&members) {
                self.solution.infinite.set(*state as usize, !sure);
            }
        }
        let settled = self.problem.rewards.is_none() && self.sure_is_one();
        let unsolved: Vec<u32> =
            component_part(&local.states, &members, !settled, self.problem.rewards.is_some());
        for (state, sure) in local.states.iter().zip(&members) {
            if *sure {
                self.solution.sure.insert(*state as usize);
                if settled {
                    self.solution.values[*state as usize] = N::one();
                }
            }
        }
        if settled {
            self.reach_surely(local, &members);
        }
        if unsolved.is_empty() {
            return Some(());
        }
        let must_be_sure = self.problem.rewards.is_some() && self.problem.direction == Direction::Min;
        // If no choices and no states are excluded, the equations extracted above are reused.
        if must_be_sure || unsolved.len() < states {
            self.cut(&unsolved, local, |run, choice| {
                let targets = run.problem.mdp.targets(choice);
                !must_be_sure || targets.iter().all(|t| run.solution.sure.contains(*t as usize))
            });
        }
        drop((unsolved, members));
        self.values(local)
    }

    /// Returns for each state of the component whether it is sure, i.e. reaches a terminal state with
    /// probability 1 (under some or under all policies, see `sure_by_choice`).
    fn sure_members(&mut self, local: &Local<N>) -> Vec<bool> {
        let outside_sure = |choice: usize| {
            self.problem.mdp.targets(local.choices[choice] as usize).iter().all(|target| {
                self.position[*target as usize] != NONE || self.solution.sure.contains(*target as usize)
            })
        };
        if self.sure_by_choice() {
            return attractor(local, outside_sure).0;
        }
        // A state is sure under all policies if no policy can stay in the component forever (in an end
        // component) and none can leave it to an unsure state. All other states are marked as unsure.
        let ends = end_components(local, |_| true);
        let mut unsure = ends.inside;
        // A path ends without success in a state without an allowed choice.
        for (state, first) in local.first.windows(2).enumerate() {
            unsure[state] |= first[0] == first[1];
        }
        let owners = local.owners();
        let users = Users::new(&local.rows, local.states.len());
        for (choice, owner) in owners.iter().enumerate() {
            unsure[*owner as usize] |= !outside_sure(choice);
        }
        let mut queue: Vec<u32> = (0..dense(unsure.len())).filter(|state| unsure[*state as usize]).collect();
        while let Some(state) = queue.pop() {
            for choice in users.of(state) {
                let owner = owners[*choice as usize];
                if !std::mem::replace(&mut unsure[owner as usize], true) {
                    queue.push(owner);
                }
            }
        }
        unsure.into_iter().map(|unsure| !unsure).collect()
    }

    /// Stores a policy for the states marked in `members` that reaches a terminal state with probability 1.
    fn reach_surely(&mut self, local: &mut Local<N>, members: &[bool]) {
        let sure = component_part(&local.states, members, true, true);
        if sure.is_empty() {
            return;
        }
        self.cut(&sure, local, |run, choice| {
            run.problem.mdp.targets(choice).iter().all(|t| run.solution.sure.contains(*t as usize))
        });
        let (_, policy) = attractor(local, |_| true);
        for (state, choice) in local.states.iter().zip(policy) {
            if choice != NONE {
                self.solution.policy[*state as usize] = local.choices[choice as usize];
            }
        }
    }

    /// Copies `states` with their equations from the process to `local`. Only the choices that the problem
    /// allows and `keep` accepts are copied. Afterwards, `position` contains the local numbers of these states.
    fn cut(&mut self, states: &[u32], local: &mut Local<N>, keep: impl Fn(&Self, usize) -> bool) {
        for state in &local.states {
            self.position[*state as usize] = NONE;
        }
        local.clear();
        local.states.extend_from_slice(states);
        for (number, state) in states.iter().enumerate() {
            self.position[*state as usize] = dense(number);
        }
        for state in states {
            for choice in self.problem.choices(*state as usize) {
                if !keep(self, choice) {
                    continue;
                }
                let reward = self.problem.reward(choice);
                local.paid.push(!reward.is_zero());
                let (mut constant, mut leaving) = (reward, N::zero());
                for (target, probability) in self.problem.mdp.transitions(choice) {
                    let position = self.position[target];
                    if position == NONE {
                        let value = &self.solution.values[target];
                        let part = probability.times(value);
                        local.tiny |= !N::EXACT && !value.is_zero() && part.to_f64() < UNDERFLOW_BOUND;
                        constant = constant.plus(&part);
                        leaving = leaving.plus(probability);
                    } else {
                        local.rows.columns.push(position);
                        local.rows.probabilities.push(probability.clone());
                    }
                }
                local.rows.end(constant, leaving);
                local.choices.push(dense(choice));
                local.widest = local.widest.max(self.problem.mdp.targets(choice).len());
            }
            local.first.push(dense(local.choices.len()));
        }
    }

    /// Computes the values and the policy of the states in `local`. If no method bounds the values
    /// in doubles, their errors are set to infinity. Returns `None` if exact arithmetic exceeds its
    /// budget.
    fn values(&mut self, local: &mut Local<N>) -> Option<()> {
        let costs = self.problem.rewards.is_some();
        let mut ends = end_components(local, |choice| !costs || !local.paid[choice]);
        if !costs && self.problem.direction == Direction::Min && ends.inside.contains(&true) {
            // Staying in an end component reaches the goal with probability 0, the least possible
            // value.
            let mut remaining = Vec::new();
            for (number, state) in local.states.iter().enumerate() {
                if ends.inside[number] {
                    self.solution.values[*state as usize] = N::zero();
                    self.solution.policy[*state as usize] = stay(local, &ends, number);
                } else {
                    remaining.push(*state);
                }
            }
            if remaining.is_empty() {
                return Some(());
            }
            self.cut(&remaining, local, |_, _| true);
            ends = end_components(local, |_| false);
        }
        let quotient = quotient(local, &ends);
        let start = self.start(local, &quotient);
        let direction = self.problem.direction;
        let enclosure = match iterate(&quotient, start, direction, &mut self.work) {
            None if N::EXACT => return None,
            Some(Iterated { policy, values, .. }) if N::EXACT || self.draft => {
                Some(Enclosed { policy, values, errors: Vec::new() })
            }
            None if self.draft => None,
            iterated => doubles::enclosed(&quotient, iterated, direction, &mut self.work),
        };
        if self.work.is_cancelled() {
            return None;
        }
        let Some(Enclosed { policy, values, errors }) = enclosure else {
            self.mark_unknown(local);
            return Some(());
        };
        let small = |value: &N| !N::EXACT && !value.is_zero() && value.to_f64() < 1e-30;
        let tiny = if local.tiny || values.iter().any(small) { UNDERFLOW_BOUND } else { 0.0 };
        let outside = self.outside_error(local) + tiny;
        for (number, state) in local.states.iter().enumerate() {
            let (block, state) = (ends.block[number] as usize, *state as usize);
            self.solution.values[state] = values[block].clone();
            if !N::EXACT {
                let error = if values[block].is_zero() {
                    0.0
                } else {
                    errors.get(block).copied().unwrap_or(f64::INFINITY)
                };
                self.solution.errors[state] = error + outside;
            }
        }
        self.write_policy(local, &ends, &quotient, &policy);
        Some(())
    }

    fn outside_error(&self, local: &Local<N>) -> f64 {
        if N::EXACT {
            return 0.0;
        }
        let targets = local.choices.iter().flat_map(|choice| self.problem.mdp.targets(*choice as usize));
        targets
            .filter(|target| self.position[**target as usize] == NONE)
            .fold(0.0, |error, target| error.max(self.solution.errors[*target as usize]))
    }

    fn mark_unknown(&mut self, local: &Local<N>) {
        for state in &local.states {
            self.solution.errors[*state as usize] = f64::INFINITY;
        }
    }

    /// Returns the initial policy: the hint if it selects a row for every block (merged end
    /// component) that has rows, otherwise a policy that leaves the component with probability 1.
    fn start(&self, local: &Local<N>, quotient: &Quotient<N>) -> Vec<u32> {
        let mut policy = vec![NONE; quotient.blocks()];
        if let Some(hint) = self.hint {
            for (block, row) in policy.iter_mut().enumerate() {
                let hinted = |row: &usize| {
                    let choice = local.choices[quotient.choices[*row] as usize];
                    hint[self.problem.mdp.owner(choice as usize)] == choice
                };
                *row = quotient.range(block).find(hinted).map_or(NONE, dense);
            }
            let complete = (0..policy.len()).all(|b| policy[b] != NONE || quotient.range(b).is_empty());
            if complete {
                return policy;
            }
        }
        leave(quotient)
    }

    fn write_policy(
        &mut self,
        local: &Local<N>,
        ends: &EndComponents,
        quotient: &Quotient<N>,
        policy: &[u32],
    ) {
        let owners = local.owners();
        let mut chosen = vec![NONE; local.states.len()];
        let mut queue = Vec::new();
        for row in policy.iter().filter(|row| **row != NONE) {
            let choice = quotient.choices[*row as usize];
            let owner = owners[choice as usize];
            chosen[owner as usize] = choice;
            queue.push(owner);
        }
        if ends.inside.contains(&true) {
            route_to_exits(local, ends, &owners, &mut chosen, queue);
        }
        for (number, state) in local.states.iter().enumerate() {
            self.solution.policy[*state as usize] = match chosen[number] {
                NONE => stay(local, ends, number),
                choice => local.choices[choice as usize],
            };
        }
    }
}

/// Extends the policy `chosen` to the states of end components that have no choice yet: they move
/// towards a state whose choice leaves the end component. `queue` contains the states with a
/// choice.
fn route_to_exits<N: Number>(
    local: &Local<N>,
    ends: &EndComponents,
    owners: &[u32],
    chosen: &mut [u32],
    queue: Vec<u32>,
) {
    let users = Users::new(&local.rows, local.states.len());
    let mut queue = VecDeque::from(queue);
    while let Some(state) = queue.pop_front() {
        for choice in users.of(state).iter().filter(|choice| ends.alive[**choice as usize]) {
            let owner = owners[*choice as usize];
            if chosen[owner as usize] == NONE {
                chosen[owner as usize] = *choice;
                queue.push_back(owner);
            }
        }
    }
}

/// Returns the states that are marked in `members` (the sure states) if `only_sure` is `true`. Otherwise, returns all
/// states if `include_sure` is `true`, and the states that are not marked if it is `false`.
fn component_part(states: &[u32], members: &[bool], include_sure: bool, only_sure: bool) -> Vec<u32> {
    let is_selected = |sure: bool| if only_sure { sure } else { include_sure || !sure };
    states.iter().zip(members).filter(|(_, sure)| is_selected(**sure)).map(|(state, _)| *state).collect()
}

fn stay<N: Number>(local: &Local<N>, ends: &EndComponents, state: usize) -> u32 {
    let mut choices = local.range(state);
    choices.find(|choice| ends.alive[*choice]).map_or(NONE, |choice| local.choices[choice])
}

/// Builds the equations of a component in which no end components are merged: each state is its own block. The
/// rows are moved out of `local`, and their self-loops are eliminated. Choices that only loop get no row.
fn unmerged<N: Number>(local: &mut Local<N>) -> Quotient<N> {
    let mut rows = std::mem::replace(&mut local.rows, Rows::new());
    let (mut first, mut choices, mut begin) = (vec![0], Vec::with_capacity(local.choices.len()), 0);
    for state in 0..local.states.len() {
        for choice in local.range(state) {
            let end = rows.first[choice.saturating_add(1)] as usize;
            if rows.move_without_loop(choice, begin..end, choices.len(), dense(state)) {
                choices.push(dense(choice));
            }
            begin = end;
        }
        first.push(dense(choices.len()));
    }
    rows.truncate(choices.len());
    Quotient { first, rows, choices, widest: local.widest }
}

/// Sorts the states by block (merged end component). Returns the start of each block in the sorted list
/// (followed by the length of the list), and the list.
fn members(ends: &EndComponents) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0_u32; ends.blocks.saturating_add(1)];
    for block in &ends.block {
        let next = &mut starts[(*block as usize).saturating_add(1)];
        *next = next.saturating_add(1);
    }
    let mut end = 0_u32;
    for start in &mut starts {
        end = end.saturating_add(*start);
        *start = end;
    }
    let (mut members, mut free) = (vec![0_u32; ends.block.len()], starts.clone());
    for (state, block) in ends.block.iter().enumerate() {
        let at = &mut free[*block as usize];
        members[*at as usize] = dense(state);
        *at = at.saturating_add(1);
    }
    (starts, members)
}

fn quotient<N: Number>(local: &mut Local<N>, ends: &EndComponents) -> Quotient<N> {
    if !ends.inside.contains(&true) {
        return unmerged(local);
    }
    let (starts, members) = members(ends);
    let mut result =
        Quotient { first: vec![0], rows: Rows::new(), choices: Vec::new(), widest: local.widest };
    let mut entries: Vec<(u32, N)> = Vec::new();
    for (block, window) in starts.windows(2).enumerate() {
        for state in &members[window[0] as usize..window[1] as usize] {
            for choice in local.range(*state as usize) {
                entries.clear();
                let (mut leaves, mut loops) = (local.rows.leaving[choice].clone(), false);
                for at in local.rows.range(choice) {
                    let target = ends.block[local.rows.columns[at] as usize];
                    if target as usize == block {
                        loops = true;
                        continue;
                    }
                    let probability = &local.rows.probabilities[at];
                    leaves = leaves.plus(probability);
                    match entries.iter_mut().find(|(column, _)| *column == target) {
                        Some((_, sum)) => *sum = sum.plus(probability),
                        None => entries.push((target, probability.clone())),
                    }
                }
                if leaves.is_zero() {
                    continue;
                }
                let scaled = |value: &N| if loops { value.over(&leaves) } else { value.clone() };
                for (target, probability) in &entries {
                    result.rows.columns.push(*target);
                    result.rows.probabilities.push(scaled(probability));
                }
                result.rows.end(scaled(&local.rows.constants[choice]), scaled(&local.rows.leaving[choice]));
                result.choices.push(dense(choice));
            }
        }
        result.first.push(dense(result.choices.len()));
    }
    result
}
