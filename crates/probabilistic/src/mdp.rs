//! Sparse Markov decision processes.
//!
//! The choices of all states are stored contiguously, as are the transitions of all choices.
//! Therefore all successors of a state form one slice, which the graph algorithms iterate over.

use std::collections::BTreeMap;

use num_rational::BigRational;

use crate::error::Error;
use crate::fraction::Fraction;
use crate::number::{Number, plus_with_error};

/// Upper limit on the number of states and on the number of choices. The two greatest 32-bit
/// numbers are reserved as markers.
pub(crate) const MAX_COUNT: usize = 0xFFFF_FFFE;

/// Converts a position to 32 bits. Panics if the position is not below 2^32; states, choices,
/// transitions and characters of a text are always fewer.
pub(crate) fn dense(position: usize) -> u32 {
    u32::try_from(position).expect("invariant: positions are below 2^32")
}

/// A Markov decision process. A Markov chain is a process with a single choice in each state.
///
/// States are numbered from 0; choices are numbered consecutively over all states.
#[derive(Debug, Clone)]
pub struct Mdp<N> {
    /// The first choice of each state, followed by the number of choices.
    first_choice: Vec<u32>,
    /// The first transition of each choice, followed by the number of transitions.
    first_transition: Vec<u32>,
    targets: Vec<u32>,
    probabilities: Vec<N>,
    actions: Vec<u32>,
    /// Positions of the targets of the current choice, if there are more than [`MAX_SCANNED`]; otherwise empty.
    positions: BTreeMap<u32, usize>,
    /// For positions of the current choice, the error of the sum of several probabilities, which is added when the choice
    /// ends (see [`plus_with_error`]).
    sum_errors: BTreeMap<usize, N>,
}

/// Maximum number of targets of a choice that are compared one by one with each further target.
const MAX_SCANNED: usize = 64;

impl<N: Number> Default for Mdp<N> {
    fn default() -> Self {
        Self {
            first_choice: vec![0],
            first_transition: vec![0],
            targets: Vec::new(),
            probabilities: Vec::new(),
            actions: Vec::new(),
            positions: BTreeMap::new(),
            sum_errors: BTreeMap::new(),
        }
    }
}

impl<N: Number> Mdp<N> {
    /// Returns the number of states.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the end is listed, too, so that the list is never empty"
    )]
    pub fn states(&self) -> usize {
        self.first_choice.len() - 1
    }

    /// Returns the number of choices, summed over all states.
    pub fn choice_count(&self) -> usize {
        self.actions.len()
    }

    /// Returns the number of transitions, summed over all choices.
    pub fn transition_count(&self) -> usize {
        self.targets.len()
    }

    /// Returns the range of the choices of a state.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the start of the next one is there, because the end is listed, too"
    )]
    pub fn choices(&self, state: usize) -> std::ops::Range<usize> {
        self.first_choice[state] as usize..self.first_choice[state + 1] as usize
    }

    /// Returns the state to which a choice belongs, by binary search.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the first state starts with choice 0, so that there is one that starts before"
    )]
    pub fn owner(&self, choice: usize) -> usize {
        self.first_choice.partition_point(|first| *first as usize <= choice) - 1
    }

    /// Returns the action number of a choice, as given by the generator.
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

    /// Returns the successor states of a choice, without repetition.
    pub fn targets(&self, choice: usize) -> &[u32] {
        &self.targets[self.range(choice)]
    }

    /// Iterates over the transitions of a choice: successor state and probability.
    pub fn transitions(&self, choice: usize) -> impl ExactSizeIterator<Item = (usize, &N)> {
        let range = self.range(choice);
        self.targets[range.clone()].iter().map(|state| *state as usize).zip(&self.probabilities[range])
    }

    /// Returns the successor states of all choices of a state, in the order of the choices,
    /// possibly with repetition.
    pub fn successors(&self, state: usize) -> &[u32] {
        let choices = self.choices(state);
        let first = self.first_transition[choices.start] as usize;
        &self.targets[first..self.first_transition[choices.end] as usize]
    }

    /// Adds a transition to the current choice. If the choice already has this target, the
    /// probabilities are added.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "a position in the list behind the first transition of the choice"
    )]
    pub fn push_transition(&mut self, target: u32, probability: N) {
        let first = self.first_transition[self.actions.len()] as usize;
        let is_wide = !self.positions.is_empty();
        let position = if is_wide {
            self.positions.get(&target).copied()
        } else {
            let at = self.targets[first..].iter().position(|existing| *existing == target);
            at.map(|at| first + at)
        };
        if let Some(at) = position {
            let (sum, error) = plus_with_error(&self.probabilities[at], &probability);
            self.probabilities[at] = sum;
            if !error.is_zero() {
                let total = self.sum_errors.entry(at).or_insert_with(N::zero);
                *total = total.plus(&error);
            }
            return;
        }
        self.targets.push(target);
        self.probabilities.push(probability);
        let end = self.targets.len();
        if is_wide {
            self.positions.insert(target, end - 1);
        } else if end - first > MAX_SCANNED {
            self.positions.extend(self.targets[first..].iter().copied().zip(first..));
        }
    }

    /// Ends the current choice, which gets the number `action` as its action.
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
        self.positions.clear();
        while let Some((at, error)) = self.sum_errors.pop_first() {
            self.probabilities[at] = self.probabilities[at].plus(&error);
        }
        Ok(())
    }

    /// Ends the current state. Its choices are those added since the previous call.
    pub fn end_state(&mut self) {
        self.first_choice.push(dense(self.actions.len()));
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
            positions: BTreeMap::new(),
            sum_errors: BTreeMap::new(),
        }
    }
}

impl Mdp<Fraction> {
    /// Converts the probabilities to doubles. Returns `None` if a probability is so small that later products
    /// could underflow (see [`crate::number::rounded`]).
    pub(crate) fn rounded(&self) -> Option<Mdp<f64>> {
        Some(Mdp {
            first_choice: self.first_choice.clone(),
            first_transition: self.first_transition.clone(),
            targets: self.targets.clone(),
            probabilities: self.probabilities.iter().map(Fraction::rounded).collect::<Option<_>>()?,
            actions: self.actions.clone(),
            positions: BTreeMap::new(),
            sum_errors: BTreeMap::new(),
        })
    }
}

/// Converts an exact number of the model to the number type of the solver.
pub fn number<N: Number>(value: &BigRational) -> N {
    N::from_rational(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_of_wide_choices_are_not_repeated() {
        let mut mdp = Mdp::<f64>::default();
        for target in (0..300).chain((0..300).rev()) {
            mdp.push_transition(target, 0.25);
        }
        mdp.end_choice(0).expect("there are few choices");
        mdp.push_transition(299, 1.0);
        mdp.end_choice(0).expect("there are few choices");
        mdp.end_state();
        assert!(mdp.transitions(0).eq((0..300).map(|target| (target, &0.5))));
        assert!(mdp.transitions(1).eq([(299, &1.0)]));
    }
}
