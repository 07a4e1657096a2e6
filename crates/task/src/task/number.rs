//! Number types of a ground task: scaled integers or rationals.

use num_bigint::BigInt;
use num_traits::{Signed, ToPrimitive as _};

use crate::number::{GROWTH_LIMIT, Int, LIMIT, Rational};
use crate::task::quantity::{Number, Quantity, Table};

/// Limit on the magnitude of the constant of a quantity plus the greatest magnitude in each of its tables.
pub const QUANTITY_LIMIT: Int = 1 << 123;

/// Number of summands (constant and tables) up to which [`LIMIT`] alone keeps a quantity within [`QUANTITY_LIMIT`].
const SMALL_QUANTITY: usize = 32;

/// Limit on the number of bits of rationals in a state. A state that exceeds the limit is pruned, and the
/// search is then incomplete.
const BIT_LIMIT: u64 = 4_096;

/// Number type of a ground task: scaled integers, or exact rationals if integers would overflow.
pub trait TaskNumber: Number + std::fmt::Debug + std::hash::Hash + Default {
    /// `true` if numbers of this type are multiplied by a common factor of the task that makes them integers.
    /// Otherwise, the factor is always 1.
    const SCALED: bool;

    /// Converts `number * scale`. For integers, returns `None` unless the result is an integer from -[`LIMIT`] to
    /// [`LIMIT`] - 1.
    fn from_rational(number: &Rational, scale: Int) -> Option<Self>;

    /// Returns a floating-point approximation, for estimates only.
    fn approximate(&self) -> f64;

    /// Converts the number to a rational.
    fn to_rational(&self) -> Rational;

    /// Returns the sum, or `None` on overflow.
    fn plus(&self, other: &Self) -> Option<Self>;

    /// Returns the product, or `None` on overflow.
    fn times(&self, other: &Self) -> Option<Self>;

    /// Returns `true` if the magnitude (for rationals: the number of bits) is within the limit for fluents and
    /// sums of costs.
    fn is_moderate(&self) -> bool;

    /// Returns a lower bound on the integers n with n·`part` ≥ this number, where `part` > 0. Returns 0 if no bound is
    /// known.
    fn times_at_least(&self, part: &Self) -> u32;

    /// Returns `true` if no value of the quantity can overflow. For integers, the sum of the constant's
    /// magnitude and the greatest magnitude in each table must be within a limit; rationals always fit.
    fn fits(quantity: &Quantity<Self>) -> bool;

    /// Returns `true` if the sum of `start` and all products is ≥ 0, or > 0 if `strict`. Intermediate results
    /// do not overflow.
    fn compare<'n>(
        start: Self,
        terms: impl Iterator<Item = (&'n Self, &'n Self)> + Clone,
        strict: bool,
    ) -> bool
    where
        Self: 'n;
}

/// Returns the sum of `start` and all products, or `None` on overflow.
pub fn sum_of_products<'n, N: TaskNumber + 'n>(
    start: N,
    mut terms: impl Iterator<Item = (&'n N, &'n N)>,
) -> Option<N> {
    terms.try_fold(start, |sum, (a, b)| sum.plus(&a.times(b)?))
}

impl TaskNumber for Int {
    const SCALED: bool = true;

    fn from_rational(number: &Rational, scale: Int) -> Option<Self> {
        let scaled = (number.clone() * &Rational::from_integer(scale)).to_int();
        scaled.filter(|integer| (-LIMIT..LIMIT).contains(integer))
    }

    fn approximate(&self) -> f64 {
        *self as f64
    }

    fn to_rational(&self) -> Rational {
        Rational::from_integer(*self)
    }

    fn plus(&self, other: &Self) -> Option<Self> {
        (*self).checked_add(*other)
    }

    fn times(&self, other: &Self) -> Option<Self> {
        (*self).checked_mul(*other)
    }

    fn is_moderate(&self) -> bool {
        (-GROWTH_LIMIT..=GROWTH_LIMIT).contains(self)
    }

    fn times_at_least(&self, part: &Self) -> u32 {
        let less_one = self.saturating_sub(1).checked_div_euclid(*part).unwrap_or(-1);
        u32::try_from(less_one.saturating_add(1)).unwrap_or(0)
    }

    fn fits(quantity: &Quantity<Self>) -> bool {
        let greatest = |table: &Table<Int>| table.values.iter().map(|value| value.unsigned_abs()).max();
        let mut magnitudes = quantity.tables.iter().filter_map(greatest);
        let mut sum = || magnitudes.try_fold(quantity.constant.unsigned_abs(), u128::checked_add);
        quantity.tables.len() < SMALL_QUANTITY
            || sum().is_some_and(|sum| sum <= QUANTITY_LIMIT.unsigned_abs())
    }

    fn compare<'n>(
        start: Self,
        terms: impl Iterator<Item = (&'n Self, &'n Self)> + Clone,
        strict: bool,
    ) -> bool {
        if let Some(value) = sum_of_products(start, terms.clone()) {
            return if strict { value > 0 } else { value >= 0 };
        }
        let products = terms.map(|(a, b)| BigInt::from(*a) * b);
        let value = products.fold(BigInt::from(start), |sum, product| sum + product);
        if strict { value.is_positive() } else { !value.is_negative() }
    }
}

impl TaskNumber for Rational {
    const SCALED: bool = false;

    fn from_rational(number: &Rational, scale: Int) -> Option<Self> {
        Some(number.clone() * &Self::from_integer(scale))
    }

    fn approximate(&self) -> f64 {
        self.to_big().to_f64().unwrap_or(f64::MAX)
    }

    fn to_rational(&self) -> Rational {
        self.clone()
    }

    fn plus(&self, other: &Self) -> Option<Self> {
        Some(self.clone() + other)
    }

    fn times(&self, other: &Self) -> Option<Self> {
        Some(self.clone() * other)
    }

    fn is_moderate(&self) -> bool {
        self.bits() <= BIT_LIMIT
    }

    fn times_at_least(&self, part: &Self) -> u32 {
        self.to_int().zip(part.to_int()).map_or(0, |(whole, part)| whole.times_at_least(&part))
    }

    fn fits(_: &Quantity<Self>) -> bool {
        true
    }

    fn compare<'n>(
        start: Self,
        terms: impl Iterator<Item = (&'n Self, &'n Self)> + Clone,
        strict: bool,
    ) -> bool {
        let value = terms.fold(start, |sum, (a, b)| sum + a.clone() * b);
        if strict { value.is_positive() } else { !value.is_negative() }
    }
}
