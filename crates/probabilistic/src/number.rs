//! The two kinds of numbers that a model can be solved in: doubles, and rationals of any size.
//!
//! One implementation of every algorithm serves both. Doubles are for size and need certified bounds; rationals
//! are for small models and need none.

use std::fmt::Debug;

use num_rational::BigRational;
use num_traits::{One, ToPrimitive, Zero};

/// Relative difference of doubles below which one is not better than the other.
const TOLERANCE: f64 = 1e-12;

/// Whole doubles below are exact numbers of the model, or sums of such numbers.
const WHOLE: f64 = 4e15;

/// Whether a double is a sum of whole numbers that were not rounded.
pub(crate) fn is_whole(value: f64) -> bool {
    value.fract() == 0.0 && value < WHOLE
}

/// A count of things in memory as a double.
#[expect(
    clippy::cast_precision_loss,
    reason = "what is counted is in memory, so that there is less of it than 2^53"
)]
pub(crate) fn count(things: usize) -> f64 {
    things as f64
}

/// A field with an order; probabilities, rewards and values.
pub trait Number: Clone + Debug + PartialOrd + Send + Sync + 'static {
    /// Whether arithmetic is exact.
    const EXACT: bool;

    /// Zero.
    fn zero() -> Self;
    /// One.
    fn one() -> Self;
    /// The nearest number of this kind; where doubles are whole, they are exact: what would be rounded to a whole double
    /// becomes the one beside it.
    fn from_rational(value: &BigRational) -> Self;
    /// The number that a double is; zero for what is not finite.
    fn from_f64(value: f64) -> Self;
    /// The nearest double.
    fn to_f64(&self) -> f64;
    /// The rational, where arithmetic is exact.
    fn to_rational(&self) -> Option<BigRational>;
    /// Sum.
    #[must_use]
    fn plus(&self, other: &Self) -> Self;
    /// Difference.
    #[must_use]
    fn minus(&self, other: &Self) -> Self;
    /// Product.
    #[must_use]
    fn times(&self, other: &Self) -> Self;
    /// Quotient; the divisor must not be zero.
    #[must_use]
    fn over(&self, other: &Self) -> Self;
    /// Whether this is exactly zero.
    fn is_zero(&self) -> bool;
    /// Whether this is exactly one.
    fn is_unit(&self) -> bool;
    /// Less than `other` by more than rounding errors can explain.
    fn clearly_less(&self, other: &Self) -> bool;
    /// Bits that the number takes; what makes exact solving slow.
    fn size(&self) -> u64;
}

/// What both kinds have operators for.
macro_rules! arithmetic {
    () => {
        fn plus(&self, other: &Self) -> Self {
            self + other
        }
        fn minus(&self, other: &Self) -> Self {
            self - other
        }
        fn times(&self, other: &Self) -> Self {
            self * other
        }
        fn over(&self, other: &Self) -> Self {
            self / other
        }
    };
}

impl Number for f64 {
    const EXACT: bool = false;

    fn zero() -> Self {
        0.0
    }
    fn one() -> Self {
        1.0
    }
    fn from_rational(value: &BigRational) -> Self {
        let nearest = ToPrimitive::to_f64(value).unwrap_or(f64::NAN);
        if nearest.fract() != 0.0 || nearest.abs() >= WHOLE {
            return nearest;
        }
        match BigRational::from_float(nearest) {
            Some(back) if back < *value => nearest.next_up(),
            Some(back) if back > *value => nearest.next_down(),
            _ => nearest,
        }
    }
    fn from_f64(value: f64) -> Self {
        if value.is_finite() { value } else { 0.0 }
    }
    fn to_f64(&self) -> f64 {
        *self
    }
    fn to_rational(&self) -> Option<BigRational> {
        None
    }
    arithmetic!();
    fn is_zero(&self) -> bool {
        *self == 0.0
    }
    #[expect(clippy::float_cmp, reason = "exactly one")]
    fn is_unit(&self) -> bool {
        *self == 1.0
    }
    fn clearly_less(&self, other: &Self) -> bool {
        other - self > TOLERANCE * self.abs().max(other.abs())
    }
    fn size(&self) -> u64 {
        64
    }
}

impl Number for BigRational {
    const EXACT: bool = true;

    fn zero() -> Self {
        Zero::zero()
    }
    fn one() -> Self {
        One::one()
    }
    fn from_rational(value: &BigRational) -> Self {
        value.clone()
    }
    fn from_f64(value: f64) -> Self {
        Self::from_float(value).unwrap_or_default()
    }
    fn to_f64(&self) -> f64 {
        ToPrimitive::to_f64(self).unwrap_or(f64::NAN)
    }
    fn to_rational(&self) -> Option<BigRational> {
        Some(self.clone())
    }
    arithmetic!();
    fn is_zero(&self) -> bool {
        Zero::is_zero(self)
    }
    fn is_unit(&self) -> bool {
        One::is_one(self)
    }
    fn clearly_less(&self, other: &Self) -> bool {
        self < other
    }
    fn size(&self) -> u64 {
        self.numer().bits().saturating_add(self.denom().bits())
    }
}

/// A probability or a reward in the kind of number that is solved in; none where doubles would lose digits that the bounds on
/// results count on.
pub(crate) fn rounded<N: Number>(value: &BigRational) -> Option<N> {
    let number = N::from_rational(value);
    let magnitude = number.to_f64().abs();
    (N::EXACT || Zero::is_zero(value) || (1e-250..=1e250).contains(&magnitude)).then_some(number)
}

/// A decimal as it is written, `1.25e-3`, exactly; none where the text is not a number.
pub fn parse_decimal(text: &str) -> Option<BigRational> {
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().ok()?),
        None => (text, 0),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    if whole.is_empty() && fraction.is_empty() || exponent.unsigned_abs() > 400 || mantissa.len() > 400 {
        return None;
    }
    let digits: num_bigint::BigInt = format!("{whole}{fraction}").parse().ok()?;
    let shift = exponent.checked_sub(i32::try_from(fraction.len()).ok()?)?;
    let power = num_bigint::BigInt::from(10).pow(shift.unsigned_abs());
    Some(if shift >= 0 { BigRational::from(digits * power) } else { BigRational::new(digits, power) })
}

/// A rational from a double, as the shortest decimal that reads as this double.
///
/// What stands in a file as `0.1` means one tenth, and not the double beside it. None for infinities and NaN.
pub fn from_shortest_decimal(value: f64) -> Option<BigRational> {
    let negative = value.is_sign_negative();
    let magnitude = parse_decimal(&format!("{:e}", value.abs()))?;
    Some(if negative { -magnitude } else { magnitude })
}

/// The greatest double that is at most the rational, and the least that is at least the rational.
pub fn enclosing(value: &BigRational) -> (f64, f64) {
    let nearest = Number::to_f64(value);
    match BigRational::from_float(nearest) {
        Some(back) if back > *value => (nearest.next_down(), nearest),
        Some(back) if back < *value => (nearest, nearest.next_up()),
        _ => (nearest, nearest),
    }
}
