//! Numeric and boolean functions. On decimals, results are exact up to 34 fractional digits; sines, cosines, tangents
//! and powers with fractional exponents are doubles. On other numbers, an integer quotient is an integer, and any other
//! result has the widest floating-point type of the arguments.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive, Zero};

use super::signature::BuiltIn;
use crate::literal::{Decimal, Literal, ten_to};

/// Maximum absolute exponent of an exact power. A power with a larger exponent has no result.
const MAX_EXPONENT: u32 = 1000;

/// Maximum number of digits for rounding; a double has at most 1074 fractional digits. A larger number is reduced to
/// the maximum. For a decimal, a number beyond `i32` has no result.
const MAX_DIGITS: i32 = 1100;

enum Numbers {
    Exact(Vec<BigRational>),
    Float(Vec<f64>),
    Double(Vec<f64>),
}

/// Returns the value of a numeric or boolean function. `None` for other functions, for unsuitable arguments, and if
/// there is no value, as for the division of a decimal by 0.
pub(super) fn compute(built_in: BuiltIn, arguments: &[&Literal]) -> Option<Literal> {
    if let (BuiltIn::BooleanNot, [Literal::Boolean(value)]) = (built_in, arguments) {
        return Some(Literal::Boolean(!value));
    }
    match promote(arguments)? {
        Numbers::Float(values) if built_in == BuiltIn::RoundHalfToEven => {
            rounded_float(&values).map(Literal::float)
        }
        Numbers::Double(values) if built_in == BuiltIn::RoundHalfToEven => {
            rounded_float(&values).map(Literal::double)
        }
        Numbers::Float(values) | Numbers::Double(values) if built_in == BuiltIn::IntegerDivide => {
            integer_quotient(&values)
        }
        Numbers::Exact(values) => exact(built_in, &values),
        Numbers::Float(values) => inexact(built_in, &values).map(|value| Literal::float(value as f32)),
        Numbers::Double(values) => inexact(built_in, &values).map(Literal::double),
    }
}

fn promote(arguments: &[&Literal]) -> Option<Numbers> {
    // Promotion of `XPath`: if there is a double, all numbers become doubles; otherwise, if there is a float, all
    // become floats.
    if arguments.iter().all(|a| matches!(a, Literal::Decimal(_))) {
        return Some(Numbers::Exact(arguments.iter().map(|a| a.as_rational()).collect::<Option<_>>()?));
    }
    if arguments.iter().any(|a| matches!(a, Literal::Double(_))) {
        return Some(Numbers::Double(arguments.iter().map(|a| a.as_f64()).collect::<Option<_>>()?));
    }
    let floats = arguments.iter().map(|a| a.as_f32().map(f64::from)).collect::<Option<_>>()?;
    Some(Numbers::Float(floats))
}

fn exact(built_in: BuiltIn, values: &[BigRational]) -> Option<Literal> {
    let value = match (built_in, values) {
        (BuiltIn::Add, _) => values.iter().sum(),
        (BuiltIn::Multiply, _) => values.iter().product(),
        (BuiltIn::Subtract, [a, b]) => a - b,
        (BuiltIn::Divide, [a, b]) if !b.is_zero() => a / b,
        (BuiltIn::IntegerDivide, [a, b]) if !b.is_zero() => (a / b).trunc(),
        (BuiltIn::Mod, [a, b]) if !b.is_zero() => a - b * (a / b).trunc(),
        (BuiltIn::Pow, [a, b]) if b.is_integer() => integer_power(a, b)?,
        (BuiltIn::Pow, [a, b]) => return Some(Literal::double(a.to_f64()?.powf(b.to_f64()?))),
        (BuiltIn::UnaryPlus, [a]) => a.clone(),
        (BuiltIn::UnaryMinus, [a]) => -a,
        (BuiltIn::Abs, [a]) => a.abs(),
        (BuiltIn::Ceiling, [a]) => a.ceil(),
        (BuiltIn::Floor, [a]) => a.floor(),
        (BuiltIn::Round, [a]) => (a + BigRational::new(1.into(), 2.into())).floor(),
        (BuiltIn::RoundHalfToEven, [a]) => round_half_to_even(a, 0),
        (BuiltIn::RoundHalfToEven, [a, digits]) => round_half_to_even(a, digits.to_integer().to_i32()?),
        (BuiltIn::Sin | BuiltIn::Cos | BuiltIn::Tan, [a]) => {
            return inexact(built_in, &[a.to_f64()?]).map(Literal::double);
        }
        _ => return None,
    };
    Some(Literal::Decimal(Decimal::from_rational(&value)))
}

fn integer_power(base: &BigRational, exponent: &BigRational) -> Option<BigRational> {
    let exponent = exponent.to_integer().to_i32().filter(|e| e.unsigned_abs() <= MAX_EXPONENT)?;
    let bits = base.numer().bits().max(base.denom().bits());
    // Limits the result to about 65,536 bits.
    let affordable = bits.saturating_mul(u64::from(exponent.unsigned_abs())) <= 1 << 16;
    (affordable && (exponent >= 0 || !base.is_zero())).then(|| base.pow(exponent))
}

fn round_half_to_even(value: &BigRational, digits: i32) -> BigRational {
    let digits = digits.clamp(-MAX_DIGITS, MAX_DIGITS);
    let (units, unit) = (rounded_units(value, digits), ten_to(digits.unsigned_abs()));
    if digits >= 0 { BigRational::new(units, unit) } else { BigRational::from_integer(units * unit) }
}

/// Returns a value in units of 10<sup>-digits</sup>, rounded half to even.
fn rounded_units(value: &BigRational, digits: i32) -> BigInt {
    let unit = BigRational::from_integer(ten_to(digits.unsigned_abs()));
    let scaled = if digits >= 0 { value * unit } else { value / unit };
    let floor = scaled.floor().to_integer();
    let half = BigRational::new(1.into(), 2.into());
    let fraction = &scaled - BigRational::from_integer(floor.clone());
    let rounds_up = fraction > half || (fraction == half && floor.bit(0));
    floor + BigInt::from(i32::from(rounds_up))
}

/// Rounds a float half to even, by way of its exact decimal value. The second value is the number of
/// fractional digits, by default 0.
fn rounded_float<F: std::str::FromStr>(values: &[f64]) -> Option<F> {
    let (value, digits) = match *values {
        [value] => (value, 0.0),
        [value, digits] => (value, digits),
        _ => return None,
    };
    // NaN and infinite values have no exact value. Zeros keep their signs.
    let text = match BigRational::from_float(value) {
        Some(exact) => {
            let digits = digits.clamp(f64::from(-MAX_DIGITS), f64::from(MAX_DIGITS)) as i32;
            let units = rounded_units(&exact.abs(), digits);
            format!("{}{units}e{}", if value.is_sign_negative() { "-" } else { "" }, -digits)
        }
        None => value.to_string(),
    };
    text.parse().ok()
}

/// Returns the `xsd:integer` quotient of two floats, truncated toward zero. `None` if the quotient is infinite or NaN.
fn integer_quotient(values: &[f64]) -> Option<Literal> {
    let [dividend, divisor] = *values else { return None };
    let quotient = BigRational::from_float((dividend / divisor).trunc())?;
    Some(Literal::Decimal(Decimal::from_rational(&quotient)))
}

/// Rounds a number, half toward positive infinity. The result has the sign of the number.
pub(super) fn round(value: f64) -> f64 {
    // Adding 0.5 first would round 0.49999999999999994 and odd integers above 2^52 up.
    let floor = value.floor();
    if value - floor >= 0.5 { (floor + 1.0).copysign(value) } else { floor }
}

fn inexact(built_in: BuiltIn, values: &[f64]) -> Option<f64> {
    Some(match (built_in, values) {
        (BuiltIn::Add, _) => values.iter().sum(),
        (BuiltIn::Multiply, _) => values.iter().product(),
        (BuiltIn::Subtract, [a, b]) => a - b,
        (BuiltIn::Divide, [a, b]) => a / b,
        (BuiltIn::Mod, [a, b]) => a % b,
        (BuiltIn::Pow, [a, b]) => a.powf(*b),
        (BuiltIn::UnaryPlus, [a]) => *a,
        (BuiltIn::UnaryMinus, [a]) => -a,
        (BuiltIn::Abs, [a]) => a.abs(),
        (BuiltIn::Ceiling, [a]) => a.ceil(),
        (BuiltIn::Round, [a]) => round(*a),
        (BuiltIn::Floor, [a]) => a.floor(),
        (BuiltIn::Sin, [a]) => a.sin(),
        (BuiltIn::Cos, [a]) => a.cos(),
        (BuiltIn::Tan, [a]) => a.tan(),
        _ => return None,
    })
}
