//! Conversion between decimal literals and exact rationals.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One, Pow, Signed, Zero};

/// Maximum number of digits that a number has when its exponent is expanded: `1e3` counts as `1000`, four digits. The
/// limit exceeds any measurement precision. It prevents a short text such as `1e999999999` from filling the memory.
const MAX_DIGITS: usize = 400;

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Literal {
    Name,
    Number(BigRational),
    TooLong,
}

/// Parses a symbol such as `5`, `-0.5`, `100.`, `.5` or `1e-3`. Symbols of any other form are names, for
/// example `0.8_decimal`.
pub(crate) fn literal(text: &str) -> Literal {
    let unsigned = text.strip_prefix(['-', '+']).unwrap_or(text);
    let (mantissa, exponent) = match unsigned.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, Some(exponent)),
        None => (unsigned, None),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let exponent_digits = exponent.map(|exponent| exponent.strip_prefix(['-', '+']).unwrap_or(exponent));
    let is_number = all_digits(whole)
        && all_digits(fraction)
        && !(whole.is_empty() && fraction.is_empty())
        && exponent_digits.is_none_or(|digits| !digits.is_empty() && all_digits(digits));
    if !is_number {
        return Literal::Name;
    }
    let digits = whole.len().saturating_add(fraction.len());
    let exponent = exponent.map_or(Some(0), |exponent| exponent.parse::<i32>().ok());
    let exponent = exponent.filter(|exponent| written_out(digits, fraction.len(), *exponent) <= MAX_DIGITS);
    let Some(exponent) = exponent else { return Literal::TooLong };
    let value = decimal(whole, fraction, exponent);
    Literal::Number(if text.starts_with('-') { -value } else { value })
}

/// Returns the number of digits of a number if it is written without exponent. `digits` is the number of
/// digits of its mantissa, `fraction` the number of those after the decimal point.
fn written_out(digits: usize, fraction: usize, exponent: i32) -> usize {
    // An exponent that does not fit into `usize` gives more digits than [`MAX_DIGITS`] in any case.
    let exponent_length = usize::try_from(exponent.unsigned_abs()).unwrap_or(usize::MAX);
    match (exponent >= 0, exponent_length.checked_sub(fraction)) {
        (true, Some(zeros)) => digits.saturating_add(zeros),
        (true, None) => digits.max(fraction.saturating_sub(exponent_length).saturating_add(1)),
        (false, _) => digits.max(fraction.saturating_add(exponent_length).saturating_add(1)),
    }
}

fn all_digits(text: &str) -> bool {
    text.bytes().all(|byte| byte.is_ascii_digit())
}

/// Returns the value of `whole.fraction` · 10^`exponent`.
#[expect(clippy::arithmetic_side_effects, reason = "digits are from 0 to 9, and 18 of them fit")]
fn decimal(whole: &str, fraction: &str, exponent: i32) -> BigRational {
    let digits = || whole.bytes().chain(fraction.bytes());
    // Fast path: 18 digits fit into an `i64`.
    let integer = if digits().count() <= 18 {
        let append = |value: i64, digit: u8| value * 10 + i64::from(digit - b'0');
        BigInt::from(digits().fold(0, append))
    } else {
        let digits: Vec<u8> = digits().map(|digit| digit - b'0').collect();
        BigInt::from_radix_be(num_bigint::Sign::Plus, &digits, 10).unwrap_or_default()
    };
    let power = |digits: u32| BigInt::from(10).pow(digits);
    let fraction = dense(fraction.len());
    match u32::try_from(exponent) {
        Ok(shift) if shift == fraction => BigRational::from_integer(integer),
        Ok(shift) if shift > fraction => BigRational::from_integer(integer * power(shift.abs_diff(fraction))),
        Ok(shift) => BigRational::new(integer, power(fraction.abs_diff(shift))),
        Err(_) => BigRational::new(integer, power(fraction.saturating_add(exponent.unsigned_abs()))),
    }
}

pub(crate) fn show_number(value: &BigRational) -> String {
    to_decimal(value).unwrap_or_else(|| value.to_string())
}

/// Returns the shortest decimal that equals `value`; `None` if the decimal expansion is infinite.
pub fn to_decimal(value: &BigRational) -> Option<String> {
    let mut denominator = value.denom().clone();
    // A reduced fraction has a finite decimal if its denominator has no prime factors except 2 and 5.
    let mut count = [0_u32; 2];
    for (prime, count) in [2, 5].into_iter().zip(&mut count) {
        let prime = BigInt::from(prime);
        while (&denominator % &prime).is_zero() {
            denominator /= &prime;
            *count = count.saturating_add(1);
        }
    }
    if !denominator.is_one() {
        return None;
    }
    let places = count[0].max(count[1]);
    let scaled = (value * BigRational::from_integer(BigInt::from(10).pow(places))).to_integer();
    let places = places as usize;
    let digits = format!("{:0>width$}", scaled.abs().to_string(), width = places.saturating_add(1));
    let (whole, fraction) = digits.split_at(digits.len().saturating_sub(places));
    let sign = if scaled.is_negative() { "-" } else { "" };
    let point = if fraction.is_empty() { "" } else { "." };
    Some(format!("{sign}{whole}{point}{fraction}"))
}

/// Returns `true` if the parser accepts `value` as it is printed. It refuses numbers of more than 400 digits.
pub fn is_readable(value: &BigRational) -> bool {
    // A printed number has at most one digit for each bit of its numerator and denominator, and a leading zero. Most
    // numbers are thus accepted without being printed.
    if value.numer().bits().saturating_add(value.denom().bits()) < MAX_DIGITS as u64 {
        return true;
    }
    let digits = |text: &str| text.bytes().filter(u8::is_ascii_digit).count();
    match to_decimal(value) {
        Some(decimal) => digits(&decimal) <= MAX_DIGITS,
        None => [value.numer(), value.denom()].iter().all(|part| digits(&part.to_string()) <= MAX_DIGITS),
    }
}

/// Converts an index to 32 bits. Panics from 2^32 on, which no index of bytes, names or parameters in memory
/// reaches.
pub(crate) fn dense(index: usize) -> u32 {
    u32::try_from(index).expect("invariant: fewer than 2^32 of anything are held in memory")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_are_read_exactly() {
        let cases = [
            ("5", "5"),
            ("-0.50", "-0.5"),
            ("+7", "7"),
            ("100.", "100"),
            (".25", "0.25"),
            ("1e3", "1000"),
            ("12.5E-2", "0.125"),
            ("2499.9999972941", "2499.9999972941"),
            ("123456789012345678901234567890.5", "123456789012345678901234567890.5"),
            ("-0", "0"),
        ];
        for (text, expected) in cases {
            let Literal::Number(value) = literal(text) else { panic!("{text} is a number") };
            assert_eq!(to_decimal(&value).as_deref(), Some(expected), "{text}");
        }
    }

    #[test]
    fn other_symbols_are_names() {
        for text in ["0.8_decimal", "", "-", ".", "e", "1e", "e5", "1.2.3", "?x", "1-2", "--1", "5m", "1e+"] {
            assert_eq!(literal(text), Literal::Name, "{text}");
        }
    }

    #[test]
    fn short_texts_cannot_denote_huge_numbers() {
        for text in ["1e999999999", "1e-400", "11e399", "1e99999999999999999999", &"9".repeat(401)] {
            assert_eq!(literal(text), Literal::TooLong, "{text}");
        }
    }

    #[test]
    fn printed_numbers_are_readable_up_to_the_limit() {
        let power = |exponent: u32| BigInt::from(10).pow(exponent);
        let fraction = |numerator: BigInt, denominator: BigInt| BigRational::new(numerator, denominator);
        for (value, expected) in [
            (fraction(power(399), 1.into()), true),
            (fraction(power(400), 1.into()), false),
            (fraction(1.into(), power(399)), true),
            (fraction(1.into(), power(400)), false),
            (fraction((-1).into(), power(399) + 1), true),
            (fraction(1.into(), power(400) + 1), false),
        ] {
            assert_eq!(is_readable(&value), expected, "{value}");
            if let Some(decimal) = to_decimal(&value) {
                assert_eq!(literal(&decimal) != Literal::TooLong, expected, "{value}");
            }
        }
    }

    #[test]
    fn a_third_has_no_decimal() {
        assert_eq!(to_decimal(&BigRational::new(1.into(), 3.into())), None);
    }
}
