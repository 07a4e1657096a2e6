//! The values of a property in all states.

use fixedbitset::FixedBitSet;
use num_rational::BigRational;

use crate::check::answer::{Answer, Quantity};
use crate::check::steps::Stepped;
use crate::number::{Number, enclosing};
use crate::solve::Solution;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Span {
    Probability,
    /// At least 0.
    Positive,
    Any,
}

#[derive(Debug, Clone)]
pub struct Vector<N> {
    /// The value of each state; 0 for a state in `infinite`.
    pub values: Vec<N>,
    /// Upper limit on the absolute error of each value; empty if arithmetic is exact.
    pub errors: Vec<f64>,
    pub infinite: FixedBitSet,
    pub span: Span,
}

impl<N: Number> Vector<N> {
    pub fn exactly(values: Vec<N>, span: Span) -> Self {
        let errors = if N::EXACT { Vec::new() } else { vec![0.0; values.len()] };
        Self { infinite: FixedBitSet::with_capacity(values.len()), values, errors, span }
    }

    pub fn indicator(set: &FixedBitSet, states: usize) -> Self {
        let values = (0..states).map(|state| if set.contains(state) { N::one() } else { N::zero() });
        Self::exactly(values.collect(), Span::Probability)
    }

    pub fn solved(solution: Solution<N>, span: Span) -> Self {
        let Solution { values, errors, infinite, .. } = solution;
        Self { values, errors, infinite, span }
    }

    pub fn stepped(source: Stepped<N>, span: Span) -> Self {
        let states = source.values.len();
        let errors =
            if N::EXACT { Vec::new() } else { (0..states).map(|state| source.error(state)).collect() };
        Self { values: source.values, errors, infinite: FixedBitSet::with_capacity(states), span }
    }

    pub fn error(&self, state: usize) -> f64 {
        self.errors.get(state).copied().unwrap_or(0.0)
    }

    #[must_use]
    pub fn complement(mut self) -> Self {
        for (state, value) in self.values.iter_mut().enumerate() {
            let complement = N::one().minus(value);
            if let Some(error) = self.errors.get_mut(state)
                && (*error > 0.0 || !(value.is_zero() || complement.is_zero()))
            {
                *error += f64::EPSILON;
            }
            // A probability above 1 by rounding would become a negative value.
            *value = if complement < N::zero() { N::zero() } else { complement };
        }
        self
    }

    pub fn answer(&self, state: usize) -> Answer {
        if self.infinite.contains(state) {
            return Answer::Infinite;
        }
        if let Some(exact) = self.values[state].to_rational() {
            return Answer::from_exact(exact);
        }
        let (value, error) = (self.values[state].to_f64(), self.error(state));
        let (mut lower, mut upper) = if error == 0.0 {
            (value, value)
        } else {
            ((value - error).next_down(), (value + error).next_up())
        };
        if self.span <= Span::Positive {
            lower = lower.max(0.0);
        }
        if self.span == Span::Probability {
            upper = upper.min(1.0);
        }
        let value = if self.span == Span::Probability { value.min(1.0) } else { value };
        Answer::Finite(Quantity { value, lower, upper, exact: None })
    }

    /// Returns the lower and upper bound on the value of a state; `None` if the value is infinite.
    pub fn ends(&self, state: usize) -> Option<(BigRational, BigRational)> {
        match self.answer(state) {
            Answer::Finite(Quantity { exact: Some(exact), .. }) => Some((exact.clone(), exact)),
            Answer::Finite(quantity) => Some((
                // Infinite bounds become the greatest and the least double. Numbers with which values
                // are compared are assumed to be between these.
                BigRational::from_float(quantity.lower.max(f64::MIN))?,
                BigRational::from_float(quantity.upper.min(f64::MAX))?,
            )),
            _ => None,
        }
    }

    pub fn everywhere(value: &BigRational, states: usize) -> Self {
        let rounded = N::from_rational(value);
        let (lower, upper) = enclosing(value);
        let error = if N::EXACT || lower.to_bits() == upper.to_bits() { 0.0 } else { upper - lower };
        let errors = if N::EXACT { Vec::new() } else { vec![error; states] };
        Self {
            values: vec![rounded; states],
            errors,
            infinite: FixedBitSet::with_capacity(states),
            span: Span::Any,
        }
    }
}
