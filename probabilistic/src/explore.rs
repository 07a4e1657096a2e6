//! A generator of successors to the process of all states that it reaches, breadth first.
//!
//! A generator computes the successors of a state natively. It is the one place where the meaning of a state is
//! known; whatever comes after knows numbers only.

use std::hash::Hash;

use crate::error::Error;
use crate::mdp::{MOST, Mdp, dense};
use crate::number::Number;
use crate::states::States;

/// The action of the loop that a state without choices gets.
pub const DEADLOCK: u32 = u32::MAX;

/// How a model moves.
pub trait Generator<N: Number> {
    /// What a model remembers.
    type State: Clone + Eq + Hash;

    /// Where it starts.
    fn initial(&self) -> Self::State;

    /// How many rewards each choice has.
    fn rewards(&self) -> usize;

    /// How many codes there are, where [`code`](Self::code) numbers the states that can be thought of; then states are
    /// found in a table and not by hashing.
    fn codes(&self) -> Option<usize> {
        None
    }

    /// The code of a state, less than [`codes`](Self::codes). States that lead to each other should have codes that
    /// are close.
    fn code(&self, _state: &Self::State) -> usize {
        0
    }

    /// Writes all choices of a state.
    ///
    /// # Errors
    /// What the model does there and must not do.
    fn successors(&self, state: &Self::State, choices: &mut Choices<Self::State, N>) -> Result<(), Error>;
}

/// The choices of one state, as a generator writes them.
#[derive(Debug)]
pub struct Choices<S, N> {
    transitions: Vec<(S, N)>,
    /// Action, and the end of its transitions.
    ends: Vec<(u32, usize)>,
    rewards: Vec<N>,
}

impl<S, N> Default for Choices<S, N> {
    fn default() -> Self {
        Self { transitions: Vec::new(), ends: Vec::new(), rewards: Vec::new() }
    }
}

/// The transitions of a choice and its rewards.
pub type Written<'a, S, N> = (&'a [(S, N)], &'a [N]);

impl<S: Clone, N: Number> Choices<S, N> {
    /// Where the first choice with an action leads, and its rewards.
    pub fn find(&self, action: u32) -> Option<Written<'_, S, N>> {
        let at = self.ends.iter().position(|(known, _)| *known == action)?;
        let begin = at.checked_sub(1).map_or(0, |before| self.ends[before].1);
        let kinds = self.rewards.len().checked_div(self.ends.len())?;
        let rewards = if kinds == 0 { &[] } else { self.rewards.chunks(kinds).nth(at)? };
        Some((&self.transitions[begin..self.ends[at].1], rewards))
    }

    /// Adds a transition to the choice that is being written. Those of probability 0 are dropped.
    pub fn to(&mut self, state: S, probability: N) {
        if !probability.is_zero() {
            self.transitions.push((state, probability));
        }
    }

    /// Ends the choice that is being written.
    pub fn end(&mut self, action: u32, rewards: impl IntoIterator<Item = N>) {
        self.rewards.extend(rewards);
        self.ends.push((action, self.transitions.len()));
    }

    fn clear(&mut self) {
        self.transitions.clear();
        self.ends.clear();
        self.rewards.clear();
    }
}

/// When exploration has to stop.
pub struct Bounds<'a> {
    /// More states than this are an error.
    pub states: usize,
    /// Told the number of states from time to time; false stops.
    pub progress: &'a dyn Fn(usize) -> bool,
}

impl Default for Bounds<'_> {
    fn default() -> Self {
        Self { states: 50_000_000, progress: &|_| true }
    }
}

/// A process with what its states and choices mean.
#[derive(Debug)]
pub struct Explored<S, N> {
    /// The process; state 0 is where it starts.
    pub mdp: Mdp<N>,
    /// The states by number.
    pub states: States<S>,
    /// For each reward its value for each choice.
    pub rewards: Vec<Vec<N>>,
    /// How many states had no choice and got a loop.
    pub deadlocks: usize,
}

/// Explores all states.
///
/// # Errors
/// What the model must not do, a limit, or that the caller wants to stop.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "no more deadlocks than states, which are counted by 32 bits"
)]
pub fn explore<N: Number, G: Generator<N>>(
    generator: &G,
    bounds: &Bounds<'_>,
) -> Result<Explored<G::State, N>, Error> {
    let mut states = States::new(generator.codes());
    let most = bounds.states.min(MOST);
    let too_many = |states: usize| Error::StateLimit { states, limit: most };
    let initial = generator.initial();
    states.insert(generator.code(&initial), initial).ok_or_else(|| too_many(0))?;
    let mut mdp = Mdp::default();
    let kinds = generator.rewards();
    let mut rewards: Vec<Vec<N>> = vec![Vec::new(); kinds];
    let mut choices = Choices::default();
    let mut deadlocks = 0;
    for at in 0..MOST {
        if at == states.len() {
            break;
        }
        if at % 65_536 == 0 && !(bounds.progress)(states.len()) {
            return Err(Error::Interrupted { states: states.len() });
        }
        choices.clear();
        let state = states[at].clone();
        generator.successors(&state, &mut choices)?;
        let mut transitions = choices.transitions.drain(..);
        let mut begin = 0;
        let mut reward = choices.rewards.drain(..);
        for (action, end) in choices.ends.drain(..) {
            for _ in begin..end {
                if let Some((target, probability)) = transitions.next() {
                    let target = states.insert(generator.code(&target), target);
                    mdp.push_transition(target.ok_or_else(|| too_many(states.len()))?, probability);
                }
            }
            begin = end;
            mdp.end_choice(action)?;
            for values in &mut rewards {
                values.push(reward.next().unwrap_or_else(N::zero));
            }
        }
        if states.len() > most {
            return Err(too_many(states.len()));
        }
        if mdp.open_choices() == 0 {
            deadlocks += 1;
            mdp.push_transition(dense(at), N::one());
            mdp.end_choice(DEADLOCK)?;
            for values in &mut rewards {
                values.push(N::zero());
            }
        }
        mdp.end_state();
    }
    Ok(Explored { mdp, states, rewards, deadlocks })
}
