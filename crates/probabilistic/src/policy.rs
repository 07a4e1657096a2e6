//! Evaluates policies, breaks ties by a secondary reward, and conditions a policy on success.

use fixedbitset::FixedBitSet;

use crate::mdp::{Mdp, dense};
use crate::number::Number;
use crate::solve::{Direction, NONE, Problem, Solution, solve};

/// Returns the set of the choices that a policy makes in any state.
pub fn choices_of<N: Number>(mdp: &Mdp<N>, policy: &[u32]) -> FixedBitSet {
    let mut allowed = FixedBitSet::with_capacity(mdp.choice_count());
    for choice in policy.iter().filter(|choice| **choice != NONE) {
        allowed.insert(*choice as usize);
    }
    allowed
}

/// Evaluates a policy in a problem. In a state in which the policy has no choice, a path ends without success.
/// Returns `None` if exact arithmetic exceeds its budget.
pub fn evaluate<N: Number>(problem: Problem<'_, N>, policy: &[u32]) -> Option<Solution<N>> {
    let allowed = choices_of(problem.mdp, policy);
    solve(Problem { allowed: Some(&allowed), ..problem }, None)
}

/// Relative difference of doubles up to which values of choices or policies count as equal.
const TIE_TOLERANCE: f64 = 1e-9;

/// Returns `true` if a policy is optimal with respect to a solution: in all states with a finite value, the values of the
/// policy are equal to those of the solution. In doubles, they may differ by the errors of both and a relative tolerance.
///
/// Returns `None` if exact arithmetic exceeds its budget.
pub(crate) fn attains<N: Number>(
    problem: Problem<'_, N>,
    policy: &[u32],
    solution: &Solution<N>,
) -> Option<bool> {
    let attained = evaluate(problem, policy)?;
    let is_equal = |state: usize| {
        if attained.infinite.contains(state) {
            return false;
        }
        let (value, optimum) = (&attained.values[state], &solution.values[state]);
        let difference = (value.to_f64() - optimum.to_f64()).abs();
        let tolerance = || attained.errors[state] + solution.errors[state] + TIE_TOLERANCE * optimum.to_f64();
        if N::EXACT { value == optimum } else { difference <= tolerance() }
    };
    let mut finite = (0..problem.mdp.states()).filter(|state| !solution.infinite.contains(*state));
    Some(finite.all(is_equal))
}

/// Returns the optimal choices with respect to a solution, in the states that have a finite value and are
/// neither terminal nor blocked.
///
/// In doubles, choices within a tolerance of the optimum count as optimal, so a policy of such choices may lose more than
/// the tolerance over many steps. The choices of the solution's policy count in any case.
pub fn conserving<N: Number>(problem: &Problem<'_, N>, solution: &Solution<N>) -> FixedBitSet {
    let mdp = problem.mdp;
    let mut optimal = FixedBitSet::with_capacity(mdp.choice_count());
    for state in (0..mdp.states()).filter(|state| !problem.is_sink(*state)) {
        if solution.infinite.contains(state) {
            continue;
        }
        let value = &solution.values[state];
        for choice in problem.choices(state) {
            // The value is finite, so a choice with a possibly infinite value is not optimal.
            if mdp.targets(choice).iter().any(|target| solution.infinite.contains(*target as usize)) {
                continue;
            }
            let worth = mdp.transitions(choice).fold(problem.reward(choice), |sum, (target, probability)| {
                sum.plus(&probability.times(&solution.values[target]))
            });
            let difference = (worth.to_f64() - value.to_f64()).abs();
            let keeps = if N::EXACT { worth == *value } else { difference <= TIE_TOLERANCE * value.to_f64() };
            if keeps || solution.policy[state] as usize == choice {
                optimal.insert(choice);
            }
        }
    }
    optimal
}

/// Minimises a secondary reward over the policies that consist of [optimal choices](conserving) for a problem.
///
/// A policy that maximises a probability may contain cycles before success or after failure, which
/// do not change the probability. The resulting policy instead reaches a terminal state or a state
/// of value 0 with the least expected secondary reward.
///
/// Returns `None` if exact arithmetic exceeds its budget, or if an optimal policy may have to
/// continue forever (a minimal probability or a maximal reward).
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

/// Returns the Markov chain of a policy, conditioned on reaching `end` (Doob's h-transform): each transition is
/// weighted with `success`, the probability of reaching `end`, of its target. Also returns the original choice
/// of each choice in the result.
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
