//! Rational numbers with a compact representation of small values.
//!
//! Probabilities and rewards of models are mostly fractions of small integers. If numerator and
//! denominator fit into one 64-bit word each, the fraction needs no heap memory. Common factors are
//! cancelled before multiplication (Knuth, The Art of Computer Programming 2, 4.5.1). Other
//! fractions are stored as arbitrary-precision rationals.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::num::NonZeroU64;

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::ToPrimitive;

use crate::number::{Number, rounded};

/// A fraction in lowest terms with a positive denominator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fraction {
    /// Numerator and denominator, if both fit into a signed 64-bit word.
    Short(i64, NonZeroU64),
    Long(Box<BigRational>),
}

use Fraction::{Long, Short};

/// Upper limit on the magnitude of integers that are certainly exact as doubles.
const WHOLE: u64 = 1 << 53;

/// Returns the greatest common divisor by the binary algorithm (Stein, J. Comp. Phys. 1, 1967). The
/// result is at least 1, also if both arguments are 0.
#[expect(clippy::arithmetic_side_effects, reason = "the smaller one is taken off the greater one")]
const fn divisor(mut left: u64, mut right: u64) -> u64 {
    if left == 0 || right == 0 {
        return if left == 0 && right == 0 { 1 } else { left | right };
    }
    let common = (left | right).trailing_zeros();
    left >>= left.trailing_zeros();
    loop {
        right >>= right.trailing_zeros();
        if left > right {
            (left, right) = (right, left);
        }
        right -= left;
        if right == 0 || left == 1 {
            return left << common;
        }
    }
}

/// Creates a fraction from a coprime numerator and denominator. The denominator must not be zero.
fn reduced(numerator: i128, denominator: u128) -> Fraction {
    let below = i64::try_from(denominator).ok().and_then(|below| NonZeroU64::new(below.unsigned_abs()));
    if let (Ok(numerator), Some(denominator)) = (i64::try_from(numerator), below) {
        return Short(numerator, denominator);
    }
    Long(Box::new(BigRational::new_raw(BigInt::from(numerator), BigInt::from(denominator))))
}

#[expect(
    clippy::arithmetic_side_effects,
    reason = "products of two words below 2^63 and the sum of two such products fit into 128 bits; divisors are at least 1"
)]
fn sum((a, b): (i64, NonZeroU64), (c, d): (i64, NonZeroU64), is_difference: bool) -> Fraction {
    let (b, d) = (b.get(), d.get());
    let c = if is_difference { -i128::from(c) } else { i128::from(c) };
    let common = if b == d { b } else { divisor(b, d) };
    let (left, right) = (b / common, d / common);
    let sum = i128::from(a) * i128::from(right) + c * i128::from(left);
    // The numerator and the denominator can only have common factors that divide the common divisor of the two
    // denominators.
    let factor = if common == 1 { 1 } else { divisor(remainder(sum, common), common) };
    reduced(sum / i128::from(factor), u128::from(left) * u128::from(d / factor))
}

/// Returns the absolute value of `sum` modulo `divisor`.
#[expect(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    reason = "the divisor is at least 1, and a remainder is less than it"
)]
const fn remainder(sum: i128, divisor: u64) -> u64 {
    let magnitude = sum.unsigned_abs();
    if magnitude >> 64 == 0 { magnitude as u64 % divisor } else { (magnitude % divisor as u128) as u64 }
}

/// Returns the product of the fractions `a / b` and `c / d`. The sign of the second fraction is given by
/// `is_negative`.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "the product of two magnitudes up to 2^63 fits into 128 bits; divisors are at least 1"
)]
fn product((a, b): (i64, NonZeroU64), is_negative: bool, (c, d): (u64, u64)) -> Fraction {
    let first = divisor(a.unsigned_abs(), d);
    let second = divisor(c, b.get());
    let magnitude = u128::from(a.unsigned_abs() / first) * u128::from(c / second);
    let denominator = u128::from(b.get() / second) * u128::from(d / first);
    let magnitude = i128::try_from(magnitude).expect("invariant: at most 2^126");
    reduced(if (a < 0) == is_negative { magnitude } else { -magnitude }, denominator)
}

impl Fraction {
    fn long(&self) -> Cow<'_, BigRational> {
        match self {
            Short(numerator, denominator) => {
                Cow::Owned(BigRational::new_raw(BigInt::from(*numerator), BigInt::from(denominator.get())))
            }
            Long(rational) => Cow::Borrowed(rational),
        }
    }

    fn from_long(rational: BigRational) -> Self {
        Self::fitting(&rational).unwrap_or_else(|| Long(Box::new(rational)))
    }

    fn fitting(rational: &BigRational) -> Option<Self> {
        let denominator = rational.denom().to_i64()?.unsigned_abs();
        Some(Short(rational.numer().to_i64()?, NonZeroU64::new(denominator)?))
    }

    /// Returns the quotient of numerator and denominator, rounded once. Returns `None` for long fractions, and
    /// if one of the two is above 2^53, because it may not be an exact double.
    ///
    /// A fraction that is not an integer is never rounded to an integer: it differs from every integer by at
    /// least 1 / d, where d is the denominator, and the rounding error is less than 1 / d.
    #[expect(clippy::cast_precision_loss, reason = "both are at most 2^53")]
    fn quotient(&self) -> Option<f64> {
        match self {
            Short(numerator, denominator)
                if numerator.unsigned_abs() <= WHOLE && denominator.get() <= WHOLE =>
            {
                Some(*numerator as f64 / denominator.get() as f64)
            }
            _ => None,
        }
    }

    /// Converts the fraction to a double. Returns `None` if its magnitude is so small or large that later
    /// products could underflow or overflow (see [`rounded`]).
    pub fn rounded(&self) -> Option<f64> {
        self.quotient().or_else(|| rounded(&self.long()))
    }
}

impl PartialOrd for Fraction {
    #[expect(clippy::arithmetic_side_effects, reason = "products of two words fit into 128 bits")]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        let (Short(a, b), Short(c, d)) = (self, other) else { return self.long().partial_cmp(&other.long()) };
        let [left, right] =
            [(a, d), (c, b)].map(|(above, below)| i128::from(*above) * i128::from(below.get()));
        left.partial_cmp(&right)
    }
}

impl Number for Fraction {
    const EXACT: bool = true;

    fn zero() -> Self {
        Short(0, NonZeroU64::MIN)
    }
    fn one() -> Self {
        Short(1, NonZeroU64::MIN)
    }
    fn from_rational(value: &BigRational) -> Self {
        Self::fitting(value).unwrap_or_else(|| Long(Box::new(value.clone())))
    }
    fn from_f64(value: f64) -> Self {
        Self::from_long(Number::from_f64(value))
    }
    fn to_f64(&self) -> f64 {
        self.quotient().unwrap_or_else(|| Number::to_f64(&*self.long()))
    }
    fn to_rational(&self) -> Option<BigRational> {
        Some(self.long().into_owned())
    }
    fn plus(&self, other: &Self) -> Self {
        match (self, other) {
            (Short(0, _), term) | (term, Short(0, _)) => term.clone(),
            (Short(a, b), Short(c, d)) => sum((*a, *b), (*c, *d), false),
            _ => Self::from_long(&*self.long() + &*other.long()),
        }
    }
    fn minus(&self, other: &Self) -> Self {
        match (self, other) {
            (term, Short(0, _)) => term.clone(),
            (Short(a, b), Short(c, d)) => sum((*a, *b), (*c, *d), true),
            _ => Self::from_long(&*self.long() - &*other.long()),
        }
    }
    fn times(&self, other: &Self) -> Self {
        match (self, other) {
            (Short(a, b), Short(c, d)) => product((*a, *b), *c < 0, (c.unsigned_abs(), d.get())),
            _ if self.is_unit() => other.clone(),
            _ if other.is_unit() => self.clone(),
            _ => Self::from_long(&*self.long() * &*other.long()),
        }
    }
    fn over(&self, other: &Self) -> Self {
        match (self, other) {
            (Short(a, b), Short(c, d)) if *c != 0 => product((*a, *b), *c < 0, (d.get(), c.unsigned_abs())),
            _ if other.is_unit() => self.clone(),
            _ => Self::from_long(&*self.long() / &*other.long()),
        }
    }
    fn is_zero(&self) -> bool {
        matches!(self, Short(0, _))
    }
    fn is_unit(&self) -> bool {
        matches!(self, Short(1, NonZeroU64::MIN))
    }
    fn clearly_less(&self, other: &Self) -> bool {
        self < other
    }
    fn size(&self) -> u64 {
        match self {
            Short(numerator, denominator) => {
                let bits = |part: u64| u64::from(u64::BITS.saturating_sub(part.leading_zeros()));
                bits(numerator.unsigned_abs()).saturating_add(bits(denominator.get()))
            }
            Long(rational) => rational.size(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn part() -> impl Strategy<Value = i128> {
        let sizes = (0_u32..72, any::<i128>()).prop_map(|(bits, number)| number >> (127 - bits));
        let word = i128::from(i64::MAX);
        let ends = (-3_i128..4, prop_oneof![Just(0), Just(word), Just(-word), Just(1 << 53)]);
        prop_oneof![sizes, ends.prop_map(|(offset, end)| end + offset), -12_i128..13]
    }

    fn rational() -> impl Strategy<Value = BigRational> {
        (part(), part().prop_filter("a denominator", |part| *part != 0))
            .prop_map(|(above, below)| BigRational::new(BigInt::from(above), BigInt::from(below)))
    }

    fn is(fraction: &Fraction, expected: &BigRational) {
        let fits = i64::try_from(expected.numer()).is_ok() && i64::try_from(expected.denom()).is_ok();
        assert_eq!(matches!(fraction, Short(..)), fits, "{fraction:?} {expected}");
        assert_eq!(fraction.to_rational().as_ref(), Some(expected));
        assert_eq!(*fraction, Fraction::from_rational(expected));
        assert_eq!(Number::is_zero(fraction), expected.numer().bits() == 0);
        assert_eq!(Number::is_unit(fraction), expected.numer() == expected.denom());
        assert_eq!(fraction.size(), expected.numer().bits() + expected.denom().bits());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn arithmetic_is_that_of_rationals(left in rational(), right in rational()) {
            let (a, b) = (Fraction::from_rational(&left), Fraction::from_rational(&right));
            is(&a, &left);
            is(&a.plus(&b), &(&left + &right));
            is(&a.minus(&b), &(&left - &right));
            is(&a.times(&b), &(&left * &right));
            if right.numer().bits() > 0 {
                is(&a.over(&b), &(&left / &right));
            }
            prop_assert_eq!(a.partial_cmp(&b), left.partial_cmp(&right));
            prop_assert_eq!(a.clearly_less(&b), left < right);
        }

        #[test]
        fn doubles_are_those_of_rationals(value in rational(), double in any::<f64>()) {
            let fraction = Fraction::from_rational(&value);
            prop_assert_eq!(Number::to_f64(&fraction).to_bits(), Number::to_f64(&value).to_bits());
            prop_assert_eq!(fraction.rounded().map(f64::to_bits), rounded::<f64>(&value).map(f64::to_bits));
            is(&Number::from_f64(double), &<BigRational as Number>::from_f64(double));
        }
    }

    #[test]
    fn a_fraction_takes_two_words() {
        assert_eq!(size_of::<Fraction>(), 16);
    }
}
