//! Values after a bounded number of steps: repeated application of the equations.

use crate::number::{Number, count};
use crate::solve::{Direction, Problem, Work};

/// Products of positive doubles below lose digits; values that are made of them are off by no more than this.
const TINY: f64 = 1e-280;

/// Values after some steps.
pub struct Stepped<N> {
    /// For each state its value.
    pub values: Vec<N>,
    /// How far they can be from the truth, relative to each.
    pub relative: f64,
    /// Whether products became too small for doubles.
    pub lost: bool,
}

impl<N: Number> Stepped<N> {
    /// How far the value of a state can be from the truth.
    pub fn error(&self, state: usize) -> f64 {
        let value = self.values[state].to_f64();
        value * self.relative + if self.lost { TINY } else { 0.0 }
    }
}

/// Applies the equations of all states so many times, starting with `values`. Those of the states at which the problem ends
/// do not change. None where exact arithmetic takes too long.
///
/// All that is added and multiplied is positive, so that each step makes the error of a value a little greater, relative to
/// that value.
pub fn apply<N: Number>(
    problem: Problem<'_, N>,
    mut values: Vec<N>,
    steps: u32,
    work: &mut Work,
) -> Option<Stepped<N>> {
    let mdp = problem.mdp;
    let (mut widest, mut lost) = (1, false);
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
                lost |= !N::EXACT
                    && value.to_f64() < TINY
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
            if let Some(best) = best {
                next[state] = best;
            }
        }
        let settled = next == values;
        values = next;
        if settled {
            break;
        }
    }
    // Values that settle may do so because of rounding, so that all steps count.
    let relative = if N::EXACT { 0.0 } else { f64::from(steps) * (count(widest) + 4.0) * f64::EPSILON };
    Some(Stepped { values, relative, lost })
}
