//! Decimals of up to 76 decimal places, with a mantissa of at most 254 bits. Sums and products of measured
//! numbers are decimals, and unlike fractions they need no greatest common divisors.
//!
//! The representation is unique: the mantissa is not a multiple of 10, unless the number of decimal places is
//! 0.

use std::cmp::Ordering;

use ethnum::{I256, U256};
use num_bigint::BigInt;
use num_rational::{BigRational, Ratio};

/// Maximum number of decimal places; 10^76 has fewer than 254 bits.
const PLACES: u32 = 76;

const BITS: u32 = 254;

const FIVES: [u128; 56] = powers(5);

const TENS: [u128; 39] = powers(10);

#[expect(clippy::arithmetic_side_effects, reason = "what does not fit is an error when this is compiled")]
const fn powers<const N: usize>(base: u128) -> [u128; N] {
    let mut powers = [1; N];
    let mut exponent = 1;
    while exponent < N {
        powers[exponent] = powers[exponent - 1] * base;
        exponent += 1;
    }
    powers
}

/// A decimal number with the value `mantissa / 10^places`.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Decimal {
    mantissa: I256,
    places: u32,
}

fn power_of_ten(exponent: u32) -> Option<I256> {
    let power = |exponent: u32| TENS.get(exponent as usize).copied().map(I256::from);
    power(exponent).or_else(|| power(exponent.checked_sub(38)?)?.checked_mul(power(38)?))
}

fn fits(mantissa: I256) -> bool {
    mantissa.unsigned_abs().leading_zeros() >= U256::BITS - BITS
}

fn exponent_of_five(power: u128) -> Option<u32> {
    FIVES.binary_search(&power).ok().and_then(|exponent| u32::try_from(exponent).ok())
}

/// Returns `true` if a number is divisible by 5. Because 2^64 ≡ 1 (mod 5), a number is congruent to the sum
/// of its 64-bit words.
fn is_multiple_of_five(number: I256) -> bool {
    let bytes = number.unsigned_abs().to_le_bytes();
    let (words, _) = bytes.as_chunks::<8>();
    words.iter().map(|word| u64::from_le_bytes(*word) % 5).sum::<u64>() % 5 == 0
}

impl Decimal {
    /// Creates a decimal and removes trailing zeros after the decimal point. Returns `None` if it has too
    /// many digits.
    fn new(mut mantissa: I256, mut places: u32) -> Option<Self> {
        // A multiple of 10 is divisible by 2 and by 5.
        while places > 0 && mantissa.trailing_zeros() > 0 && is_multiple_of_five(mantissa) {
            mantissa = mantissa.checked_div(I256::new(10))?;
            places = places.checked_sub(1)?;
        }
        (places <= PLACES && fits(mantissa)).then_some(Self { mantissa, places })
    }

    /// Converts a fraction. Returns `None` if the fraction has no finite decimal expansion or too many
    /// digits.
    pub(super) fn from_small(small: &Ratio<i128>) -> Option<Self> {
        if *small.denom() == 1 {
            return Some(Self { mantissa: I256::from(*small.numer()), places: 0 });
        }
        let denominator = small.denom().unsigned_abs();
        let twos = denominator.trailing_zeros();
        let fives = exponent_of_five(denominator >> twos)?;
        let places = twos.max(fives);
        // Either `twos` or `fives` equals `places`, so at least one of the two factors is 1.
        let missing_twos = I256::ONE.checked_shl(places.checked_sub(twos)?)?;
        let missing_fives = I256::new(5).checked_pow(places.checked_sub(fives)?)?;
        let mantissa = I256::from(*small.numer()).checked_mul(missing_twos)?.checked_mul(missing_fives)?;
        Self::new(mantissa, places)
    }

    pub(super) fn from_big(big: &BigRational) -> Option<Self> {
        let bits = |integer: &BigInt| integer.bits();
        if bits(big.numer()) > BITS.into() || bits(big.denom()) > U256::BITS.into() {
            return None;
        }
        let mut power = BigInt::ONE;
        let places = (0..=PLACES).find(|_| {
            let enough = (&power % big.denom()) == BigInt::ZERO;
            if !enough {
                power *= 10;
            }
            enough
        })?;
        let mantissa = big.numer() * (power / big.denom());
        let bytes = mantissa.to_signed_bytes_le();
        if bytes.len() > 32 {
            return None;
        }
        let sign = if mantissa.sign() == num_bigint::Sign::Minus { 0xff } else { 0 };
        let mut padded = [sign; 32];
        padded[..bytes.len()].copy_from_slice(&bytes);
        Self::new(I256::from_le_bytes(padded), places)
    }

    /// Converts to a reduced fraction. Returns `None` if the numerator or denominator exceeds 128 bits.
    pub(super) fn to_small(self) -> Option<Ratio<i128>> {
        let (mut mantissa, mut denominator) = (self.mantissa, power_of_ten(self.places)?);
        if self.places > 0 {
            // The mantissa is not a multiple of 10, so it is divisible by at most one of 2 and 5.
            let twos = mantissa.trailing_zeros().min(self.places);
            mantissa = mantissa.checked_shr(twos)?;
            denominator = denominator.checked_shr(twos)?;
            for _ in 0..if twos > 0 { 0 } else { self.places } {
                if !is_multiple_of_five(mantissa) {
                    break;
                }
                mantissa = mantissa.checked_div(I256::new(5))?;
                denominator = denominator.checked_div(I256::new(5))?;
            }
        }
        let numerator = i128::try_from(mantissa).ok().filter(|numerator| *numerator > i128::MIN)?;
        Some(Ratio::new_raw(numerator, i128::try_from(denominator).ok()?))
    }

    pub(super) fn to_big(self) -> BigRational {
        let mantissa = BigInt::from_signed_bytes_le(&self.mantissa.to_le_bytes());
        BigRational::new(mantissa, BigInt::from(10).pow(self.places))
    }

    pub(super) fn is_integer(self) -> bool {
        self.places == 0
    }

    pub(super) fn is_positive(self) -> bool {
        self.mantissa.is_positive()
    }

    fn aligned(self, other: Self) -> Option<(I256, I256, u32)> {
        let widen =
            |own: Self, places: u32| own.mantissa.checked_mul(power_of_ten(places.checked_sub(own.places)?)?);
        match self.places.cmp(&other.places) {
            Ordering::Equal => Some((self.mantissa, other.mantissa, self.places)),
            Ordering::Less => Some((widen(self, other.places)?, other.mantissa, other.places)),
            Ordering::Greater => Some((self.mantissa, widen(other, self.places)?, self.places)),
        }
    }

    pub(super) fn plus(self, other: Self) -> Option<Self> {
        let (left, other, places) = self.aligned(other)?;
        Self::new(left.checked_add(other)?, places)
    }

    pub(super) fn minus(self, other: Self) -> Option<Self> {
        let (left, other, places) = self.aligned(other)?;
        Self::new(left.checked_sub(other)?, places)
    }

    pub(super) fn times(self, other: Self) -> Option<Self> {
        Self::new(self.mantissa.checked_mul(other.mantissa)?, self.places.checked_add(other.places)?)
    }

    pub(super) fn compare(self, other: Self) -> Option<Ordering> {
        let (left, other, _) = self.aligned(other)?;
        Some(left.cmp(&other))
    }
}
