//! Converts plans to the format of PlanSys2: actions with start and duration, as the planner POPF writes them.
//!
//! PlanSys2 orders actions only by their times. So an action has to begin strictly after the end of
//! its predecessor, and no action may have the duration 0. As in POPF, the smallest difference
//! between two times is a thousandth.

use std::fmt::Write as _;

use ::mission::Mission;
use num_rational::BigRational;
use pddl::ast::Problem;
use planner::{Exact, Limits, Plan, Step};

use crate::mission::confirm::{Reading, verdict_of};

/// A line of a plan for PlanSys2: one action with its times.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlanLine {
    /// Start of the action, in the domain's time unit.
    pub start: Exact,
    /// The action as a PDDL call: `(move leia kitchen bedroom)`.
    pub action: String,
    /// Duration of the action, in the domain's time unit; greater than 0.
    pub duration: Exact,
}

/// Delays actions so that each action that starts at or after the end of another starts at least a thousandth after it.
/// Equal actions get different starts. Returns the given plan if the delayed plan is invalid, or if a limit is reached.
#[must_use]
pub fn spaced(mission: &Mission, problem: &Problem, plan: Plan, reading: &Reading, limits: &Limits) -> Plan {
    let mut later = plan.clone();
    for next in 1..plan.steps.len() {
        let start = plan.steps[next].start.to_rational();
        let after = plan.steps[..next].iter().zip(&later.steps).map(|(before, moved)| {
            let (start_before, moved) = (before.start.to_rational(), moved.start.to_rational());
            // Actions that overlap keep the difference of their starts.
            if start_before.clone() + before.duration.to_rational() <= start {
                moved + lasting(before) + instant()
            } else if start_before == start && before.call() == plan.steps[next].call() {
                // PlanSys2 identifies an action by its call and its start, so equal calls need
                // different starts.
                moved + instant()
            } else {
                moved + &start - start_before
            }
        });
        later.steps[next].start = after.fold(start.clone(), BigRational::max).into();
    }
    // Delays can violate timed initial literals.
    let verdict = verdict_of(mission, problem, &later, reading, limits);
    if verdict.is_ok_and(|verdict| verdict.violation.is_none()) { later } else { plan }
}

/// Converts a plan to lines for PlanSys2; a duration of 0 becomes a thousandth. The plan's arguments must be those of
/// the domain's file, without the designs that the knowledge base has added.
pub fn plan_lines(plan: &Plan) -> Vec<PlanLine> {
    let line = |step: &Step| {
        let (start, duration) = step.times();
        let duration = if duration.is_zero() { instant().into() } else { duration };
        PlanLine { start, action: step.call(), duration }
    };
    plan.steps.iter().map(line).collect()
}

fn lasting(step: &Step) -> BigRational {
    if step.duration.is_zero() { instant() } else { step.duration.to_rational() }
}

/// Smallest difference between two times in PlanSys2: a thousandth.
pub fn instant() -> BigRational {
    BigRational::new(1.into(), 1000.into())
}

/// Formats lines in the output format of POPF, which PlanSys2's POPF plugin parses.
pub fn popf_text(lines: &[PlanLine]) -> String {
    let mut text = "Solution Found\n".to_owned();
    for line in lines {
        let (start, duration) = (line.start.as_time(), line.duration.as_time());
        let _ = writeln!(text, "{start}: {}  [{duration}]", line.action);
    }
    text
}

#[cfg(test)]
mod tests {
    use num_bigint::BigInt;

    use super::*;

    fn exact(numerator: i64, denominator: i64) -> Exact {
        BigRational::new(BigInt::from(numerator), BigInt::from(denominator)).into()
    }

    /// Returns the output for PlanSys2 of a plan with the steps `(name, start, duration)`, whose
    /// times are in thousandths. `init` is the text of the problem's `:init`.
    fn lines(init: &str, concurrent: bool, steps: &[(&str, i64, i64)]) -> String {
        let domain = "(define (domain d) (:predicates (p) (q) (r))
            (:durative-action aside :parameters () :duration (= ?duration 5) :condition () :effect (at end (r)))
            (:durative-action long :parameters () :duration (= ?duration 5) :condition () :effect (at end (p)))
            (:durative-action short :parameters () :duration (= ?duration 2) :condition (over all (p)) :effect (at end (q)))
            (:action now :parameters () :precondition () :effect (q)))";
        let domain = pddl::Source::new("d", domain);
        let problem = format!("(define (problem p) (:domain d) (:init {init}) (:goal (q)))");
        let problem = pddl::Source::new("p", problem);
        let mission = Mission::new("", None, ::mission::Bindings::default(), Ok(domain), Ok(problem));
        let mission = mission.expect("a mission");
        let steps = steps.iter().map(|&(name, start, duration)| Step {
            action: name.to_owned(),
            arguments: Vec::new(),
            configuration: Vec::new(),
            reconfigured: Vec::new(),
            start: exact(start, 1000),
            duration: exact(duration, 1000),
            cost: exact(0, 1),
        });
        let plan = Plan { steps: steps.collect(), cost: exact(0, 1) };
        let reading = if concurrent { Reading::concurrent(&instant()) } else { Reading::sequential(true) };
        popf_text(&plan_lines(&spaced(&mission, mission.problem(), plan, &reading, &Limits::none())))
    }

    fn check(init: &str, concurrent: bool, steps: &[(&str, i64, i64)], expected: &str) {
        assert_eq!(lines(init, concurrent, steps), format!("Solution Found\n{expected}"));
    }

    #[test]
    fn successors_begin_a_thousandth_later() {
        let sequence = [("long", 0, 5000), ("now", 5000, 0), ("short", 5000, 2000), ("now", 9000, 0)];
        let spaced =
            "0.000: (long)  [5.000]\n5.001: (now)  [0.001]\n5.003: (short)  [2.000]\n9.000: (now)  [0.001]\n";
        check("", false, &sequence, spaced);
        let overlapping = [("long", 0, 5000), ("aside", 1000, 5000), ("short", 5000, 2000)];
        let spaced = "0.000: (long)  [5.000]\n1.000: (aside)  [5.000]\n5.001: (short)  [2.000]\n";
        check("", true, &overlapping, spaced);
        let twice = [("long", 0, 5000), ("long", 0, 5000), ("short", 6000, 2000)];
        let spaced = "0.000: (long)  [5.000]\n0.001: (long)  [5.000]\n6.000: (short)  [2.000]\n";
        check("", true, &twice, spaced);
    }

    /// A fact that is true only from time 5 to time 7 leaves no room to delay `short`, so the given plan is returned
    /// without a gap after `now`.
    #[test]
    fn plans_without_room_for_gaps_are_unchanged() {
        let steps = [("now", 5000, 0), ("short", 5000, 2000)];
        let expected = "5.000: (now)  [0.001]\n5.000: (short)  [2.000]\n";
        check("(at 5 (p)) (at 7 (not (p)))", false, &steps, expected);
    }
}
