//! Variables, commands and rewards of a program, their names resolved.

use std::borrow::Cow;

use num_rational::BigRational;
use num_traits::{One, Signed};

use crate::error::{Diagnostic, Error, Place};
use crate::number::Number;
use crate::prism::code::{Code, Fault, rounded};
use crate::prism::guard::Guard;

/// How far the sum of probabilities may be from one, as in PRISM; what is within is scaled to one.
const SUM_TOLERANCE: f64 = 1e-5;

/// A variable with its range evaluated.
#[derive(Debug, Clone)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Whether it is a truth value.
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
    /// The probabilities of the updates, where no variable occurs in them and they sum to one.
    pub certain: Option<Vec<N>>,
    pub place: Place,
}

impl<N: Number> Command<N> {
    /// Tells all variables that what it does depends on.
    pub fn each_variable(&self, tell: &mut impl FnMut(u32)) {
        self.guard.each_variable(tell);
        for update in &self.updates {
            update.probability.each_variable(tell);
            update.assignments.iter().for_each(|(_, value, _)| value.each_variable(tell));
        }
    }

    /// The probabilities of its updates in a state.
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
    /// The reward, where no variable occurs in it.
    pub certain: Option<N>,
    pub place: Place,
}

impl<N> RewardItem<N> {
    /// Tells all variables that it depends on.
    pub fn each_variable(&self, tell: &mut impl FnMut(u32)) {
        self.guard.each_variable(tell);
        self.reward.each_variable(tell);
    }
}

/// The probabilities of the updates of a command, which sum to one.
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
    let off = (Number::to_f64(&sum) - 1.0).abs();
    if off.is_nan() || off > SUM_TOLERANCE {
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
