//! Problems, solutions, and the working state of the solver.

use fixedbitset::FixedBitSet;

use crate::mdp::Mdp;
use crate::number::{Number, enclosing};
use crate::solve::work::Work;

/// The direction of optimisation over all policies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// The least value over all policies.
    Min,
    /// The greatest value over all policies.
    Max,
}

/// An optimisation problem on a Markov decision process.
///
/// Without rewards, the value of a state is the expected value of the first terminal state on a path; a path without
/// terminal states counts as 0. With rewards, the value is the expected sum of rewards until a terminal state, plus
/// the value of this terminal state. The sum is infinite if a terminal state is reached with a probability below 1.
#[derive(Debug)]
pub struct Problem<'a, N> {
    /// The Markov decision process.
    pub mdp: &'a Mdp<N>,
    /// Direction of optimisation.
    pub direction: Direction,
    /// Reward of each choice, at least 0; `None` for a problem without rewards.
    pub rewards: Option<&'a [N]>,
    /// The states in which a path ends.
    pub terminal: &'a FixedBitSet,
    /// The values of the terminal states, indexed by state. By default, they are 1 without rewards
    /// and 0 with rewards.
    pub terminal_values: Option<&'a [N]>,
    /// States in which a path ends as a failure. Their value is 0 without rewards, and infinite with rewards.
    pub blocked: Option<&'a FixedBitSet>,
    /// The allowed choices; `None` allows all choices. In a nonterminal state without an allowed choice, a path
    /// ends as a failure, as in a blocked state.
    pub allowed: Option<&'a FixedBitSet>,
}

impl<N> Clone for Problem<'_, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<N> Copy for Problem<'_, N> {}

impl<'a, N> Problem<'a, N> {
    /// Creates a problem with default terminal values, without blocked states, and with all choices
    /// allowed.
    pub const fn new(
        mdp: &'a Mdp<N>,
        direction: Direction,
        rewards: Option<&'a [N]>,
        terminal: &'a FixedBitSet,
    ) -> Self {
        Self { mdp, direction, rewards, terminal, terminal_values: None, blocked: None, allowed: None }
    }
}

impl<N: Number> Problem<'_, N> {
    pub(crate) fn is_sink(&self, state: usize) -> bool {
        self.terminal.contains(state) || self.blocked.is_some_and(|blocked| blocked.contains(state))
    }

    pub(crate) fn choices(&self, state: usize) -> impl Iterator<Item = usize> + use<'_, N> {
        self.mdp.choices(state).filter(|choice| self.allowed.is_none_or(|allowed| allowed.contains(*choice)))
    }

    pub(crate) fn reward(&self, choice: usize) -> N {
        self.rewards.map_or_else(N::zero, |rewards| rewards[choice].clone())
    }

    pub(super) fn worth(&self, state: usize) -> N {
        match (self.terminal.contains(state), self.terminal_values) {
            (true, Some(values)) => values[state].clone(),
            (true, None) if self.rewards.is_none() => N::one(),
            (true, None) | (false, _) => N::zero(),
        }
    }
}

/// The values of all states, and a policy that attains them. In doubles, both are approximate.
#[derive(Debug, Clone)]
pub struct Solution<N> {
    /// Value of each state; 0 if the value is infinite.
    pub values: Vec<N>,
    /// Upper bound on the absolute error of each value; empty in exact arithmetic.
    pub errors: Vec<f64>,
    /// The states whose value is infinite.
    pub infinite: FixedBitSet,
    /// The states from which a terminal state is reached with probability 1. For the greatest
    /// probability and the least reward, some policy reaches it; otherwise, all policies do.
    pub sure: FixedBitSet,
    /// The choice of each state. [`NONE`](crate::solve::NONE) if no choice was computed, for example in
    /// terminal states.
    pub policy: Vec<u32>,
}

impl<N: Number> Solution<N> {
    /// Returns a lower and an upper bound on the value of a state, or `None` if the value is infinite. In exact
    /// arithmetic, the bounds are the closest doubles that enclose the value.
    pub fn bounds(&self, state: usize) -> Option<(f64, f64)> {
        if self.infinite.contains(state) {
            return None;
        }
        if let Some(exact) = self.values[state].to_rational() {
            return Some(enclosing(&exact));
        }
        let (value, error) = (self.values[state].to_f64(), self.errors[state]);
        let lower = if error == 0.0 { value } else { (value - error).next_down().max(0.0) };
        Some((lower, if error == 0.0 { value } else { (value + error).next_up() }))
    }
}

/// Products of positive doubles below this limit may have lost digits by underflow. The limit is added to the
/// error of values that depend on such products.
pub(super) const UNDERFLOW_BOUND: f64 = 1e-280;

pub(crate) struct Run<'a, N> {
    pub problem: Problem<'a, N>,
    pub solution: Solution<N>,
    pub hint: Option<&'a [u32]>,
    /// The local number of each state in the current component, or [`NONE`] outside the component.
    pub position: Vec<u32>,
    pub work: Work<'a>,
    /// Whether only a good policy is needed; errors are then not bounded.
    pub draft: bool,
}

impl<N: Number> Run<'_, N> {
    /// Returns `true` if a state counts as sure when some policy reaches a terminal state with probability 1, and
    /// `false` when all policies must do so.
    pub fn sure_by_choice(&self) -> bool {
        self.problem.rewards.is_some() == (self.problem.direction == Direction::Min)
    }

    /// Returns `true` if the value of a sure state, i.e. one that reaches a terminal state with
    /// probability 1, is always 1.
    pub fn sure_is_one(&self) -> bool {
        self.problem.rewards.is_none() && self.problem.terminal_values.is_none()
    }
}
