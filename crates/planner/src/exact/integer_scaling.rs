//! Scales the constants of a task in rationals to integers, which are faster to add and compare.

use std::convert::Infallible;

use num_rational::BigRational;
use num_traits::One;

use task::context::Context;
use task::limits::Interrupted;
use task::number::Rational;
use task::task::common_denominator::CommonDenominator;
use task::task::quantity::{Linear, Quantity};
use task::task::table_map::TableMap;
use task::task::{Condition, Task};

const MOST_BITS: u64 = 200;

/// A task whose constants are scaled to integers where possible. The factor of the costs is
/// `cost_scale`.
pub struct Integral {
    pub(crate) task: Task<Rational>,
    pub(crate) cost_scale: Rational,
}

fn compared(condition: &mut Condition<Rational>) -> impl Iterator<Item = &mut Linear<Rational>> {
    condition.comparisons.iter_mut().chain(&mut condition.above)
}

fn linears(task: &mut Task<Rational>) -> impl Iterator<Item = &mut Linear<Rational>> {
    let bodies = task.axioms.iter_mut().flat_map(|layer| &mut layer.rules).map(|rule| &mut rule.body);
    let operators = task.operators.iter_mut().flat_map(|operator| {
        let values = operator.numeric_effects.iter_mut().map(|effect| &mut effect.value);
        compared(&mut operator.condition).chain(values)
    });
    bodies.chain([&mut task.goal]).flat_map(compared).chain(operators)
}

/// Returns the common denominator as a scaling factor, or 1 if the denominator has too many bits.
fn scale(denominator: CommonDenominator) -> Rational {
    let scale = |common| Rational::from_big(BigRational::from_integer(common));
    denominator.get().map_or_else(Rational::one, scale)
}

fn multiply(quantity: &mut Quantity<Rational>, scale: &Rational, tables: &mut TableMap<Rational>) {
    let product = |number: &Rational| Ok::<_, Infallible>(number.clone() * scale);
    let Ok(scaled) = tables.map(quantity, &product);
    *quantity = scaled;
}

impl Integral {
    pub(crate) fn of(context: Context<'_, Rational>) -> Result<Self, Interrupted> {
        let mut task = context.task.clone();
        let mut costs = CommonDenominator::of_at_most(MOST_BITS);
        for operator in context.limits.watch(&task.operators) {
            costs.quantity(&operator?.cost);
        }
        let mut numbers = CommonDenominator::of_at_most(MOST_BITS);
        task.initial.numbers.iter().for_each(|number| numbers.number(number));
        for linear in linears(&mut task) {
            numbers.quantity(&linear.quantity);
        }
        let (cost_scale, number_scale) = (scale(costs), scale(numbers));
        let mut tables = TableMap::default();
        for operator in &mut task.operators {
            multiply(&mut operator.cost, &cost_scale, &mut tables);
        }
        for number in &mut task.initial.numbers {
            *number = number.clone() * &number_scale;
        }
        let mut tables = TableMap::default();
        for linear in linears(&mut task) {
            multiply(&mut linear.quantity, &number_scale, &mut tables);
        }
        Ok(Self { task, cost_scale })
    }
}
