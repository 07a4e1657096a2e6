//! Compiles metrics to operator costs, which are minimised.
//!
//! A metric is a linear expression over fluents and total time. A fluent whose changes are state-independent
//! becomes a constant offset plus a sum of operator costs. The other fluents remain in the objective, and
//! their final values are added to the cost of a plan at its end. A planner that minimises operator costs
//! alone does not minimise such a metric. A metric to be maximised is negated. Without a metric, the cost is
//! the total duration if the domain has a durative action, and the number of actions otherwise.
use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;

use num_traits::{One, Zero};

use crate::error::{Error, Errors, Place};
use crate::ground::config::Generality;
use crate::ground::evaluate::expression::ground;
use crate::ground::vocabulary::eval_error::Failure;
use crate::ground::vocabulary::operator::GroundOperator;
use crate::ground::vocabulary::task::{GroundObjective, GroundTask};
use crate::ground::vocabulary::world::World;
use crate::lifted::{Expression, Metric, Rational};
use crate::task::quantity::{Linear, NumericId, Quantity};
use crate::task::table_map::TableMap;
use pddl::ast::Direction;

/// Computes the costs of all operators, and stores the parts of the metrics that are not operator costs in the
/// task.
///
/// # Errors
/// A metric is not linear, divides by 0, reads a function without a value, or contains a fluent with state-dependent changes
/// although `generality` does not allow this. It is also an error if the deadline has passed or the run is
/// interrupted.
pub fn attach_costs(task: &mut GroundTask<'_>, generality: &Generality) -> Result<(), Errors> {
    let lifted = task.world.lifted;
    if lifted.metrics.is_empty() {
        let temporal =
            lifted.schemas.iter().any(|schema| schema.duration.is_some() || schema.joint.is_some());
        for operator in &mut task.operators {
            // A wait is not an action of the plan and has no cost.
            let unit = Quantity::constant(Rational::from_integer(i128::from(operator.wait.is_none())));
            operator.costs = vec![if temporal { operator.duration.clone() } else { unit }];
        }
        task.objectives = vec![GroundObjective::default()];
        return Ok(());
    }
    let mut errors = Vec::new();
    for metric in &lifted.metrics {
        attach(task, metric, generality).unwrap_or_else(|error| errors.push(error));
    }
    if errors.is_empty() { Ok(()) } else { Err(errors.into()) }
}

fn attach(task: &mut GroundTask<'_>, metric: &Metric, generality: &Generality) -> Result<(), Error> {
    let limits = task.world.limits;
    let (mut linear, mut time) = split(&mut task.world, &metric.expression, metric.place)?;
    let maximize = metric.direction == Direction::Maximize;
    // Operator costs are minimised.
    if maximize {
        linear = linear.negated();
        time = -time;
    }
    let rest = rest(task, &mut linear, (metric, generality))?;
    // Costs are changes of fluents, so the initial values of the fluents become a constant offset.
    let initial: Vec<_> = linear
        .coefficients
        .iter()
        .map(|(variable, factor)| task.world.initial_value(*variable) * factor)
        .collect();
    let offset = initial.into_iter().fold(linear.quantity.constant.clone(), |sum, value| sum + value);
    task.objectives.push(GroundObjective { offset, maximize, rest });
    let mut scaled = ScaledQuantities::default();
    for operator in limits.watch(&mut task.operators) {
        let operator = operator?;
        operator.costs.push(cost(operator, &linear, &time, &mut scaled));
    }
    Ok(())
}

/// Removes the fluents with state-dependent changes from a metric and returns them with their factors. If `generality`
/// measures rewards, also removes the fluents with changes that improve the metric.
fn rest(
    task: &GroundTask<'_>,
    linear: &mut Linear<Rational>,
    (metric, generality): (&Metric, &Generality),
) -> Result<Vec<(NumericId, Rational)>, Error> {
    let mut dependent: BTreeSet<NumericId> = BTreeSet::new();
    for operator in task.world.limits.watch(&task.operators) {
        let operator = operator?;
        for (variable, value, factor) in measured_effects(operator, linear) {
            // A state-independent change has the form `variable + quantity`.
            let is_dependent = value.coefficients[..] != [(variable, Rational::one())];
            let is_reward = generality.measures_rewards && lowers(value, factor);
            if is_dependent && !generality.measures_ends {
                return Err(Error::Unsupported {
                    construct: format!(
                        "a metric over a fluent that `{}` changes depending on the state",
                        task.world.lifted.schemas[operator.schema as usize].name
                    ),
                    instead: "a metric over fluents that are only increased or decreased by constants".into(),
                    place: metric.place,
                });
            }
            if is_dependent || is_reward {
                dependent.insert(variable);
            }
        }
    }
    let (rest, kept) = linear.coefficients.drain(..).partition(|(variable, _)| dependent.contains(variable));
    linear.coefficients = kept;
    Ok(rest)
}

/// Returns the numeric effects of an operator on the fluents of a metric, each with the factor of the fluent.
fn measured_effects<'o>(
    operator: &'o GroundOperator,
    metric: &'o Linear<Rational>,
) -> impl Iterator<Item = (NumericId, &'o Linear<Rational>, &'o Rational)> {
    operator.numeric_effects.iter().filter_map(|(variable, value)| {
        let position = metric.coefficients.binary_search_by_key(variable, |(fluent, _)| *fluent).ok()?;
        Some((*variable, value, &metric.coefficients[position].1))
    })
}

fn lowers(value: &Linear<Rational>, factor: &Rational) -> bool {
    let mut change = value.quantity.clone();
    change.scale(factor);
    change.minimum().is_negative()
}

fn split(
    world: &mut World<'_>,
    expression: &Expression,
    place: Place,
) -> Result<(Linear<Rational>, Rational), Error> {
    match expression {
        Expression::TotalTime => Ok((Linear::constant(Rational::zero()), Rational::from_integer(1))),
        Expression::Sum(parts) => {
            let (mut sum, mut time) = (Linear::constant(Rational::zero()), Rational::zero());
            for part in parts {
                let (linear, part_time) = split(world, part, place)?;
                sum.add(&linear);
                time += part_time;
            }
            Ok((sum, time))
        }
        Expression::Negate(inner) => {
            split(world, inner, place).map(|(linear, time)| (linear.negated(), -time))
        }
        Expression::Product(parts, place) => {
            let mut product = (Linear::constant(Rational::from_integer(1)), Rational::zero());
            for part in parts {
                let (linear, time) = split(world, part, *place)?;
                product = multiply(product, (linear, time)).ok_or(Error::NonLinear { place: *place })?;
            }
            Ok(product)
        }
        Expression::Quotient(left, right, place) => {
            let (mut linear, time) = split(world, left, *place)?;
            let (divisor, divisor_time) = split(world, right, *place)?;
            let constant = divisor.quantity.constant.clone();
            if !divisor.coefficients.is_empty() || !divisor_time.is_zero() {
                return Err(Error::NonLinear { place: *place });
            }
            if constant.is_zero() {
                return Err(Error::ZeroDivisor { place: *place });
            }
            linear.scale(&constant.recip());
            Ok((linear, time / constant))
        }
        Expression::Number(_) | Expression::Function(..) => match ground(world, expression, &Vec::new()) {
            Ok(linear) => Ok((linear, Rational::zero())),
            Err(Failure::Error(error)) => Err(error),
            Err(Failure::Undefined) => Err(Error::Unsupported {
                construct: "a metric over a function without a value".into(),
                instead: "a value for it in `:init`".into(),
                place,
            }),
        },
    }
}

fn multiply(
    left: (Linear<Rational>, Rational),
    right: (Linear<Rational>, Rational),
) -> Option<(Linear<Rational>, Rational)> {
    let constant =
        |(linear, time): &(Linear<Rational>, Rational)| linear.coefficients.is_empty() && time.is_zero();
    let ((mut linear, time), (factor, _)) = if constant(&right) {
        (left, right)
    } else if constant(&left) {
        (right, left)
    } else {
        return None;
    };
    linear.scale(&factor.quantity.constant);
    Some((linear, time * &factor.quantity.constant))
}

/// Cache of multiplied quantities, so that tables shared between operators remain shared.
#[derive(Default)]
struct ScaledQuantities {
    by_factor: BTreeMap<Rational, TableMap<Rational>>,
}

impl ScaledQuantities {
    fn times(&mut self, quantity: &Quantity<Rational>, factor: &Rational) -> Quantity<Rational> {
        if factor.is_one() {
            return quantity.clone();
        }
        if factor.is_zero() {
            return Quantity::constant(Rational::zero());
        }
        let tables = self.by_factor.entry(factor.clone()).or_default();
        let Ok(scaled) = tables.map::<Infallible>(quantity, &|number| Ok(number.clone() * factor));
        scaled
    }
}

fn cost(
    operator: &GroundOperator,
    metric: &Linear<Rational>,
    time: &Rational,
    scaled: &mut ScaledQuantities,
) -> Quantity<Rational> {
    let mut total = scaled.times(&operator.duration, time);
    for (_, value, factor) in measured_effects(operator, metric) {
        total.add(&scaled.times(&value.quantity, factor));
    }
    total
}
