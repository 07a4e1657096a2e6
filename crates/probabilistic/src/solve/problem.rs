//! Problems, solutions, and the state of the solver.

use fixedbitset::FixedBitSet;

use crate::mdp::Mdp;
use crate::number::{Number, enclosing};
use crate::solve::work::Work;

/// Direction of optimisation over all policies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// The least value.
    Min,
    /// The greatest value.
    Max,
}

/// A query on a process.
///
/// Without rewards, the value of a state is the expected value of the first terminal state that is reached, or 0 on paths
/// that reach none. With rewards, it is the expected sum of rewards until then, infinite if possibly none is reached.
#[derive(Debug)]
pub struct Problem<'a, N> {
    /// The process.
    pub mdp: &'a Mdp<N>,
    /// Direction of optimisation.
    pub direction: Direction,
    /// Reward of each choice, at least 0.
    pub rewards: Option<&'a [N]>,
    /// The terminal states.
    pub terminal: &'a FixedBitSet,
    /// Value of each terminal state, by state. The default is 1 without rewards, and 0 with rewards.
    pub terminal_values: Option<&'a [N]>,
    /// States that count as failures: nothing after them counts.
    pub blocked: Option<&'a FixedBitSet>,
    /// The allowed choices; `None` allows all. Each nonterminal state needs an allowed choice.
    pub allowed: Option<&'a FixedBitSet>,
}

impl<N> Clone for Problem<'_, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<N> Copy for Problem<'_, N> {}

impl<'a, N> Problem<'a, N> {
    /// Creates a problem with default terminal values, in which all choices are allowed.
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

/// The values of all states.
#[derive(Debug, Clone)]
pub struct Solution<N> {
    /// Value of each state; 0 if the value is infinite.
    pub values: Vec<N>,
    /// Bound on the absolute error of each value; empty in exact arithmetic.
    pub errors: Vec<f64>,
    /// The states whose value is infinite.
    pub infinite: FixedBitSet,
    /// The states from which a terminal state is reached with probability 1: under some policy for the greatest probability
    /// and the least reward, under all policies otherwise.
    pub sure: FixedBitSet,
    /// Choice of each state, or [`NONE`](crate::solve::NONE) if the state needs no choice.
    pub policy: Vec<u32>,
}

impl<N: Number> Solution<N> {
    /// Bounds that enclose the true value of a state; the enclosing doubles in exact arithmetic. `None` if the value is
    /// infinite.
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

/// Products of positive doubles below this value lose digits. It is added to the error of values that depend on them.
pub(super) const UNDERFLOW_BOUND: f64 = 1e-280;

/// State of the solver, shared by all components.
pub(crate) struct Run<'a, N> {
    pub problem: Problem<'a, N>,
    pub solution: Solution<N>,
    /// An initial policy.
    pub hint: Option<&'a [u32]>,
    /// Number of each state in the current component, or `NONE`.
    pub position: Vec<u32>,
    /// Remaining budget of exact arithmetic.
    pub work: Work,
    /// `true` if only a good policy is needed: nothing is certified.
    pub draft: bool,
}

impl<N: Number> Run<'_, N> {
    /// Returns `true` if sure states are defined by the best policy, `false` if by all policies.
    pub fn sure_by_choice(&self) -> bool {
        self.problem.rewards.is_some() == (self.problem.direction == Direction::Min)
    }

    /// Returns `true` if sure states have value 1 without further computation.
    pub fn sure_is_one(&self) -> bool {
        self.problem.rewards.is_none() && self.problem.terminal_values.is_none()
    }
}
