//! Evaluates expressions with unbound slots (parameters whose designs are not grounded) to tables. A table has one
//! value for each combination of the designs that are possible for its slots.

use crate::error::Error;
use crate::ground::evaluate::expression::ground;
use crate::ground::vocabulary::atom::Binding;
use crate::ground::vocabulary::eval_error::Failure;
use crate::ground::vocabulary::world::World;
use crate::lifted::configuration::{SlotParameter, slots_of_expression};
use crate::lifted::{Expression, ObjectId, Rational};
use crate::limits::{LimitPoll, Limits};
use crate::task::quantity::{Linear, Quantity, SlotSet, Table};

/// Unbound slot parameters of the current action schema, with the designs that are still possible for each.
pub struct Slots<'a> {
    pub(crate) parameters: &'a [SlotParameter],
    pub(crate) designs: Vec<Vec<ObjectId>>,
}

impl Slots<'_> {
    pub(crate) fn sizes(&self) -> Vec<usize> {
        self.designs.iter().map(Vec::len).collect()
    }
}

/// Evaluates an expression with unbound slot parameters. Each summand becomes a separate table over the slots that it
/// mentions. Design combinations with undefined values count as 0, and are passed to `undefined` as (slots, design
/// indices).
///
/// # Errors
/// The expression is not linear, a part that mentions no slot is undefined, a fluent has no initial value, the
/// deadline has passed, or the run is interrupted.
pub fn open(
    world: &mut World<'_>,
    expression: &Expression,
    binding: &mut Binding,
    slots: &Slots<'_>,
    undefined: &mut dyn FnMut(&SlotSet, SlotSet),
) -> Result<Linear<Rational>, Failure> {
    let mentioned = slots_of_expression(expression, slots.parameters);
    if mentioned.is_empty() {
        return ground(world, expression, binding);
    }
    match expression {
        Expression::Sum(parts) => {
            let mut sum = Linear::constant(Rational::from_integer(0));
            for part in parts {
                sum.add(&open(world, part, binding, slots, undefined)?);
            }
            Ok(sum)
        }
        Expression::Negate(inner) => Ok(open(world, inner, binding, slots, undefined)?.negated()),
        Expression::Product(parts, place) => {
            let (mentioning, closed): (Vec<_>, Vec<_>) =
                parts.iter().partition(|part| !slots_of_expression(part, slots.parameters).is_empty());
            // If only one factor mentions slots, it is evaluated to tables, which are multiplied by the other
            // factors. If several factors mention slots, the product is evaluated to one table over all their
            // slots.
            let [part] = mentioning[..] else {
                return table(world, expression, mentioned, binding, slots, undefined);
            };
            let mut product = open(world, part, binding, slots, undefined)?;
            for factor in closed {
                let factor = ground(world, factor, binding)?;
                if !factor.coefficients.is_empty() {
                    return Err(Failure::Error(Error::NonLinear { place: *place }));
                }
                product.scale(&factor.quantity.constant);
            }
            Ok(product)
        }
        _ => table(world, expression, mentioned, binding, slots, undefined),
    }
}

fn table(
    world: &mut World<'_>,
    expression: &Expression,
    mentioned: SlotSet,
    binding: &mut Binding,
    slots: &Slots<'_>,
    undefined: &mut dyn FnMut(&SlotSet, SlotSet),
) -> Result<Linear<Rational>, Failure> {
    let mut values = Vec::new();
    let limits = world.limits;
    for_each_combination(&mentioned, slots, binding, limits, &mut |binding, combination| {
        match ground(world, expression, binding) {
            Ok(linear) => {
                // Terms that mention a slot are static; otherwise the parameter would not be a slot.
                assert!(linear.coefficients.is_empty(), "invariant: a table has no fluents");
                values.push(linear.quantity.constant);
            }
            Err(Failure::Undefined) => {
                values.push(Rational::from_integer(0));
                undefined(&mentioned, SlotSet::from_slice(combination));
            }
            Err(other) => return Err(other),
        }
        Ok(())
    })?;
    let mut quantity = Quantity::constant(Rational::from_integer(0));
    quantity.add_table(Table { slots: mentioned, values: values.into() });
    Ok(Linear { coefficients: Vec::new(), quantity })
}

/// Callback that receives the binding, and the index of the chosen design for each slot of the enumeration.
type Visit<'v> = dyn FnMut(&Binding, &[u32]) -> Result<(), Failure> + 'v;

/// Calls `visit` for every combination of designs of the slots in `mentioned`; the last slot varies fastest.
///
/// # Errors
/// The deadline has passed, the run is interrupted, or `visit` fails.
pub fn for_each_combination(
    mentioned: &[u32],
    slots: &Slots<'_>,
    binding: &mut Binding,
    limits: &Limits,
    visit: &mut Visit<'_>,
) -> Result<(), Failure> {
    fn go(
        mentioned: &[u32],
        slots: &Slots<'_>,
        binding: &mut Binding,
        chosen: &mut Vec<u32>,
        pulse: &mut LimitPoll<'_>,
        visit: &mut Visit<'_>,
    ) -> Result<(), Failure> {
        let Some((slot, remaining)) = mentioned.split_first() else {
            pulse.beat()?;
            return visit(binding, chosen);
        };
        let parameter = slots.parameters[*slot as usize].parameter as usize;
        for (design, index) in slots.designs[*slot as usize].iter().zip(0..) {
            binding[parameter] = Some(*design);
            chosen.push(index);
            let visited = go(remaining, slots, binding, chosen, pulse, visit);
            chosen.pop();
            binding[parameter] = None;
            visited?;
        }
        Ok(())
    }
    go(mentioned, slots, binding, &mut Vec::new(), &mut limits.pulse(), visit)
}
