//! What is asked of a process, what is found, and what is at hand while it is being solved.

use fixedbitset::FixedBitSet;

use crate::mdp::Mdp;
use crate::number::{Number, enclosing};
use crate::solve::work::Work;

/// Which policy is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// The one with the least value.
    Min,
    /// The one with the greatest value.
    Max,
}

/// What is asked of a process.
///
/// Without rewards: the expected value of the first terminal state that is reached, 0 if none is. With rewards: the
/// expected sum of rewards until then, infinite if one may never be reached.
#[derive(Debug)]
pub struct Problem<'a, N> {
    /// The process.
    pub mdp: &'a Mdp<N>,
    /// Least or greatest.
    pub direction: Direction,
    /// For each choice its reward, at least zero.
    pub rewards: Option<&'a [N]>,
    /// The states at which it ends.
    pub terminal: &'a FixedBitSet,
    /// What they are worth, for each state; otherwise 1 without rewards, and 0 with them.
    pub terminal_values: Option<&'a [N]>,
    /// States that must not be entered: nothing that comes after them counts.
    pub blocked: Option<&'a FixedBitSet>,
    /// The choices that may be made; all of them otherwise. Each state that is not terminal needs one.
    pub allowed: Option<&'a FixedBitSet>,
}

impl<N> Clone for Problem<'_, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<N> Copy for Problem<'_, N> {}

impl<'a, N> Problem<'a, N> {
    /// The plain question: terminal states are worth what they are without more being said, and every choice may be made.
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
    /// For each state its value; 0 where it is infinite.
    pub values: Vec<N>,
    /// How far a value can be from the truth; empty where arithmetic is exact.
    pub errors: Vec<f64>,
    /// The states whose value is infinite.
    pub infinite: FixedBitSet,
    /// The states from which a terminal state is reached with probability 1: by some policy where the best one is
    /// looked for (greatest probability, least reward), else by all.
    pub sure: FixedBitSet,
    /// For each state the number of its choice, [`NONE`](crate::solve::NONE) where nothing is to be chosen.
    pub policy: Vec<u32>,
}

impl<N: Number> Solution<N> {
    /// Bounds on the value of a state, none if it is infinite. They enclose the true value; as doubles also where
    /// arithmetic is exact.
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

/// Products of positive doubles below lose digits; values that are made of them get this error on top.
pub(super) const TINY: f64 = 1e-280;

/// What the components share while a problem is solved.
pub(crate) struct Run<'a, N> {
    pub problem: Problem<'a, N>,
    pub solution: Solution<N>,
    /// A policy to start from.
    pub hint: Option<&'a [u32]>,
    /// For each state its number in the component at work.
    pub position: Vec<u32>,
    /// What exact arithmetic may still cost.
    pub work: Work,
    /// Whether a policy is all that is wanted, which need not be the best one: nothing is certified.
    pub draft: bool,
}

impl<N: Number> Run<'_, N> {
    /// Whether the sure states are those of the best policy, or those of all policies.
    pub fn sure_by_choice(&self) -> bool {
        self.problem.rewards.is_some() == (self.problem.direction == Direction::Min)
    }

    /// Whether the value of sure states is 1 for that reason alone.
    pub fn sure_is_one(&self) -> bool {
        self.problem.rewards.is_none() && self.problem.terminal_values.is_none()
    }
}
