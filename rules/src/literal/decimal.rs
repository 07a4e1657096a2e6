//! Value space of `xsd:decimal` and its integer types: exact numbers of any size.
//!
//! Values within 64 bits and 18 fractional digits are compared without allocation. Larger values hardly
//! occur in knowledge bases.

use std::cmp::Ordering;
use std::fmt;

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One, Signed, ToPrimitive, Zero};

/// Largest accepted absolute value of an exponent in a lexical form. It prevents hostile input such as
/// `1e999999999` from filling the memory.
const MAX_EXPONENT: u64 = 1000;
/// Largest scale (number of fractional digits) of the small representation. `10^18` is the largest power of
/// ten that a signed 64-bit integer can hold.
const SMALL_SCALE: u32 = 18;
/// Number of fractional digits to which a rational number is rounded, such as an inexact quotient.
const DIVISION_DIGITS: u32 = 34;

/// A decimal number `unscaled / 10^scale`. The scale is the smallest possible, so that equal values are
/// equal structs.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Decimal(Repr);

#[derive(Clone, PartialEq, Eq, Hash, Debug)]
enum Repr {
    Small { unscaled: i64, scale: u32 },
    Large { unscaled: Box<BigInt>, scale: u32 },
}

impl Decimal {
    /// Returns the approximate number of bytes of the digits; 0 for the small representation.
    pub(super) fn size(&self) -> usize {
        match &self.0 {
            Repr::Small { .. } => 0,
            Repr::Large { unscaled, .. } => unscaled.bits() as usize / 8,
        }
    }

    /// Parses a decimal number such as `-12.50`. An exponent is accepted, too, because Python programs write decimals
    /// such as `1e-05`. Returns `None` if the form is invalid, or if the absolute value of the exponent is above 1000.
    pub fn parse(lexical: &str) -> Option<Self> {
        let (mantissa, exponent) = match lexical.find(['e', 'E']) {
            Some(position) => (&lexical[..position], lexical[position + 1..].parse::<i64>().ok()?),
            None => (lexical, 0),
        };
        let (negative, digits) = match mantissa.as_bytes().first()? {
            b'-' => (true, &mantissa[1..]),
            b'+' => (false, &mantissa[1..]),
            _ => (false, mantissa),
        };
        let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
        let fraction = match fraction.trim_end_matches('0') {
            // Keeps the zeros of a form such as `.00`: only a form without any digit may give an empty text.
            "" if whole.is_empty() => fraction,
            significant => significant,
        };
        let text = format!("{whole}{fraction}");
        if text.is_empty()
            || !text.bytes().all(|b| b.is_ascii_digit())
            || exponent.unsigned_abs() > MAX_EXPONENT
        {
            return None;
        }
        let magnitude: BigInt = text.parse().ok()?;
        let unscaled = if negative { -magnitude } else { magnitude };
        Some(Self::from_exponent(unscaled, exponent - i64::try_from(fraction.len()).ok()?))
    }

    fn from_exponent(unscaled: BigInt, exponent: i64) -> Self {
        match u32::try_from(-exponent) {
            Ok(scale) => Self::new(unscaled, scale),
            Err(_) => Self::new(unscaled * power_of_ten(exponent.unsigned_abs() as u32), 0),
        }
    }

    /// Creates the number `unscaled / 10^scale`.
    pub fn new(unscaled: BigInt, scale: u32) -> Self {
        let (mut unscaled, mut scale) = (unscaled, scale);
        // Trailing zeros of a machine integer are removed without big-integer arithmetic.
        if let Some(small) = unscaled.to_i64() {
            let (small, scale) = strip_zeros(small, scale);
            if scale <= SMALL_SCALE {
                return Self(Repr::Small { unscaled: small, scale });
            }
            unscaled = small.into();
            return Self(Repr::Large { unscaled: Box::new(unscaled), scale });
        }
        let zeros;
        (unscaled, zeros) = divide_out(unscaled, 10, scale);
        scale -= zeros;
        match unscaled.to_i64() {
            Some(small) if scale <= SMALL_SCALE => Self(Repr::Small { unscaled: small, scale }),
            _ => Self(Repr::Large { unscaled: Box::new(unscaled), scale }),
        }
    }

    /// Returns `unscaled` and `scale` of the number `unscaled / 10^scale`.
    pub fn parts(&self) -> (BigInt, u32) {
        match &self.0 {
            Repr::Small { unscaled, scale } => (BigInt::from(*unscaled), *scale),
            Repr::Large { unscaled, scale } => ((**unscaled).clone(), *scale),
        }
    }

    /// Returns `true` if the value is an integer.
    pub fn is_integer(&self) -> bool {
        matches!(self.0, Repr::Small { scale: 0, .. } | Repr::Large { scale: 0, .. })
    }

    /// Returns the exact value.
    pub fn to_rational(&self) -> BigRational {
        let (unscaled, scale) = self.parts();
        BigRational::new(unscaled, power_of_ten(scale))
    }

    /// Converts a rational number to the nearest decimal with at most 34 fractional digits. Halves are
    /// rounded away from zero.
    pub fn from_rational(value: &BigRational) -> Self {
        if let Some(short) = Self::short(value) {
            return short;
        }
        let scaled = value * BigRational::from_integer(power_of_ten(DIVISION_DIGITS));
        Self::new(scaled.round().to_integer(), DIVISION_DIGITS)
    }

    /// Converts a rational number exactly. Returns `None` if its decimal expansion is infinite.
    pub(super) fn exact(value: &BigRational) -> Option<Self> {
        let (denominator, twos) = divide_out(value.denom().clone(), 2, u32::MAX);
        let (denominator, fives) = divide_out(denominator, 5, u32::MAX);
        let scale = twos.max(fives);
        let factor = BigInt::from(2).pow(scale - twos) * BigInt::from(5).pow(scale - fives);
        denominator.is_one().then(|| Self::new(value.numer() * factor, scale))
    }

    /// Converts a rational number exactly if it fits into the small representation: 64 bits and at most 18
    /// fractional digits. Otherwise returns `None`. This path avoids a long product with trailing zeros.
    fn short(value: &BigRational) -> Option<Self> {
        let (numerator, denominator) = (value.numer().to_i64()?, value.denom().to_u64()?);
        let scale = (0..=SMALL_SCALE).find(|&scale| 10_u64.pow(scale).is_multiple_of(denominator))?;
        let factor = i64::try_from(10_u64.pow(scale) / denominator).ok()?;
        Some(Self(Repr::Small { unscaled: numerator.checked_mul(factor)?, scale }))
    }

    /// Returns the nearest double.
    pub fn to_f64(&self) -> f64 {
        // The parser of the standard library rounds correctly.
        self.to_string().parse().unwrap_or(f64::NAN)
    }

    /// Returns the nearest float.
    pub fn to_f32(&self) -> f32 {
        self.to_string().parse().unwrap_or(f32::NAN)
    }
}

impl<'a> std::iter::Sum<&'a Decimal> for Decimal {
    fn sum<I: Iterator<Item = &'a Self>>(values: I) -> Self {
        let (mut sum, mut scale) = (BigInt::zero(), 0);
        for value in values {
            let (unscaled, value_scale) = value.parts();
            if value_scale > scale {
                sum *= power_of_ten(value_scale - scale);
                scale = value_scale;
            }
            sum += unscaled * power_of_ten(scale - value_scale);
        }
        Self::new(sum, scale)
    }
}

impl From<i64> for Decimal {
    fn from(value: i64) -> Self {
        Self(Repr::Small { unscaled: value, scale: 0 })
    }
}

fn strip_zeros(mut unscaled: i64, mut scale: u32) -> (i64, u32) {
    if unscaled == 0 {
        return (0, 0);
    }
    while scale > 0 && unscaled % 10 == 0 {
        unscaled /= 10;
        scale -= 1;
    }
    (unscaled, scale)
}

/// Divides a number other than 0 by `base` as often as it is divisible, but at most `most` times. Returns the quotient and
/// the number of divisions. Divides by large powers of the base, because one division per factor takes quadratic time.
fn divide_out(mut value: BigInt, base: u32, most: u32) -> (BigInt, u32) {
    let mut count = 0;
    let mut powers = vec![BigInt::from(base)];
    while powers.len() < 32
        && 1 << powers.len() <= most
        && powers.last().is_some_and(|power| (&value % power).is_zero())
    {
        powers.extend(powers.last().map(|power| power * power));
    }
    for (exponent, power) in powers.iter().enumerate().rev() {
        let factors = 1 << exponent;
        if most - count >= factors && (&value % power).is_zero() {
            value /= power;
            count += factors;
        }
    }
    (value, count)
}

fn power_of_ten(exponent: u32) -> BigInt {
    BigInt::from(10).pow(exponent)
}

impl Ord for Decimal {
    fn cmp(&self, other: &Self) -> Ordering {
        if let (Repr::Small { unscaled: a, scale: s }, Repr::Small { unscaled: b, scale: t }) =
            (&self.0, &other.0)
        {
            let scale = *s.max(t);
            // |unscaled| <= 2^63 and 10^18 < 2^60, so that the product fits 128 bits.
            let widen = |unscaled: i64, from: u32| i128::from(unscaled) * 10_i128.pow(scale - from);
            return widen(*a, *s).cmp(&widen(*b, *t));
        }
        let ((a, s), (b, t)) = (self.parts(), other.parts());
        let scale = s.max(t);
        (a * power_of_ten(scale - s)).cmp(&(b * power_of_ten(scale - t)))
    }
}

impl PartialOrd for Decimal {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl fmt::Display for Decimal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (unscaled, scale) = self.parts();
        let sign = if unscaled.is_negative() { "-" } else { "" };
        if scale == 0 {
            return write!(f, "{sign}{}", unscaled.magnitude());
        }
        let digits = format!("{:0>width$}", unscaled.magnitude().to_string(), width = scale as usize + 1);
        let (whole, fraction) = digits.split_at(digits.len() - scale as usize);
        write!(f, "{sign}{whole}.{fraction}")
    }
}

/// Returns `true` if an integer lies within optional inclusive bounds. The value must have scale 0.
pub(super) fn in_range(value: &Decimal, minimum: Option<i128>, maximum: Option<i128>) -> bool {
    let (unscaled, _) = value.parts();
    minimum.is_none_or(|m| unscaled >= BigInt::from(m)) && maximum.is_none_or(|m| unscaled <= BigInt::from(m))
}

pub(crate) fn ten_to(exponent: u32) -> BigInt {
    if exponent == 0 { BigInt::one() } else { power_of_ten(exponent) }
}

#[cfg(test)]
mod tests {
    use super::{BigInt, BigRational, DIVISION_DIGITS, Decimal, power_of_ten};

    #[test]
    fn huge_exponents_are_refused() {
        for exponent in [i64::MIN, -1001, 1001, i64::MAX] {
            assert_eq!(Decimal::parse(&format!("1e{exponent}")), None);
        }
        assert!(Decimal::parse("1e-1000").is_some() && Decimal::parse("1e1000").is_some());
    }

    #[test]
    fn trailing_zeros_are_removed_up_to_the_scale() {
        let digits: BigInt = "-123456789012345678901".parse().expect("an integer");
        for zeros in 0..70_u32 {
            for scale in 0..70_u32 {
                let removed = zeros.min(scale);
                let expected = (&digits * power_of_ten(zeros - removed), scale - removed);
                let value = Decimal::new(&digits * power_of_ten(zeros), scale);
                assert_eq!(value.parts(), expected, "{zeros} {scale}");
            }
        }
        // Quadratic time would take minutes.
        let long = format!("1.{}", "0".repeat(1_000_000));
        assert_eq!(Decimal::parse(&long), Some(Decimal::from(1)));
    }

    #[test]
    fn short_conversion_equals_general_conversion() {
        let mut values = vec![(i64::MAX, 1), (i64::MIN, 1), (i64::MAX, 10), (1, i64::MAX), (0, 7), (100, 1)];
        values
            .extend((-60..60).flat_map(|numerator| (1..70).map(move |denominator| (numerator, denominator))));
        values.extend(
            (0..19_u32).flat_map(|power| [1, 7, -25, i64::MAX].map(|unscaled| (unscaled, 10_i64.pow(power)))),
        );
        for (numerator, denominator) in values {
            let value = BigRational::new(numerator.into(), denominator.into());
            let scaled = &value * BigRational::from_integer(power_of_ten(DIVISION_DIGITS));
            let nearest: BigInt = scaled.round().to_integer();
            let (result, expected) = (Decimal::from_rational(&value), Decimal::new(nearest, DIVISION_DIGITS));
            assert_eq!(format!("{result:?}"), format!("{expected:?}"), "{numerator}/{denominator}");
        }
    }
}
