//! The metric of concurrent plans: a weight for the makespan plus the costs of actions.

use pddl::ast::Direction;
use task::error::Error;
use task::lifted::{Expression, Metric, Rational};
use task::normalize::duration::time_factor;
use task::number::{Int, LIMIT, checked_lcm};
use task::plan::Exact;
use task::task::Objective;
use task::task::number::TaskNumber;

/// The metric in integers: `time` for each unit of time and `cost` for each unit of cost.
#[derive(Debug, Clone)]
pub(super) struct Measure {
    pub(super) time: Int,
    pub(super) cost: Int,
    /// Both together are this many times the metric.
    scale: Int,
    offset: Int,
    maximize: bool,
}

impl Measure {
    /// For costs by an objective, and times that are `time_scale` times those of the files.
    pub(super) fn new(objective: &Objective, weight: Rational, time_scale: Int) -> Result<Self, Error> {
        let overflow = || Error::overflow("the metric");
        let by_time = weight / Rational::from_integer(time_scale);
        let common = by_time.denominator().and_then(|own| checked_lcm(own, objective.scale));
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

    /// A plan of this makespan and cost, in integers; none if that does not fit.
    pub(super) fn total(&self, makespan: Int, cost: Int) -> Option<Int> {
        self.time.checked_mul(makespan)?.checked_add(self.cost.checked_mul(cost)?)
    }

    /// The metric of the file.
    pub(super) fn metric(&self, total: &Rational) -> Exact {
        let sum = total.clone() + Rational::from_integer(self.offset);
        Exact::scaled(&if self.maximize { -sum } else { sum }, self.scale)
    }

    /// The total that has a metric.
    pub(super) fn total_of(&self, metric: &Exact) -> Rational {
        let scaled = Rational::from_big(metric.to_rational()) * Rational::from_integer(self.scale);
        (if self.maximize { -scaled } else { scaled }) - &Rational::from_integer(self.offset)
    }
}

/// The weight of the makespan in a metric to be minimised, and the rest of the metric. None if it is not linear in time.
pub(super) fn split(metric: &Metric) -> Option<(Rational, Metric)> {
    let factor = time_factor(&metric.expression)?;
    let weight = if metric.direction == Direction::Minimize { factor } else { -factor };
    let rest = Metric { expression: without_time(&metric.expression), ..metric.clone() };
    (!weight.is_negative()).then_some((weight, rest))
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
