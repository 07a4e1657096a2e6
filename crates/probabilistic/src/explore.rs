//! A generator of successors to the process of all states that it reaches, breadth first.
//!
//! A generator computes the successors of a state natively. It is the one place where the meaning of a state is
//! known; whatever comes after knows numbers only.

use std::hash::Hash;

use crate::error::Error;
use crate::fraction::Fraction;
use crate::mdp::{MOST, Mdp, dense};
use crate::number::Number;
use crate::states::{Look, States};

/// The action of the loop that a state without choices gets.
pub const DEADLOCK: u32 = u32::MAX;

/// How a model moves.
pub trait Generator<N: Number> {
    /// What a model remembers.
    type State: Clone + Eq + Hash;

    /// Where it starts.
    fn initial(&self) -> Self::State;

    /// All states in which it can start, if there are several.
    fn starts(&self) -> Vec<Self::State> {
        vec![self.initial()]
    }

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

/// The choices of one state after the other, as a generator writes them.
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

    /// How much was written so far.
    pub(crate) fn mark(&self) -> [usize; 3] {
        [self.transitions.len(), self.ends.len(), self.rewards.len()]
    }

    /// Forgets what was written after a mark.
    pub(crate) fn back_to(&mut self, [transitions, ends, rewards]: [usize; 3]) {
        self.transitions.truncate(transitions);
        self.ends.truncate(ends);
        self.rewards.truncate(rewards);
    }

    fn clear(&mut self) {
        self.transitions.clear();
        self.ends.clear();
        self.rewards.clear();
    }
}

/// When exploration has to stop. Each `with_` changes one thing.
#[derive(Clone, Copy)]
#[non_exhaustive]
pub struct Bounds<'a> {
    /// More states than this are an error.
    pub states: usize,
    /// Told the number of states from time to time; false stops.
    pub progress: &'a dyn Fn(usize) -> bool,
}

impl<'a> Bounds<'a> {
    /// More states than this are an error; 50 million unless said otherwise.
    #[must_use]
    pub fn with_states(self, states: usize) -> Self {
        Self { states, ..self }
    }

    /// Told the number of states from time to time; false stops.
    #[must_use]
    pub fn with_progress(self, progress: &'a dyn Fn(usize) -> bool) -> Self {
        Self { progress, ..self }
    }
}

impl Default for Bounds<'_> {
    fn default() -> Self {
        Self { states: 50_000_000, progress: &|_| true }
    }
}

/// A process with what its states and choices mean.
#[derive(Debug)]
pub struct Explored<S, N> {
    /// The process; it starts in state 0, or in one of the first ones.
    pub mdp: Mdp<N>,
    /// How many states it can start in.
    pub starts: usize,
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
pub fn explore<N: Number, G: Generator<N>>(
    generator: &G,
    bounds: &Bounds<'_>,
) -> Result<Explored<G::State, N>, Error> {
    let mut exploration = Exploration::new(generator, bounds)?;
    exploration.go_on(generator, bounds, usize::MAX)?;
    Ok(exploration.found)
}

/// An exploration that can be interrupted.
pub(crate) struct Exploration<S, N> {
    /// What was found so far.
    pub found: Explored<S, N>,
    /// The state that is next.
    next: usize,
    /// The state from which on progress is told again.
    told: usize,
}

impl<S: Clone + Eq + Hash, N: Number> Exploration<S, N> {
    /// Knows the states in which a model starts.
    pub fn new<G: Generator<N, State = S>>(generator: &G, bounds: &Bounds<'_>) -> Result<Self, Error> {
        let mut states = States::new(generator.codes());
        for start in generator.starts() {
            let look = states.look(&start, |state| generator.code(state));
            let known = states.insert(start, look);
            known
                .ok_or_else(|| Error::StateLimit { states: states.len(), limit: bounds.states.min(MOST) })?;
        }
        let rewards = vec![Vec::new(); generator.rewards()];
        let found = Explored { mdp: Mdp::default(), starts: states.len(), states, rewards, deadlocks: 0 };
        Ok(Self { found, next: 0, told: 0 })
    }

    /// Explores until all is known or there are so many transitions, or a few more; whether all is known.
    pub fn go_on<G: Generator<N, State = S>>(
        &mut self,
        generator: &G,
        bounds: &Bounds<'_>,
        transitions: usize,
    ) -> Result<bool, Error> {
        let mut batch = Batch { choices: Choices::default(), ends: Vec::new(), looks: Vec::new() };
        let most = bounds.states.min(MOST);
        loop {
            let begin = self.next;
            let end = self.found.states.len().min(begin.saturating_add(BATCH));
            if begin == end {
                return Ok(true);
            }
            if self.found.mdp.transition_count() >= transitions {
                return Ok(false);
            }
            if begin >= self.told {
                self.told = begin.saturating_add(TELL);
                if !(bounds.progress)(self.found.states.len()) {
                    return Err(Error::Interrupted { states: self.found.states.len() });
                }
            }
            batch.write(generator, &self.found.states, begin..end)?;
            self.found.add(&mut batch, begin, most)?;
            self.next = end;
        }
    }
}

/// States whose successors are written before they are looked up.
const BATCH: usize = 32;
/// States between two words on progress.
const TELL: usize = 65_536;

/// The choices of a few states that come after each other.
struct Batch<S, N> {
    choices: Choices<S, N>,
    /// For each state the end of its choices.
    ends: Vec<usize>,
    /// For each transition a first look at its target.
    looks: Vec<Look>,
}

impl<S: Clone + Eq + Hash, N: Number> Batch<S, N> {
    fn write<G: Generator<N, State = S>>(
        &mut self,
        generator: &G,
        states: &States<S>,
        range: std::ops::Range<usize>,
    ) -> Result<(), Error> {
        self.choices.clear();
        self.ends.clear();
        for state in range {
            generator.successors(&states[state], &mut self.choices)?;
            self.ends.push(self.choices.ends.len());
        }
        self.looks.clear();
        let targets = self.choices.transitions.iter();
        self.looks.extend(targets.map(|(target, _)| states.look(target, |state| generator.code(state))));
        Ok(())
    }
}

impl<S: Clone + Eq + Hash, N: Number> Explored<S, N> {
    /// Adds the choices of the states from `first` on.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "no more deadlocks than states, which are counted by 32 bits, and positions in lists"
    )]
    fn add(&mut self, batch: &mut Batch<S, N>, first: usize, most: usize) -> Result<(), Error> {
        let Self { mdp, states, rewards, deadlocks, .. } = self;
        let too_many = |states: usize| Error::StateLimit { states, limit: most };
        let mut transitions = batch.choices.transitions.drain(..).zip(&batch.looks);
        let mut reward = batch.choices.rewards.drain(..);
        let mut choices = batch.choices.ends.drain(..);
        let (mut begin, mut taken) = (0, 0);
        for (at, end) in batch.ends.iter().enumerate() {
            for (action, end) in choices.by_ref().take(end - taken) {
                for ((target, probability), look) in transitions.by_ref().take(end - begin) {
                    let target = states.insert(target, *look);
                    mdp.push_transition(target.ok_or_else(|| too_many(states.len()))?, probability);
                }
                begin = end;
                mdp.end_choice(action)?;
                for values in &mut *rewards {
                    values.push(reward.next().unwrap_or_else(N::zero));
                }
            }
            taken = *end;
            if states.len() > most {
                return Err(too_many(states.len()));
            }
            if mdp.open_choices() == 0 {
                *deadlocks += 1;
                mdp.push_transition(dense(first + at), N::one());
                mdp.end_choice(DEADLOCK)?;
                for values in &mut *rewards {
                    values.push(N::zero());
                }
            }
            mdp.end_state();
        }
        Ok(())
    }
}

impl<S: Clone> Exploration<S, Fraction> {
    /// The same in doubles; none where a number is too large or too small for them.
    pub fn rounded(&self) -> Option<Exploration<S, f64>> {
        Some(Exploration { found: self.found.rounded()?, next: self.next, told: self.told })
    }
}

impl<S: Clone> Explored<S, Fraction> {
    /// The same in doubles; none where a number is too large or too small for them.
    pub(crate) fn rounded(&self) -> Option<Explored<S, f64>> {
        let rewards = self.rewards.iter().map(|values| values.iter().map(Fraction::rounded).collect());
        Some(Explored {
            mdp: self.mdp.rounded()?,
            starts: self.starts,
            states: self.states.clone(),
            rewards: rewards.collect::<Option<_>>()?,
            deadlocks: self.deadlocks,
        })
    }
}
