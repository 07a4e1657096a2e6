//! Policy iteration over the blocks of a component, with direct solution of each chain.

use std::collections::VecDeque;

use crate::mdp::dense;
use crate::number::Number;
use crate::solve::chain::{Rows, Solved, solve_chain};
use crate::solve::local::NONE;
use crate::solve::problem::Direction;
use crate::solve::quotient::Quotient;
use crate::solve::work::Work;

/// Rounds of policy iteration after which the best policy so far is taken; the certificate tells what it is worth.
const ROUNDS: usize = 1000;
/// Sweeps between two solutions of the chain, where components are large.
const SWEEPS: usize = 40;
/// Blocks from which on sweeps pay off.
const LARGE: usize = 200;

/// A policy that no row improves on, as far as can be told, with the values of its blocks.
pub struct Iterated<N> {
    pub policy: Vec<u32>,
    pub values: Vec<N>,
    /// How far the values of this policy can be off, relative to each.
    pub relative: Vec<f64>,
}

/// Policy iteration from a proper policy; none where the chain of a policy is too large to be solved, or exact arithmetic
/// takes too long.
pub fn iterate<N: Number>(
    quotient: &Quotient<N>,
    start: Vec<u32>,
    direction: Direction,
    work: &mut Work,
) -> Option<Iterated<N>> {
    let mut policy = start;
    let Solved { mut values, mut relative } = chain(quotient, &policy, work)?;
    for _ in 0..ROUNDS {
        let mut improved = false;
        let large = !N::EXACT && quotient.blocks() >= LARGE;
        for _ in 0..if large { SWEEPS } else { 1 } {
            let changed = improve(quotient, &mut policy, &mut values, direction, large, work)?;
            improved |= changed;
            if !changed {
                break;
            }
        }
        if !improved {
            break;
        }
        Solved { values, relative } = chain(quotient, &policy, work)?;
    }
    Some(Iterated { policy, values, relative })
}

/// The values of a policy.
fn chain<N: Number>(quotient: &Quotient<N>, policy: &[u32], work: &mut Work) -> Option<Solved<N>> {
    // Blocks that nothing leaves are worth nothing; they get an empty row.
    if policy.contains(&NONE) {
        let mut padded = Rows::new();
        let mut chosen = Vec::with_capacity(policy.len());
        for row in policy {
            if *row != NONE {
                for at in quotient.rows.range(*row as usize) {
                    padded.columns.push(quotient.rows.columns[at]);
                    padded.probabilities.push(quotient.rows.probabilities[at].clone());
                }
            }
            let constant =
                if *row == NONE { N::zero() } else { quotient.rows.constants[*row as usize].clone() };
            let leaving = if *row == NONE { N::one() } else { quotient.rows.leaving[*row as usize].clone() };
            chosen.push(dense(padded.len()));
            padded.end(constant, leaving);
        }
        return solve_chain(&padded, &chosen, |row| padded.constants[row].clone(), work);
    }
    solve_chain(&quotient.rows, policy, |row| quotient.rows.constants[row].clone(), work)
}

/// Takes the best row of each block; `sweep` writes its value, too. Whether any changed.
fn improve<N: Number>(
    quotient: &Quotient<N>,
    policy: &mut [u32],
    values: &mut [N],
    direction: Direction,
    sweep: bool,
    work: &mut Work,
) -> Option<bool> {
    let mut changed = false;
    let old: Option<Vec<N>> = (!sweep).then(|| values.to_vec());
    for block in 0..quotient.blocks() {
        for row in quotient.range(block) {
            if policy[block] as usize == row {
                continue;
            }
            let value = quotient.rows.apply(row, old.as_deref().unwrap_or(values));
            work.spend(&value, quotient.rows.range(row).len())?;
            let better = match direction {
                Direction::Min => value.clearly_less(&values[block]),
                Direction::Max => values[block].clearly_less(&value),
            };
            if better {
                policy[block] = dense(row);
                values[block] = value;
                changed = true;
            }
        }
    }
    Some(changed)
}

/// A policy under which every block is left, by rows that get closer to the outside.
pub fn leave<N: Number>(quotient: &Quotient<N>) -> Vec<u32> {
    let mut policy = vec![NONE; quotient.blocks()];
    let mut users: Vec<Vec<(u32, u32)>> = vec![Vec::new(); quotient.blocks()];
    let mut queue = VecDeque::new();
    for (block, chosen) in policy.iter_mut().enumerate() {
        for row in quotient.range(block) {
            if *chosen == NONE && !quotient.rows.leaving[row].is_zero() {
                *chosen = dense(row);
                queue.push_back(block);
            }
            for at in quotient.rows.range(row) {
                users[quotient.rows.columns[at] as usize].push((dense(block), dense(row)));
            }
        }
    }
    while let Some(at) = queue.pop_front() {
        for (block, row) in &users[at] {
            if policy[*block as usize] == NONE {
                policy[*block as usize] = *row;
                queue.push_back(*block as usize);
            }
        }
    }
    policy
}
