//! Writes certificates for the planner's claims and verifies the certificates.

use metaplan::certificate::{self, Contents, Ground};
use metaplan::mission::Mission;
use pddl::ast::{InitialElement, Problem};
use planner::{ExactTask, Limits, Solution, Status, Task};

use crate::judge::{Case, Tally, Truth, compare, plan_lines, rational, steps_of};

#[derive(Debug)]
pub enum Planned {
    Integers(Box<Task>),
    Exact(Box<ExactTask>),
}

fn without_names(message: &str) -> String {
    let mut depth = 0_usize;
    let mut outside = String::new();
    for character in message.chars() {
        match character {
            '(' => depth += 1,
            ')' => depth = depth.saturating_sub(1),
            _ if depth == 0 => outside.push(character),
            _ => {}
        }
    }
    outside
}

/// Writes and verifies a certificate for a claim of optimality or unsolvability. Verification must
/// fail if the oracle refutes the claim, and succeed otherwise. Exceeded limits, and claims without
/// a certificate, are only counted.
pub fn check(
    case: &Case,
    (mission, problem): (&Mission, &Problem),
    task: &Planned,
    solution: &Solution,
    tally: &mut Tally,
) {
    if !matches!(solution.status, Status::Optimal | Status::Unsolvable) {
        return;
    }
    let parent = tempfile::tempdir().expect("a temporary directory");
    let directory = parent.path().join("certificate");
    let plan = solution.plan.as_ref().map_or_else(String::new, |plan| plan_lines(&steps_of(plan)));
    let task = match task {
        Planned::Integers(task) => Ground::Integers(task),
        Planned::Exact(task) => Ground::Exact(task),
    };
    let contents = Contents { mission, problem, task, solution, plan: &plan };
    let limits = || Limits::none().with_time(case.limit);
    if let Err(message) = certificate::write(&directory, &contents, &limits()) {
        // Names are specific to a task. Without them, equal reasons are counted together.
        return tally.count(format!("{}: {:.120}", message.code, without_names(&message.message)));
    }
    // The time limit is generous, because a busy machine must not make verification fail.
    let limits = Limits::none().with_time(30 * case.limit);
    let report = certificate::Verifier::new(&directory).stop(|| limits.reached()).verify();
    // A claim is false if it contradicts the oracle; an optimum worse than a known plan is one such case.
    let refuted = match (&case.truth, &solution.plan) {
        (Truth::Best(best, _), Some(plan)) => rational(&plan.cost) != *best,
        (Truth::Open(Some((incumbent, _))), Some(plan)) => {
            compare(case.maximize, incumbent, &rational(&plan.cost)).is_lt()
        }
        (Truth::NoPlan, None) | (Truth::Open(None), _) => false,
        (Truth::NoPlan, Some(_)) | (Truth::NoBest(..), _) | (Truth::Best(..) | Truth::Open(_), None) => true,
    };
    let failing_part = report.parts.iter().find_map(|part| Some((part.part, part.result.as_ref().err()?)));
    match (failing_part, refuted) {
        (None, true) => tally.fail(case, "A FALSE CLAIM IS VERIFIED", &format!("{:?}", report.claim)),
        (None, false) => {
            let is_timed = problem.init.iter().any(|element| matches!(element, InitialElement::Timed(..)));
            tally.count(if is_timed { "certificate: verified, timed" } else { "certificate: verified" });
        }
        (Some((part, reason)), true) => {
            tally.count(format!("certificate of a false claim fails: {part}: {reason:.40}"));
        }
        (Some(("limits", _)), false) => tally.count("certificate: limit"),
        (Some((part, reason)), false) => {
            tally.fail(case, "a true claim is not verified", &format!("{part}: {reason}"));
        }
    }
}
