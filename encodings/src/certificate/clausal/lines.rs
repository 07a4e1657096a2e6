//! Lines of numbers, each ended by 0, as DIMACS and DRAT have them; read one at a time.

use std::io::{BufRead, Read};

/// A line is not longer than this, in bytes.
const LINE_LIMIT: u64 = 1 << 22;

/// Reads a line, without its end; none at the end of the text.
pub(super) fn read<'l>(input: &mut dyn BufRead, line: &'l mut Vec<u8>) -> std::io::Result<Option<&'l [u8]>> {
    line.clear();
    Read::take(&mut *input, LINE_LIMIT).read_until(b'\n', line)?;
    Ok((!line.is_empty()).then(|| line.trim_ascii_end()))
}

/// The numbers of a line without the 0 that ends it; none if there are other words, or numbers that are not within the limit.
pub(super) fn numbers(line: &[u8], limit: usize, numbers: &mut Vec<i32>) -> Option<()> {
    numbers.clear();
    let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    loop {
        let word = words.next()?;
        let (digits, negative) = word.strip_prefix(b"-").map_or((word, false), |rest| (rest, true));
        let digit = |number: i128, digit: &u8| {
            let number = number * 10 + i128::from(digit.is_ascii_digit().then(|| digit - b'0')?);
            (number <= limit as i128).then_some(number)
        };
        let number = digits.iter().try_fold(0, digit)? as i32;
        if digits.is_empty() {
            return None;
        }
        if number == 0 {
            return (!negative && words.next().is_none()).then_some(());
        }
        numbers.push(if negative { -number } else { number });
    }
}

/// Appends a number in decimals.
fn push(line: &mut Vec<u8>, number: i32) {
    if number < 0 {
        line.push(b'-');
    }
    let start = line.len();
    let mut rest = number.unsigned_abs();
    loop {
        line.push(b'0' + (rest % 10) as u8);
        rest /= 10;
        if rest == 0 {
            break;
        }
    }
    line[start..].reverse();
}

/// Makes a line of numbers, with its end.
pub(super) fn format(line: &mut Vec<u8>, numbers: &[i32]) {
    line.clear();
    for number in numbers {
        push(line, *number);
        line.push(b' ');
    }
    line.extend(b"0\n");
}
