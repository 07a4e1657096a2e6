//! The number types of the solvers: doubles and exact rationals.
//!
//! Every algorithm is generic in the number type. Doubles scale to large models, and their rounding
//! errors are bounded; rationals are feasible for small models only.

use std::fmt::Debug;

use num_rational::BigRational;
use num_traits::{One, ToPrimitive, Zero};

/// Relative difference below which two doubles are considered equal.
const TOLERANCE: f64 = 1e-12;

/// Upper limit (exclusive) on integral doubles that are considered exact, either as numbers of the
/// model or as sums of such numbers.
const WHOLE: f64 = 4e15;

pub(crate) fn is_whole(value: f64) -> bool {
    value.fract() == 0.0 && value < WHOLE
}

/// Adds two rewards. A double that is an integer below 4·10^15 counts as exact. The sum must therefore not be such a
/// double unless both rewards are: if it is, the next greater double is returned instead. In exact arithmetic, returns
/// the sum.
pub(crate) fn sum_of_rewards<N: Number>(left: &N, right: &N) -> N {
    let mut sum = RewardSum::new(left.clone());
    sum.add(right);
    sum.total()
}

/// A sum of any number of rewards, each at least 0. In doubles, the rounding errors of the additions are summed, too, so
/// that the relative error of the sum does not grow with their number (see [`plus_with_error`]). The sum is an integer
/// below 4·10^15 only if all rewards are, as in [`sum_of_rewards`].
pub(crate) struct RewardSum<N> {
    sum: N,
    error: N,
    all_whole: bool,
}

impl<N: Number> RewardSum<N> {
    pub fn new(first: N) -> Self {
        let all_whole = N::EXACT || is_whole(first.to_f64());
        Self { sum: first, error: N::zero(), all_whole }
    }

    pub fn add(&mut self, reward: &N) {
        let (sum, error) = plus_with_error(&self.sum, reward);
        self.sum = sum;
        if !N::EXACT {
            self.error = self.error.plus(&error);
            self.all_whole &= is_whole(reward.to_f64());
        }
    }

    pub fn total(self) -> N {
        if N::EXACT {
            return self.sum;
        }
        let total = self.sum.plus(&self.error);
        if self.all_whole || !is_whole(total.to_f64()) {
            total
        } else {
            N::from_f64(total.to_f64().next_up())
        }
    }
}

/// Returns the sum and the rounding error that has to be added to it to get the exact sum; 0 in exact arithmetic (two-sum
/// algorithm). If the errors of all additions of n nonnegative doubles are summed and added at the end, the relative error
/// of the result is at most u + n²u², where u is the unit roundoff.
///
/// Reference: Ogita, Rump and Oishi, "Accurate Sum and Dot Product", SIAM Journal on Scientific Computing 26(6), 2005.
pub(crate) fn plus_with_error<N: Number>(left: &N, right: &N) -> (N, N) {
    let sum = left.plus(right);
    if N::EXACT {
        return (sum, N::zero());
    }
    let right_part = sum.minus(left);
    let left_error = left.minus(&sum.minus(&right_part));
    let error = left_error.plus(&right.minus(&right_part));
    (sum, error)
}

#[expect(
    clippy::cast_precision_loss,
    reason = "what is counted is in memory, so that there is less of it than 2^53"
)]
pub(crate) fn count(things: usize) -> f64 {
    things as f64
}

/// A number type for probabilities, rewards and values: an ordered field.
pub trait Number: Clone + Debug + PartialOrd + Send + Sync + 'static {
    /// Whether arithmetic in this type is exact.
    const EXACT: bool;

    /// Zero.
    fn zero() -> Self;
    /// One.
    fn one() -> Self;
    /// Converts a rational to this type. In doubles, the result is the nearest double, but a rational that is not
    /// an integer never becomes an integral double below 4·10^15: instead of the integer, an adjacent double is
    /// returned.
    fn from_rational(value: &BigRational) -> Self;
    /// Converts a double to this type; infinities and NaN become zero.
    fn from_f64(value: f64) -> Self;
    /// Converts to the nearest double.
    fn to_f64(&self) -> f64;
    /// Returns the rational value if arithmetic is exact, otherwise `None`.
    fn to_rational(&self) -> Option<BigRational>;
    /// Returns the sum.
    #[must_use]
    fn plus(&self, other: &Self) -> Self;
    /// Returns the difference.
    #[must_use]
    fn minus(&self, other: &Self) -> Self;
    /// Returns the product.
    #[must_use]
    fn times(&self, other: &Self) -> Self;
    /// Returns the quotient; the divisor must not be zero.
    #[must_use]
    fn over(&self, other: &Self) -> Self;
    /// Returns `true` if the number is exactly zero.
    fn is_zero(&self) -> bool;
    /// Returns `true` if the number is exactly one.
    fn is_unit(&self) -> bool;
    /// Returns `true` if the number is less than `other` by more than the tolerance for rounding
    /// errors.
    fn clearly_less(&self, other: &Self) -> bool;
    /// Returns the size of the number in bits, which measures the cost of exact arithmetic.
    fn size(&self) -> u64;
}

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

/// Converts a probability or a reward of the model to the number type of the solver. For doubles, returns `None` if the
/// value is so small or large that later products could underflow or overflow.
pub(crate) fn rounded<N: Number>(value: &BigRational) -> Option<N> {
    let number = N::from_rational(value);
    let magnitude = number.to_f64().abs();
    (N::EXACT || Zero::is_zero(value) || (1e-250..=1e250).contains(&magnitude)).then_some(number)
}

/// Parses a decimal such as `1.25e-3` exactly. Returns `None` if the text is not a decimal, its
/// mantissa has more than 400 characters, or the magnitude of its exponent exceeds 400.
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

/// Converts a double to the rational value of its shortest decimal representation.
///
/// The decimal `0.1` in a file thus means one tenth, not the nearest double. Returns `None` for
/// infinities and NaN.
pub fn from_shortest_decimal(value: f64) -> Option<BigRational> {
    let negative = value.is_sign_negative();
    let magnitude = parse_decimal(&format!("{:e}", value.abs()))?;
    Some(if negative { -magnitude } else { magnitude })
}

/// Returns the greatest double that is at most `value`, and the least double that is at least
/// `value`.
pub fn enclosing(value: &BigRational) -> (f64, f64) {
    let nearest = Number::to_f64(value);
    match BigRational::from_float(nearest) {
        Some(back) if back > *value => (nearest.next_down(), nearest),
        Some(back) if back < *value => (nearest, nearest.next_up()),
        // Beyond the range of doubles.
        None if nearest > 0.0 => (f64::MAX, f64::INFINITY),
        None => (f64::NEG_INFINITY, f64::MIN),
        Some(_) => (nearest, nearest),
    }
}
