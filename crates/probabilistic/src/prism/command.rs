//! Variables, commands and reward items of a program, with resolved names.

use std::borrow::Cow;

use num_rational::BigRational;
use num_traits::{One, Signed};

use crate::error::{Diagnostic, Error, Place};
use crate::number::Number;
use crate::prism::code::{Code, Fault, rounded};
use crate::prism::guard::Guard;

/// Upper limit on the deviation of the sum of a command's probabilities from 1, as in PRISM. Probabilities within the
/// limit are scaled to the sum 1.
const SUM_TOLERANCE: f64 = 1e-5;

#[derive(Debug, Clone)]
pub struct Variable {
    pub name: String,
    /// Whether the variable is Boolean; its range is then 0 to 1.
    pub is_bool: bool,
    pub least: i64,
    pub greatest: i64,
    pub initial: i64,
}

#[derive(Debug, Clone)]
pub struct Update {
    pub probability: Code,
    pub assignments: Vec<(u32, Code, Place)>,
}

#[derive(Debug, Clone)]
pub struct Command<N> {
    pub guard: Guard,
    pub updates: Vec<Update>,
    /// The probabilities of the updates, if all of them are constants and valid.
    pub certain: Option<Vec<N>>,
    pub place: Place,
}

impl<N: Number> Command<N> {
    pub fn each_variable(&self, visit: &mut impl FnMut(u32)) {
        self.guard.each_variable(visit);
        for update in &self.updates {
            update.probability.each_variable(visit);
            update.assignments.iter().for_each(|(_, value, _)| value.each_variable(visit));
        }
    }

    pub fn probabilities(&self, values: &[i64]) -> Result<Cow<'_, [N]>, Error> {
        Ok(match &self.certain {
            Some(certain) => Cow::Borrowed(certain),
            None => Cow::Owned(probabilities(&self.updates, values, self.place)?),
        })
    }
}

#[derive(Debug, Clone)]
pub struct RewardItem<N> {
    pub guard: Guard,
    pub reward: Code,
    pub certain: Option<N>,
    pub place: Place,
}

impl<N> RewardItem<N> {
    pub fn each_variable(&self, visit: &mut impl FnMut(u32)) {
        self.guard.each_variable(visit);
        self.reward.each_variable(visit);
    }
}

/// Evaluates the probabilities of a command's updates in a state and scales them to the sum 1.
/// Fails if an expression has no value, a probability is negative or too small for doubles, or the
/// sum differs from 1 by more than [`SUM_TOLERANCE`].
pub fn probabilities<N: Number>(
    updates: &[Update],
    values: &[i64],
    place: Place,
) -> Result<Vec<N>, Diagnostic> {
    let fault = |Fault(text)| Diagnostic::new("Q303", place, text);
    let mut exact = Vec::with_capacity(updates.len());
    for update in updates {
        let probability = update.probability.number(values).map_err(fault)?;
        if probability.is_negative() {
            let text = format!("a negative probability, {}", Number::to_f64(&probability));
            return Err(Diagnostic::new("Q302", place, text));
        }
        exact.push(probability);
    }
    let sum: BigRational = exact.iter().sum();
    let deviation = (Number::to_f64(&sum) - 1.0).abs();
    if deviation.is_nan() || deviation > SUM_TOLERANCE {
        let text = format!("the probabilities sum to {}, not to 1", Number::to_f64(&sum));
        return Err(Diagnostic::new("Q301", place, text));
    }
    if !sum.is_one() {
        for probability in &mut exact {
            *probability /= &sum;
        }
    }
    exact.iter().map(|probability| rounded(probability).map_err(fault)).collect()
}
