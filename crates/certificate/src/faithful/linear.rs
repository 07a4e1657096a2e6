//! Linear expressions over numeric fluents, with exact rationals.

use std::collections::BTreeMap;

use num_rational::BigRational;
use num_traits::{One, Signed, Zero};

use crate::faithful::key::Key;

/// A sum of fluents with nonzero factors, plus a constant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Linear {
    pub(super) factors: BTreeMap<Key, BigRational>,
    pub(super) constant: BigRational,
}

#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Interval {
    pub(super) low: Option<BigRational>,
    pub(super) high: Option<BigRational>,
}

/// Returns `sum + number * factor`. Integers are added without the common divisors that fractions need, because
/// most numbers of a task are integers and divisors take most of the time.
fn sum_with_product(sum: BigRational, number: &BigRational, factor: &BigRational) -> BigRational {
    if number.is_zero() {
        sum
    } else if [&sum, number, factor].into_iter().all(BigRational::is_integer) {
        BigRational::from_integer(sum.numer() + number.numer() * factor.numer())
    } else {
        sum + number * factor
    }
}

impl Interval {
    pub(super) fn point(value: &BigRational) -> Self {
        Self { low: Some(value.clone()), high: Some(value.clone()) }
    }

    pub(super) fn value(&self) -> Option<&BigRational> {
        self.low.as_ref().filter(|low| Some(*low) == self.high.as_ref())
    }

    pub(super) fn contains(&self, other: &Self) -> bool {
        let low = self.low.as_ref().is_none_or(|own| other.low.as_ref().is_some_and(|low| own <= low));
        let high = self.high.as_ref().is_none_or(|own| other.high.as_ref().is_some_and(|high| own >= high));
        low && high
    }
}

impl Linear {
    pub(super) fn constant(constant: BigRational) -> Self {
        Self { factors: BTreeMap::new(), constant }
    }

    pub(super) fn fluent(key: Key) -> Self {
        Self { factors: BTreeMap::from([(key, BigRational::one())]), constant: BigRational::zero() }
    }

    pub(super) fn plus(mut self, other: &Self, factor: &BigRational) -> Self {
        self.constant = sum_with_product(self.constant, &other.constant, factor);
        for (key, other_factor) in &other.factors {
            let previous = self.factors.remove(key).unwrap_or_else(BigRational::zero);
            let sum = sum_with_product(previous, other_factor, factor);
            if !sum.is_zero() {
                self.factors.insert(key.clone(), sum);
            }
        }
        self
    }

    pub(super) fn minus(self, other: &Self) -> Self {
        self.plus(other, &-BigRational::one())
    }

    pub(super) fn times(&self, factor: &BigRational) -> Self {
        Self::constant(BigRational::zero()).plus(self, factor)
    }

    pub(super) fn negated(&self) -> Self {
        self.times(&-BigRational::one())
    }

    pub(super) fn value(&self) -> Option<&BigRational> {
        self.factors.is_empty().then_some(&self.constant)
    }

    /// Returns the factor r such that this expression without its constant is r times `other`
    /// without its constant. Returns `None` if there is no such factor, or if this expression is
    /// constant.
    pub(super) fn ratio_to(&self, other: &Self) -> Option<BigRational> {
        let (key, own) = self.factors.first_key_value()?;
        let ratio = own / other.factors.get(key)?;
        let is_multiple = self.factors.len() == other.factors.len()
            && self
                .factors
                .iter()
                .all(|(key, own)| other.factors.get(key).is_some_and(|factor| factor * &ratio == *own));
        is_multiple.then_some(ratio)
    }

    pub(super) fn range<'i>(&self, interval: impl Fn(&Key) -> Option<&'i Interval>) -> Interval {
        let mut range = Interval::point(&self.constant);
        for (key, factor) in &self.factors {
            let bounds = interval(key);
            let (low, high) = (
                bounds.and_then(|bounds| bounds.low.as_ref()),
                bounds.and_then(|bounds| bounds.high.as_ref()),
            );
            let (low, high) = if factor.is_negative() { (high, low) } else { (low, high) };
            let add = |sum: Option<BigRational>, end: Option<&BigRational>| Some(sum? + end? * factor);
            range = Interval { low: add(range.low, low), high: add(range.high, high) };
        }
        range
    }
}
