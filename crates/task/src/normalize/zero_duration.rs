//! Durative actions whose duration can be 0: start and end are one happening then.
//!
//! Its conditions, of start and end, hold in the one state before it, its effects take place together, and nothing holds over all of
//! an interval without a point in it (`validate`, clauses 1 and 4 of the definition). So such a schema becomes a second one for
//! duration 0; the first keeps the durations above 0.
use num_traits::Zero;
use rustc_hash::FxHashMap;

use crate::error::{Error, Errors};
use crate::lifted::{Expression, Formula, FunctionId, Joint, Lifted, Rational, Schema};
use pddl::ast::Comparison;

/// The least and the greatest value that an expression can have; none where that is not known.
type Range = Option<(Rational, Rational)>;

/// Splits every schema whose duration can be 0. The schemas that are added come last.
///
/// # Errors
/// A duration that is chosen as short as it may be, and may be 0 or less: what holds with 0 does not tell what holds with a little more.
pub fn split(lifted: &mut Lifted) -> Result<(), Errors> {
    let mut ranges: FxHashMap<FunctionId, (Rational, Rational)> = FxHashMap::default();
    for (function, _, value) in &lifted.values {
        let range = ranges.entry(*function).or_insert_with(|| (value.clone(), value.clone()));
        range.0 = range.0.clone().min(value.clone());
        range.1 = range.1.clone().max(value.clone());
    }
    let functions = &lifted.functions;
    let known = |function: FunctionId| {
        (!functions[function.index()].fluent).then(|| ranges.get(&function).cloned()).flatten()
    };
    let (mut instants, mut errors) = (Vec::new(), Vec::new());
    for schema in &mut lifted.schemas {
        let Some(duration) = schema.duration.clone() else { continue };
        match range(&duration, &known) {
            Some((low, _)) if low.is_positive() => {}
            _ if schema.is_chosen => errors.push(Error::Unsupported {
                construct: format!("a duration of `{}` that is chosen, and may be 0", schema.name),
                instead: "a lower bound above 0".into(),
                place: schema.place,
            }),
            Some((low, high)) if low.is_zero() && high.is_zero() => *schema = instant(schema),
            Some((_, high)) if high.is_negative() => {}
            _ => {
                let compare = |comparison| {
                    let zero = Expression::Number(Rational::zero());
                    Formula::Compare(comparison, duration.clone(), zero, schema.place)
                };
                let (none, some) = (compare(Comparison::Equal), compare(Comparison::Greater));
                let mut other = instant(schema);
                // A happening reads its duration.
                if let Some(joint) = &mut other.joint {
                    joint.start = Formula::And(vec![none.clone(), schema.start_condition.clone()]);
                }
                other.start_condition = Formula::And(vec![none, other.start_condition]);
                instants.push(other);
                let own = std::mem::replace(&mut schema.start_condition, Formula::truth());
                schema.start_condition = Formula::And(vec![some, own]);
            }
        }
    }
    lifted.schemas.extend(instants);
    if errors.is_empty() { Ok(()) } else { Err(errors.into()) }
}

/// The schema with duration 0.
fn instant(schema: &Schema) -> Schema {
    let condition = Formula::And(vec![schema.start_condition.clone(), schema.at_end.clone()]);
    Schema {
        start_condition: condition,
        start_effects: Vec::new(),
        middle_condition: Formula::truth(),
        over_all: Formula::truth(),
        at_end: Formula::truth(),
        end_effects: schema.start_effects.iter().chain(&schema.end_effects).cloned().collect(),
        duration: Some(Expression::Number(Rational::zero())),
        joint: Some(Box::new(Joint {
            start: schema.start_condition.clone(),
            end: schema.at_end.clone(),
            start_effects: schema.start_effects.len(),
        })),
        ..schema.clone()
    }
}

fn range(expression: &Expression, known: &dyn Fn(FunctionId) -> Range) -> Range {
    match expression {
        Expression::Number(number) => Some((number.clone(), number.clone())),
        Expression::Function(function, ..) => known(*function),
        Expression::TotalTime => None,
        Expression::Negate(inner) => range(inner, known).map(|(low, high)| (-high, -low)),
        Expression::Sum(parts) => {
            parts.iter().try_fold((Rational::zero(), Rational::zero()), |(low, high), part| {
                let (least, most) = range(part, known)?;
                Some((low + least, high + most))
            })
        }
        Expression::Product(parts, _) => {
            let one = Rational::from_integer(1);
            parts.iter().try_fold((one.clone(), one), |own, part| product(own, range(part, known)?))
        }
        Expression::Quotient(left, right, _) => {
            let ((low, high), (least, most)) = (range(left, known)?, range(right, known)?);
            if !(least.is_positive() || most.is_negative()) {
                return None;
            }
            product((low, high), (most.recip(), least.recip()))
        }
    }
}

#[allow(clippy::unnecessary_wraps)]
fn product((a, b): (Rational, Rational), (c, d): (Rational, Rational)) -> Range {
    let all = [a.clone() * &c, a * &d, b.clone() * &c, b * &d];
    let low = all.iter().min().cloned()?;
    Some((low, all.into_iter().max()?))
}
