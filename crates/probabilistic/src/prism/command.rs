//! Variables, commands and rewards of a program, with names resolved.

use std::borrow::Cow;

use num_rational::BigRational;
use num_traits::{One, Signed};

use crate::error::{Diagnostic, Error, Place};
use crate::number::Number;
use crate::prism::code::{Code, Fault, rounded};
use crate::prism::guard::Guard;

/// Tolerance for the sum of the probabilities of a command, as in PRISM. Sums within it are scaled to 1.
const SUM_TOLERANCE: f64 = 1e-5;

/// A variable with its range evaluated.
#[derive(Debug, Clone)]
pub struct Variable {
    /// The name.
    pub name: String,
    /// `true` for Boolean variables; their range is 0 to 1.
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
    /// The probabilities of the updates, if they are constants that sum to 1.
    pub certain: Option<Vec<N>>,
    pub place: Place,
}

impl<N: Number> Command<N> {
    /// Calls `visit` with each variable that the enabledness or the effect of the command depends on.
    pub fn each_variable(&self, visit: &mut impl FnMut(u32)) {
        self.guard.each_variable(visit);
        for update in &self.updates {
            update.probability.each_variable(visit);
            update.assignments.iter().for_each(|(_, value, _)| value.each_variable(visit));
        }
    }

    /// Returns the probabilities of the updates in a state.
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
    /// The reward, if it is a valid constant.
    pub certain: Option<N>,
    pub place: Place,
}

impl<N> RewardItem<N> {
    /// Calls `visit` with each variable that the reward depends on.
    pub fn each_variable(&self, visit: &mut impl FnMut(u32)) {
        self.guard.each_variable(visit);
        self.reward.each_variable(visit);
    }
}

/// Evaluates the probabilities of the updates of a command and scales them to the sum 1.
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
