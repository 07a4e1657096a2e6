//! Values after a bounded number of steps: repeated application of the equations.

use crate::number::{Number, count};
use crate::solve::{Direction, EXACT_WORK, Problem};

/// Applies the equations of all states so many times, starting with `values`. Those of the states at which the problem ends
/// do not change. The second result bounds the rounding error. None where exact arithmetic takes too long.
pub fn apply<N: Number>(problem: Problem<'_, N>, mut values: Vec<N>, steps: u32) -> Option<(Vec<N>, f64)> {
    let mdp = problem.mdp;
    let (mut widest, mut work) = (1, 0_u64);
    for _ in 0..steps {
        let mut next = values.clone();
        for state in (0..mdp.states()).filter(|state| !problem.is_sink(*state)) {
            let mut best: Option<N> = None;
            for choice in problem.choices(state) {
                widest = widest.max(mdp.targets(choice).len());
                let start = problem.reward(choice);
                let value = mdp
                    .transitions(choice)
                    .fold(start, |sum, (target, p)| sum.plus(&p.times(&values[target])));
                // Fractions are reduced, which takes the square of their length.
                if N::EXACT {
                    let square = value.size().saturating_mul((value.size() / 64).saturating_add(1));
                    work = u64::saturating_add(work, square);
                }
                let better = best.as_ref().is_none_or(|best| match problem.direction {
                    Direction::Min => value < *best,
                    Direction::Max => value > *best,
                });
                if better {
                    best = Some(value);
                }
            }
            if let Some(best) = best {
                next[state] = best;
            }
            if work > EXACT_WORK {
                return None;
            }
        }
        let settled = next == values;
        values = next;
        if settled {
            break;
        }
    }
    let greatest = values.iter().map(Number::to_f64).fold(0.0, f64::max);
    // Values that settle may do so because of rounding, so that all steps count.
    let error =
        if N::EXACT { 0.0 } else { f64::from(steps) * (count(widest) + 2.0) * f64::EPSILON * greatest };
    Some((values, error))
}
