//! Integers of any size: 128 bits if sufficient, otherwise arbitrary precision. No operation wraps
//! or saturates. Integers in documents have at most [`MAX_DIGITS`] digits, because the time for
//! parsing is quadratic.

use std::cmp::Ordering;
use std::iter::Sum;
use std::ops::{Add, Mul, Neg, Sub};

use num_bigint::BigInt;
use num_integer::Integer as _;
use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Number;

/// Upper limit on the number of digits of an integer in a document. (The limit for PDDL files is
/// 400 digits.)
pub const MAX_DIGITS: usize = 10_000;

/// An arbitrary-precision integer. In documents it has at most [`MAX_DIGITS`] digits.
#[derive(Clone, PartialEq, Eq, Hash)]
pub struct Integer(Repr);

/// Canonical: `Small` if and only if the value fits, so that equality is structural.
#[derive(Clone, PartialEq, Eq, Hash)]
enum Repr {
    Small(i128),
    Big(Box<BigInt>),
}

use Repr::{Big, Small};

impl Integer {
    pub(crate) const ZERO: Self = Self(Small(0));

    pub(crate) fn to_big(&self) -> BigInt {
        match &self.0 {
            Small(small) => BigInt::from(*small),
            Big(big) => (**big).clone(),
        }
    }

    /// Converts the integer to a fraction.
    #[must_use]
    pub fn to_rational(&self) -> BigRational {
        BigRational::from_integer(self.to_big())
    }

    pub(crate) fn is_zero(&self) -> bool {
        matches!(self.0, Small(0))
    }

    pub(crate) fn is_positive(&self) -> bool {
        match &self.0 {
            Small(small) => *small > 0,
            Big(big) => big.is_positive(),
        }
    }

    pub(crate) fn is_negative(&self) -> bool {
        !self.is_positive() && !self.is_zero()
    }

    pub(crate) fn div_floor(&self, divisor: &Self) -> Self {
        match (&self.0, &divisor.0) {
            // Divisors are positive, so Euclidean division rounds down.
            (Small(own), Small(other)) => Self(Small(own.div_euclid(*other))),
            _ => Self::from(self.to_big().div_floor(&divisor.to_big())),
        }
    }

    pub(crate) fn bit(&self, position: usize) -> bool {
        match &self.0 {
            Small(small) => small >> position.min(127) & 1 == 1,
            Big(big) => big.bit(position as u64),
        }
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "at most 128 leading zeros, and bits that are held in memory"
    )]
    pub(crate) fn width(&self) -> usize {
        match &self.0 {
            Small(small) => {
                (129 - if *small < 0 { (!small).leading_zeros() } else { small.leading_zeros() }) as usize
            }
            // A magnitude needs one additional bit for the sign.
            Big(big) => usize::try_from(big.bits()).unwrap_or(usize::MAX - 1) + 1,
        }
    }

    fn combine(
        &self,
        other: &Self,
        small: impl Fn(i128, i128) -> Option<i128>,
        big: impl Fn(BigInt, BigInt) -> BigInt,
    ) -> Self {
        if let (Small(own), Small(other)) = (&self.0, &other.0)
            && let Some(result) = small(*own, *other)
        {
            return Self(Small(result));
        }
        Self::from(big(self.to_big(), other.to_big()))
    }
}

impl From<i128> for Integer {
    fn from(small: i128) -> Self {
        Self(Small(small))
    }
}

impl From<BigInt> for Integer {
    fn from(big: BigInt) -> Self {
        big.to_i128().map_or_else(|| Self(Big(Box::new(big))), Self::from)
    }
}

impl Default for Integer {
    fn default() -> Self {
        Self::ZERO
    }
}

impl Add for &Integer {
    type Output = Integer;

    fn add(self, other: Self) -> Integer {
        self.combine(other, i128::checked_add, |a, b| a + b)
    }
}

impl Sub for &Integer {
    type Output = Integer;

    fn sub(self, other: Self) -> Integer {
        self.combine(other, i128::checked_sub, |a, b| a - b)
    }
}

impl Mul for &Integer {
    type Output = Integer;

    fn mul(self, other: Self) -> Integer {
        self.combine(other, i128::checked_mul, |a, b| a * b)
    }
}

impl Neg for &Integer {
    type Output = Integer;

    fn neg(self) -> Integer {
        &Integer::ZERO - self
    }
}

impl<'i> Sum<&'i Integer> for Integer {
    fn sum<I: Iterator<Item = &'i Integer>>(all: I) -> Self {
        all.fold(Self::ZERO, |sum, own| &sum + own)
    }
}

impl PartialOrd for Integer {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Integer {
    fn cmp(&self, other: &Self) -> Ordering {
        match (&self.0, &other.0) {
            (Small(own), Small(other)) => own.cmp(other),
            _ => self.to_big().cmp(&other.to_big()),
        }
    }
}

impl std::fmt::Display for Integer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.0 {
            Small(small) => small.fmt(f),
            Big(big) => big.fmt(f),
        }
    }
}

impl std::fmt::Debug for Integer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{self}")
    }
}

impl Serialize for Integer {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.0 {
            Small(small) => serializer.serialize_i128(*small),
            Big(big) => Number::from_string_unchecked(big.to_string()).serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Integer {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let number = Number::deserialize(deserializer)?;
        let digits = number.as_str();
        if let Ok(small) = digits.parse::<i128>() {
            return Ok(Self::from(small));
        }
        if digits.len() > MAX_DIGITS {
            let message = format!("a number of {} digits, more than {MAX_DIGITS}", digits.len());
            return Err(D::Error::custom(message));
        }
        let is_integer = digits.bytes().all(|byte| byte.is_ascii_digit() || byte == b'-');
        let big = if is_integer { digits.parse::<BigInt>().ok() } else { None };
        big.map(Self::from).ok_or_else(|| D::Error::custom(format!("{digits} is not an integer")))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn integer() -> impl Strategy<Value = BigInt> {
        prop_oneof![
            (-20_i128..20).prop_map(BigInt::from),
            any::<i64>().prop_map(BigInt::from),
            any::<i128>().prop_map(BigInt::from),
            (-2_i128..=2).prop_map(|offset| BigInt::from(i128::MAX) + offset),
            (-2_i128..=2).prop_map(|offset| BigInt::from(i128::MIN) + offset),
            any::<(i128, i128)>().prop_map(|(a, b)| BigInt::from(a) * b),
        ]
    }

    proptest! {
        #[test]
        fn arithmetic_is_that_of_big_integers(a in integer(), b in integer(), position in 0_usize..300) {
            let (x, y) = (Integer::from(a.clone()), Integer::from(b.clone()));
            prop_assert_eq!((&x + &y).to_big(), &a + &b);
            prop_assert_eq!((&x - &y).to_big(), &a - &b);
            prop_assert_eq!((&x * &y).to_big(), &a * &b);
            prop_assert_eq!((-&x).to_big(), -&a);
            prop_assert_eq!(x.cmp(&y), a.cmp(&b));
            prop_assert_eq!(x == y, a == b);
            prop_assert_eq!(x.is_positive(), a > BigInt::from(0));
            prop_assert_eq!(x.is_negative(), a < BigInt::from(0));
            if y.is_positive() {
                prop_assert_eq!(x.div_floor(&y).to_big(), a.div_floor(&b));
            }
            prop_assert_eq!(x.bit(position), a.bit(position as u64));
            // All bits from position `width - 1` on equal the sign.
            let width = x.width();
            prop_assert!((width - 1..width + 3).all(|position| x.bit(position) == x.is_negative()));
            let written = serde_json::to_string(&x).expect("JSON");
            prop_assert_eq!(&written, &a.to_string());
            prop_assert_eq!(serde_json::from_str::<Integer>(&written).expect("an integer"), x);
        }
    }

    #[test]
    fn numbers_with_too_many_digits_are_rejected_without_parsing() {
        let longest = "9".repeat(MAX_DIGITS);
        assert_eq!(serde_json::from_str::<Integer>(&longest).expect("an integer").to_string(), longest);
        let error = serde_json::from_str::<Integer>(&"9".repeat(10_000_000)).expect_err("too long");
        assert!(error.to_string().starts_with("a number of 10000000 digits, more than 10000"), "{error}");
    }

    #[test]
    fn text_that_is_not_an_integer_is_rejected() {
        for text in ["1.5", "1e3", "\"7\"", "null", "1e400", "-", "+1"] {
            assert!(serde_json::from_str::<Integer>(text).is_err(), "{text}");
        }
    }
}
