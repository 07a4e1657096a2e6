//! A policy and a process to what the policy is worth; secondary objectives; values under the condition of success.

use fixedbitset::FixedBitSet;

use crate::mdp::{Mdp, dense};
use crate::number::Number;
use crate::solve::{Direction, NONE, Problem, Solution, solve};

/// The choices that a policy makes.
pub fn choices_of<N: Number>(mdp: &Mdp<N>, policy: &[u32]) -> FixedBitSet {
    let mut allowed = FixedBitSet::with_capacity(mdp.choice_count());
    for choice in policy.iter().filter(|choice| **choice != NONE) {
        allowed.insert(*choice as usize);
    }
    allowed
}

/// What a policy is worth in a problem: its own choices and no others. States for which it makes no choice count as
/// ends without success.
pub fn evaluate<N: Number>(problem: Problem<'_, N>, policy: &[u32]) -> Option<Solution<N>> {
    let allowed = choices_of(problem.mdp, policy);
    solve(Problem { allowed: Some(&allowed), ..problem }, None)
}

/// The choices that keep the value of a solution, at each state where it is finite and positive or costs count.
///
/// With doubles, differences that rounding can explain count as none.
pub fn conserving<N: Number>(problem: &Problem<'_, N>, solution: &Solution<N>) -> FixedBitSet {
    let mdp = problem.mdp;
    let mut kept = FixedBitSet::with_capacity(mdp.choice_count());
    for state in (0..mdp.states()).filter(|state| !problem.is_sink(*state)) {
        if solution.infinite.contains(state) {
            continue;
        }
        let value = &solution.values[state];
        for choice in problem.choices(state) {
            if mdp.targets(choice).iter().any(|target| solution.infinite.contains(*target as usize)) {
                continue;
            }
            let worth = mdp.transitions(choice).fold(problem.reward(choice), |sum, (target, probability)| {
                sum.plus(&probability.times(&solution.values[target]))
            });
            let difference = (worth.to_f64() - value.to_f64()).abs();
            let keeps = if N::EXACT { worth == *value } else { difference <= 1e-9 * value.to_f64() };
            if keeps || solution.policy[state] as usize == choice {
                kept.insert(choice);
            }
        }
    }
    kept
}

/// Makes a policy that is best for a problem best for a second reward, too, among the policies that are best for the first.
///
/// A policy for a probability alone may wander: what it does before or without success costs nothing. The result goes
/// to where the first problem is decided (its end, or states from which nothing can be gained) at the least expected
/// second reward. None where exact arithmetic takes too long, or the first problem's value is that of staying for ever.
pub fn with_secondary<N: Number>(
    problem: &Problem<'_, N>,
    solution: &Solution<N>,
    secondary: &[N],
) -> Option<Solution<N>> {
    let allowed = conserving(problem, solution);
    let mut terminal = problem.terminal.clone();
    terminal.grow(problem.mdp.states());
    if problem.rewards.is_none() {
        if problem.direction == Direction::Min {
            return None;
        }
        for state in 0..problem.mdp.states() {
            if solution.values[state].is_zero() {
                terminal.insert(state);
            }
        }
    } else if problem.direction == Direction::Max {
        return None;
    }
    let second = Problem {
        blocked: problem.blocked,
        allowed: Some(&allowed),
        ..Problem::new(problem.mdp, Direction::Min, Some(secondary), &terminal)
    };
    solve(second, None)
}

/// The chain of a policy under the condition that its end is reached (Doob's transform): each transition is weighted
/// with the probability of success after it. The choices keep the numbers of their order in the result; its second
/// part tells for each choice which one of the process it was.
pub fn conditioned<N: Number>(
    mdp: &Mdp<N>,
    policy: &[u32],
    success: &[N],
    end: &FixedBitSet,
) -> (Mdp<N>, Vec<u32>) {
    let mut result = Mdp::default();
    let mut origin = Vec::new();
    for state in 0..mdp.states() {
        let choice = policy[state];
        if choice != NONE && !end.contains(state) && !success[state].is_zero() {
            for (target, probability) in mdp.transitions(choice as usize) {
                let weighted = probability.times(&success[target]).over(&success[state]);
                if !weighted.is_zero() {
                    result.push_transition(dense(target), weighted);
                }
            }
            if result.end_choice(mdp.action(choice as usize)).is_ok() {
                origin.push(choice);
            }
        }
        result.end_state();
    }
    (result, origin)
}
