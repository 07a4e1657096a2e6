//! The metric of concurrent plans: a weight for the makespan plus the costs of actions.

use num_bigint::BigInt;
use num_integer::Integer as _;
use num_rational::BigRational;
use pddl::ast::Direction;
use task::error::{Error, Place};
use task::lifted::{Expression, Metric, Rational};
use task::normalize::duration::time_factor;
use task::number::Int;
use task::plan::Exact;
use task::task::Objective;

use crate::concurrent::time_number::TimeNumber;

/// The minimised metric as an integer: `time` per internal time unit plus `cost` per unit of the
/// task's cost.
#[derive(Debug, Clone)]
pub(super) struct Measure<T: TimeNumber = Int> {
    pub(super) time: T,
    pub(super) cost: T,
    /// Integer value per unit of the PDDL metric.
    scale: T,
    offset: T,
    maximize: bool,
}

impl<T: TimeNumber> Measure<T> {
    /// Computes the integer weights of costs and times. `weight` is the metric per PDDL time unit,
    /// `unit` the number of internal time units per PDDL time unit.
    ///
    /// # Errors
    /// `Error::Overflow` if `T` is too narrow.
    pub(super) fn new(objective: &Objective, weight: &Rational, unit: &BigInt) -> Result<Self, Error> {
        let overflow = || Error::overflow("the metric");
        let factor = |number: &BigRational| {
            let integer = number.is_integer().then(|| number.to_integer())?;
            T::from_big(&integer).filter(|_| integer.bits() <= T::FACTOR_BITS)
        };
        let integer = |number: Int| BigRational::from_integer(number.into());
        let by_time = weight.to_big() / BigRational::from_integer(unit.clone());
        let scale = BigRational::from_integer(by_time.denom().lcm(&objective.scale.into()));
        let cost = &scale / integer(objective.scale);
        let offset = integer(objective.offset) * &cost;
        Ok(Self {
            time: factor(&(by_time * &scale)).ok_or_else(overflow)?,
            cost: factor(&cost).ok_or_else(overflow)?,
            scale: factor(&scale).ok_or_else(overflow)?,
            offset: T::from_big(&offset.to_integer())
                .filter(|offset| offset.is_moderate())
                .ok_or_else(overflow)?,
            maximize: objective.maximize,
        })
    }

    /// Integer metric of a plan with this makespan and cost. Returns `None` if the metric
    /// overflows.
    pub(super) fn total(&self, makespan: T, cost: Int) -> Option<T> {
        self.time.checked_mul(makespan)?.checked_add(self.cost.checked_mul(cost.into())?)
    }

    pub(super) fn metric(&self, total: &Rational) -> Exact {
        let sum = (total.clone() + self.offset.to_rational()) / self.scale.to_rational();
        Exact::scaled(&if self.maximize { -sum } else { sum }, 1)
    }

    pub(super) fn total_of(&self, metric: &Exact) -> Rational {
        let scaled = Rational::from_big(metric.to_rational()) * self.scale.to_rational();
        (if self.maximize { -scaled } else { scaled }) - &self.offset.to_rational()
    }
}

/// Splits a metric into the weight of the makespan in the minimised metric and the metric without
/// `total-time`.
///
/// # Errors
/// The metric has the divisor 0, is not linear in time, or rewards a longer makespan.
pub(super) fn split(metric: &Metric) -> Result<(Rational, Metric), Error> {
    let unsupported = || Error::Unsupported {
        construct: "a metric that rewards time, or is not linear in it, where actions overlap".into(),
        instead:
            "a metric that grows with `total-time` and multiplies it by numbers only, or does not mention it"
                .into(),
        place: metric.place,
    };
    if let Some(place) = zero_divisor(&metric.expression) {
        return Err(Error::ZeroDivisor { place });
    }
    let factor = time_factor(&metric.expression).ok_or_else(unsupported)?;
    let weight = if metric.direction == Direction::Minimize { factor } else { -factor };
    if weight.is_negative() {
        return Err(unsupported());
    }
    Ok((weight, Metric { expression: without_time(&metric.expression), ..metric.clone() }))
}

fn zero_divisor(expression: &Expression) -> Option<Place> {
    match expression {
        Expression::Quotient(left, right, place) => match &**right {
            Expression::Number(number) if *number == Rational::from_integer(0) => Some(*place),
            _ => zero_divisor(left).or_else(|| zero_divisor(right)),
        },
        Expression::Sum(parts) | Expression::Product(parts, _) => parts.iter().find_map(zero_divisor),
        Expression::Negate(inner) => zero_divisor(inner),
        Expression::TotalTime | Expression::Number(_) | Expression::Function(..) => None,
    }
}

fn without_time(expression: &Expression) -> Expression {
    let each = |parts: &[Expression]| parts.iter().map(without_time).collect();
    match expression {
        Expression::TotalTime => Expression::Number(Rational::from_integer(0)),
        Expression::Sum(parts) => Expression::Sum(each(parts)),
        Expression::Product(parts, place) => Expression::Product(each(parts), *place),
        Expression::Negate(inner) => Expression::Negate(Box::new(without_time(inner))),
        Expression::Quotient(left, right, place) => {
            Expression::Quotient(Box::new(without_time(left)), right.clone(), *place)
        }
        Expression::Number(_) | Expression::Function(..) => expression.clone(),
    }
}
