//! Numeric and boolean functions. On decimals, results are exact up to 34 fractional digits; sines, cosines, tangents
//! and powers with fractional exponents are doubles. On other numbers, the result has the widest floating-point type
//! of the arguments.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive, Zero};

use super::signature::BuiltIn;
use crate::literal::{Decimal, Literal, ten_to};

/// Maximum absolute exponent of an exact power, and maximum number of digits for rounding decimals. A power
/// with a larger exponent has no result. A larger number of digits counts as the maximum, or has no result if it
/// exceeds `i32`.
const MAX_EXPONENT: u32 = 1000;

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
    let unit = BigRational::from_integer(ten_to(digits.unsigned_abs().min(MAX_EXPONENT)));
    let scaled = if digits >= 0 { value * &unit } else { value / &unit };
    let floor = scaled.floor().to_integer();
    let half = BigRational::new(1.into(), 2.into());
    let fraction = &scaled - BigRational::from_integer(floor.clone());
    let rounds_up = fraction > half || (fraction == half && floor.bit(0));
    let rounded = BigRational::from_integer(floor + BigInt::from(i32::from(rounds_up)));
    if digits >= 0 { rounded / unit } else { rounded * unit }
}

fn inexact(built_in: BuiltIn, values: &[f64]) -> Option<f64> {
    Some(match (built_in, values) {
        (BuiltIn::Add, _) => values.iter().sum(),
        (BuiltIn::Multiply, _) => values.iter().product(),
        (BuiltIn::Subtract, [a, b]) => a - b,
        (BuiltIn::Divide, [a, b]) => a / b,
        (BuiltIn::IntegerDivide, [a, b]) if *b != 0.0 && (a / b).is_finite() => (a / b).trunc(),
        (BuiltIn::Mod, [a, b]) => a % b,
        (BuiltIn::Pow, [a, b]) => a.powf(*b),
        (BuiltIn::UnaryPlus, [a]) => *a,
        (BuiltIn::UnaryMinus, [a]) => -a,
        (BuiltIn::Abs, [a]) => a.abs(),
        (BuiltIn::Ceiling, [a]) => a.ceil(),
        // Adding 0.5 first would round 0.49999999999999994 and odd integers above 2^52 up.
        (BuiltIn::Round, [a]) if a - a.floor() >= 0.5 => a.floor() + 1.0,
        (BuiltIn::Floor | BuiltIn::Round, [a]) => a.floor(),
        (BuiltIn::RoundHalfToEven, [a]) => a.round_ties_even(),
        (BuiltIn::RoundHalfToEven, [a, digits]) => {
            let unit = 10_f64.powi(digits.clamp(-300.0, 300.0) as i32);
            (a * unit).round_ties_even() / unit
        }
        (BuiltIn::Sin, [a]) => a.sin(),
        (BuiltIn::Cos, [a]) => a.cos(),
        (BuiltIn::Tan, [a]) => a.tan(),
        _ => return None,
    })
}
