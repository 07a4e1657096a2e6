//! A plan as text, and its times as decimals that keep what lies between them.
//!
//! A third has no decimal. Starts and ends are rounded to the same grid, and a duration is what is left between the two, so that what is a
//! thousandth apart stays so, and what follows something never comes before it.

use std::fmt;

use num_rational::BigRational;

use crate::plan::named_plan::{Exact, Plan, Step};

/// Decimals of times that have no finite number of them.
const DECIMALS: u32 = 12;

impl Step {
    /// The start and the duration as decimals; as they are, where they are decimals.
    pub fn times(&self) -> (Exact, Exact) {
        let start = self.start.to_rational();
        let end = rounded(&start + self.duration.to_rational());
        let start = rounded(start);
        let duration = end - &start;
        (start.into(), duration.into())
    }

    /// The action with its arguments, as PDDL writes it: `(move a b)`.
    pub fn call(&self) -> String {
        let words: Vec<&str> =
            std::iter::once(&self.action).chain(&self.arguments).map(String::as_str).collect();
        format!("({})", words.join(" "))
    }
}

impl Exact {
    /// As a time of a plan: with three decimals, or as many more as it has, because an action must not start before what it waits for;
    /// rounded to nine where it has no end of them.
    pub fn as_time(&self) -> String {
        let text = self.to_string();
        match text.split_once('.') {
            _ if text.contains('/') => format!("{:.9}", self.to_f64()),
            Some((_, decimals)) => text.clone() + &"0".repeat(3_usize.saturating_sub(decimals.len())),
            None => text + ".000",
        }
    }
}

/// The plan as the planning competitions write it and as `pddl::validate::PlanText` reads it: a line `(action arguments)` for each step, or
/// `start: (action arguments)  [duration]` if there are times.
impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let timed = |step: &Step| !step.duration.is_zero() || !step.start.is_zero();
        let temporal = self.steps.iter().any(timed);
        for step in &self.steps {
            if temporal {
                let (start, duration) = step.times();
                writeln!(f, "{}: {}  [{}]", start.as_time(), step.call(), duration.as_time())?;
            } else {
                writeln!(f, "{}", step.call())?;
            }
        }
        Ok(())
    }
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

    #[test]
    fn times_are_not_rounded() {
        for (numerator, denominator, expected) in [
            (5, 1, "5.000"),
            (5, 2, "2.500"),
            (1, 8, "0.125"),
            (100_001, 10_000, "10.0001"),
            (1, 3, "0.333333333"),
        ] {
            assert_eq!(Exact::from(fraction(numerator, denominator)).as_time(), expected);
        }
    }
}
