//! Times of a plan as decimals that keep what lies between them.
//!
//! A third has no decimal. Starts and ends are rounded to the same grid, and a duration is what is left between the two, so that what is a
//! thousandth apart stays so, and what follows something never comes before it.

use encodings::{Exact, Step};
use num_rational::BigRational;

/// Decimals of times that have no finite number of them.
const DECIMALS: u32 = 12;

/// The start and the duration of a step as decimals; as they are, where they are decimals.
pub fn times(step: &Step) -> (Exact, Exact) {
    let start = step.start.to_rational();
    let end = rounded(&start + step.duration.to_rational());
    let start = rounded(start);
    let duration = end - &start;
    (start.into(), duration.into())
}

fn rounded(time: BigRational) -> BigRational {
    let is_decimal = !Exact::from(time.clone()).to_string().contains('/');
    if is_decimal {
        return time;
    }
    let scale = BigRational::from_integer(10_i64.pow(DECIMALS).into());
    (time * &scale).round() / scale
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fraction(numerator: i64, denominator: i64) -> BigRational {
        BigRational::new(numerator.into(), denominator.into())
    }

    #[test]
    fn what_is_a_thousandth_apart_stays_so() {
        let apart = fraction(1, 1000);
        for (numerator, denominator) in [(1, 3), (2, 3), (22, 7), (5, 4), (1, 999), (586_754, 999)] {
            let time = fraction(numerator, denominator);
            let later = rounded(&time + &apart);
            assert_eq!(later - rounded(time), apart, "{numerator}/{denominator}");
        }
        assert_eq!(rounded(fraction(5, 4)), fraction(5, 4));
        assert_eq!(Exact::from(rounded(fraction(1, 3))).to_string(), "0.333333333333");
    }
}
