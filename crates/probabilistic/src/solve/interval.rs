//! A component that is too large for elimination to values with bounds, by iteration from both sides.
//!
//! From below, values are iterated from zero. They are then taken a little higher, and if no equation raises any of them
//! any more they are upper bounds, because end components are merged (optimistic value iteration: Hartmanns and
//! Kaminski, CAV 2020; see also Haddad and Monmege, TCS 735, 2018). Each evaluation of an equation is rounded towards its side, so
//! that every value is a bound at any time, in whichever order the equations are taken: each uses what those before it in
//! the same sweep have found (Gauss-Seidel), and the blocks that are left soonest come first.

use std::collections::VecDeque;

use crate::mdp::dense;
use crate::number::{Number, count};
use crate::solve::local::NONE;
use crate::solve::problem::Direction;
use crate::solve::quotient::Quotient;
use crate::solve::users::{Users, owners};

/// Policies with values, and how far these can be from the truth.
pub struct Enclosed<N> {
    pub policy: Vec<u32>,
    pub values: Vec<N>,
    /// Empty where arithmetic is exact.
    pub errors: Vec<f64>,
}

/// Transitions that are looked at, at most.
const WORK: u64 = 30_000_000_000;
/// Sweeps from above before the values from below are made better.
const UPPER_SWEEPS: usize = 40;
/// How far bounds are taken from values that are close already, as a share of the width that is asked for.
const NEAR: f64 = 0.45;
/// Sweeps over the rows of one policy between two sweeps over all rows.
const POLICY_SWEEPS: usize = 25;

/// Bounds on the values of all blocks whose width is `width`, relative to the value; none where they do not get close in time.
pub fn enclose<N: Number>(quotient: &Quotient<N>, direction: Direction, width: f64) -> Option<Enclosed<N>> {
    let sorted = Sorted::new(quotient);
    let rows = sorted.rows(quotient, direction);
    let (lower, upper) = rows.iterated(width)?;
    Some(rows.enclosed(quotient, &lower, &upper))
}

/// The same around values that are close already; none where they are not close enough.
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

/// Rows in the order in which they are swept.
struct Rows<'a, N> {
    direction: Direction,
    /// The block at each place of the order, and the number of each row in the component; none where they are in their own order.
    sorted: Option<(&'a [u32], &'a [u32])>,
    /// For each place its first row, and the end.
    blocks: &'a [u32],
    /// For each row its first transition, and the end.
    first: &'a [u32],
    /// Places that rows lead to.
    columns: &'a [u32],
    probabilities: &'a [N],
    constants: &'a [N],
    /// The relative error of evaluating one row.
    rounding: f64,
}

/// Rows by the order in which blocks are left.
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
        let mut places = vec![0_u32; order.len()];
        for (place, block) in order.iter().enumerate() {
            places[*block as usize] = dense(place);
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
                    sorted.columns.push(places[quotient.rows.columns[at] as usize]);
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
    /// The rows as they stand: states that were found last come first, and these are mostly left soonest.
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

    fn block(&self, place: usize) -> usize {
        self.sorted.map_or(place, |(order, _)| order[place] as usize)
    }

    fn number(&self, row: u32) -> u32 {
        self.sorted.map_or(row, |(_, numbers)| numbers[row as usize])
    }

    fn places(&self) -> usize {
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

    /// The best row of a place with its value; places that nothing leaves are worth nothing.
    #[expect(clippy::arithmetic_side_effects, reason = "the end is listed, too")]
    fn best(&self, place: usize, values: &[f64]) -> (u32, f64) {
        let mut best = (NONE, 0.0);
        for row in self.blocks[place]..self.blocks[place + 1] {
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

    /// Bounds around values that are close already, by the same argument from both sides.
    fn around(&self, near: &[N], width: f64) -> Option<(Vec<f64>, Vec<f64>)> {
        let scaled = |scale: f64| -> Vec<f64> {
            (0..self.places()).map(|place| near[self.block(place)].to_f64() * scale).collect()
        };
        let (mut lower, mut upper) = (scaled(1.0 - width * NEAR), scaled(1.0 + width * NEAR));
        let settles = |values: &mut [f64], moves: &dyn Fn(&mut [f64]) -> bool| {
            (0..UPPER_SWEEPS).any(|_| !moves(values))
        };
        let holds = settles(&mut lower, &|values| self.lowers(values, 1.0 - self.rounding))
            && settles(&mut upper, &|values| self.raises(values, 1.0 + self.rounding));
        let within = lower.iter().zip(&upper).all(|(lower, upper)| upper - lower <= width * lower);
        (holds && within).then_some((lower, upper))
    }

    /// Bounds by iteration from zero.
    fn iterated(&self, width: f64) -> Option<(Vec<f64>, Vec<f64>)> {
        let (down, up) = (1.0 - self.rounding, 1.0 + self.rounding);
        let all = self.columns.len().saturating_add(self.constants.len()) as u64;
        let mut lower = vec![0.0_f64; self.places()];
        let mut policy = vec![NONE; self.places()];
        let (mut work, mut threshold) = (0_u64, width * 0.05);
        while work < WORK {
            loop {
                let mut change = self.sweep(&mut lower, &mut policy, down);
                work = work.saturating_add(all);
                // Some policy is not better than the best one, and so its values are lower bounds where the greatest ones are asked for.
                if self.direction == Direction::Max && change > threshold {
                    for _ in 0..POLICY_SWEEPS {
                        let (grown, looked) = self.follow(&mut lower, &policy, down);
                        work = work.saturating_add(looked);
                        change = grown;
                        if change <= threshold || work >= WORK {
                            break;
                        }
                    }
                    // What other rows are worth is seen by the next sweep.
                    continue;
                }
                if change <= threshold || work >= WORK {
                    break;
                }
            }
            let mut upper: Vec<f64> = lower.iter().map(|value| value * (1.0 + width * 0.5)).collect();
            for _ in 0..UPPER_SWEEPS {
                work = work.saturating_add(all);
                if !self.raises(&mut upper, up) {
                    return Some((lower, upper));
                }
            }
            threshold *= 0.1;
        }
        None
    }

    /// All values once more, and the rows that give them; the greatest relative growth.
    fn sweep(&self, values: &mut [f64], policy: &mut [u32], scale: f64) -> f64 {
        let mut change = 0.0_f64;
        for (place, chosen) in policy.iter_mut().enumerate() {
            let (row, value) = self.best(place, values);
            *chosen = row;
            change = change.max(grow(&mut values[place], value * scale));
        }
        change
    }

    /// All values once more by the rows of a policy; the greatest relative growth, and how many transitions were looked at.
    fn follow(&self, values: &mut [f64], policy: &[u32], scale: f64) -> (f64, u64) {
        let (mut change, mut looked) = (0.0_f64, 0_u64);
        for (place, row) in policy.iter().enumerate().filter(|(_, row)| **row != NONE) {
            let value = self.apply(*row as usize, values) * scale;
            looked = looked.saturating_add(2);
            change = change.max(grow(&mut values[place], value));
        }
        (change, looked)
    }

    /// All values once more from above; whether any is raised. If none is, they are upper bounds: each equation was taken with values that
    /// are at least as great as those that are left.
    fn raises(&self, values: &mut [f64], scale: f64) -> bool {
        let mut raised = false;
        for place in 0..values.len() {
            let value = self.best(place, values).1 * scale;
            raised |= value > values[place];
            values[place] = value;
        }
        raised
    }

    /// All values once more from below; whether any is lowered. If none is, they are lower bounds: no equation lowers them, and from the
    /// rows that were taken, which are left for sure, they only grow towards what these are worth.
    fn lowers(&self, values: &mut [f64], scale: f64) -> bool {
        let mut lowered = false;
        for place in 0..values.len() {
            let value = self.best(place, values).1 * scale;
            lowered |= value < values[place];
            values[place] = value;
        }
        lowered
    }

    fn enclosed(&self, quotient: &Quotient<N>, lower: &[f64], upper: &[f64]) -> Enclosed<N> {
        // The choices that keep a bound from getting worse have values that are within it.
        let kept = if self.direction == Direction::Min { upper } else { lower };
        let blocks = quotient.blocks();
        let mut found = Enclosed {
            policy: vec![NONE; blocks],
            values: vec![N::zero(); blocks],
            errors: vec![0.0; blocks],
        };
        for place in 0..self.places() {
            let block = self.block(place);
            let (row, _) = self.best(place, kept);
            found.policy[block] = if row == NONE { NONE } else { self.number(row) };
            let middle = f64::midpoint(lower[place], upper[place]);
            found.values[block] = N::from_f64(middle);
            found.errors[block] = (upper[place] - lower[place]) * 0.5 + middle * 4.0 * f64::EPSILON;
        }
        found
    }
}

/// Writes a value; how much it has grown, relative to itself.
fn grow(old: &mut f64, new: f64) -> f64 {
    let change = if new > *old { (new - *old) / new } else { 0.0 };
    *old = new;
    change
}

/// The blocks in the order in which they are left, by rows that lead out soonest; those that nothing leaves come last.
fn order<N: Number>(quotient: &Quotient<N>) -> Vec<u32> {
    let blocks = quotient.blocks();
    let mut seen = vec![false; blocks];
    let (owners, users) = (owners(&quotient.first), Users::new(&quotient.rows, blocks));
    let mut order = Vec::with_capacity(blocks);
    let mut queue = VecDeque::new();
    for (block, seen) in seen.iter_mut().enumerate() {
        if quotient.range(block).any(|row| !quotient.rows.leaving[row].is_zero()) {
            *seen = true;
            queue.push_back(dense(block));
        }
    }
    while let Some(block) = queue.pop_front() {
        order.push(block);
        for row in users.of(block) {
            let user = owners[*row as usize];
            if !std::mem::replace(&mut seen[user as usize], true) {
                queue.push_back(user);
            }
        }
    }
    order.extend((0..dense(blocks)).filter(|block| !seen[*block as usize]));
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::certify::certify;
    use crate::solve::chain;
    use crate::solve::work::Work;

    /// A walk over a square with two choices in each place, which is left with probability 1/50 at each step.
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
    fn bounds_enclose_what_elimination_finds() {
        for direction in [Direction::Min, Direction::Max] {
            let quotient = square(12);
            let found = enclose(&quotient, direction, 1e-7).expect("it converges");
            let chain = chain::Chain { rows: &quotient.rows, policy: &found.policy, costs: None };
            let values = chain.solve(&mut Work::new(0)).expect("each place is left").values;
            let exact = certify(&quotient, &found.policy, &values, direction);
            let near = around(&quotient, &values, direction, 1e-7).expect("they are close");
            for ((value, error), (known, rounding)) in
                near.values.iter().zip(&near.errors).zip(values.iter().zip(&exact))
            {
                assert!((value - known).abs() <= error + rounding, "{value} ± {error}, not {known}");
                assert!(*error <= 0.5e-7 * value, "{error} for {value}");
            }
            for factor in [0.99, 1.01] {
                let far: Vec<f64> = values.iter().map(|value| value * factor).collect();
                assert!(around(&quotient, &far, direction, 1e-7).is_none(), "values that are not close");
            }
            for ((value, error), (known, rounding)) in
                found.values.iter().zip(&found.errors).zip(values.iter().zip(exact))
            {
                assert!((value - known).abs() <= error + rounding, "{value} ± {error}, not {known}");
                assert!(*error <= 1e-7 * value, "{error} for {value}");
            }
        }
    }
}
