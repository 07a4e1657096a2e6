//! A plan as PlanSys2 has it: actions with start and duration in seconds, as POPF writes them.
//!
//! PlanSys2 orders actions by their times alone. So what follows begins after the end of what it follows, never at the same time, and all
//! that is done takes time; as in POPF, a thousandth stands for "at once".

use std::fmt::Write as _;

use ::mission::Mission;
use encodings::{Exact, Plan, Step};
use num_rational::BigRational;
use num_traits::Zero as _;
use pddl::ast::InitialElement;

/// An action of a plan for PlanSys2.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlanLine {
    /// When it starts, in the domain's time unit.
    pub start: Exact,
    /// As in `(move leia kitchen bedroom)`.
    pub action: String,
    /// How long it takes, in the domain's time unit; not 0.
    pub duration: Exact,
}

/// The lines of a plan, whose arguments are as the domain's file writes them.
///
/// The times of a plan whose actions overlap, and of one that has to meet timed initial literals, stay as they are.
pub fn plan_lines(mission: &Mission, plan: &Plan) -> Vec<PlanLine> {
    let instant = BigRational::new(1.into(), 1000.into());
    let end = |step: &Step| step.start.to_rational() + step.duration.to_rational();
    let is_sequence =
        plan.steps.windows(2).all(|pair| pair.iter().map(end).next() <= Some(pair[1].start.to_rational()));
    let is_timed = mission.problem().init.iter().any(|element| matches!(element, InitialElement::Timed(..)));
    let mut free = BigRational::zero();
    let mut lines = Vec::new();
    for step in &plan.steps {
        let (mut start, mut duration) = (step.start.to_rational(), step.duration.to_rational());
        if duration.is_zero() {
            duration.clone_from(&instant);
        }
        if is_sequence && !is_timed {
            start = start.max(free);
        }
        free = &start + &duration + &instant;
        lines.push(PlanLine { start: start.into(), action: call(step), duration: duration.into() });
    }
    lines
}

fn call(step: &Step) -> String {
    let words: Vec<&str> = std::iter::once(&step.action).chain(&step.arguments).map(String::as_str).collect();
    format!("({})", words.join(" "))
}

/// The lines as POPF writes them, and as PlanSys2's plugin for POPF reads them.
pub fn popf_text(lines: &[PlanLine]) -> String {
    let mut text = "Solution Found\n".to_owned();
    for line in lines {
        let (start, duration) = (decimal(&line.start), decimal(&line.duration));
        let _ = writeln!(text, "{start}: {}  [{duration}]", line.action);
    }
    text
}

/// A time with three decimals, or as many more as it has: an action must not start before what it waits for.
pub fn decimal(time: &Exact) -> String {
    let text = time.to_string();
    match text.split_once('.') {
        _ if text.contains('/') => format!("{:.9}", time.to_f64()),
        Some((_, decimals)) => text.clone() + &"0".repeat(3_usize.saturating_sub(decimals.len())),
        None => text + ".000",
    }
}

#[cfg(test)]
mod tests {
    use num_bigint::BigInt;

    use super::*;

    fn exact(numerator: i64, denominator: i64) -> Exact {
        BigRational::new(BigInt::from(numerator), BigInt::from(denominator)).into()
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
            assert_eq!(decimal(&exact(numerator, denominator)), expected);
        }
    }

    /// Lines of steps `(name, start, duration)`, in thousandths, for a problem with this in `:init`.
    fn lines(init: &str, steps: &[(&str, i64, i64)]) -> String {
        let domain = pddl::Source::new("d", "(define (domain d) (:predicates (p)))".to_owned());
        let problem = format!("(define (problem p) (:domain d) (:init {init}) (:goal (and)))");
        let problem = pddl::Source::new("p", problem);
        let mission = Mission::new("", None, ::mission::Bindings::default(), Ok(domain), Ok(problem));
        let steps = steps.iter().map(|&(name, start, duration)| Step {
            action: name.to_owned(),
            arguments: vec!["x".to_owned()],
            configuration: Vec::new(),
            reconfigured: Vec::new(),
            start: exact(start, 1000),
            duration: exact(duration, 1000),
            cost: exact(0, 1),
        });
        let plan = Plan { steps: steps.collect(), cost: exact(0, 1) };
        popf_text(&plan_lines(&mission.expect("a mission"), &plan))
    }

    #[test]
    fn actions_of_a_sequence_do_not_touch() {
        assert_eq!(
            lines("", &[("a", 0, 5000), ("b", 5000, 0), ("c", 5000, 2000), ("d", 9000, 0)]),
            "Solution Found\n0.000: (a x)  [5.000]\n5.001: (b x)  [0.001]\n5.003: (c x)  [2.000]\n\
             9.000: (d x)  [0.001]\n"
        );
    }

    #[test]
    fn times_that_matter_stay() {
        let overlapping = [("a", 0, 5000), ("b", 1000, 1000), ("c", 2000, 1000)];
        assert_eq!(
            lines("", &overlapping),
            "Solution Found\n0.000: (a x)  [5.000]\n1.000: (b x)  [1.000]\n2.000: (c x)  [1.000]\n"
        );
        let timed = lines("(at 7 (p))", &[("a", 0, 5000), ("b", 5000, 2000)]);
        assert_eq!(timed, "Solution Found\n0.000: (a x)  [5.000]\n5.000: (b x)  [2.000]\n");
    }
}
