//! Sparse Markov decision processes.
//!
//! States, choices and transitions are stored in three arrays; the choices of a state and the
//! transitions of a choice are contiguous. All successors of a state are therefore one slice,
//! which the graph algorithms iterate over.

use num_rational::BigRational;

use crate::error::Error;
use crate::fraction::Fraction;
use crate::number::Number;

/// Upper limit on the number of states and of choices; the two greatest 32-bit numbers are
/// reserved.
pub(crate) const MAX_COUNT: usize = 0xFFFF_FFFE;

/// Converts a position to 32 bits. Positions of states, choices, transitions and characters of a
/// text are below 2^32.
pub(crate) fn dense(position: usize) -> u32 {
    u32::try_from(position).expect("invariant: positions are below 2^32")
}

/// A Markov decision process. A Markov chain is a process with a single choice in each state.
///
/// States are numbered from 0; choices are numbered consecutively over all states.
#[derive(Debug, Clone)]
pub struct Mdp<N> {
    /// The first choice of each state, and the number of choices at the end.
    first_choice: Vec<u32>,
    /// The first transition of each choice, and the number of transitions at the end.
    first_transition: Vec<u32>,
    targets: Vec<u32>,
    probabilities: Vec<N>,
    /// The action of each choice.
    actions: Vec<u32>,
}

impl<N: Number> Default for Mdp<N> {
    fn default() -> Self {
        Self {
            first_choice: vec![0],
            first_transition: vec![0],
            targets: Vec::new(),
            probabilities: Vec::new(),
            actions: Vec::new(),
        }
    }
}

impl<N: Number> Mdp<N> {
    /// Number of states.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the end is listed, too, so that the list is never empty"
    )]
    pub fn states(&self) -> usize {
        self.first_choice.len() - 1
    }

    /// Number of choices in all states.
    pub fn choice_count(&self) -> usize {
        self.actions.len()
    }

    /// Number of transitions.
    pub fn transition_count(&self) -> usize {
        self.targets.len()
    }

    /// The choices of a state.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the start of the next one is there, because the end is listed, too"
    )]
    pub fn choices(&self, state: usize) -> std::ops::Range<usize> {
        self.first_choice[state] as usize..self.first_choice[state + 1] as usize
    }

    /// The state of a choice.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the first state starts with choice 0, so that there is one that starts before"
    )]
    pub fn owner(&self, choice: usize) -> usize {
        self.first_choice.partition_point(|first| *first as usize <= choice) - 1
    }

    /// The action of a choice, as numbered by the generator.
    pub fn action(&self, choice: usize) -> u32 {
        self.actions[choice]
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the start of the next one is there, because the end is listed, too"
    )]
    fn range(&self, choice: usize) -> std::ops::Range<usize> {
        self.first_transition[choice] as usize..self.first_transition[choice + 1] as usize
    }

    /// The successors of a choice, without repetition.
    pub fn targets(&self, choice: usize) -> &[u32] {
        &self.targets[self.range(choice)]
    }

    /// The transitions of a choice: successor and probability.
    pub fn transitions(&self, choice: usize) -> impl ExactSizeIterator<Item = (usize, &N)> {
        let range = self.range(choice);
        self.targets[range.clone()].iter().map(|state| *state as usize).zip(&self.probabilities[range])
    }

    /// All successors of a state, by choice, possibly with repetition.
    pub fn successors(&self, state: usize) -> &[u32] {
        let choices = self.choices(state);
        let first = self.first_transition[choices.start] as usize;
        &self.targets[first..self.first_transition[choices.end] as usize]
    }

    /// Adds a transition to the current choice. Probabilities of equal targets are added.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "a position in the list behind the first transition of the choice"
    )]
    pub fn push_transition(&mut self, target: u32, probability: N) {
        let first = self.first_transition[self.actions.len()] as usize;
        if let Some(at) = self.targets[first..].iter().position(|existing| *existing == target) {
            self.probabilities[first + at] = self.probabilities[first + at].plus(&probability);
        } else {
            self.targets.push(target);
            self.probabilities.push(probability);
        }
    }

    /// Ends the current choice.
    ///
    /// # Errors
    /// More choices or transitions than 32 bits can count.
    pub fn end_choice(&mut self, action: u32) -> Result<(), Error> {
        let end = u32::try_from(self.targets.len()).map_err(|_| self.too_large())?;
        if self.actions.len() >= MAX_COUNT {
            return Err(self.too_large());
        }
        self.actions.push(action);
        self.first_transition.push(end);
        Ok(())
    }

    /// Ends the current state.
    pub fn end_state(&mut self) {
        self.first_choice.push(dense(self.actions.len()));
    }

    /// Number of choices of the current state that were added.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the state that is being written starts after the choices of those before"
    )]
    pub fn open_choices(&self) -> usize {
        self.actions.len() - self.first_choice[self.states()] as usize
    }

    fn too_large(&self) -> Error {
        Error::StateLimit { states: self.states(), limit: self.states() }
    }

    /// Converts the probabilities to doubles.
    pub fn to_f64(&self) -> Mdp<f64> {
        Mdp {
            first_choice: self.first_choice.clone(),
            first_transition: self.first_transition.clone(),
            targets: self.targets.clone(),
            probabilities: self.probabilities.iter().map(Number::to_f64).collect(),
            actions: self.actions.clone(),
        }
    }
}

impl Mdp<Fraction> {
    /// Converts the probabilities to doubles. Returns `None` if a probability is out of range.
    pub(crate) fn rounded(&self) -> Option<Mdp<f64>> {
        Some(Mdp {
            first_choice: self.first_choice.clone(),
            first_transition: self.first_transition.clone(),
            targets: self.targets.clone(),
            probabilities: self.probabilities.iter().map(Fraction::rounded).collect::<Option<_>>()?,
            actions: self.actions.clone(),
        })
    }
}

/// Converts an exact number of the model to the kind of number that is solved in.
pub fn number<N: Number>(value: &BigRational) -> N {
    N::from_rational(value)
}
