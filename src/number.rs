//! Conversion of exact numbers from and to decimal text and JSON.

use num_rational::BigRational;
use num_traits::{ToPrimitive, Zero};
use serde_json::Value;

/// Maximum number of characters of an accepted number, and maximum absolute value of its decimal
/// exponent. Larger numbers would only consume memory.
const MAX_CHARACTERS: usize = 40;

pub(crate) const DECIMAL: &str = "a decimal number (at most 40 characters; exponent from -40 to 40)";

/// Number of decimals to which values are rounded. Floating-point values of a robot would otherwise
/// make the planner's integers huge.
const DECIMALS: u32 = 6;

/// Parses a decimal, with or without an exponent: `-12`, `0.25`, `1e-2`. Returns `None` for other
/// text and for numbers above the limits.
pub(crate) fn exact(text: &str) -> Option<BigRational> {
    let text = text.trim();
    if text.len() > MAX_CHARACTERS {
        return None;
    }
    let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    let exponent: i32 =
        exponent.parse().ok().filter(|power: &i32| power.unsigned_abs() as usize <= MAX_CHARACTERS)?;
    let literal = rules::Literal::parse(mantissa, Some("http://www.w3.org/2001/XMLSchema#decimal"), None);
    let power = num_traits::pow(BigRational::from_integer(10.into()), exponent.unsigned_abs() as usize);
    let value = literal.as_rational()?;
    Some(if exponent < 0 { value / power } else { value * power })
}

pub(crate) fn rounded(value: &BigRational) -> BigRational {
    let scale = BigRational::from_integer(10_i64.pow(DECIMALS).into());
    (value * &scale).round() / scale
}

/// Parses a JSON number, or a string that contains a number. Returns `None` for other values, and in the cases of
/// [`exact`].
pub(crate) fn from_json(value: &Value) -> Option<BigRational> {
    match value {
        Value::Number(number) => exact(&number.to_string()),
        Value::String(text) => exact(text),
        _ => None,
    }
}

pub(crate) fn decimal(value: &BigRational) -> String {
    rules::Decimal::from_rational(value).to_string()
}

/// Rounds the number to at most 34 fractional digits.
pub(crate) fn to_json(value: &BigRational) -> Value {
    decimal(value).parse::<serde_json::Number>().map_or(Value::Null, Value::Number)
}

/// Rounds a fraction without a finite decimal expansion to a double.
pub(crate) fn exact_to_json(value: &planner::Exact) -> Value {
    value.to_string().parse::<serde_json::Number>().map_or_else(|_| value.to_f64().into(), Value::Number)
}

pub(crate) fn to_f64(value: &BigRational) -> f64 {
    if value.is_zero() { 0.0 } else { value.to_f64().unwrap_or(f64::MAX) }
}

pub(crate) fn of_plan(value: &planner::Exact) -> BigRational {
    value.to_rational()
}

#[cfg(test)]
mod tests {
    use super::{DECIMAL, MAX_CHARACTERS, decimal, exact, rounded};

    fn check(text: &str, expected: Option<&str>) {
        assert_eq!(exact(text).map(|value| decimal(&rounded(&value))).as_deref(), expected, "{text}");
    }

    #[test]
    fn decimals_are_exact_and_bounded() {
        check("12", Some("12"));
        check("-0.25", Some("-0.25"));
        check("1e-2", Some("0.01"));
        check("1.5E2", Some("150"));
        check("0.30000000000000004", Some("0.3"));
        check("1e999999999", None);
        check("NaN", None);
        check("", None);
        check(&"9".repeat(60), None);
        check(&"9".repeat(MAX_CHARACTERS), Some(&"9".repeat(MAX_CHARACTERS)));
        check("1e41", None);
        assert!(
            DECIMAL
                .contains(&format!("at most {MAX_CHARACTERS} characters; exponent from -{MAX_CHARACTERS}"))
        );
    }
}
