//! Values as they are reported.

use num_rational::BigRational;

use crate::number::{Number, enclosing};

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

/// How wide the bounds on a value may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Precision {
    /// So much, as a part of the value.
    Relative(f64),
    /// So much.
    Absolute(f64),
}

impl Precision {
    /// Whether the bounds on a value are within it.
    pub fn holds(self, quantity: &Quantity) -> bool {
        let width = quantity.upper - quantity.lower;
        match self {
            _ if quantity.exact.is_some() => true,
            // The ends are rounded to doubles.
            Self::Relative(most) => width <= (most.max(4.0 * f64::EPSILON)) * quantity.value.abs(),
            Self::Absolute(most) => width <= most.max(4.0 * f64::EPSILON * quantity.value.abs()),
        }
    }
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
    /// The least and the greatest value, where there are several states to start in or it was asked for.
    Range(Answer, Answer),
    /// Some states, with their values.
    States(Vec<Listed>),
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

impl Outcome {
    /// Whether the bounds on all of its values are within a width.
    pub fn is_within(&self, precision: Precision) -> bool {
        let fits = |answer: &Answer| answer.quantity().is_none_or(|quantity| precision.holds(quantity));
        match self {
            Self::Value(answer) | Self::Undecided(answer) => fits(answer),
            Self::Range(least, greatest) => fits(least) && fits(greatest),
            Self::States(states) => states.iter().filter_map(|state| state.answer.as_ref()).all(fits),
            Self::Front(vertices) => vertices.iter().flatten().all(fits),
            Self::Constrained { randomised, deterministic, .. } => fits(randomised) && fits(deterministic),
            // What is decided is decided.
            Self::Truth(..) => true,
        }
    }
}

/// A state with its value.
#[derive(Debug, Clone, PartialEq)]
pub struct Listed {
    /// The values of the variables, in their order.
    pub values: Vec<i64>,
    /// Whether the property holds, for one that does or does not.
    pub truth: Option<bool>,
    /// The value, for a property that has one.
    pub answer: Option<Answer>,
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
