//! Number types of times: 128-bit integers, or 512-bit integers if the times or the metric need more bits.
//!
//! Twelve distinct prime speeds in durations `(/ (distance ?a ?b) (speed ?r))` can have a common denominator
//! of more than 80 bits. The times of a task must be exact, so such tasks are planned with wider integers.
//! The searches are generic over the number type: tasks with small numbers pay nothing.

use std::fmt::Debug;
use std::hash::Hash;
use std::ops::{Add, AddAssign, Neg, Sub};

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::ToPrimitive as _;
use task::number::{GROWTH_LIMIT, Int, Rational};

/// Exact integers for times, in internal time units, and for the metric. Sums panic on overflow.
pub(super) trait TimeNumber:
    Copy
    + Ord
    + Hash
    + Debug
    + Default
    + From<Int>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + 'static
{
    const ZERO: Self;
    /// Greatest number. As an upper bound on a time it means that no bound exists.
    const MAX: Self;
    /// Times and durations have at most this number of bits. The sum of fewer than 2^32 times then
    /// does not overflow.
    const TIME_BITS: u64;
    /// Factors of the metric have at most this number of bits.
    const FACTOR_BITS: u64;

    fn from_big(number: &BigInt) -> Option<Self>;

    fn to_big(self) -> BigInt;

    fn checked_add(self, other: Self) -> Option<Self>;

    fn checked_mul(self, other: Self) -> Option<Self>;

    /// Returns `true` if the magnitude is within the limit for values of the metric.
    fn is_moderate(self) -> bool;

    /// Appends the number to a hash key. The number of words depends on the type only.
    fn append_words(self, words: &mut Vec<u32>);

    /// Appends an encoding in which small magnitudes take few bytes.
    fn write(self, bytes: &mut Vec<u8>);

    fn read(bytes: &mut impl Iterator<Item = u8>) -> Self;

    fn to_rational(self) -> Rational {
        Rational::from_big(BigRational::from_integer(self.to_big()))
    }

    fn bits(self) -> u64 {
        self.to_big().bits()
    }

    /// Quotient of two positive numbers, rounded down. Returns `None` if the divisor is 0 or the quotient is
    /// not representable.
    fn quotient(self, divisor: Self) -> Option<Int> {
        self.to_big().checked_div(&divisor.to_big())?.to_i128()
    }

    /// Quotient by 2^`shift`, rounded down. Saturates.
    fn shifted_down(self, shift: u64) -> Int {
        let quotient = self.to_big() >> shift;
        let limit = if self < Self::ZERO { Int::MIN } else { Int::MAX };
        quotient.to_i128().unwrap_or(limit)
    }
}

impl TimeNumber for Int {
    const ZERO: Self = 0;
    const MAX: Self = Self::MAX;
    const TIME_BITS: u64 = 90;
    const FACTOR_BITS: u64 = 118;

    fn from_big(number: &BigInt) -> Option<Self> {
        number.to_i128()
    }

    fn to_big(self) -> BigInt {
        self.into()
    }

    fn checked_add(self, other: Self) -> Option<Self> {
        self.checked_add(other)
    }

    fn checked_mul(self, other: Self) -> Option<Self> {
        self.checked_mul(other)
    }

    fn is_moderate(self) -> bool {
        (-GROWTH_LIMIT..GROWTH_LIMIT).contains(&self)
    }

    fn append_words(self, words: &mut Vec<u32>) {
        words.extend(task::number::words(self));
    }

    /// Zigzag and variable-length encoding with seven bits per byte.
    fn write(self, bytes: &mut Vec<u8>) {
        let mut remaining_bits = ((self << 1) ^ (self >> (Self::BITS - 1))).cast_unsigned();
        loop {
            let byte = (remaining_bits & 0x7f) as u8;
            remaining_bits >>= 7;
            if remaining_bits == 0 {
                bytes.push(byte);
                return;
            }
            bytes.push(byte | 0x80);
        }
    }

    fn read(bytes: &mut impl Iterator<Item = u8>) -> Self {
        let (mut number, mut shift) = (0_u128, 0_u32);
        for byte in bytes {
            number |= u128::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                break;
            }
            shift = shift.saturating_add(7);
        }
        let half = (number >> 1).cast_signed();
        if number & 1 == 0 { half } else { !half }
    }

    fn to_rational(self) -> Rational {
        Rational::from_integer(self)
    }

    fn quotient(self, divisor: Self) -> Option<Int> {
        self.checked_div(divisor)
    }

    fn bits(self) -> u64 {
        Self::BITS.saturating_sub(self.unsigned_abs().leading_zeros()).into()
    }

    fn shifted_down(self, shift: u64) -> Int {
        let shift = u32::try_from(shift).unwrap_or(u32::MAX);
        self.checked_shr(shift).unwrap_or(if self < 0 { -1 } else { 0 })
    }
}

const WORDS: usize = 8;
const BYTES: usize = WORDS * 8;

/// A 512-bit integer in two's complement, least significant word first.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default)]
pub(super) struct Wide([u64; WORDS]);

#[expect(clippy::cast_possible_truncation, reason = "the upper half is a carry or the next word")]
fn low_word(number: u128) -> u64 {
    number as u64
}

impl Wide {
    fn is_negative(self) -> bool {
        self.0[WORDS - 1].cast_signed() < 0
    }

    fn magnitude(self) -> [u64; WORDS] {
        if self.is_negative() { self.neg().0 } else { self.0 }
    }

    fn from_bytes(bytes: &[u8; BYTES]) -> Self {
        let (words, _) = bytes.as_chunks::<8>();
        Self(std::array::from_fn(|word| u64::from_le_bytes(words[word])))
    }

    fn to_bytes(self) -> [u8; BYTES] {
        let mut bytes = [0; BYTES];
        let (words, _) = bytes.as_chunks_mut::<8>();
        for (chunk, word) in words.iter_mut().zip(self.0) {
            *chunk = word.to_le_bytes();
        }
        bytes
    }
}

impl From<Int> for Wide {
    fn from(number: Int) -> Self {
        let extension = if number < 0 { u64::MAX } else { 0 };
        let mut words = [extension; WORDS];
        let low = number.cast_unsigned();
        words[0] = low_word(low);
        words[1] = low_word(low >> 64);
        Self(words)
    }
}

impl PartialOrd for Wide {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Wide {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let signs = other.is_negative().cmp(&self.is_negative());
        signs.then_with(|| self.0.iter().rev().cmp(other.0.iter().rev()))
    }
}

impl Add for Wide {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self.checked_add(other).expect("invariant: sums of times fit, as they are within `TIME_BITS`")
    }
}

impl Neg for Wide {
    type Output = Self;

    fn neg(self) -> Self {
        let mut words = self.0.map(|word| !word);
        for word in &mut words {
            let (sum, carries) = word.overflowing_add(1);
            *word = sum;
            if !carries {
                break;
            }
        }
        Self(words)
    }
}

impl Sub for Wide {
    type Output = Self;

    #[expect(clippy::arithmetic_side_effects, reason = "the sum panics on overflow")]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl AddAssign for Wide {
    #[expect(clippy::arithmetic_side_effects, reason = "the sum panics on overflow")]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Debug for Wide {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.to_big())
    }
}

impl TimeNumber for Wide {
    const ZERO: Self = Self([0; WORDS]);
    const MAX: Self = {
        let mut words = [u64::MAX; WORDS];
        words[WORDS - 1] = u64::MAX >> 1;
        Self(words)
    };
    const TIME_BITS: u64 = 474;
    const FACTOR_BITS: u64 = 500;

    fn from_big(number: &BigInt) -> Option<Self> {
        let significant = number.to_signed_bytes_le();
        let extension = if number.sign() == num_bigint::Sign::Minus { u8::MAX } else { 0 };
        let mut bytes = [extension; BYTES];
        bytes.get_mut(..significant.len())?.copy_from_slice(&significant);
        Some(Self::from_bytes(&bytes))
    }

    fn to_big(self) -> BigInt {
        BigInt::from_signed_bytes_le(&self.to_bytes())
    }

    fn checked_add(self, other: Self) -> Option<Self> {
        let mut carries = false;
        let mut sum = Self::ZERO;
        for (sum, (a, b)) in sum.0.iter_mut().zip(self.0.into_iter().zip(other.0)) {
            let (partial, first) = a.overflowing_add(b);
            let (whole, second) = partial.overflowing_add(carries.into());
            (*sum, carries) = (whole, first || second);
        }
        let overflows = self.is_negative() == other.is_negative() && sum.is_negative() != self.is_negative();
        (!overflows).then_some(sum)
    }

    /// Schoolbook multiplication of the magnitudes.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions are below twice the number of words; (2^64 - 1)^2 + 2 (2^64 - 1) fits into 128 bits"
    )]
    fn checked_mul(self, other: Self) -> Option<Self> {
        let (a, b) = (self.magnitude(), other.magnitude());
        let mut product = [0_u64; WORDS];
        for (i, x) in a.iter().enumerate().filter(|(_, x)| **x > 0) {
            let mut carry = 0;
            for (j, y) in b.iter().enumerate() {
                if i + j >= WORDS {
                    if *y > 0 {
                        return None;
                    }
                    continue;
                }
                let sum = u128::from(*x) * u128::from(*y) + u128::from(product[i + j]) + carry;
                product[i + j] = low_word(sum);
                carry = sum >> 64;
            }
            if carry > 0 {
                return None;
            }
        }
        let product = Self(product);
        if product.is_negative() {
            return None;
        }
        Some(if self.is_negative() == other.is_negative() { product } else { -product })
    }

    fn is_moderate(self) -> bool {
        let top = Self(self.magnitude()).0[WORDS - 1];
        top >> 60 == 0
    }

    fn append_words(self, words: &mut Vec<u32>) {
        words.extend(self.0.into_iter().flat_map(|word| [(word & 0xffff_ffff) as u32, (word >> 32) as u32]));
    }

    /// Writes the number of bytes, then the least significant bytes without those that only extend the
    /// sign.
    fn write(self, bytes: &mut Vec<u8>) {
        let buffer = self.to_bytes();
        let extension = if self.is_negative() { u8::MAX } else { 0 };
        let redundant = buffer.iter().rev().take_while(|byte| **byte == extension).count();
        let mut length = BYTES.saturating_sub(redundant);
        // The sign is that of the last byte.
        let is_ambiguous = length
            .checked_sub(1)
            .map_or(self.is_negative(), |last| (buffer[last] & 0x80 > 0) != self.is_negative());
        length = length.saturating_add(is_ambiguous.into());
        bytes.push(u8::try_from(length).unwrap_or(u8::MAX));
        bytes.extend(&buffer[..length]);
    }

    fn read(bytes: &mut impl Iterator<Item = u8>) -> Self {
        let length = bytes.next().map_or(0, usize::from);
        let mut buffer = [0; BYTES];
        let mut last = 0;
        for (byte, read) in buffer.iter_mut().zip(bytes.take(length)) {
            *byte = read;
            last = read;
        }
        if last & 0x80 > 0 {
            buffer[length..].fill(u8::MAX);
        }
        Self::from_bytes(&buffer)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn number() -> impl Strategy<Value = BigInt> {
        let magnitude = (0_u32..508, any::<[u64; 8]>()).prop_map(|(bits, words)| {
            let whole = words.iter().fold(BigInt::from(0), |sum, word| (sum << 64) + *word);
            whole % (BigInt::from(1) << bits)
        });
        let small = any::<i16>().prop_map(BigInt::from);
        let near = (0_u32..508, -2_i8..=2).prop_map(|(bits, offset)| (BigInt::from(1) << bits) + offset);
        let any_magnitude = prop_oneof![magnitude, small, near];
        (any_magnitude, any::<bool>()).prop_map(|(number, negative)| if negative { -number } else { number })
    }

    fn check<T: TimeNumber>(a: &BigInt, b: &BigInt, fits: impl Fn(&BigInt) -> bool) {
        let (Some(x), Some(y)) = (T::from_big(a), T::from_big(b)) else { return };
        assert_eq!((x.to_big(), y.to_big()), (a.clone(), b.clone()));
        assert_eq!(x.cmp(&y), a.cmp(b));
        assert_eq!(x.checked_mul(y).map(T::to_big), Some(a * b).filter(&fits));
        assert_eq!(x.checked_add(y).map(T::to_big), Some(a + b).filter(&fits));
        if fits(&(a - b)) && fits(&(a + b)) {
            let mut sum = x;
            sum += y;
            assert_eq!((sum.to_big(), (x - y).to_big(), (-x).to_big()), (a + b, a - b, -a));
        }
        assert_eq!(x.bits(), a.bits());
        for shift in [0, 1, 39, 64, 130, 600] {
            let quotient = a >> shift;
            assert_eq!(
                Some(x.shifted_down(shift)),
                quotient.to_i128().or(Some(if *a < BigInt::ZERO { Int::MIN } else { Int::MAX }))
            );
        }
        assert_eq!(x.to_rational().to_big(), BigRational::from_integer(a.clone()));
        let mut bytes = Vec::new();
        x.write(&mut bytes);
        y.write(&mut bytes);
        let mut bytes = bytes.into_iter();
        assert_eq!((T::read(&mut bytes), T::read(&mut bytes), bytes.next()), (x, y, None));
        let words = |number: T| {
            let mut words = Vec::new();
            number.append_words(&mut words);
            words
        };
        assert_eq!(words(x) == words(y), a == b);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        #[test]
        fn operations_are_those_of_big_integers(a in number(), b in number()) {
            let limit = BigInt::from(1) << 511;
            let fits = |number: &BigInt| *number < limit && *number > -&limit;
            check::<Wide>(&a, &b, fits);
            check::<Int>(&a, &b, |number| number.to_i128().is_some());
            let shift = 400_u32;
            check::<Wide>(&(&a >> shift), &(&b >> shift), fits);
            check::<Int>(&(&a >> shift), &(&b >> shift), |number| number.to_i128().is_some());
        }
    }

    #[test]
    fn limits() {
        assert_eq!(Wide::MAX.to_big(), (BigInt::from(1) << 511) - 1);
        assert_eq!(Wide::MAX.checked_add(1.into()), None);
        assert_eq!((-Wide::MAX).checked_add((-2).into()), None);
        assert_eq!(Wide::MAX.checked_mul(2.into()), None);
        assert_eq!(Wide::from_big(&(BigInt::from(1) << 511)), None);
        assert!(
            !Wide::MAX.is_moderate()
                && Wide::from_big(&(BigInt::from(1) << 500)).expect("a number").is_moderate()
        );
    }
}
