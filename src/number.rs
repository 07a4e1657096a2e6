//! Conversion of exact numbers from and to decimal text and JSON.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{Signed as _, ToPrimitive, Zero};
use serde_json::Value;

/// Maximum number of characters of an accepted number, and maximum absolute value of its decimal
/// exponent. Larger numbers would only consume memory.
const MAX_CHARACTERS: usize = 40;

pub(crate) const DECIMAL: &str = "a decimal number (at most 40 characters; exponent from -40 to 40)";

/// Number of decimals, or significant digits of small values, to which long values are rounded.
const DECIMALS: u32 = 6;

/// Maximum number of significant digits of a reported value that is not rounded.
const EXACT_DIGITS: usize = 9;

/// Maximum number of decimals of a reported value that is not rounded.
const MAX_DECIMALS: u32 = 15;

/// Maximum number of decimals to which a long value is rounded. The noise of sums of floating-point numbers has more.
const MAX_ROUNDED_DECIMALS: u32 = 9;

/// Maximum number of bits of the denominator of a value that [`bounded`] does not round.
const MAX_DENOMINATOR_BITS: u64 = 64;

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

/// Rounds a reported decimal to six decimals, or to six significant digits if they have more decimals, but at most to
/// [`MAX_ROUNDED_DECIMALS`]. Values of at most [`EXACT_DIGITS`] significant digits and [`MAX_DECIMALS`] decimals are not
/// rounded. Floating-point values of a robot would otherwise make the planner's integers huge.
pub(crate) fn reported(value: &BigRational) -> BigRational {
    let whole = |power| BigRational::from_integer(BigInt::from(10).pow(power));
    let shift = BigRational::from_integer(scale_of(value));
    if shift <= whole(MAX_DECIMALS) && (value * shift).to_integer().abs().to_string().len() <= EXACT_DIGITS {
        return value.clone();
    }
    let (mut scale, least, greatest) = (whole(DECIMALS), whole(DECIMALS - 1), whole(MAX_ROUNDED_DECIMALS));
    while value.abs() * &scale < least && scale < greatest {
        scale *= whole(1);
    }
    (value * &scale).round() / scale
}

/// Returns `true` if `value` rounded to the decimals of the decimal `report`, at least six, is `report`. A `report` of 0
/// confirms only 0, because a small value can be positive in conditions.
pub(crate) fn confirms(report: &BigRational, value: &BigRational) -> bool {
    let scale = BigRational::from_integer(scale_of(report).max(BigInt::from(10).pow(DECIMALS)));
    report.is_zero() == value.is_zero() && (value * &scale).round() == report * scale
}

/// Returns the least power of ten whose product with a decimal is an integer.
fn scale_of(decimal: &BigRational) -> BigInt {
    let mut scale = BigInt::from(1);
    while !(&scale % decimal.denom()).is_zero() {
        scale *= 10;
    }
    scale
}

/// Rounds a value whose denominator has become huge, because amounts of changes depend on the value. Otherwise, the
/// denominator would grow with every change.
pub(crate) fn bounded(value: BigRational) -> BigRational {
    if value.denom().bits() > MAX_DENOMINATOR_BITS { rounded(&value) } else { value }
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
    use super::{DECIMAL, MAX_CHARACTERS, confirms, decimal, exact, reported, rounded};

    fn check(text: &str, expected: Option<&str>) {
        assert_eq!(exact(text).map(|value| decimal(&rounded(&value))).as_deref(), expected, "{text}");
    }

    #[test]
    fn only_long_reports_are_rounded() {
        for (report, expected) in [
            ("0", "0"),
            ("0.3333334", "0.3333334"),
            ("-12.0000004", "-12.0000004"),
            ("0.0000004", "0.0000004"),
            ("4e-15", "0.000000000000004"),
            ("4e-16", "0"),
            ("1.2246467991473532e-16", "0"),
            ("1.2246467991473532e-12", "0"),
            // 100.1 - 100 - 0.1 with floating-point numbers.
            ("-5.689893001203927e-15", "0"),
            ("0.30000000000000004", "0.3"),
            ("0.30000001192092896", "0.3"),
            ("-0.00012345678901234", "-0.000123457"),
            ("123456789012.1234567", "123456789012.123457"),
        ] {
            let report = exact(report).expect("a number");
            assert_eq!(decimal(&reported(&report)), expected);
        }
        let third = exact("1").expect("a number") / exact("3").expect("a number");
        for (report, expected) in [
            ("0.333333", true),
            ("0.3333333", true),
            ("0.3333334", false),
            ("0.33", false),
            ("0.333334", false),
        ] {
            assert_eq!(confirms(&exact(report).expect("a number"), &third), expected, "{report}");
        }
        let (zero, small) = (exact("0").expect("a number"), exact("4e-7").expect("a number"));
        assert!(confirms(&zero, &zero) && !confirms(&zero, &small) && !confirms(&small, &zero));
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
