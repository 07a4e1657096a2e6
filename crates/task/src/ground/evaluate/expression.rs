//! Evaluates numeric expressions whose slot parameters are bound.

use crate::error::{Error, Place};
use crate::ground::vocabulary::atom::{Binding, arguments};
use crate::ground::vocabulary::eval_error::Failure;
use crate::ground::vocabulary::world::World;
use crate::lifted::{Expression, Rational};
use crate::task::quantity::Linear;

/// Evaluates an expression under a binding to a linear expression over numeric fluents. The binding must assign all
/// slot parameters in the expression.
///
/// # Errors
/// A value is undefined, the expression is not linear, or a fluent has no initial value.
pub fn ground(
    world: &mut World<'_>,
    expression: &Expression,
    binding: &Binding,
) -> Result<Linear<Rational>, Failure> {
    match expression {
        Expression::Number(number) => Ok(Linear::constant(number.clone())),
        // `total-time` occurs only in metrics. The `metric` pass removes it before it calls this function.
        Expression::TotalTime => Err(Failure::Undefined),
        Expression::Function(function, terms, place) => {
            let arguments = arguments(terms, binding);
            if world.lifted.functions[function.index()].fluent {
                return Ok(Linear::variable(world.numeric(*function, &arguments, *place)?));
            }
            world.value(*function, &arguments).map(Linear::constant).ok_or(Failure::Undefined)
        }
        Expression::Sum(parts) => {
            let mut sum = Linear::constant(Rational::from_integer(0));
            for part in parts {
                sum.add(&ground(world, part, binding)?);
            }
            Ok(sum)
        }
        Expression::Negate(inner) => Ok(ground(world, inner, binding)?.negated()),
        Expression::Product(parts, place) => {
            let mut product = Linear::constant(Rational::from_integer(1));
            for part in parts {
                let factor = ground(world, part, binding)?;
                product = multiply(product, factor, *place)?;
            }
            Ok(product)
        }
        Expression::Quotient(left, right, place) => {
            let divisor = ground(world, right, binding)?;
            if !divisor.coefficients.is_empty() {
                return Err(Failure::Error(Error::NonLinear { place: *place }));
            }
            let divisor = divisor.quantity.constant;
            // Division by zero leaves the value undefined.
            if divisor == Rational::from_integer(0) {
                return Err(Failure::Undefined);
            }
            let mut value = ground(world, left, binding)?;
            value.scale(&divisor.recip());
            Ok(value)
        }
    }
}

fn multiply(
    left: Linear<Rational>,
    right: Linear<Rational>,
    place: Place,
) -> Result<Linear<Rational>, Failure> {
    let (mut scaled, factor) = match (left.coefficients.is_empty(), right.coefficients.is_empty()) {
        (_, true) => (left, right),
        (true, false) => (right, left),
        (false, false) => return Err(Failure::Error(Error::NonLinear { place })),
    };
    scaled.scale(&factor.quantity.constant);
    Ok(scaled)
}
