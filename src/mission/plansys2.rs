//! A plan as PlanSys2 has it: actions with start and duration in seconds, as POPF writes them.
//!
//! PlanSys2 orders actions by their times alone. So what follows begins after the end of what it follows, never at the same time, and all
//! that is done takes time; as in POPF, a thousandth stands for "at once".

use std::fmt::Write as _;

use ::mission::Mission;
use num_rational::BigRational;
use pddl::ast::Problem;
use planner::{Exact, Limits, Plan, Step};

use crate::mission::confirm::{Reading, verdict_of};

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

/// The plan with a thousandth between the end of an action and whatever begins then. It is returned as it is if it is no plan then, or if a
/// limit is reached.
#[must_use]
pub fn spaced(mission: &Mission, problem: &Problem, plan: Plan, reading: &Reading, limits: &Limits) -> Plan {
    let mut later = plan.clone();
    for next in 1..plan.steps.len() {
        let start = plan.steps[next].start.to_rational();
        let after = plan.steps[..next].iter().zip(&later.steps).map(|(before, moved)| {
            let (own, moved) = (before.start.to_rational(), moved.start.to_rational());
            // What overlaps keeps its distance.
            if own.clone() + before.duration.to_rational() <= start {
                moved + lasting(before) + instant()
            } else if own == start && before.call() == plan.steps[next].call() {
                // By its name and its time PlanSys2 knows an action.
                moved + instant()
            } else {
                moved + &start - own
            }
        });
        later.steps[next].start = after.fold(start.clone(), BigRational::max).into();
    }
    let verdict = verdict_of(mission, problem, &later, reading, limits);
    if verdict.is_ok_and(|verdict| verdict.violation.is_none()) { later } else { plan }
}

/// The lines of a plan, whose arguments are as the domain's file writes them.
pub fn plan_lines(plan: &Plan) -> Vec<PlanLine> {
    let line = |step: &Step| {
        let (start, duration) = step.times();
        let duration = if duration.is_zero() { instant().into() } else { duration };
        PlanLine { start, action: step.call(), duration }
    };
    plan.steps.iter().map(line).collect()
}

/// How long PlanSys2 takes an action to last.
fn lasting(step: &Step) -> BigRational {
    if step.duration.is_zero() { instant() } else { step.duration.to_rational() }
}

/// What stands for "at once", and for "as soon as that has ended": a thousandth.
pub fn instant() -> BigRational {
    BigRational::new(1.into(), 1000.into())
}

/// The lines as POPF writes them, and as PlanSys2's plugin for POPF reads them.
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

    /// Lines of steps `(name, start, duration)`, in thousandths, for a problem with this in `:init`.
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
    fn what_follows_begins_a_thousandth_later() {
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

    /// Something that holds from 5 to 7 leaves no time.
    #[test]
    fn times_that_must_be_stay() {
        let steps = [("now", 5000, 0), ("short", 5000, 2000)];
        let kept = "5.000: (now)  [0.001]\n5.000: (short)  [2.000]\n";
        check("(at 5 (p)) (at 7 (not (p)))", false, &steps, kept);
    }
}
