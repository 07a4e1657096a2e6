//! Explores the reachable states of a model breadth first and builds a sparse Markov decision
//! process.
//!
//! A generator computes the successors of a state. Only the generator interprets states; all later
//! stages use state numbers.

use std::hash::Hash;

use crate::error::Error;
use crate::fraction::Fraction;
use crate::mdp::{MAX_COUNT, Mdp};
use crate::number::Number;
use crate::states::{Probe, States};

/// The action number of the self-loop that is added to a state without choices.
pub const DEADLOCK: u32 = u32::MAX;

/// A model that generates states and transitions on the fly.
pub trait Generator<N: Number> {
    /// The type of states.
    type State: Clone + Eq + Hash;

    /// Returns the initial state; if there are several, one of them.
    fn initial(&self) -> Self::State;

    /// Returns all initial states.
    fn starts(&self) -> Vec<Self::State> {
        vec![self.initial()]
    }

    /// Returns the number of reward structures, i.e. the number of rewards per choice.
    fn rewards(&self) -> usize;

    /// Returns the rewards of the loop that is added to a state without choices. By default, all are 0.
    ///
    /// # Errors
    /// The model is invalid in this state, e.g. a reward is negative.
    fn loop_rewards(&self, _state: &Self::State) -> Result<Vec<N>, Error> {
        Ok(vec![N::zero(); self.rewards()])
    }

    /// Returns the number of state codes if [`code`](Self::code) numbers all conceivable states,
    /// otherwise `None`. Up to 2^29 codes, states are indexed by a table instead of a hash map.
    fn codes(&self) -> Option<usize> {
        None
    }

    /// Returns the code of a state, which is less than [`codes`](Self::codes). States connected by
    /// transitions should have close codes, for locality of memory accesses.
    fn code(&self, _state: &Self::State) -> usize {
        0
    }

    /// Appends all choices of a state to `choices`.
    ///
    /// # Errors
    /// The model is invalid in this state, e.g. probabilities do not sum to 1.
    fn successors(&self, state: &Self::State, choices: &mut Choices<Self::State, N>) -> Result<(), Error>;
}

/// A buffer for the choices that a generator writes, for one state after another.
#[derive(Debug)]
pub struct Choices<S, N> {
    transitions: Vec<(S, N)>,
    /// For each choice, its action and the end of its transitions in `transitions`.
    ends: Vec<(u32, usize)>,
    rewards: Vec<N>,
}

impl<S, N> Default for Choices<S, N> {
    fn default() -> Self {
        Self { transitions: Vec::new(), ends: Vec::new(), rewards: Vec::new() }
    }
}

/// The transitions (target and probability) and the rewards of a choice.
pub type Written<'a, S, N> = (&'a [(S, N)], &'a [N]);

impl<S: Clone, N: Number> Choices<S, N> {
    /// Returns the transitions and rewards of the first choice with this action, or `None`.
    pub fn find(&self, action: u32) -> Option<Written<'_, S, N>> {
        let at = self.ends.iter().position(|(candidate, _)| *candidate == action)?;
        let begin = at.checked_sub(1).map_or(0, |before| self.ends[before].1);
        let kinds = self.rewards.len().checked_div(self.ends.len())?;
        let rewards = if kinds == 0 { &[] } else { self.rewards.chunks(kinds).nth(at)? };
        Some((&self.transitions[begin..self.ends[at].1], rewards))
    }

    /// Adds a transition to the current choice, unless the probability is 0.
    pub fn to(&mut self, state: S, probability: N) {
        if !probability.is_zero() {
            self.transitions.push((state, probability));
        }
    }

    /// Ends the current choice and sets its action and its rewards.
    pub fn end(&mut self, action: u32, rewards: impl IntoIterator<Item = N>) {
        self.rewards.extend(rewards);
        self.ends.push((action, self.transitions.len()));
    }

    pub(crate) fn mark(&self) -> [usize; 3] {
        [self.transitions.len(), self.ends.len(), self.rewards.len()]
    }

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

/// Limits of an exploration. Each `with_` method sets one limit.
#[derive(Clone, Copy)]
#[non_exhaustive]
pub struct Bounds<'a> {
    /// Upper limit on the number of reached states.
    pub states: usize,
    /// Callback that periodically receives the number of reached states; its result `false` cancels the
    /// exploration or the computation of the values.
    pub progress: &'a dyn Fn(usize) -> bool,
}

impl<'a> Bounds<'a> {
    /// Sets the upper limit on the number of states (default: 50 million).
    #[must_use]
    pub fn with_states(self, states: usize) -> Self {
        Self { states, ..self }
    }

    /// Sets the callback that periodically receives the number of reached states; its result `false` cancels
    /// the exploration or the computation of the values.
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

/// An explored process with its states and rewards.
#[derive(Debug)]
pub struct Explored<S, N> {
    /// The process. The initial states have the smallest numbers.
    pub mdp: Mdp<N>,
    /// Number of initial states.
    pub starts: usize,
    /// The states, indexed by state number.
    pub states: States<S>,
    /// For each computed reward structure, the reward of each choice.
    pub rewards: Vec<Vec<N>>,
    /// Number of states without an enabled choice; each of them got a self-loop.
    pub deadlocks: usize,
}

/// Explores all states reachable from the initial states.
///
/// # Errors
/// The model is invalid in a reachable state, a limit is exceeded, or the caller cancels.
pub fn explore<N: Number, G: Generator<N>>(
    generator: &G,
    bounds: &Bounds<'_>,
) -> Result<Explored<G::State, N>, Error> {
    let mut exploration = Exploration::new(generator, bounds)?;
    exploration.run(generator, bounds, usize::MAX)?;
    Ok(exploration.explored)
}

pub(crate) struct Exploration<S, N> {
    pub explored: Explored<S, N>,
    next: usize,
    next_report: usize,
}

impl<S: Clone + Eq + Hash, N: Number> Exploration<S, N> {
    pub fn new<G: Generator<N, State = S>>(generator: &G, bounds: &Bounds<'_>) -> Result<Self, Error> {
        let mut states = States::new(generator.codes());
        let limit = bounds.states.min(MAX_COUNT);
        for start in generator.starts() {
            let probe = states.probe(&start, |state| generator.code(state));
            if states.insert(start, probe).is_none() || states.len() > limit {
                return Err(Error::StateLimit { states: states.len(), limit });
            }
        }
        let rewards = vec![Vec::new(); generator.rewards()];
        let explored = Explored { mdp: Mdp::default(), starts: states.len(), states, rewards, deadlocks: 0 };
        Ok(Self { explored, next: 0, next_report: 0 })
    }

    /// Expands states until all are expanded or the process has at least `transitions` transitions; the
    /// limit can be exceeded by one batch. Returns `true` if all states are expanded.
    pub fn run<G: Generator<N, State = S>>(
        &mut self,
        generator: &G,
        bounds: &Bounds<'_>,
        transitions: usize,
    ) -> Result<bool, Error> {
        let mut batch = Batch { choices: Choices::default(), ends: Vec::new(), probes: Vec::new() };
        let limit = bounds.states.min(MAX_COUNT);
        loop {
            let begin = self.next;
            let end = self.explored.states.len().min(begin.saturating_add(BATCH));
            if begin == end {
                return Ok(true);
            }
            if self.explored.mdp.transition_count() >= transitions {
                return Ok(false);
            }
            if begin >= self.next_report {
                self.next_report = begin.saturating_add(REPORT_INTERVAL);
                if !(bounds.progress)(self.explored.states.len()) {
                    return Err(Error::Interrupted { states: self.explored.states.len() });
                }
            }
            batch.write(generator, &self.explored.states, begin..end)?;
            self.explored.add(&mut batch, limit)?;
            self.next = end;
        }
    }
}

/// Number of states that are expanded together. Their target states are looked up together, so that memory
/// latencies overlap.
const BATCH: usize = 32;
const REPORT_INTERVAL: usize = 65_536;

struct Batch<S, N> {
    choices: Choices<S, N>,
    /// For each state, the end of its choices in `choices`.
    ends: Vec<usize>,
    /// For each transition, the result of a first lookup of its target state.
    probes: Vec<Probe>,
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
            let before = self.choices.ends.len();
            generator.successors(&states[state], &mut self.choices)?;
            if self.choices.ends.len() == before {
                let state = &states[state];
                self.choices.to(state.clone(), N::one());
                self.choices.end(DEADLOCK, generator.loop_rewards(state)?);
            }
            self.ends.push(self.choices.ends.len());
        }
        self.probes.clear();
        let targets = self.choices.transitions.iter();
        self.probes.extend(targets.map(|(target, _)| states.probe(target, |state| generator.code(state))));
        Ok(())
    }
}

impl<S: Clone + Eq + Hash, N: Number> Explored<S, N> {
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "no more deadlocks than states, which are counted by 32 bits, and positions in lists"
    )]
    fn add(&mut self, batch: &mut Batch<S, N>, limit: usize) -> Result<(), Error> {
        let Self { mdp, states, rewards, deadlocks, .. } = self;
        let too_many = |states: usize| Error::StateLimit { states, limit };
        let mut transitions = batch.choices.transitions.drain(..).zip(&batch.probes);
        let mut reward = batch.choices.rewards.drain(..);
        let mut choices = batch.choices.ends.drain(..);
        let (mut begin, mut finished_choices) = (0, 0);
        for end in &batch.ends {
            for (action, end) in choices.by_ref().take(end - finished_choices) {
                for ((target, probability), probe) in transitions.by_ref().take(end - begin) {
                    let target = states.insert(target, *probe);
                    mdp.push_transition(target.ok_or_else(|| too_many(states.len()))?, probability);
                }
                begin = end;
                mdp.end_choice(action)?;
                *deadlocks += usize::from(action == DEADLOCK);
                for values in &mut *rewards {
                    values.push(reward.next().unwrap_or_else(N::zero));
                }
            }
            finished_choices = *end;
            if states.len() > limit {
                return Err(too_many(states.len()));
            }
            mdp.end_state();
        }
        Ok(())
    }
}

impl<S: Clone> Exploration<S, Fraction> {
    pub fn rounded(&self) -> Option<Exploration<S, f64>> {
        Some(Exploration {
            explored: self.explored.rounded()?,
            next: self.next,
            next_report: self.next_report,
        })
    }
}

impl<S: Clone> Explored<S, Fraction> {
    /// Converts all numbers to doubles. Returns `None` if the magnitude of a number is too small or too large.
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
