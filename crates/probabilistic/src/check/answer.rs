//! The values that a check reports.

use num_rational::BigRational;

use crate::number::{Number, enclosing};

/// A computed value with a lower and an upper bound on the true value.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Approximation of the true value.
    pub value: f64,
    /// Lower bound on the true value.
    pub lower: f64,
    /// Upper bound on the true value; infinite if no finite bound is proved.
    pub upper: f64,
    /// The true value, if it was computed exactly.
    pub exact: Option<BigRational>,
}

/// Required width of the bounds on a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Precision {
    /// Upper limit on the difference of the bounds, divided by the absolute value.
    Relative(f64),
    /// Upper limit on the difference of the bounds.
    Absolute(f64),
}

impl Precision {
    /// Returns `true` if the bounds of `quantity` satisfy this precision, or if its value is exact. A width of
    /// 4 machine epsilons, relative to the value, always suffices.
    pub fn holds(self, quantity: &Quantity) -> bool {
        let width = quantity.upper - quantity.lower;
        match self {
            _ if quantity.exact.is_some() => true,
            // The bounds are rounded to doubles, so a smaller width may be impossible.
            Self::Relative(most) => width <= (most.max(4.0 * f64::EPSILON)) * quantity.value.abs(),
            Self::Absolute(most) => width <= most.max(4.0 * f64::EPSILON * quantity.value.abs()),
        }
    }
}

/// The value of a numeric property: a number, infinity, or undefined.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// A number.
    Finite(Quantity),
    /// Infinity.
    Infinite,
    /// Undefined: no policy satisfies the constraints.
    Undefined,
}

/// The result of checking a property.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The value of a numeric property.
    Value(Answer),
    /// The truth value of a Boolean property. For a comparison like `P>=0.9 [ F "goal" ]` in a model with one
    /// initial state, also the compared value.
    Truth(bool, Option<Answer>),
    /// The lower and the upper bound on the value lie on different sides of the threshold of the comparison, so
    /// the truth value is unknown.
    Undecided(Answer),
    /// The least and the greatest value, over several initial states or over the states of a filter.
    Range(Answer, Answer),
    /// The states selected by a filter, with their values.
    States(Vec<Listed>),
    /// The vertices of a Pareto front, each with the values of both objectives.
    Front(Vec<[Answer; 2]>),
    /// The optimum of one objective under a bound on another.
    Constrained {
        /// The optimum over randomised policies; undefined if no policy was found within the bound.
        randomised: Answer,
        /// The best value found over deterministic policies; undefined if no policy was found.
        deterministic: Answer,
        /// `true` if it is proved that no deterministic policy is better (in doubles: by more than the bounds
        /// permit), or that no policy satisfies the bound.
        proved: bool,
    },
}

impl Outcome {
    /// Returns `true` if the bounds on all numeric values of this outcome satisfy `precision`. Always `true`
    /// for a truth value.
    pub fn is_within(&self, precision: Precision) -> bool {
        let fits = |answer: &Answer| answer.quantity().is_none_or(|quantity| precision.holds(quantity));
        match self {
            Self::Value(answer) | Self::Undecided(answer) => fits(answer),
            Self::Range(least, greatest) => fits(least) && fits(greatest),
            Self::States(states) => states.iter().filter_map(|state| state.answer.as_ref()).all(fits),
            Self::Front(vertices) => vertices.iter().flatten().all(fits),
            Self::Constrained { randomised, deterministic, .. } => fits(randomised) && fits(deterministic),
            // A truth value has no width.
            Self::Truth(..) => true,
        }
    }
}

/// A state selected by a filter, with its value.
#[derive(Debug, Clone, PartialEq)]
pub struct Listed {
    /// The values of the variables of the state, in the order of the variables in the model.
    pub values: Vec<i64>,
    /// The truth value in this state if the property is Boolean.
    pub truth: Option<bool>,
    /// The value in this state if the property is numeric.
    pub answer: Option<Answer>,
}

impl Answer {
    /// Creates an answer from an exact number, or from a nonnegative rounded number and an upper limit on its
    /// absolute error. The lower bound on a rounded number is at least 0.
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

    /// Creates an answer from a rounded number and its lower and upper bound.
    pub fn between(value: f64, [lower, upper]: [f64; 2]) -> Self {
        Self::Finite(Quantity { value, lower, upper, exact: None })
    }

    /// Creates an answer from an exact number.
    pub fn from_exact(exact: BigRational) -> Self {
        let (lower, upper) = enclosing(&exact);
        Self::Finite(Quantity { value: Number::to_f64(&exact), lower, upper, exact: Some(exact) })
    }

    /// Returns the complementary probability (1 minus the value), with the bounds exchanged. An
    /// infinite or undefined answer is unchanged.
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

    /// Clamps a probability and its upper bound to 1.
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

    /// Returns the number with its bounds, or `None` if the answer is infinite or undefined.
    pub fn quantity(&self) -> Option<&Quantity> {
        match self {
            Self::Finite(quantity) => Some(quantity),
            _ => None,
        }
    }
}
