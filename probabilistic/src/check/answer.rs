//! Values as they are reported.

use num_rational::BigRational;

use crate::number::{Number, enclosing};
use crate::solve::Solution;

/// A number that was asked for, with bounds on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// The value, as near as it is known.
    pub value: f64,
    /// The true value is at least this.
    pub lower: f64,
    /// The true value is at most this; may be infinite where nothing better was found.
    pub upper: f64,
    /// The true value, where it was computed exactly.
    pub exact: Option<BigRational>,
}

/// A value that was asked for.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// A number.
    Finite(Quantity),
    /// Infinity.
    Infinite,
    /// There is no such value: no policy does what is asked.
    Undefined,
}

/// What a property is answered with.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// A value.
    Value(Answer),
    /// Whether a bound is kept, with the value; none where the bounds on the value do not decide it.
    Truth(bool, Option<Answer>),
    /// The bounds on the value do not decide whether the bound is kept.
    Undecided(Answer),
    /// The vertices of a Pareto front.
    Front(Vec<[Answer; 2]>),
    /// The best value under a bound on a second objective.
    Constrained {
        /// By policies that may draw lots.
        randomised: Answer,
        /// By policies that may not.
        deterministic: Answer,
        /// Whether the latter is proved to be the best.
        proved: bool,
    },
}

impl Answer {
    /// From an exact or rounded number with its error.
    pub fn from_number<N: Number>(value: &N, error: f64) -> Self {
        if let Some(exact) = value.to_rational() {
            return Self::from_exact(exact);
        }
        let value = value.to_f64();
        let (lower, upper) = match error {
            0.0 => (value, value),
            error => ((value - error).next_down(), (value + error).next_up()),
        };
        Self::Finite(Quantity { value, lower: lower.max(0.0), upper, exact: None })
    }

    /// From a rounded number and its bounds.
    pub fn between(value: f64, [lower, upper]: [f64; 2]) -> Self {
        Self::Finite(Quantity { value, lower, upper, exact: None })
    }

    /// From an exact number.
    pub fn from_exact(exact: BigRational) -> Self {
        let (lower, upper) = enclosing(&exact);
        Self::Finite(Quantity { value: Number::to_f64(&exact), lower, upper, exact: Some(exact) })
    }

    /// The value of a state.
    pub fn of<N: Number>(solution: &Solution<N>, state: usize) -> Self {
        match solution.bounds(state) {
            None => Self::Infinite,
            Some((lower, upper)) => Self::Finite(Quantity {
                value: solution.values[state].to_f64(),
                lower,
                upper,
                exact: solution.values[state].to_rational(),
            }),
        }
    }

    /// A probability from that of its complement.
    #[must_use]
    pub fn complement(self) -> Self {
        match self {
            Self::Finite(Quantity { exact: Some(exact), .. }) => {
                Self::from_exact(<BigRational as Number>::one() - exact)
            }
            Self::Finite(quantity) => Self::Finite(Quantity {
                value: 1.0 - quantity.value,
                lower: if quantity.upper == 0.0 { 1.0 } else { (1.0 - quantity.upper).next_down().max(0.0) },
                upper: if quantity.lower == 0.0 { 1.0 } else { (1.0 - quantity.lower).next_up().min(1.0) },
                exact: None,
            }),
            other => other,
        }
    }

    /// As a probability: bounds within 0 and 1.
    #[must_use]
    pub fn probability(self) -> Self {
        match self {
            Self::Finite(quantity) => Self::Finite(Quantity {
                value: quantity.value.min(1.0),
                upper: quantity.upper.min(1.0),
                ..quantity
            }),
            other => other,
        }
    }

    /// The number, if it is one.
    pub fn quantity(&self) -> Option<&Quantity> {
        match self {
            Self::Finite(quantity) => Some(quantity),
            _ => None,
        }
    }
}
