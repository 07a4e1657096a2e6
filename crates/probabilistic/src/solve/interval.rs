//! Interval iteration: bounds the values of components, for example if they are too large for elimination.
//!
//! `enclose` iterates the lower bound from zero. Its values are then increased a little. If no equation raises
//! these values further, they are upper bounds, because end components are merged (optimistic value iteration:
//! Hartmanns and Kaminski, CAV 2020; see also Haddad and Monmege, TCS 735, 2018). `around` instead starts on
//! both sides of approximate values.
//!
//! Each evaluation of an equation is rounded down for the lower bound and up for the upper bound. Therefore an
//! iteration from zero gives valid lower bounds at any time, in any order of the equations. Each sweep uses the
//! values that it has already updated (Gauss-Seidel).

use std::collections::VecDeque;

use crate::mdp::dense;
use crate::number::{Number, count};
use crate::solve::local::NONE;
use crate::solve::problem::Direction;
use crate::solve::quotient::Quotient;
use crate::solve::users::{Users, owners};
use crate::solve::work::Work;

/// An almost optimal policy, with the values of the blocks (merged end components) and bounds on
/// their errors.
pub struct Enclosed<N> {
    pub policy: Vec<u32>,
    pub values: Vec<N>,
    /// Upper bound on the absolute error of each value; empty in exact arithmetic and for a draft.
    pub errors: Vec<f64>,
}

/// Upper limit on the work for one strongly connected component: about the number of evaluated
/// transitions and equations.
const MAX_WORK: u64 = 30_000_000_000;
/// Maximum number of sweeps within which a candidate bound has to be confirmed by the equations.
const UPPER_SWEEPS: usize = 40;
/// Distance of the initial bounds of [`around`] from the approximate values, as a fraction of the required
/// width.
const INITIAL_SHARE: f64 = 0.45;
/// Maximum number of sweeps over the rows of a fixed policy between two sweeps over all rows.
const POLICY_SWEEPS: usize = 25;

/// Computes bounds on the values of all blocks (merged end components) with about the required width
/// ([`Work::tight`]). Returns `None` if [`MAX_WORK`] is exceeded, or if the caller has cancelled the computation.
pub fn enclose<N: Number>(
    quotient: &Quotient<N>,
    direction: Direction,
    work: &mut Work<'_>,
) -> Option<Enclosed<N>> {
    let sorted = Sorted::new(quotient);
    let rows = sorted.rows(quotient, direction);
    let (lower, upper) = rows.iterated(work)?;
    Some(rows.enclosed(quotient, &lower, &upper))
}

/// Computes bounds on the values of all blocks (merged end components) around approximate values `near`.
/// Returns `None` if this does not prove bounds with a width of at most `width` times the value.
pub fn around<N: Number>(
    quotient: &Quotient<N>,
    near: &[N],
    direction: Direction,
    width: f64,
) -> Option<Enclosed<N>> {
    let rows = Rows::of(quotient, direction);
    let (lower, upper) = rows.around(near, width)?;
    Some(rows.enclosed(quotient, &lower, &upper))
}

/// The equations of a component (one row for each choice of a block), in the order in which sweeps
/// evaluate them. A *position* is an index of a block (merged end component) in this order.
struct Rows<'a, N> {
    direction: Direction,
    /// The block at each position, and the number of each row in the quotient (the unsorted equations). `None`
    /// if the equations are not sorted.
    sorted: Option<(&'a [u32], &'a [u32])>,
    /// The first row of each position, followed by the number of rows.
    blocks: &'a [u32],
    first: &'a [u32],
    /// The position of the target block of each transition.
    columns: &'a [u32],
    probabilities: &'a [N],
    constants: &'a [N],
    /// Upper bound on the relative rounding error of evaluating a row.
    rounding: f64,
}

/// A copy of the equations, sorted by the distance of their blocks from an exit of the component,
/// nearest first. Blocks that reach no exit come last.
struct Sorted<N> {
    order: Vec<u32>,
    blocks: Vec<u32>,
    first: Vec<u32>,
    columns: Vec<u32>,
    probabilities: Vec<N>,
    constants: Vec<N>,
    numbers: Vec<u32>,
}

impl<N: Number> Sorted<N> {
    fn new(quotient: &Quotient<N>) -> Self {
        let order = order(quotient);
        let mut positions = vec![0_u32; order.len()];
        for (position, block) in order.iter().enumerate() {
            positions[*block as usize] = dense(position);
        }
        let mut sorted = Self {
            blocks: vec![0],
            first: vec![0],
            columns: Vec::with_capacity(quotient.rows.columns.len()),
            probabilities: Vec::with_capacity(quotient.rows.columns.len()),
            constants: Vec::with_capacity(quotient.rows.len()),
            numbers: Vec::with_capacity(quotient.rows.len()),
            order: Vec::new(),
        };
        for block in &order {
            for row in quotient.range(*block as usize) {
                for at in quotient.rows.range(row) {
                    sorted.columns.push(positions[quotient.rows.columns[at] as usize]);
                    sorted.probabilities.push(quotient.rows.probabilities[at].clone());
                }
                sorted.constants.push(quotient.rows.constants[row].clone());
                sorted.numbers.push(dense(row));
                sorted.first.push(dense(sorted.columns.len()));
            }
            sorted.blocks.push(dense(sorted.constants.len()));
        }
        sorted.order = order;
        sorted
    }

    fn rows(&self, quotient: &Quotient<N>, direction: Direction) -> Rows<'_, N> {
        Rows {
            direction,
            sorted: Some((&self.order, &self.numbers)),
            blocks: &self.blocks,
            first: &self.first,
            columns: &self.columns,
            probabilities: &self.probabilities,
            constants: &self.constants,
            rounding: rounding(quotient),
        }
    }
}

fn rounding<N: Number>(quotient: &Quotient<N>) -> f64 {
    (count(quotient.widest) + 16.0) * f64::EPSILON
}

impl<'a, N: Number> Rows<'a, N> {
    /// Uses the equations without sorting them. Without end components, states that were discovered last come
    /// first; they are usually closest to an exit.
    fn of(quotient: &'a Quotient<N>, direction: Direction) -> Self {
        Self {
            direction,
            sorted: None,
            blocks: &quotient.first,
            first: &quotient.rows.first,
            columns: &quotient.rows.columns,
            probabilities: &quotient.rows.probabilities,
            constants: &quotient.rows.constants,
            rounding: rounding(quotient),
        }
    }

    fn block(&self, position: usize) -> usize {
        self.sorted.map_or(position, |(order, _)| order[position] as usize)
    }

    fn number(&self, row: u32) -> u32 {
        self.sorted.map_or(row, |(_, numbers)| numbers[row as usize])
    }

    fn positions(&self) -> usize {
        self.blocks.len().saturating_sub(1)
    }

    #[expect(clippy::arithmetic_side_effects, reason = "the end is listed, too")]
    fn apply(&self, row: usize, values: &[f64]) -> f64 {
        let range = self.first[row] as usize..self.first[row + 1] as usize;
        let transitions = self.columns[range.clone()].iter().zip(&self.probabilities[range]);
        transitions.fold(self.constants[row].to_f64(), |sum, (column, probability)| {
            sum + probability.to_f64() * values[*column as usize]
        })
    }

    /// Returns the best row (choice) of the block (merged end component) at a position, with its
    /// value. Returns [`NONE`] and 0 for a block without rows, which is never left.
    #[expect(clippy::arithmetic_side_effects, reason = "the end is listed, too")]
    fn best(&self, position: usize, values: &[f64]) -> (u32, f64) {
        let mut best = (NONE, 0.0);
        for row in self.blocks[position]..self.blocks[position + 1] {
            let value = self.apply(row as usize, values);
            let better = match self.direction {
                Direction::Min => value < best.1,
                Direction::Max => value > best.1,
            };
            if best.0 == NONE || better {
                best = (row, value);
            }
        }
        best
    }

    /// Computes lower and upper bounds around approximate values `near`. Returns `None` if the bounds are not
    /// confirmed within [`UPPER_SWEEPS`] sweeps, or if their distance exceeds `width` times the value.
    fn around(&self, near: &[N], width: f64) -> Option<(Vec<f64>, Vec<f64>)> {
        let scaled = |scale: f64| -> Vec<f64> {
            (0..self.positions()).map(|position| near[self.block(position)].to_f64() * scale).collect()
        };
        let (mut lower, mut upper) =
            (scaled(1.0 - width * INITIAL_SHARE), scaled(1.0 + width * INITIAL_SHARE));
        let settles = |values: &mut [f64], moves: &dyn Fn(&mut [f64]) -> bool| {
            (0..UPPER_SWEEPS).any(|_| !moves(values))
        };
        let holds = settles(&mut lower, &|values| self.lowers(values, 1.0 - self.rounding))
            && settles(&mut upper, &|values| self.raises(values, 1.0 + self.rounding));
        let within = lower.iter().zip(&upper).all(|(lower, upper)| upper - lower <= width * lower);
        (holds && within).then_some((lower, upper))
    }

    /// Computes lower bounds by iteration from zero, and upper bounds by increasing the lower bounds slightly
    /// until no equation raises the result. Returns `None` if [`MAX_WORK`] is exceeded, or if the caller has
    /// cancelled the computation.
    fn iterated(&self, polled: &mut Work<'_>) -> Option<(Vec<f64>, Vec<f64>)> {
        let width = polled.tight;
        let (down, up) = (1.0 - self.rounding, 1.0 + self.rounding);
        let entries = self.columns.len().saturating_add(self.constants.len());
        let sweep_work = entries as u64;
        let mut lower = vec![0.0_f64; self.positions()];
        let mut policy = vec![NONE; self.positions()];
        let (mut work, mut threshold) = (0_u64, width * 0.05);
        while work < MAX_WORK {
            loop {
                polled.poll(entries)?;
                let mut change = self.sweep(&mut lower, &mut policy, down);
                work = work.saturating_add(sweep_work);
                // For maximisation, the values of any policy are lower bounds, and sweeps over a
                // single policy are cheaper.
                if self.direction == Direction::Max && change > threshold {
                    polled.poll(entries.saturating_mul(POLICY_SWEEPS))?;
                    for _ in 0..POLICY_SWEEPS {
                        let (growth, evaluated) = self.follow(&mut lower, &policy, down);
                        work = work.saturating_add(evaluated);
                        change = growth;
                        if change <= threshold || work >= MAX_WORK {
                            break;
                        }
                    }
                    // The next sweep over all rows may select other rows for the policy.
                    if work < MAX_WORK {
                        continue;
                    }
                }
                if change <= threshold || work >= MAX_WORK {
                    break;
                }
            }
            let mut upper: Vec<f64> = lower.iter().map(|value| value * (1.0 + width * 0.5)).collect();
            for _ in 0..UPPER_SWEEPS {
                work = work.saturating_add(sweep_work);
                polled.poll(entries)?;
                if !self.raises(&mut upper, up) {
                    return Some((lower, upper));
                }
            }
            // The increased lower bound was no upper bound, because the lower bound was not yet close enough to
            // the value.
            threshold *= 0.1;
        }
        None
    }

    /// Replaces each value by that of its best row times `scale` (which accounts for rounding), and
    /// stores the row in `policy`. Returns the greatest relative increase of a value, or 0 if none
    /// increased.
    fn sweep(&self, values: &mut [f64], policy: &mut [u32], scale: f64) -> f64 {
        let mut change = 0.0_f64;
        for (position, chosen) in policy.iter_mut().enumerate() {
            let (row, value) = self.best(position, values);
            *chosen = row;
            change = change.max(grow(&mut values[position], value * scale));
        }
        change
    }

    /// Updates all values by the rows of a fixed policy. Results are multiplied by `scale` to
    /// account for rounding. Returns the greatest relative growth of a value, and the work (two
    /// units per row).
    fn follow(&self, values: &mut [f64], policy: &[u32], scale: f64) -> (f64, u64) {
        let (mut change, mut work) = (0.0_f64, 0_u64);
        for (position, row) in policy.iter().enumerate().filter(|(_, row)| **row != NONE) {
            let value = self.apply(*row as usize, values) * scale;
            work = work.saturating_add(2);
            change = change.max(grow(&mut values[position], value));
        }
        (change, work)
    }

    /// Updates all values of a candidate upper bound in place. Results are multiplied by `scale` to account for
    /// rounding. Returns `true` if a value was raised. If none was raised, the values are upper bounds, because
    /// further updates would only lower them.
    fn raises(&self, values: &mut [f64], scale: f64) -> bool {
        let mut raised = false;
        for position in 0..values.len() {
            let value = self.best(position, values).1 * scale;
            raised |= value > values[position];
            values[position] = value;
        }
        raised
    }

    /// Updates all values of a candidate lower bound in place. Results are multiplied by `scale` to account for
    /// rounding. Returns `true` if a value was lowered. If none was lowered, the values are lower bounds,
    /// because further updates would only raise them.
    fn lowers(&self, values: &mut [f64], scale: f64) -> bool {
        let mut lowered = false;
        for position in 0..values.len() {
            let value = self.best(position, values).1 * scale;
            lowered |= value < values[position];
            values[position] = value;
        }
        lowered
    }

    fn enclosed(&self, quotient: &Quotient<N>, lower: &[f64], upper: &[f64]) -> Enclosed<N> {
        // The best rows for the upper bound (minimum) or for the lower bound (maximum) form a policy whose
        // values are within both bounds.
        let maintained = if self.direction == Direction::Min { upper } else { lower };
        let blocks = quotient.blocks();
        let mut result = Enclosed {
            policy: vec![NONE; blocks],
            values: vec![N::zero(); blocks],
            errors: vec![0.0; blocks],
        };
        for position in 0..self.positions() {
            let block = self.block(position);
            let (row, _) = self.best(position, maintained);
            result.policy[block] = if row == NONE { NONE } else { self.number(row) };
            let middle = f64::midpoint(lower[position], upper[position]);
            result.values[block] = N::from_f64(middle);
            result.errors[block] = (upper[position] - lower[position]) * 0.5 + middle * 4.0 * f64::EPSILON;
        }
        result
    }
}

fn grow(old: &mut f64, new: f64) -> f64 {
    let change = if new > *old { (new - *old) / new } else { 0.0 };
    *old = new;
    change
}

/// Orders the blocks (merged end components) by the number of rows on a shortest path out of the
/// component (breadth-first search). Blocks without such a path come last.
fn order<N: Number>(quotient: &Quotient<N>) -> Vec<u32> {
    let blocks = quotient.blocks();
    let mut visited = vec![false; blocks];
    let (owners, users) = (owners(&quotient.first), Users::new(&quotient.rows, blocks));
    let mut order = Vec::with_capacity(blocks);
    let mut queue = VecDeque::new();
    for (block, visited) in visited.iter_mut().enumerate() {
        if quotient.range(block).any(|row| !quotient.rows.leaving[row].is_zero()) {
            *visited = true;
            queue.push_back(dense(block));
        }
    }
    while let Some(block) = queue.pop_front() {
        order.push(block);
        for row in users.of(block) {
            let user = owners[*row as usize];
            if !std::mem::replace(&mut visited[user as usize], true) {
                queue.push_back(user);
            }
        }
    }
    order.extend((0..dense(blocks)).filter(|block| !visited[*block as usize]));
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::certify::certify;
    use crate::solve::chain;

    fn square(side: u32) -> Quotient<f64> {
        let mut quotient =
            Quotient { first: vec![0], rows: chain::Rows::new(), choices: Vec::new(), widest: 4 };
        for place in 0..side * side {
            let (x, y) = (place % side, place / side);
            for choice in 0..2_u32 {
                let step = |x: u32, y: u32| (y % side) * side + x % side;
                let targets =
                    [step(x + 1, y), step(x, y + 1 + choice), step(x + side - 1, y + side - choice)];
                let shares = if choice == 0 { [0.5, 0.28, 0.2] } else { [0.2, 0.5, 0.28] };
                for (target, share) in targets.into_iter().zip(shares) {
                    quotient.rows.columns.push(target);
                    quotient.rows.probabilities.push(share);
                }
                quotient.rows.end(f64::from(1 + (place * 7 + choice * 3) % 11), 0.02);
                quotient.choices.push(place * 2 + choice);
            }
            quotient.first.push(place * 2 + 2);
        }
        quotient
    }

    #[test]
    fn bounds_enclose_the_values_of_elimination() {
        for direction in [Direction::Min, Direction::Max] {
            let quotient = square(12);
            let enclosed = enclose(&quotient, direction, &mut Work::new(0)).expect("it converges");
            let chain = chain::Chain { rows: &quotient.rows, policy: &enclosed.policy, costs: None };
            let values = chain.solve(&mut Work::new(0)).expect("each place is left").values;
            let exact = certify(&quotient, &enclosed.policy, &values, direction);
            let near = around(&quotient, &values, direction, 1e-7).expect("they are close");
            for ((value, error), (expected, rounding)) in
                near.values.iter().zip(&near.errors).zip(values.iter().zip(&exact))
            {
                assert!((value - expected).abs() <= error + rounding, "{value} ± {error}, not {expected}");
                assert!(*error <= 0.5e-7 * value, "{error} for {value}");
            }
            for factor in [0.99, 1.01] {
                let far: Vec<f64> = values.iter().map(|value| value * factor).collect();
                assert!(around(&quotient, &far, direction, 1e-7).is_none(), "values that are not close");
            }
            for ((value, error), (expected, rounding)) in
                enclosed.values.iter().zip(&enclosed.errors).zip(values.iter().zip(exact))
            {
                assert!((value - expected).abs() <= error + rounding, "{value} ± {error}, not {expected}");
                assert!(*error <= 1e-7 * value, "{error} for {value}");
            }
        }
    }
}
