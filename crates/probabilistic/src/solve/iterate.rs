//! Policy iteration over the blocks (merged end components) of a component. The Markov chain of
//! each policy is solved directly.

use std::collections::VecDeque;

use crate::mdp::dense;
use crate::number::Number;
use crate::solve::chain::{Chain, Solved};
use crate::solve::local::NONE;
use crate::solve::problem::Direction;
use crate::solve::quotient::Quotient;
use crate::solve::users::{Users, owners};
use crate::solve::work::Work;

/// Upper limit on the number of rounds of policy iteration in doubles. If it is reached, the last policy may not be
/// optimal; its error is bounded afterwards.
const MAX_ROUNDS: usize = 1000;
/// Upper limit on the number of rounds in exact arithmetic. If it is reached, there is no result, because a
/// result counts as optimal. Usually, the budget of work is exceeded much earlier.
const MAX_EXACT_ROUNDS: usize = 1_000_000;
/// Least and greatest number of sweeps that improve the policy before its chain is solved again. Only for large
/// components in doubles; otherwise there is one sweep.
const SWEEPS: (u64, u64) = (2, 40);
/// Number of entries that a sweep evaluates in the time that elimination needs for one entry.
const SWEEP_SPEED: u64 = 4;
/// Number of blocks (merged end components) from which on several sweeps per round save time, in
/// doubles.
const SWEEP_MIN_BLOCKS: usize = 200;

/// A policy with the value of each block (merged end component). No row clearly improves the
/// policy, unless [`MAX_ROUNDS`] was reached in doubles.
pub struct Iterated<N> {
    pub policy: Vec<u32>,
    pub values: Vec<N>,
    /// Upper bound on the relative error of each value, with respect to the exact value of this
    /// policy.
    pub relative: Vec<f64>,
}

/// Performs policy iteration from the policy `start`, which must lead from every block (merged end
/// component) out of the component with probability 1. Returns `None` if the chain of a policy
/// cannot be solved within the limits, if exact arithmetic exceeds its budget or [`MAX_EXACT_ROUNDS`], or if the
/// caller has cancelled the computation.
pub fn iterate<N: Number>(
    quotient: &Quotient<N>,
    start: Vec<u32>,
    direction: Direction,
    work: &mut Work<'_>,
) -> Option<Iterated<N>> {
    let mut policy = start;
    let mut touched = work.touched();
    let Solved { mut values, mut relative } = chain(quotient, &policy, work)?;
    let large = !N::EXACT && quotient.blocks() >= SWEEP_MIN_BLOCKS;
    let (rounds, mut is_stable) = (if N::EXACT { MAX_EXACT_ROUNDS } else { MAX_ROUNDS }, false);
    for _ in 0..rounds {
        work.poll(quotient.rows.columns.len())?;
        let mut improved = false;
        // The sweeps may take about as long as the last elimination. Without fill-in, elimination is fast, so
        // there are few sweeps.
        let eliminated = work.touched().saturating_sub(touched).saturating_mul(SWEEP_SPEED);
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
            is_stable = true;
            break;
        }
        touched = work.touched();
        Solved { values, relative } = chain(quotient, &policy, work)?;
    }
    (is_stable || !N::EXACT).then_some(Iterated { policy, values, relative })
}

fn chain<N: Number>(quotient: &Quotient<N>, policy: &[u32], work: &mut Work<'_>) -> Option<Solved<N>> {
    Chain { rows: &quotient.rows, policy, costs: None }.solve(work)
}

/// Switches each block (merged end component) to a row (choice) that is clearly better than the current one, if
/// there is one. With `sweep`, rows are evaluated with the updated values, otherwise with the values before the
/// call. Returns `true` if a row was switched, and `None` if exact arithmetic exceeds its budget.
fn improve<N: Number>(
    quotient: &Quotient<N>,
    policy: &mut [u32],
    values: &mut [N],
    direction: Direction,
    sweep: bool,
    work: &mut Work<'_>,
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
            // Only clear improvements count, so that rounding causes no endless alternation between policies.
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

/// Returns a policy under which every block (merged end component) from which the component can be
/// left reaches an exit with positive probability. Other blocks get no row ([`NONE`]). Rows are
/// chosen by breadth-first search backwards from the exits.
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
