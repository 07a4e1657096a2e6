//! Policy iteration over the blocks of a component, with direct solution of each chain.

use std::collections::VecDeque;

use crate::mdp::dense;
use crate::number::Number;
use crate::solve::chain::{Chain, Solved};
use crate::solve::local::NONE;
use crate::solve::problem::Direction;
use crate::solve::quotient::Quotient;
use crate::solve::users::{Users, owners};
use crate::solve::work::Work;

/// Rounds of policy iteration after which the best policy so far is taken; the certificate tells what it is worth.
const ROUNDS: usize = 1000;
/// Sweeps between two solutions of the chain, at least and at most, where components are large.
const SWEEPS: (u64, u64) = (2, 40);
/// How many entries a sweep looks at in the time in which elimination touches one.
const SWEPT: u64 = 4;
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
    let mut touched = work.touched();
    let Solved { mut values, mut relative } = chain(quotient, &policy, work)?;
    let large = !N::EXACT && quotient.blocks() >= LARGE;
    for _ in 0..ROUNDS {
        let mut improved = false;
        // Sweeps are worth it for as long as elimination takes; where nothing fills up, that is not long.
        let eliminated = work.touched().saturating_sub(touched).saturating_mul(SWEPT);
        let sweeps =
            eliminated.checked_div(quotient.rows.columns.len() as u64).unwrap_or(0).clamp(SWEEPS.0, SWEEPS.1);
        for _ in 0..if large { sweeps } else { 1 } {
            let changed = improve(quotient, &mut policy, &mut values, direction, large, work)?;
            improved |= changed;
            if !changed {
                break;
            }
        }
        if !improved {
            break;
        }
        touched = work.touched();
        Solved { values, relative } = chain(quotient, &policy, work)?;
    }
    Some(Iterated { policy, values, relative })
}

/// The values of a policy.
fn chain<N: Number>(quotient: &Quotient<N>, policy: &[u32], work: &mut Work) -> Option<Solved<N>> {
    Chain { rows: &quotient.rows, policy, costs: None }.solve(work)
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
    let (owners, users) = (owners(&quotient.first), Users::new(&quotient.rows, quotient.blocks()));
    let mut queue = VecDeque::new();
    for (block, chosen) in policy.iter_mut().enumerate() {
        if let Some(row) = quotient.range(block).find(|row| !quotient.rows.leaving[*row].is_zero()) {
            *chosen = dense(row);
            queue.push_back(dense(block));
        }
    }
    while let Some(at) = queue.pop_front() {
        for row in users.of(at) {
            let block = owners[*row as usize];
            if policy[block as usize] == NONE {
                policy[block as usize] = *row;
                queue.push_back(block);
            }
        }
    }
    policy
}
