//! Values after a bounded number of steps: repeated application of the equations.

use fixedbitset::FixedBitSet;

use crate::mdp::Mdp;
use crate::number::Number;
use crate::solve::Direction;

/// Applies the equations of all states so many times, starting with `values`. The values of states in `fixed` do not
/// change. The second result bounds the rounding error.
pub fn apply<N: Number>(
    mdp: &Mdp<N>,
    direction: Direction,
    rewards: Option<&[N]>,
    fixed: &FixedBitSet,
    mut values: Vec<N>,
    steps: u64,
) -> (Vec<N>, f64) {
    let (mut widest, mut taken) = (1, 0);
    for _ in 0..steps {
        let mut next = values.clone();
        for state in (0..mdp.states()).filter(|state| !fixed.contains(*state)) {
            let mut best: Option<N> = None;
            for choice in mdp.choices(state) {
                widest = widest.max(mdp.targets(choice).len());
                let start = rewards.map_or_else(N::zero, |rewards| rewards[choice].clone());
                let value = mdp
                    .transitions(choice)
                    .fold(start, |sum, (target, p)| sum.plus(&p.times(&values[target])));
                let better = best.as_ref().is_none_or(|best| match direction {
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
        taken += 1;
        let settled = next == values;
        values = next;
        if settled {
            break;
        }
    }
    let greatest = values.iter().map(Number::to_f64).fold(0.0, f64::max);
    let error = if N::EXACT { 0.0 } else { (taken * (widest + 2)) as f64 * f64::EPSILON * greatest };
    (values, error)
}
