//! Reads and writes lines of integers that end with 0, as in the DIMACS and DRAT formats.

use std::io::{BufRead, Read};

use crate::clausal::literal::Literal;

const LINE_LIMIT: u64 = 1 << 22;

/// Reads a line of at most 4 MiB into the buffer `line`; the remainder of a longer line is read by
/// the next call. Returns the line without trailing white space, or `None` at the end of the input.
///
/// # Errors
/// I/O errors of the input.
pub fn read<'l>(input: &mut dyn BufRead, line: &'l mut Vec<u8>) -> std::io::Result<Option<&'l [u8]>> {
    line.clear();
    Read::take(&mut *input, LINE_LIMIT).read_until(b'\n', line)?;
    Ok((!line.is_empty()).then(|| line.trim_ascii_end()))
}

/// Parses a line in the DIMACS syntax and stores its literals, without the final 0, in `literals`. Returns
/// `None` if the line is malformed or has a variable above `variables`.
pub fn literals(line: &[u8], variables: usize, literals: &mut Vec<Literal>) -> Option<()> {
    literals.clear();
    numbers(line, variables, &mut |negative, variable| {
        let literal = Literal::of_variable(variable)?;
        literals.push(if negative { -literal } else { literal });
        Some(())
    })
}

/// Parses a line of clause numbers from 1 to `clauses`, and stores them in `places` as indices from
/// 0. Returns `None` if the line is malformed or a number is out of range.
pub(crate) fn places(line: &[u8], clauses: usize, places: &mut Vec<usize>) -> Option<()> {
    places.clear();
    numbers(line, clauses, &mut |negative, number| {
        places.push(number.checked_sub(1).filter(|_| !negative)?);
        Some(())
    })
}

/// Calls `visit` with the sign (`true` if negative) and the magnitude of each number in a line,
/// except the final 0. Returns `None` if the line is malformed, a magnitude exceeds `limit`, or
/// `visit` returns `None`.
fn numbers(line: &[u8], limit: usize, visit: &mut dyn FnMut(bool, usize) -> Option<()>) -> Option<()> {
    let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    loop {
        let word = words.next()?;
        let (digits, negative) = word.strip_prefix(b"-").map_or((word, false), |digits| (digits, true));
        let digit = |number: usize, digit: &u8| {
            let digit = char::from(*digit).to_digit(10)?;
            let number = number.checked_mul(10)?.checked_add(digit as usize)?;
            (number <= limit).then_some(number)
        };
        let number = digits.iter().try_fold(0, digit)?;
        if digits.is_empty() {
            return None;
        }
        if number == 0 {
            return (!negative && words.next().is_none()).then_some(());
        }
        visit(negative, number)?;
    }
}

/// Replaces `line` by the numbers, followed by 0 and a line feed.
pub fn format(line: &mut Vec<u8>, numbers: impl Iterator<Item = i32>) {
    line.clear();
    let mut digits = itoa::Buffer::new();
    for number in numbers {
        line.extend(digits.format(number).as_bytes());
        line.push(b' ');
    }
    line.extend(b"0\n");
}
