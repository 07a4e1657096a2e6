//! Number types of a ground task: scaled integers, or rationals.

use num_bigint::BigInt;
use num_traits::{Signed, ToPrimitive as _};

use crate::number::{GROWTH_LIMIT, Int, LIMIT, Rational};
use crate::task::quantity::{Number, Quantity, Table};

/// What the numbers of a quantity come to together, whatever their signs.
pub const QUANTITY_LIMIT: Int = 1 << 123;

/// Quantities with so many numbers are below [`QUANTITY_LIMIT`] by [`LIMIT`] alone.
const SMALL_QUANTITY: usize = 32;

/// Rationals of a task may take this many bits; a state with longer ones is left out, and the search knows that it is not complete
/// then.
const BIT_LIMIT: u64 = 4_096;

/// What numbers of a ground task are: integers that are scaled, or, where these do not fit, rationals as they are.
pub trait TaskNumber: Number + std::fmt::Debug + std::hash::Hash + Default {
    /// Whether fractions become integers by a common factor; otherwise that factor is 1.
    const SCALED: bool;

    /// A rational times a factor; none if that is not a number of this kind.
    fn from_rational(number: &Rational, scale: Int) -> Option<Self>;

    /// About the number, for estimates.
    fn approximate(&self) -> f64;

    /// The number as a rational.
    fn to_rational(&self) -> Rational;

    /// The sum; none if it does not fit.
    fn plus(&self, other: &Self) -> Option<Self>;

    /// The product; none if it does not fit.
    fn times(&self, other: &Self) -> Option<Self>;

    /// Whether a fluent or a sum of costs may become as large as this.
    fn is_moderate(&self) -> bool;

    /// How often a number above 0 has to be added up at least to come to this one; 0 if that is not known.
    fn times_at_least(&self, part: &Self) -> u32;

    /// Whether all sums over the numbers of a quantity fit: those of its tables' greatest magnitudes and its constant do.
    fn fits(quantity: &Quantity<Self>) -> bool;

    /// Whether `start`, with products added, is at least 0 (more than 0 if `strict`), however large the numbers in between.
    fn compare<'n>(
        start: Self,
        terms: impl Iterator<Item = (&'n Self, &'n Self)> + Clone,
        strict: bool,
    ) -> bool
    where
        Self: 'n;
}

/// The sum of a number and of products; none if something does not fit.
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
        let mut all = quantity.tables.iter().filter_map(greatest);
        let mut sum = || all.try_fold(quantity.constant.unsigned_abs(), u128::checked_add);
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
