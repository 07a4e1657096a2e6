//! A component that is too large for elimination to values with bounds, by iteration from both sides.
//!
//! From below, values are iterated from zero. They are then taken a little higher, and if no equation raises any of them
//! any more they are upper bounds, because end components are merged (optimistic value iteration: Hartmanns and
//! Kaminski, CAV 2020; see also Haddad and Monmege, TCS 735, 2018). Rounding errors are added to what comes from above, and
//! taken off what comes from below, one share for each sweep.

use num_rational::BigRational;

use crate::mdp::dense;
use crate::number::{Number, count};
use crate::solve::local::NONE;
use crate::solve::problem::Direction;
use crate::solve::quotient::Quotient;

/// Policies with values, and how far these can be from the truth.
pub struct Enclosed<N> {
    pub policy: Vec<u32>,
    pub values: Vec<N>,
    /// Empty where arithmetic is exact.
    pub errors: Vec<f64>,
}

/// Rows that are evaluated at most.
const WORK: u64 = 2_000_000_000;
/// Sweeps from above before the values from below are made better.
const UPPER_SWEEPS: usize = 40;

/// Bounds on the values of all blocks whose width is `width`, relative to the value; none where they do not get close in time.
pub fn enclose<N: Number>(quotient: &Quotient<N>, direction: Direction, width: f64) -> Option<Enclosed<N>> {
    let rows = Rows::new(quotient, direction);
    let blocks = quotient.blocks();
    let mut lower = vec![0.0_f64; blocks];
    let mut next = lower.clone();
    let (mut sweeps, mut work, mut threshold) = (0.0_f64, 0_u64, width * 0.05);
    while work < WORK {
        loop {
            // All at once, and not one after the other, so that each sweep adds one rounding error only.
            let change = rows.sweep(&lower, &mut next, 1.0);
            std::mem::swap(&mut lower, &mut next);
            sweeps += 1.0;
            work = work.saturating_add(rows.constants.len() as u64);
            if change <= threshold || work >= WORK {
                break;
            }
        }
        let mut upper: Vec<f64> = lower.iter().map(|value| value * (1.0 + width * 0.5)).collect();
        for _ in 0..UPPER_SWEEPS {
            work = work.saturating_add(rows.constants.len() as u64);
            let before = upper.clone();
            rows.sweep(&before, &mut upper, 1.0 + rows.rounding);
            if upper.iter().zip(&before).all(|(after, before)| after <= before) {
                let rounded = 1.0 - sweeps * rows.rounding * 2.0;
                return Some(rows.enclosed(&lower, &upper, rounded.max(0.0)));
            }
        }
        threshold *= 0.1;
    }
    None
}

/// The rows in doubles.
struct Rows<'a, N> {
    quotient: &'a Quotient<N>,
    direction: Direction,
    constants: Vec<f64>,
    probabilities: Vec<f64>,
    /// The relative error of evaluating one row.
    rounding: f64,
}

impl<'a, N: Number> Rows<'a, N> {
    fn new(quotient: &'a Quotient<N>, direction: Direction) -> Self {
        let rows = &quotient.rows;
        Self {
            quotient,
            direction,
            constants: rows.constants.iter().map(Number::to_f64).collect(),
            probabilities: rows.probabilities.iter().map(Number::to_f64).collect(),
            rounding: (count(quotient.widest) + 16.0) * f64::EPSILON,
        }
    }

    fn apply(&self, row: usize, values: &[f64]) -> f64 {
        self.quotient.rows.range(row).fold(self.constants[row], |sum, at| {
            sum + self.probabilities[at] * values[self.quotient.rows.columns[at] as usize]
        })
    }

    /// The best row of a block with its value; blocks that nothing leaves are worth nothing.
    fn best(&self, block: usize, values: &[f64]) -> (u32, f64) {
        let mut best = (NONE, 0.0);
        for row in self.quotient.range(block) {
            let value = self.apply(row, values);
            let better = match self.direction {
                Direction::Min => value < best.1,
                Direction::Max => value > best.1,
            };
            if best.0 == NONE || better {
                best = (dense(row), value);
            }
        }
        best
    }

    /// All values once more; the greatest relative growth.
    fn sweep(&self, before: &[f64], after: &mut [f64], scale: f64) -> f64 {
        let mut change = 0.0_f64;
        for (block, (before_, after)) in before.iter().zip(after).enumerate() {
            *after = self.best(block, before).1 * scale;
            if *after > *before_ {
                change = change.max((*after - *before_) / *after);
            }
        }
        change
    }

    fn enclosed(&self, lower: &[f64], upper: &[f64], rounded: f64) -> Enclosed<N> {
        // The choices that keep a bound from getting worse have values that are within it.
        let kept = if self.direction == Direction::Min { upper } else { lower };
        let policy = (0..lower.len()).map(|block| self.best(block, kept).0).collect();
        let (mut values, mut errors) = (Vec::new(), Vec::new());
        for (lower, upper) in lower.iter().map(|lower| lower * rounded).zip(upper) {
            let middle = f64::midpoint(lower, *upper);
            let exact = BigRational::from_float(middle).unwrap_or_default();
            values.push(N::from_rational(&exact));
            errors.push((upper - lower) * 0.5 + middle * 4.0 * f64::EPSILON);
        }
        Enclosed { policy, values, errors }
    }
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
            let values = chain::solve_chain(
                &quotient.rows,
                &found.policy,
                |row| quotient.rows.constants[row],
                &mut Work::new(0),
            )
            .expect("each place is left")
            .values;
            let exact = certify(&quotient, &found.policy, &values, direction);
            for ((value, error), (known, rounding)) in
                found.values.iter().zip(&found.errors).zip(values.iter().zip(exact))
            {
                assert!((value - known).abs() <= error + rounding, "{value} ± {error}, not {known}");
                assert!(*error <= 1e-7 * value, "{error} for {value}");
            }
        }
    }
}
