//! Exact numbers: rationals of any size for reading and grounding, and integers for the ground task.
//!
//! No operation rounds, wraps or saturates. A rational that does not fit two 128-bit integers is stored as a
//! decimal with 256 bits if possible, otherwise with big integers. Integers of a task that may overflow are
//! computed by checked operations, and the callers handle the overflow.

mod decimal;

use std::cmp::Ordering;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use num_bigint::BigInt;
use num_rational::{BigRational, Ratio};
use num_traits::{CheckedAdd, CheckedDiv, CheckedMul, CheckedSub, One, Signed, ToPrimitive, Zero};

use decimal::Decimal;

/// A number of a ground task, scaled to an integer.
///
/// Scaled constants are at most [`LIMIT`] in magnitude. Values that may exceed the type (products with fluents,
/// growing fluents, sums of costs) are computed by checked operations. `overflow-checks` is enabled for the crates
/// of this workspace in every profile.
pub type Int = i128;

/// Limit on the magnitude of scaled constants.
pub const LIMIT: Int = 1 << 118;

/// Limit on the magnitude of fluents and of sums of costs. A state that exceeds the limit is pruned, and the
/// search is then incomplete.
pub const GROWTH_LIMIT: Int = 1 << 124;

/// An exact rational of any size.
#[derive(Clone, PartialEq, Eq, Hash)]
pub struct Rational(Repr);

/// Unique representation of a rational: `Small` if the number fits, otherwise `Decimal` if it fits, otherwise
/// `Big`. Equal numbers thus have equal representations.
#[derive(Clone, PartialEq, Eq, Hash)]
enum Repr {
    Small(Ratio<i128>),
    Decimal(Decimal),
    Big(Box<BigRational>),
}

impl Rational {
    pub const fn from_integer(integer: Int) -> Self {
        Self(Repr::Small(Ratio::new_raw(integer, 1)))
    }

    /// Returns `numerator / denominator`. The denominator must not be 0.
    pub(crate) fn new(numerator: Int, denominator: Int) -> Self {
        if numerator > Int::MIN && denominator > 0 {
            return Self(Repr::Small(Ratio::new(numerator, denominator)));
        }
        Self::from_big(BigRational::new(numerator.into(), denominator.into()))
    }

    pub fn from_big(big: BigRational) -> Self {
        match (big.numer().to_i128(), big.denom().to_i128()) {
            // The least `i128` has no negation, so it is excluded.
            (Some(numerator), Some(denominator)) if numerator > i128::MIN => {
                Self(Repr::Small(Ratio::new_raw(numerator, denominator)))
            }
            _ => Self(Decimal::from_big(&big).map_or_else(|| Repr::Big(Box::new(big)), Repr::Decimal)),
        }
    }

    fn from_decimal(decimal: Decimal) -> Self {
        Self(decimal.to_small().map_or(Repr::Decimal(decimal), Repr::Small))
    }

    fn to_decimal(&self) -> Option<Decimal> {
        match &self.0 {
            Repr::Small(small) => Decimal::from_small(small),
            Repr::Decimal(decimal) => Some(*decimal),
            Repr::Big(_) => None,
        }
    }

    pub fn to_big(&self) -> BigRational {
        match &self.0 {
            Repr::Small(small) => {
                BigRational::new_raw(BigInt::from(*small.numer()), BigInt::from(*small.denom()))
            }
            Repr::Decimal(decimal) => decimal.to_big(),
            Repr::Big(big) => (**big).clone(),
        }
    }

    pub fn is_integer(&self) -> bool {
        match &self.0 {
            Repr::Small(small) => small.is_integer(),
            Repr::Decimal(decimal) => decimal.is_integer(),
            Repr::Big(big) => big.is_integer(),
        }
    }

    /// Returns the positive denominator of the reduced fraction, or `None` if it exceeds 128 bits.
    pub fn denominator(&self) -> Option<Int> {
        match &self.0 {
            Repr::Small(small) => Some(*small.denom()),
            Repr::Decimal(decimal) => decimal.to_big().denom().to_i128(),
            Repr::Big(big) => big.denom().to_i128(),
        }
    }

    /// Converts to an integer. Returns `None` if the number is not an integer or exceeds 128 bits.
    pub fn to_int(&self) -> Option<Int> {
        match &self.0 {
            Repr::Small(small) => small.is_integer().then(|| *small.numer()),
            Repr::Decimal(_) | Repr::Big(_) => None,
        }
    }

    /// Returns `1 / self`. The number must not be 0.
    #[must_use]
    pub fn recip(&self) -> Self {
        Self::one() / self.clone()
    }

    pub fn is_positive(&self) -> bool {
        match &self.0 {
            Repr::Small(small) => small.is_positive(),
            Repr::Decimal(decimal) => decimal.is_positive(),
            Repr::Big(big) => big.is_positive(),
        }
    }

    pub fn is_negative(&self) -> bool {
        !self.is_positive() && !self.is_zero()
    }

    /// Returns an upper bound on the number of bits of the numerator and of the denominator: the exact maximum
    /// for big rationals, and 256 for all others.
    pub(crate) fn bits(&self) -> u64 {
        match &self.0 {
            Repr::Small(_) | Repr::Decimal(_) => 256,
            Repr::Big(big) => big.numer().bits().max(big.denom().bits()),
        }
    }

    fn integers(&self, other: &Self, operation: impl Fn(i128, i128) -> Option<i128>) -> Option<Self> {
        let (a, b) = (self.to_int()?, other.to_int()?);
        operation(a, b).filter(|result| *result > i128::MIN).map(Self::from_integer)
    }

    fn combine(
        &self,
        other: &Self,
        decimal: impl Fn(Decimal, Decimal) -> Option<Decimal>,
        small: impl Fn(&Ratio<i128>, &Ratio<i128>) -> Option<Ratio<i128>>,
        big: impl Fn(BigRational, BigRational) -> BigRational,
    ) -> Self {
        // Decimals are tried first, because they need no greatest common divisor.
        if let (Some(a), Some(b)) = (self.to_decimal(), other.to_decimal())
            && let Some(result) = decimal(a, b)
        {
            return Self::from_decimal(result);
        }
        if let (Repr::Small(a), Repr::Small(b)) = (&self.0, &other.0)
            && let Some(result) = small(a, b)
            && *result.numer() > i128::MIN
            && *result.denom() > 0
        {
            return Self(Repr::Small(result));
        }
        Self::from_big(big(self.to_big(), other.to_big()))
    }
}

/// Converts an index (of an operator, atom, value, design or step) to 32 bits.
///
/// # Panics
/// Panics if the index is 2^32 or greater.
pub fn dense(index: usize) -> u32 {
    u32::try_from(index).expect("invariant: fewer than 2^32 of anything are held in memory")
}

/// Splits a number into 32-bit words, lowest word first, for use in hash keys.
pub fn words(number: Int) -> [u32; 4] {
    let bytes = number.to_le_bytes();
    let (words, _) = bytes.as_chunks::<4>();
    std::array::from_fn(|word| u32::from_le_bytes(words[word]))
}

/// Returns the least common multiple of two positive integers, or `None` on overflow.
pub fn checked_lcm(a: Int, b: Int) -> Option<Int> {
    a.checked_div(num_integer::gcd(a, b))?.checked_mul(b)
}

impl Default for Rational {
    fn default() -> Self {
        Self::zero()
    }
}

impl Zero for Rational {
    fn zero() -> Self {
        Self::from_integer(0)
    }

    fn is_zero(&self) -> bool {
        matches!(&self.0, Repr::Small(small) if *small.numer() == 0)
    }
}

impl One for Rational {
    fn one() -> Self {
        Self::from_integer(1)
    }
}

impl Add<&Self> for Rational {
    type Output = Self;

    fn add(self, other: &Self) -> Self {
        self.integers(other, i128::checked_add)
            .unwrap_or_else(|| self.combine(other, Decimal::plus, CheckedAdd::checked_add, |a, b| a + b))
    }
}

impl Add for Rational {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self + &other
    }
}

impl AddAssign for Rational {
    fn add_assign(&mut self, other: Self) {
        *self = self.clone() + &other;
    }
}

impl Sub<&Self> for Rational {
    type Output = Self;

    fn sub(self, other: &Self) -> Self {
        self.integers(other, i128::checked_sub)
            .unwrap_or_else(|| self.combine(other, Decimal::minus, CheckedSub::checked_sub, |a, b| a - b))
    }
}

impl Sub for Rational {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self - &other
    }
}

impl Mul<&Self> for Rational {
    type Output = Self;

    fn mul(self, other: &Self) -> Self {
        self.integers(other, i128::checked_mul)
            .unwrap_or_else(|| self.combine(other, Decimal::times, CheckedMul::checked_mul, |a, b| a * b))
    }
}

impl Mul for Rational {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        self * &other
    }
}

/// Exact division. Panics if the divisor is 0.
impl Div for Rational {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        self.combine(&other, |_, _| None, CheckedDiv::checked_div, |a, b| a / b)
    }
}

impl Neg for Rational {
    type Output = Self;

    fn neg(self) -> Self {
        match self.0 {
            Repr::Small(small) => Self(Repr::Small(-small)),
            Repr::Decimal(_) => Self::zero() - self,
            Repr::Big(big) => Self::from_big(-*big),
        }
    }
}

impl Sum for Rational {
    fn sum<I: Iterator<Item = Self>>(numbers: I) -> Self {
        numbers.fold(Self::zero(), |sum, number| sum + number)
    }
}

impl PartialOrd for Rational {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Rational {
    fn cmp(&self, other: &Self) -> Ordering {
        match (&self.0, &other.0) {
            (Repr::Small(a), Repr::Small(b)) if a.denom() == b.denom() => a.numer().cmp(b.numer()),
            _ => {
                let decimals = self.to_decimal().zip(other.to_decimal());
                let compared = decimals.and_then(|(a, b)| a.compare(b));
                compared.unwrap_or_else(|| match (&self.0, &other.0) {
                    (Repr::Small(a), Repr::Small(b)) => a.cmp(b),
                    _ => self.to_big().cmp(&other.to_big()),
                })
            }
        }
    }
}

impl std::fmt::Debug for Rational {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.to_big())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn number() -> impl Strategy<Value = BigRational> {
        let integer = prop_oneof![
            (-20_i128..20).prop_map(BigInt::from),
            any::<i64>().prop_map(BigInt::from),
            any::<i128>().prop_map(BigInt::from),
            (-2_i128..=2).prop_map(|offset| BigInt::from(i128::MAX) + offset),
            (-2_i128..=2).prop_map(|offset| BigInt::from(i128::MIN) + offset),
            any::<(i128, i128)>().prop_map(|(a, b)| BigInt::from(a) * b),
        ];
        let ten = (0_u32..80).prop_map(|places| BigInt::from(10).pow(places));
        let two = (0_u32..130).prop_map(|places| BigInt::from(2).pow(places));
        let five = (0_u32..60).prop_map(|places| BigInt::from(5).pow(places));
        let near = (0_u32..260, -2_i8..=2).prop_map(|(bits, offset)| BigInt::from(2).pow(bits) + offset);
        let numerator = prop_oneof![integer.clone(), near, ten.clone(), five.clone()];
        let signed = (numerator, any::<bool>()).prop_map(|(own, negative)| if negative { -own } else { own });
        (signed, prop_oneof![integer, ten, two, five]).prop_map(|(numerator, denominator)| {
            let denominator = if denominator.is_zero() { BigInt::from(1) } else { denominator };
            BigRational::new(numerator, denominator)
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        #[test]
        fn arithmetic_is_that_of_big_rationals(a in number(), b in number()) {
            let (x, y) = (Rational::from_big(a.clone()), Rational::from_big(b.clone()));
            prop_assert_eq!((x.clone() + &y).to_big(), &a + &b);
            prop_assert_eq!((x.clone() - &y).to_big(), &a - &b);
            prop_assert_eq!((x.clone() * &y).to_big(), &a * &b);
            prop_assert_eq!((-x.clone()).to_big(), -a.clone());
            prop_assert_eq!(x.to_big(), a.clone());
            // Equal numbers have equal representations, independent of their computation.
            prop_assert_eq!(x.clone() + &y, Rational::from_big(&a + &b));
            prop_assert_eq!(x.clone() - &y, Rational::from_big(&a - &b));
            prop_assert_eq!(x.clone() * &y, Rational::from_big(&a * &b));
            prop_assert_eq!((x.clone() + &y) - &y, x.clone());
            prop_assert_eq!(x.cmp(&y), a.cmp(&b));
            prop_assert_eq!(x.is_positive(), a.is_positive());
            prop_assert_eq!(x.is_integer(), a.is_integer());
            if !b.is_zero() {
                prop_assert_eq!((x.clone() / y.clone()).to_big(), &a / &b);
                // Equal numbers have equal representations, independent of their computation.
                prop_assert_eq!((x.clone() / y.clone()) * &y, x);
            }
        }
    }
}
