//! Durative actions whose duration may be 0, so that start and end are simultaneous.
//!
//! If the duration is 0, the conditions of start and end must hold in the state before both, and all effects are
//! simultaneous. `over all` conditions are void, because the interval is empty. A schema whose duration may be 0 gets a
//! copy for duration 0; the original keeps the positive durations.
use num_traits::Zero;
use rustc_hash::FxHashMap;

use crate::error::{Error, Errors};
use crate::lifted::{DurationChoice, Expression, Formula, FunctionId, Joint, Lifted, Rational, Schema};
use pddl::ast::Comparison;

type Range = Option<(Rational, Rational)>;

/// Splits every schema whose duration may be 0 into two schemas. The schemas for duration 0 are appended. A schema
/// whose duration is always 0 is converted instead.
///
/// # Errors
/// Returns an error for each schema with a variable duration if 0 and longer durations may be admissible, and the
/// conditions or effects for duration 0 differ from those for longer durations.
pub fn split(lifted: &mut Lifted) -> Result<(), Errors> {
    let mut ranges: FxHashMap<FunctionId, (Rational, Rational)> = FxHashMap::default();
    for (function, _, value) in &lifted.values {
        let range = ranges.entry(*function).or_insert_with(|| (value.clone(), value.clone()));
        range.0 = range.0.clone().min(value.clone());
        range.1 = range.1.clone().max(value.clone());
    }
    let functions = &lifted.functions;
    let range_of_function = |function: FunctionId| {
        (!functions[function.index()].fluent).then(|| ranges.get(&function).cloned()).flatten()
    };
    let (mut instants, mut errors) = (Vec::new(), Vec::new());
    for schema in &mut lifted.schemas {
        let Some(duration) = schema.duration.clone() else { continue };
        let is_above_zero = |(operator, bound): &(Comparison, Expression)| {
            range(bound, &range_of_function).is_some_and(|(low, _)| {
                low.is_positive() || *operator == Comparison::Greater && low.is_zero()
            })
        };
        let admits_zero = match &schema.choice {
            DurationChoice::None => false,
            DurationChoice::Shortest => !is_above_zero(&(Comparison::GreaterOrEqual, duration.clone())),
            DurationChoice::Longest(lower) => {
                let may_be_positive = |(_, high): (Rational, Rational)| high.is_positive();
                differs_at_zero(schema)
                    && !lower.iter().any(is_above_zero)
                    && range(&duration, &range_of_function).is_none_or(may_be_positive)
            }
        };
        match range(&duration, &range_of_function) {
            _ if admits_zero => errors.push(Error::Unsupported {
                construct: format!("a duration of `{}` that is chosen, and may be 0", schema.name),
                instead: "a lower bound above 0, or `--concurrent`".into(),
                place: schema.place,
            }),
            Some((low, _)) if low.is_positive() => {}
            Some((low, high)) if low.is_zero() && high.is_zero() => *schema = instant(schema),
            Some((_, high)) if high.is_negative() => {}
            _ => {
                let compare = |comparison| {
                    let zero = Expression::Number(Rational::zero());
                    Formula::Compare(comparison, duration.clone(), zero, schema.place)
                };
                let (is_zero, is_positive) = (compare(Comparison::Equal), compare(Comparison::Greater));
                let mut copy = instant(schema);
                // `is_zero` belongs to the condition at the start, so the start also reads the functions in the
                // duration.
                if let Some(joint) = &mut copy.joint {
                    joint.start = Formula::And(vec![is_zero.clone(), schema.start_condition.clone()]);
                }
                copy.start_condition = Formula::And(vec![is_zero, copy.start_condition]);
                instants.push(copy);
                let original = std::mem::replace(&mut schema.start_condition, Formula::truth());
                schema.start_condition = Formula::And(vec![is_positive, original]);
            }
        }
    }
    lifted.schemas.extend(instants);
    if errors.is_empty() { Ok(()) } else { Err(errors.into()) }
}

/// Returns `true` if the conditions or effects for duration 0 may differ from those for longer durations.
fn differs_at_zero(schema: &Schema) -> bool {
    let is_empty = |formula: &Formula| matches!(formula, Formula::And(parts) if parts.is_empty());
    let has_end = !schema.end_effects.is_empty() || !is_empty(&schema.at_end);
    !is_empty(&schema.over_all) || !schema.start_effects.is_empty() && has_end
}

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
            let unit = Rational::from_integer(1);
            parts
                .iter()
                .try_fold((unit.clone(), unit), |accumulated, part| product(accumulated, range(part, known)?))
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
    let products = [a.clone() * &c, a * &d, b.clone() * &c, b * &d];
    let low = products.iter().min().cloned()?;
    Some((low, products.into_iter().max()?))
}
