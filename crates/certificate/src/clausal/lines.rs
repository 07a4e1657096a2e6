//! Lines of numbers, each ended by 0, as DIMACS and DRAT have them; read one at a time.

use std::io::{BufRead, Read};

use crate::clausal::literal::Literal;

/// A line is not longer than this, in bytes.
const LINE_LIMIT: u64 = 1 << 22;

/// Reads a line, without its end; none at the end of the text.
///
/// # Errors
/// The input fails.
pub fn read<'l>(input: &mut dyn BufRead, line: &'l mut Vec<u8>) -> std::io::Result<Option<&'l [u8]>> {
    line.clear();
    Read::take(&mut *input, LINE_LIMIT).read_until(b'\n', line)?;
    Ok((!line.is_empty()).then(|| line.trim_ascii_end()))
}

/// The literals of a line, over so many variables; none if something else is there.
pub fn literals(line: &[u8], variables: usize, literals: &mut Vec<Literal>) -> Option<()> {
    literals.clear();
    numbers(line, variables, &mut |negative, variable| {
        let literal = Literal::of_variable(variable)?;
        literals.push(if negative { -literal } else { literal });
        Some(())
    })
}

/// The places in a list of so many clauses that a line names by numbers from 1; none if something else is there.
pub(crate) fn places(line: &[u8], clauses: usize, places: &mut Vec<usize>) -> Option<()> {
    places.clear();
    numbers(line, clauses, &mut |negative, number| {
        places.push(number.checked_sub(1).filter(|_| !negative)?);
        Some(())
    })
}

/// Visits the numbers of a line without the 0 that ends it; none if there are other words, or numbers beyond the limit.
fn numbers(line: &[u8], limit: usize, visit: &mut dyn FnMut(bool, usize) -> Option<()>) -> Option<()> {
    let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    loop {
        let word = words.next()?;
        let (digits, negative) = word.strip_prefix(b"-").map_or((word, false), |rest| (rest, true));
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

/// Makes a line of numbers, with its end.
pub fn format(line: &mut Vec<u8>, numbers: impl Iterator<Item = i32>) {
    line.clear();
    let mut digits = itoa::Buffer::new();
    for number in numbers {
        line.extend(digits.format(number).as_bytes());
        line.push(b' ');
    }
    line.extend(b"0\n");
}
