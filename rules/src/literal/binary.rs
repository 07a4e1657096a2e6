//! Values of `xsd:hexBinary`, `xsd:base64Binary` and the recurring dates (`xsd:gYear` and related types).

use super::temporal::{split_zone, zone_text};

pub(super) fn parse_hexadecimal(text: &str) -> Option<Box<[u8]>> {
    let digit = |byte: u8| char::from(byte).to_digit(16);
    let pairs = text.as_bytes().chunks(2);
    let byte = |pair: &[u8]| match pair {
        [high, low] => Some((digit(*high)? * 16 + digit(*low)?) as u8),
        _ => None,
    };
    pairs.map(byte).collect()
}

pub(super) fn hexadecimal(bytes: &[u8]) -> String {
    let digit = |half: u8| char::from(b"0123456789ABCDEF"[usize::from(half)]);
    bytes.iter().flat_map(|byte| [digit(byte >> 4), digit(byte & 15)]).collect()
}

const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

pub(super) fn parse_base64(text: &str) -> Option<Box<[u8]>> {
    let digits: Vec<u8> = text.bytes().filter(|byte| !byte.is_ascii_whitespace()).collect();
    let padding = digits.iter().rev().take_while(|&&byte| byte == b'=').count();
    if !digits.len().is_multiple_of(4) || padding > 2 {
        return None;
    }
    let value = |byte: &u8| ALPHABET.iter().position(|digit| digit == byte);
    // Six bits per digit, with zero bits for the padding.
    let mut bits: Vec<usize> = digits[..digits.len() - padding].iter().map(value).collect::<Option<_>>()?;
    bits.resize(digits.len(), 0);
    let group = |four: &[usize]| {
        let word = four.iter().fold(0, |word, six| word << 6 | six);
        [(word >> 16) as u8, (word >> 8) as u8, word as u8]
    };
    let mut bytes: Vec<u8> = bits.chunks(4).flat_map(group).collect();
    let unused = bytes.split_off(bytes.len() - padding);
    // The bits that the padding replaces have to be zero.
    unused.iter().all(|byte| *byte == 0).then(|| bytes.into())
}

pub(super) fn base64(bytes: &[u8]) -> String {
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let word = (0..3).fold(0, |word, at| word << 8 | usize::from(three.get(at).copied().unwrap_or(0)));
        for at in 0..4 {
            let digit = char::from(ALPHABET[word >> (18 - 6 * at) & 63]);
            text.push(if at > three.len() { '=' } else { digit });
        }
    }
    text
}

/// Parses a recurring date (`xsd:gYear` or a related type) of the datatype with the local name `local`.
/// Returns its canonical form, which identifies the value, and the local name; `None` if the text is invalid.
pub(super) fn recurring(text: &str, local: &str) -> Option<(Box<str>, &'static str)> {
    let (body, zone) = split_zone(text)?;
    let number = |part: &str, range: std::ops::RangeInclusive<u32>| {
        part.len() == 2
            && part.bytes().all(|b| b.is_ascii_digit())
            && part.parse().is_ok_and(|n| range.contains(&n))
    };
    let year = |part: &str| {
        let digits = part.strip_prefix('-').unwrap_or(part);
        digits.len() >= 4
            && digits.bytes().all(|b| b.is_ascii_digit())
            && (digits.len() == 4 || !digits.starts_with('0'))
    };
    let days = |month: &str| match month {
        // Without a year, February may have 29 days.
        "02" => 29,
        "04" | "06" | "09" | "11" => 30,
        _ => 31,
    };
    let (local, valid) = match local {
        "gYear" => ("gYear", year(body)),
        "gYearMonth" => {
            ("gYearMonth", body.rsplit_once('-').is_some_and(|(y, month)| year(y) && number(month, 1..=12)))
        }
        "gMonth" => ("gMonth", body.strip_prefix("--").is_some_and(|month| number(month, 1..=12))),
        "gMonthDay" => {
            let parts = body.strip_prefix("--").and_then(|rest| rest.split_once('-'));
            let valid = |(month, day): (&str, &str)| number(month, 1..=12) && number(day, 1..=days(month));
            ("gMonthDay", parts.is_some_and(valid))
        }
        _ => ("gDay", body.strip_prefix("---").is_some_and(|day| number(day, 1..=31))),
    };
    // The year 0 has two forms, `0000` and `-0000`.
    let body = body.strip_prefix('-').filter(|digits| digits.starts_with("0000")).unwrap_or(body);
    let zone = zone.map(zone_text).unwrap_or_default();
    valid.then(|| (format!("{body}{zone}").into(), local))
}

pub(super) fn recurring_datatype(local: &str) -> &'static str {
    match local {
        "gYear" => "http://www.w3.org/2001/XMLSchema#gYear",
        "gYearMonth" => "http://www.w3.org/2001/XMLSchema#gYearMonth",
        "gMonth" => "http://www.w3.org/2001/XMLSchema#gMonth",
        "gMonthDay" => "http://www.w3.org/2001/XMLSchema#gMonthDay",
        _ => "http://www.w3.org/2001/XMLSchema#gDay",
    }
}
