//! Evaluation of aggregates over a group of matches.
//!
//! The result does not depend on the order of the values. Numbers are compared by their exact values, and
//! floating-point sums are computed in ascending order.

use std::cmp::Ordering;

use num_rational::BigRational;

use crate::literal::{Decimal, Literal};
use crate::rule::Aggregate;
use crate::source::Source;
use crate::symbol::{Symbol, Symbols};

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Function {
    pub aggregate: Aggregate,
    /// Aggregated operand: a column of the rows, or a constant. `Source::Variable` holds the position of the column in
    /// the row, not the number of a variable of the rule. Ignored by `count`.
    pub value: Source,
}

impl Function {
    /// Returns the aggregate of the rows. `count` always has a value. Otherwise `None` if an operand is not a
    /// literal, if a minimum or maximum has no rows or incomparable values, or if a sum has a value that is not a
    /// number.
    pub fn evaluate<'r>(
        &self,
        rows: impl Iterator<Item = &'r [Symbol]>,
        symbols: &Symbols,
    ) -> Option<Literal> {
        let literal = |row: &[Symbol]| {
            symbols.as_literal(match self.value {
                Source::Variable(column) => row[usize::from(column)],
                Source::Constant(symbol) => symbol,
            })
        };
        match self.aggregate {
            Aggregate::Count => Some(Literal::integer(i64::try_from(rows.count()).ok()?)),
            Aggregate::Sum(_) => sum(&rows.map(literal).collect::<Option<Vec<_>>>()?),
            Aggregate::Min(_) => extreme(&rows.map(literal).collect::<Option<Vec<_>>>()?, Ordering::Less),
            Aggregate::Max(_) => extreme(&rows.map(literal).collect::<Option<Vec<_>>>()?, Ordering::Greater),
        }
    }
}

fn sum(values: &[&Literal]) -> Option<Literal> {
    if let Some(decimals) = values.iter().map(|value| as_decimal(value)).collect::<Option<Vec<_>>>() {
        return Some(Literal::Decimal(decimals.into_iter().sum()));
    }
    if !values.iter().all(|value| value.is_numeric()) {
        return None;
    }
    // Decimals are summed exactly, and rounded once.
    let exact: Decimal = values.iter().filter_map(|value| as_decimal(value)).sum();
    let exact = Literal::Decimal(exact);
    let floats = values.iter().copied().filter(|value| as_decimal(value).is_none());
    let values = floats.clone().chain([&exact]);
    if floats.clone().any(|value| matches!(value, Literal::Double(_))) {
        let mut values: Vec<f64> = values.filter_map(Literal::as_f64).collect();
        values.sort_by(f64::total_cmp);
        return Some(Literal::double(values.into_iter().sum()));
    }
    let mut values: Vec<f32> = values.filter_map(Literal::as_f32).collect();
    values.sort_by(f32::total_cmp);
    Some(Literal::float(values.into_iter().sum()))
}

fn as_decimal(value: &Literal) -> Option<&Decimal> {
    match value {
        Literal::Decimal(decimal) => Some(decimal),
        _ => None,
    }
}

/// Returns the minimum (for `Ordering::Less`) or maximum of the values; `None` if there are no values, or if
/// a value is incomparable with the extreme one. Among equal values, a decimal is preferred, and then the
/// first by datatype and lexical form.
fn extreme(values: &[&Literal], direction: Ordering) -> Option<Literal> {
    let mut best: Option<&Literal> = None;
    for &value in values {
        let is_better = match best {
            None => true,
            Some(best) => match compare(value, best) {
                Some(Ordering::Equal) => spelling(value) < spelling(best),
                order => order == Some(direction),
            },
        };
        if is_better {
            best = Some(value);
        }
    }
    // If a value is incomparable with `best` (NaN, or a value of another kind), there is no extreme value.
    let best = best?;
    let is_extreme = |value: &&Literal| compare(value, best).is_some_and(|order| order != direction);
    values.iter().all(is_extreme).then(|| best.clone())
}

fn spelling(value: &Literal) -> (bool, &str, String) {
    (as_decimal(value).is_none(), value.datatype(), value.lexical())
}

/// Compares literals like [`Literal::compare`], but numbers by their exact values. This order is transitive
/// over all numeric types.
fn compare(left: &Literal, right: &Literal) -> Option<Ordering> {
    match (left, right) {
        (Literal::Decimal(left), Literal::Decimal(right)) => Some(left.cmp(right)),
        _ if left.is_numeric() && right.is_numeric() => {
            match (left.as_rational(), right.as_rational()) {
                (Some(left), Some(right)) => Some(BigRational::cmp(&left, &right)),
                // At least one value is infinite or NaN.
                _ => infinite(left)?.partial_cmp(&infinite(right)?),
            }
        }
        _ => left.compare(right),
    }
}

/// Maps infinities and NaN to themselves, and finite numbers to 0. Returns `None` for other literals.
fn infinite(value: &Literal) -> Option<f64> {
    match value {
        Literal::Decimal(_) => Some(0.0),
        _ => value.as_f64().map(|value| if value.is_finite() { 0.0 } else { value }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(aggregate: fn(crate::rule::Term) -> Aggregate, values: &[&str], expected: Option<&str>) {
        let read = |text: &&str| {
            let (lexical, datatype) = text.split_once('^').unwrap_or((text, "decimal"));
            Literal::parse(lexical, Some(&format!("{}{datatype}", crate::literal::XSD)), None)
        };
        let mut symbols = Symbols::new();
        let mut rows: Vec<[Symbol; 1]> = values.iter().map(|text| [symbols.literal(read(text))]).collect();
        let value = Source::Variable(0);
        let function = Function { aggregate: aggregate(crate::rule::Variable(0).into()), value };
        for _ in 0..2 {
            let result = function.evaluate(rows.iter().map(<[Symbol; 1]>::as_slice), &symbols);
            assert_eq!(result, expected.as_ref().map(read), "{values:?}");
            rows.reverse();
        }
    }

    #[test]
    fn aggregates_follow_the_value_spaces_of_xsd() {
        check(Aggregate::Sum, &[], Some("0"));
        check(Aggregate::Sum, &["0.1", "0.2"], Some("0.3"));
        let long = format!("0.{}1", "0".repeat(60));
        check(Aggregate::Sum, &["1", &long], Some(&format!("1.{}1", "0".repeat(60))));
        check(Aggregate::Sum, &["0.5", "1e0^double", "0.25^float"], Some("1.75^double"));
        check(Aggregate::Sum, &["0.5", "0.25^float"], Some("0.75^float"));
        check(Aggregate::Sum, &["1", "INF^double"], Some("INF^double"));
        check(Aggregate::Sum, &["-INF^double", "INF^double"], Some("NaN^double"));
        check(Aggregate::Sum, &["1", "x^string"], None);
        check(Aggregate::Min, &[], None);
        check(Aggregate::Min, &["2", "1.5", "1.50"], Some("1.5"));
        check(Aggregate::Max, &["2", "2^double", "1"], Some("2"));
        check(Aggregate::Max, &["2", "INF^float", "-INF^double"], Some("INF^float"));
        check(Aggregate::Min, &["2", "NaN^double"], None);
        check(Aggregate::Min, &["2", "x^string"], None);
        check(Aggregate::Min, &["b^string", "a^string"], Some("a^string"));
        check(Aggregate::Max, &["2020-01-02^date", "2020-01-01^date"], Some("2020-01-02^date"));
        check(Aggregate::Max, &["P1M^duration", "P30D^duration"], None);
        check(|_| Aggregate::Count, &["1", "x^string"], Some("2"));
        check(|_| Aggregate::Count, &[], Some("0"));
    }
}
