//! Step-bounded values by value iteration, i.e. repeated application of the Bellman operator.

use crate::number::{Number, count};
use crate::solve::{Direction, Problem, Work};

/// Underflow threshold: positive products below this value may lose relative precision. The absolute error caused by
/// such a loss is less than the threshold.
pub const UNDERFLOW_THRESHOLD: f64 = 1e-280;

pub struct Stepped<N> {
    pub values: Vec<N>,
    /// Upper limit on the rounding error of each value, relative to the value.
    pub relative: f64,
    /// Whether a value was below the underflow threshold, so that an absolute error is added.
    pub lost: bool,
}

impl<N: Number> Stepped<N> {
    pub fn error(&self, state: usize) -> f64 {
        let value = self.values[state].to_f64();
        value * self.relative + if self.lost { UNDERFLOW_THRESHOLD } else { 0.0 }
    }
}

/// Applies the Bellman operator `steps` times, starting with `values`. The values of terminal and
/// blocked states do not change. In another state without an allowed choice, a path ends, so the value of a further step
/// is 0. Returns `None` if exact arithmetic exceeds its budget, or if the caller has cancelled the computation.
///
/// All operands are nonnegative, so each step increases the relative error of a value by a
/// bounded amount.
pub fn apply<N: Number>(
    problem: Problem<'_, N>,
    mut values: Vec<N>,
    steps: u32,
    work: &mut Work<'_>,
) -> Option<Stepped<N>> {
    let mdp = problem.mdp;
    let (mut widest, mut lost) = (1, false);
    // Exact arithmetic is slower, so the callback is called after fewer transitions.
    let entries = mdp.transition_count().saturating_mul(if N::EXACT { 64 } else { 1 });
    for _ in 0..steps {
        // Exploration of a tiny process ends at once, but its steps can take hours.
        work.poll(entries)?;
        let mut next = values.clone();
        for state in (0..mdp.states()).filter(|state| !problem.is_sink(*state)) {
            let mut best: Option<N> = None;
            for choice in problem.choices(state) {
                widest = widest.max(mdp.targets(choice).len());
                let start = problem.reward(choice);
                let value = mdp
                    .transitions(choice)
                    .fold(start, |sum, (target, p)| sum.plus(&p.times(&values[target])));
                lost |= !N::EXACT
                    && value.to_f64() < UNDERFLOW_THRESHOLD
                    && mdp.targets(choice).iter().any(|target| !values[*target as usize].is_zero());
                work.spend(&value, mdp.targets(choice).len())?;
                let better = best.as_ref().is_none_or(|best| match problem.direction {
                    Direction::Min => value < *best,
                    Direction::Max => value > *best,
                });
                if better {
                    best = Some(value);
                }
            }
            next[state] = best.unwrap_or_else(N::zero);
        }
        let settled = next == values;
        values = next;
        if settled {
            break;
        }
    }
    // Values may only seem stationary because of rounding, so the error bound counts all steps.
    let relative = if N::EXACT { 0.0 } else { f64::from(steps) * (count(widest) + 4.0) * f64::EPSILON };
    Some(Stepped { values, relative, lost })
}
