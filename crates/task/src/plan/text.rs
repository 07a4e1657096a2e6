//! Text form of plans, with times as decimals that preserve the order of actions.
//!
//! A fraction such as 1/3 has no finite decimal expansion. Such starts and ends are rounded to the same grid,
//! and the printed duration is the difference between rounded end and rounded start. Gaps of a thousandth are
//! thus preserved, and no action starts before its predecessor ends.

use std::fmt;

use num_rational::BigRational;

use crate::plan::named_plan::{Exact, Plan, Step};

/// Number of decimal places to which a time without a finite decimal expansion is rounded.
const DECIMALS: u32 = 12;

impl Step {
    /// Returns start and duration with finite decimal expansions; they are rounded only if necessary.
    pub fn times(&self) -> (Exact, Exact) {
        let start = self.start.to_rational();
        let end = rounded(&start + self.duration.to_rational());
        let start = rounded(start);
        let duration = end - &start;
        (start.into(), duration.into())
    }

    fn timed_line(&self) -> String {
        let (start, duration) = self.times();
        format!("{}: {}  [{}]\n", start.as_time(), self.call(), duration.as_time())
    }

    /// Formats the action in PDDL: `(move a b)`.
    pub fn call(&self) -> String {
        let words: Vec<&str> =
            std::iter::once(&self.action).chain(&self.arguments).map(String::as_str).collect();
        format!("({})", words.join(" "))
    }
}

impl Exact {
    /// Formats the number as a time with at least three decimal places. Finite decimals are not rounded,
    /// because an action must not start before its preconditions hold. Other numbers are rounded to nine
    /// decimal places.
    pub fn as_time(&self) -> String {
        let text = self.to_string();
        match text.split_once('.') {
            _ if text.contains('/') => format!("{:.9}", self.to_f64()),
            Some((_, decimals)) => text.clone() + &"0".repeat(3_usize.saturating_sub(decimals.len())),
            None => text + ".000",
        }
    }
}

impl Plan {
    /// Formats the plan with start and duration of each step, even if all are 0: see the implementation of
    /// [`fmt::Display`].
    pub fn timed_text(&self) -> String {
        self.steps.iter().map(Step::timed_line).collect()
    }
}

/// Writes the plan in the format of the planning competitions, which `pddl::validate::PlanText` parses. Each step is
/// a line `start: (action arguments)  [duration]`, or `(action arguments)` if all starts and durations are 0.
impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let timed = |step: &Step| !step.duration.is_zero() || !step.start.is_zero();
        if self.steps.iter().any(timed) {
            return f.write_str(&self.timed_text());
        }
        self.steps.iter().try_for_each(|step| writeln!(f, "{}", step.call()))
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
    fn gaps_of_a_thousandth_are_preserved() {
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
    fn finite_decimals_are_not_rounded() {
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
