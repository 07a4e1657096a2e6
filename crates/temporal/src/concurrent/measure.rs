//! The metric of concurrent plans: a weight for the makespan plus the costs of actions.

use pddl::ast::Direction;
use task::error::Error;
use task::lifted::{Expression, Metric, Rational};
use task::normalize::duration::time_factor;
use task::number::{Int, LIMIT, checked_lcm};
use task::plan::Exact;
use task::task::Objective;
use task::task::number::TaskNumber;

/// The minimised metric as an integer: `time` per internal time unit plus `cost` per unit of the
/// task's cost.
#[derive(Debug, Clone)]
pub(super) struct Measure {
    pub(super) time: Int,
    pub(super) cost: Int,
    /// Integer value per unit of the PDDL metric.
    scale: Int,
    offset: Int,
    maximize: bool,
}

impl Measure {
    /// Computes the integer weights of costs and times. `weight` is the metric per PDDL time unit,
    /// `time_scale` the number of internal time units per PDDL time unit.
    pub(super) fn new(objective: &Objective, weight: Rational, time_scale: Int) -> Result<Self, Error> {
        let overflow = || Error::overflow("the metric");
        let by_time = weight / Rational::from_integer(time_scale);
        let common = by_time.denominator().and_then(|denominator| checked_lcm(denominator, objective.scale));
        let scale = common.filter(|scale| *scale < LIMIT).ok_or_else(overflow)?;
        let time = (by_time * Rational::from_integer(scale)).to_int();
        let cost = scale.checked_div(objective.scale).ok_or_else(overflow)?;
        let offset = objective.offset.checked_mul(cost).filter(Int::is_moderate).ok_or_else(overflow)?;
        Ok(Self {
            time: time.filter(|time| *time < LIMIT).ok_or_else(overflow)?,
            cost,
            scale,
            offset,
            maximize: objective.maximize,
        })
    }

    /// Integer metric of a plan with this makespan and cost. Returns `None` if the metric
    /// overflows.
    pub(super) fn total(&self, makespan: Int, cost: Int) -> Option<Int> {
        self.time.checked_mul(makespan)?.checked_add(self.cost.checked_mul(cost)?)
    }

    /// Converts an integer value to the metric of the PDDL problem.
    pub(super) fn metric(&self, total: &Rational) -> Exact {
        let sum = total.clone() + Rational::from_integer(self.offset);
        Exact::scaled(&if self.maximize { -sum } else { sum }, self.scale)
    }

    pub(super) fn total_of(&self, metric: &Exact) -> Rational {
        let scaled = Rational::from_big(metric.to_rational()) * Rational::from_integer(self.scale);
        (if self.maximize { -scaled } else { scaled }) - &Rational::from_integer(self.offset)
    }
}

/// Splits a metric into the weight of the makespan in the minimised metric and the metric without
/// `total-time`. Returns `None` if the metric is not linear in time or rewards a longer makespan.
pub(super) fn split(metric: &Metric) -> Option<(Rational, Metric)> {
    let factor = time_factor(&metric.expression)?;
    let weight = if metric.direction == Direction::Minimize { factor } else { -factor };
    let cost_metric = Metric { expression: without_time(&metric.expression), ..metric.clone() };
    (!weight.is_negative()).then_some((weight, cost_metric))
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
