//! Bounds the error of the values computed by policy iteration, for components of an MDP in doubles.
//!
//! Let v be the computed values, w the greatest expected numbers of steps under almost optimal policies, and δ
//! a small number. For maximisation, v + δw is an upper bound on the true values if applying the equations to
//! v + δw does not increase it. For minimisation, v − δw is a lower bound if applying the equations does not
//! decrease it. This is the inductive argument of Hartmanns and Kaminski, Optimistic Value Iteration, CAV 2020.
//! The computed policy itself proves the bound on the other side, and its error is also at most δw. All checks
//! include rounding errors. If the checks fail, the error is infinite.

use crate::mdp::dense;
use crate::number::{Number, count};
use crate::solve::chain::Chain;
use crate::solve::problem::Direction;
use crate::solve::quotient::Quotient;
use crate::solve::work::Work;

const MAX_ROUNDS: usize = 200;

/// Maximum number of sweeps that improve the policy with the greatest expected number of steps before its chain
/// is solved again.
const SWEEPS: usize = 10;

/// Upper limit on the relative rounding error of evaluating a row (the equation of a choice) that was built
/// from at most `widest` transitions.
pub fn rounding(widest: usize) -> f64 {
    (64.0 + 3.0 * count(widest)) * f64::EPSILON
}

/// Returns an upper bound on the absolute error of the value of each block (merged end component). The bounds
/// are infinite if they cannot be proved. Errors in the values of successors outside the component are not
/// included.
pub fn certify<N: Number>(
    quotient: &Quotient<N>,
    policy: &[u32],
    values: &[N],
    direction: Direction,
) -> Vec<f64> {
    let blocks = values.len();
    let v: Vec<f64> = values.iter().map(Number::to_f64).collect();
    let rows: Vec<f64> =
        (0..quotient.choices.len()).map(|row| quotient.rows.apply(row, values).to_f64()).collect();
    let relative = rounding(quotient.widest);
    let row_error = |row: usize| relative * rows[row];
    // Amount by which a row is worse than the computed value of its block; negative if the row is better.
    let loss = |block: usize, row: usize| match direction {
        Direction::Min => rows[row] - v[block],
        Direction::Max => v[block] - rows[row],
    };
    if blocks == 1 {
        // With a single block, the value of a row does not depend on other rows. Policy iteration may have
        // ignored a row that is better by less than its tolerance.
        let (better, rounding) = (0..rows.len()).fold((0.0_f64, 0.0_f64), |(better, rounding), row| {
            let near = loss(0, row) <= v[0];
            (better.max(-loss(0, row)), if near { rounding.max(row_error(row)) } else { rounding })
        });
        return vec![better + rounding];
    }
    // A smaller threshold gives a smaller w (see the head of this file), but leaves less slack for the other
    // rows, whose loss exceeds the threshold.
    for threshold in [1e-8, 1e-12] {
        let is_near = |block: usize, row: usize| {
            loss(block, row) <= threshold * v[block].max(1e-12) || policy[block] as usize == row
        };
        let near = (0..blocks).flat_map(|block| quotient.range(block).map(move |row| (block, row)));
        let near: Vec<bool> = near.map(|(block, row)| is_near(block, row)).collect();
        let Some(steps) = greatest_steps(quotient, policy, &near) else { continue };
        let value_rounding = |block: usize| 4.0 * f64::EPSILON * v[block];
        let mut delta = 0.0_f64;
        for (block, chosen) in policy.iter().enumerate() {
            for row in quotient.range(block).filter(|row| near[*row]) {
                let rounding = row_error(row) + value_rounding(block);
                delta = delta.max(rounding - loss(block, row));
                if *chosen as usize == row {
                    delta = delta.max(rounding + loss(block, row));
                }
            }
        }
        // The check needs a δ that is greater than the least one that covers the rounding errors.
        delta *= 2.0;
        let holds = (0..blocks).all(|block| {
            quotient.range(block).all(|row| {
                let steps_after = steps_after(quotient, row, &steps);
                let growth =
                    delta * (steps_after - steps[block]) + delta * 1e-9 * (steps_after + steps[block]);
                // The row of the policy proves the bound on the other side, too.
                let loss = loss(block, row);
                let least_loss = if policy[block] as usize == row { -loss.abs() } else { loss };
                least_loss - row_error(row) - value_rounding(block) >= growth
            })
        });
        if holds {
            return steps.iter().map(|steps| delta * steps * (1.0 + 1e-9)).collect();
        }
    }
    vec![f64::INFINITY; blocks]
}

fn steps_after<N: Number>(quotient: &Quotient<N>, row: usize, steps: &[f64]) -> f64 {
    let range = quotient.rows.range(row);
    let transitions = quotient.rows.columns[range.clone()].iter().zip(&quotient.rows.probabilities[range]);
    transitions.map(|(column, probability)| probability.to_f64() * steps[*column as usize]).sum()
}

/// Returns the greatest expected number of steps from each block (merged end component) until the
/// run leaves the component, over policies that use only the rows in `near`. Returns `None` if a number is
/// infinite, or if the numbers are not found within the limits.
fn greatest_steps<N: Number>(quotient: &Quotient<N>, policy: &[u32], near: &[bool]) -> Option<Vec<f64>> {
    let rows = &quotient.rows;
    let mut policy = policy.to_vec();
    for _ in 0..MAX_ROUNDS {
        let chain = Chain { rows, policy: &policy, costs: Some(N::one()) };
        let steps = chain.solve(&mut Work::new(0))?.values;
        let mut steps: Vec<f64> = steps.iter().map(Number::to_f64).collect();
        if steps.iter().any(|steps| !steps.is_finite()) {
            return None;
        }
        let mut changed = false;
        for _ in 0..SWEEPS {
            if !lengthen(quotient, near, &mut policy, &mut steps) {
                break;
            }
            changed = true;
        }
        if !changed {
            return Some(steps);
        }
    }
    None
}

/// Switches each block to a row of `near` with a clearly greater expected number of steps if there is one, and
/// updates `steps`. Returns `true` if a row was switched.
fn lengthen<N: Number>(quotient: &Quotient<N>, near: &[bool], policy: &mut [u32], steps: &mut [f64]) -> bool {
    let mut changed = false;
    for (block, chosen) in policy.iter_mut().enumerate() {
        for row in quotient.range(block).filter(|row| near[*row]) {
            let longer = steps_after(quotient, row, steps) + 1.0;
            // The margin prevents endless switches between rows that are equal up to rounding.
            if *chosen as usize != row && longer > steps[block] + 0.01 {
                steps[block] = longer;
                *chosen = dense(row);
                changed = true;
            }
        }
    }
    changed
}
