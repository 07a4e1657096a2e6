//! Regression tests from user reports: tasks on which the planner was wrong, with the correct answers.
//!
//! Small tasks are written out; larger ones are files in `field/`. The correct answers follow the definition
//! of a plan. Where an answer differs from the user's report, a comment gives the reason.

use std::time::Duration;

use metaplan::mission::Planning as _;
use num_bigint::BigInt;
use num_rational::BigRational;
use planner::{Config, Limits, Status};

use crate::judge::{Case, Mode, Step, Tally, Truth, judge, read};

fn exact(text: &str) -> BigRational {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    let digits: BigInt = format!("{whole}{fraction}").parse().expect("a number");
    BigRational::new(digits, BigInt::from(10).pow(fraction.len() as u32))
}

/// Parses steps `start: (action arguments) [duration]`, which are separated by commas.
fn steps(text: &str) -> Vec<Step> {
    let step = |text: &str| {
        let (start, remainder) = text.split_once(": (").expect("a start");
        let (call, duration) = remainder.split_once(") [").expect("a duration");
        let mut call = call.split(' ').map(str::to_owned);
        Step {
            start: exact(start.trim()),
            action: call.next().expect("an action"),
            arguments: call.collect(),
            duration: exact(duration.trim_end_matches(']')),
        }
    };
    text.split(", ").filter(|text| !text.is_empty()).map(step).collect()
}

fn best(value: &str, plan: &str) -> Truth {
    Truth::Best(exact(value), steps(plan))
}

fn sequential() -> Mode {
    Mode::Sequential
}

fn overlapping() -> Mode {
    // The default separation of the program.
    Mode::Concurrent(exact("0.001"))
}

fn check(name: &str, (domain, problem): (&str, &str), cases: Vec<(Mode, Truth)>) {
    let mut tally = Tally::default();
    for (mode, truth) in cases {
        let value = match &truth {
            Truth::Best(value, _) | Truth::NoBest(value, _) => Ok(value.clone()),
            _ => Err("there is no plan".to_owned()),
        };
        // Certificates exist for sequential plans only.
        let certify = mode == Mode::Sequential;
        let case = Case {
            name: name.to_owned(),
            domain: domain.to_owned(),
            problem: problem.to_owned(),
            mode,
            maximize: problem.contains("maximize"),
            truth,
            execute: Box::new(move |_| value.clone()),
            certify,
            limit: Duration::from_secs(20),
            // Every plan must be the known optimum, so that no run may end at its limit, not even on a busy machine.
            second_limit: Duration::from_secs(20),
        };
        judge(&case, &mut tally);
    }
    tally.finish();
}

const CONFLICT: &str = "(:durative-action a :parameters () :duration (= ?duration 2) :condition (and)
  :effect (and (at start (q)) (at start (p)) (at start (increase (f) 5)) (when (at start (p)) (at start (assign (f) 0)))))";

fn conflict(costly_action: &str) -> String {
    format!(
        "(define (domain d) (:requirements :adl :fluents :durative-actions) (:predicates (p) (q)) (:functions (f)) {CONFLICT} {costly_action})"
    )
}

#[test]
fn b1_conditional_start_conflict() {
    let problem = "(define (problem p) (:domain d) (:init (= (f) 2)) (:goal (q)))";
    let costly_action = "(:durative-action dear :parameters () :duration (= ?duration 100) :condition (and) :effect (at end (q)))";
    for costly_action in ["", costly_action] {
        let truth = best("2", "0: (a) [2]");
        check(
            "b1",
            (&conflict(costly_action), problem),
            vec![(sequential(), truth.clone()), (overlapping(), truth)],
        );
    }
}

#[test]
fn b1_all_pairs() {
    let effects =
        ["(increase (f) 5)", "(decrease (f) 1)", "(scale-up (f) 2)", "(assign (f) 0)", "(assign (f) 1)"];
    for first in effects {
        for second in effects {
            for time in ["start", "end"] {
                let domain = format!(
                    "(define (domain d) (:requirements :adl :fluents :durative-actions) (:predicates (p) (q)) (:functions (f))
                     (:durative-action a :parameters () :duration (= ?duration 2) :condition (and)
                      :effect (and (at end (q)) (at {time} {first}) (when (at {time} (p)) (at {time} {second}))))
                     (:action other :parameters () :precondition (q) :effect (p)))"
                );
                let problem = "(define (problem p) (:domain d) (:init (= (f) 2)) (:goal (q)))";
                check("b1-pair", (&domain, problem), vec![(sequential(), best("2", "0: (a) [2]"))]);
            }
        }
    }
}

#[test]
fn b1_undefined_operand() {
    let domain = "(define (domain d) (:requirements :adl :fluents :durative-actions)
     (:predicates (p) (q) (r)) (:functions (f) (s) (total-cost))
     (:durative-action a :parameters () :duration (= ?duration 1) :condition (and (at start (r)) (at end (r)))
      :effect (and (at end (q)) (when (at start (p)) (at start (increase (f) (s))))))
     (:action dear :parameters () :precondition (and) :effect (and (p) (not (r)) (increase (total-cost) 0))))";
    let problem = "(define (problem p) (:domain d) (:init (= (f) 2) (r)) (:goal (q)))";
    check("b1-undefined", (domain, problem), vec![(sequential(), best("1", "0: (a) [1]"))]);
}

const BETWEEN: &str = "(:durative-action a :parameters () :duration (= ?duration 10)
  :condition (and (at start (p)) (at end (q))) :effect (at end (g)))";

/// The start lies between two events. In concurrent mode the end reads the fact that the event at 12 adds, so
/// the end is at least the separation later.
#[test]
fn b2_wait_between_events() {
    let costly_action = "(:durative-action dear :parameters () :duration (= ?duration 100) :condition (and) :effect (at end (g)))";
    for costly_action in ["", costly_action] {
        let domain = format!(
            "(define (domain d) (:requirements :durative-actions :timed-initial-literals) (:predicates (p) (q) (g)) {BETWEEN} {costly_action})"
        );
        let problem = "(define (problem p) (:domain d) (:init (p) (at 5 (not (p))) (at 12 (q))) (:goal (g)))";
        let cases = vec![
            (sequential(), best("10", "3: (a) [10]")),
            (overlapping(), best("12.001", "2.001: (a) [10]")),
        ];
        check("b2", (&domain, problem), cases);
    }
}

/// The metric has no best value, and the plan must wait for an event. The planner once reported a horizon
/// although none was set.
#[test]
fn b3_no_horizon() {
    let domain = "(define (domain d) (:requirements :durative-actions :timed-initial-literals :fluents)
     (:predicates (p) (g)) (:functions (total-cost))
     (:action a :parameters () :precondition (p) :effect (and (g) (increase (total-cost) 1))))";
    for (event, plan) in [("(at 5 (p))", "6: (a) [0]"), ("(p)", "0: (a) [0]")] {
        let problem = format!(
            "(define (problem p) (:domain d) (:init {event} (= (total-cost) 0)) (:goal (g)) (:metric maximize (total-cost)))"
        );
        check("b3", (domain, &problem), vec![(sequential(), Truth::NoBest(exact("1"), steps(plan)))]);
    }
}

/// A condition over all need not hold at the end itself.
#[test]
fn b4_event_at_the_end() {
    let costly_action = "(:durative-action dear :parameters () :duration (= ?duration 50) :condition (and) :effect (at end (g)))";
    for costly_action in ["", costly_action] {
        let domain = format!(
            "(define (domain d) (:requirements :durative-actions :timed-initial-literals) (:predicates (p) (g))
             (:durative-action a :parameters () :duration (= ?duration 2) :condition (over all (p)) :effect (at end (g))) {costly_action})"
        );
        let problem = "(define (problem p) (:domain d) (:init (p) (at 2 (not (p)))) (:goal (g)))";
        let truth = best("2", "0: (a) [2]");
        check("b4", (&domain, problem), vec![(sequential(), truth.clone()), (overlapping(), truth)]);
    }
}

/// Start and end of an action of duration 0 are one happening. Here their effects interfere.
#[test]
fn duration_zero_that_interferes() {
    let domain = "(define (domain d) (:requirements :adl :fluents :durative-actions) (:predicates (p) (g)) (:functions (total-cost))
     (:durative-action a :parameters () :duration (= ?duration 0) :condition (over all (p))
      :effect (and (at start (p)) (at end (not (p))) (at end (g))))
     (:action dear :parameters () :precondition (and) :effect (and (g) (increase (total-cost) 50))))";
    let problem = "(define (problem p) (:domain d) (:init (= (total-cost) 0)) (:goal (g)) (:metric minimize (total-cost)))";
    let truth = best("50", "0: (dear) [0]");
    check("e4", (domain, problem), vec![(sequential(), truth.clone()), (overlapping(), truth)]);
}

/// An event coincides with the end of an action, but does not interfere with it.
#[test]
fn conc_14() {
    let domain = "(define (domain c) (:requirements :durative-actions :fluents :negative-preconditions :timed-initial-literals)
     (:predicates (p0) (p1) (p2))
     (:durative-action a0 :parameters () :duration (= ?duration 5)
      :condition (and (at end (not (p2))) (at start (p1))) :effect (and (at end (not (p0))) (at end (p1))))
     (:durative-action a1 :parameters () :duration (= ?duration 2)
      :condition (and (over all (p2))) :effect (and (at start (p0)) (at start (not (p2)))))
     (:durative-action a2 :parameters () :duration (= ?duration 1) :condition (and (over all (p1)) (at start (not (p2))))
      :effect (and (at end (p0)) (at end (not (p2))) (at start (p2)))))";
    let problem = "(define (problem p) (:domain c) (:init (p1) (at 6 (not (p1))) (at 1 (not (p1)))) (:goal (and (p0))))";
    let truth = best("1", "0: (a2) [1]");
    check("conc-14", (domain, problem), vec![(sequential(), truth.clone()), (overlapping(), truth)]);
}

/// The user's report expected 1. However, an end at 1 adds the fact that the event at 1 deletes, so they
/// interfere. (p2) holds from 3 on. The start reads (p2), so it is at 3.001 or later in concurrent mode, and
/// after 3 in sequential mode.
#[test]
fn conc_30012() {
    let domain = "(define (domain c) (:requirements :durative-actions :fluents :negative-preconditions :timed-initial-literals)
     (:predicates (p0) (p1) (p2) (p3))
     (:durative-action a0 :parameters () :duration (= ?duration 3)
      :condition (and (over all (p0)) (at start (p2)) (over all (p3))) :effect (and (at end (p1))))
     (:durative-action a1 :parameters () :duration (= ?duration 1) :condition (and (over all (p2)) (at start (p2)))
      :effect (and (at start (p2)) (at end (p3)) (at end (p2)))))";
    let problem = "(define (problem p) (:domain c) (:init (p1) (p2) (at 3 (p2)) (at 1 (not (p2)))) (:goal (and (p1) (p3))))";
    let cases =
        vec![(sequential(), best("1", "4: (a1) [1]")), (overlapping(), best("4.001", "3.001: (a1) [1]"))];
    check("conc-30012", (domain, problem), cases);
}

macro_rules! random {
    ($test:ident, $name:literal, $value:literal, $plan:literal) => {
        #[test]
        fn $test() {
            let domain = include_str!(concat!("field/", $name, "-domain.pddl"));
            let problem = include_str!(concat!("field/", $name, "-problem.pddl"));
            check($name, (domain, problem), vec![(sequential(), best($value, $plan))]);
        }
    };
}

random!(dur_1065, "dur-1065", "0", "0: (a0 tb_0) [2]");
random!(
    dur_40254,
    "dur-40254",
    "800.000002",
    "0: (mv l0 l2) [2], 2: (mv l2 l3) [2], 4: (a3 tb_0 tb_0) [2], 6: (a3 tb_0 tb_1) [2]"
);
random!(til_20019, "til-20019", "107", "0.001: (a0) [0.5], 0.502: (a0) [0.5]");
random!(til_20146, "til-20146", "4", "0: (a1 l0) [2], 2.001: (a1 l0) [2]");
random!(til_40171, "til-40171", "0.5", "1.6: (a1 tb_1) [1.5]");

fn one_action(functions: &str, condition: &str, values: &str) -> (String, String) {
    let domain = format!(
        "(define (domain d) (:requirements :fluents) (:predicates (done)) (:functions {functions})
         (:action go :parameters () :precondition {condition} :effect (done)))"
    );
    (domain, format!("(define (problem p) (:domain d) (:init {values}) (:goal (done)))"))
}

#[test]
fn n1_products() {
    let cases = [
        ("(>= (* (big) (big)) 1)", "(= (big) 18446744073709551616)"),
        (
            "(>= (* (a) (b) (c)) 0.5)",
            "(= (a) 0.9389223822355513) (= (b) 0.9762061333860831) (= (c) 0.9856748130961577)",
        ),
        (
            "(>= (* (a) (b) (c)) 0.5)",
            "(= (a) 0.98147466740908) (= (b) 0.9333705472472253) (= (c) 0.9836707393119472)",
        ),
    ];
    for (condition, values) in cases {
        let (domain, problem) = one_action("(big) (a) (b) (c)", condition, values);
        let cases = vec![(sequential(), best("1", "0: (go) [0]")), (overlapping(), best("0", "0: (go) [0]"))];
        check("n1", (&domain, &problem), cases);
    }
}

#[test]
fn n1_cheap_and_dear() {
    let domain = "(define (domain d) (:requirements :fluents) (:predicates (done)) (:functions (total-cost) (a) (b) (c))
     (:action risky :parameters () :precondition (>= (* (a) (b) (c)) 0.0001) :effect (and (done) (increase (total-cost) 1)))
     (:action safe :parameters () :effect (and (done) (increase (total-cost) 100))))";
    for values in [
        "(= (a) 0.6307070394199809) (= (b) 0.2200377354949996) (= (c) 0.6706353937051572)",
        "(= (a) 0.6338035485622269) (= (b) 0.2174744612379466) (= (c) 0.9250096893649316)",
    ] {
        let problem = format!(
            "(define (problem p) (:domain d) (:init (= (total-cost) 0) {values}) (:goal (done)) (:metric minimize (total-cost)))"
        );
        let truth = best("1", "0: (risky) [0]");
        check("n1-dear", (domain, &problem), vec![(sequential(), truth.clone()), (overlapping(), truth)]);
    }
}

#[test]
fn n1_large_cost() {
    let domain =
        "(define (domain d) (:requirements :fluents) (:predicates (done)) (:functions (total-cost) (big))
     (:action dear :parameters () :effect (and (done) (increase (total-cost) (* (big) (big)))))
     (:action cheap :parameters () :effect (and (done) (increase (total-cost) 1))))";
    let problem = "(define (problem p) (:domain d) (:init (= (total-cost) 0) (= (big) 18446744073709551616)) (:goal (done))
     (:metric minimize (total-cost)))";
    check("n1-cost", (domain, problem), vec![(sequential(), best("1", "0: (cheap) [0]"))]);
}

/// An action must lie exactly between two events. Its start may interfere with the first event.
#[test]
fn exactly_between_events() {
    let domain = "(define (domain d) (:requirements :adl :durative-actions :timed-initial-literals) (:predicates (e) (w) (q) (g))
     (:durative-action a :parameters () :duration (= ?duration 5) :condition (over all (and (e) (w)))
      :effect (and (when (at start (q)) (at start (not (e)))) (at end (g))))
     (:action disturb :parameters () :precondition (and) :effect (q)))";
    let problem = |extra_facts: &str| {
        format!(
            "(define (problem p) (:domain d) (:init (w) {extra_facts} (at 5 (e)) (at 10 (not (w)))) (:goal (g)))"
        )
    };
    check("between", (domain, &problem("")), vec![(sequential(), best("5", "5: (a) [5]"))]);
    check("between-disturbed", (domain, &problem("(q)")), vec![(sequential(), Truth::NoPlan)]);
}

/// The slower design makes the action last beyond an event; the quicker design does not.
#[test]
fn a_slow_design_reaches_over_events() {
    let domain = "(define (domain d) (:requirements :typing :fluents :durative-actions :timed-initial-literals)
     (:types function functiondesign) (:predicates (fd_solve_f ?d - functiondesign ?f - function) (p) (q) (g)) (:functions (time ?d - functiondesign))
     (:durative-action a :parameters (?f - function ?d - functiondesign) :duration (= ?duration (time ?d))
      :condition (and (at start (fd_solve_f ?d ?f)) (at start (p)) (at end (q))) :effect (at end (g))))";
    let problem = "(define (problem x) (:domain d) (:objects f - function d1 d2 - functiondesign)
     (:init (fd_solve_f d1 f) (fd_solve_f d2 f) (= (time d1) 1) (= (time d2) 4) (p) (at 2 (not (p))) (at 5 (q))) (:goal (g)))";
    check("slow-design", (domain, problem), vec![(sequential(), best("4", "1.001: (a f d2) [4]"))]);
}

/// The second of two actions must end exactly at the second event, so the first action must start exactly at
/// the first event.
#[test]
fn two_exactly_between_events() {
    let domain = "(define (domain d) (:requirements :adl :durative-actions :timed-initial-literals) (:predicates (e) (w) (q) (h) (g))
     (:durative-action a :parameters () :duration (= ?duration 5) :condition (over all (e))
      :effect (and (when (at start (q)) (at start (not (e)))) (at end (h))))
     (:durative-action b :parameters () :duration (= ?duration 10) :condition (and (at start (h)) (over all (w)))
      :effect (at end (g)))
     (:action disturb :parameters () :precondition (and) :effect (q)))";
    let problem = |end: &str| {
        format!("(define (problem p) (:domain d) (:init (w) (at 5 (e)) (at {end} (not (w)))) (:goal (g)))")
    };
    let plan = best("15", "5: (a) [5], 10: (b) [10]");
    check("two-between", (domain, &problem("20")), vec![(sequential(), plan)]);
    check("two-too-late", (domain, &problem("19.999")), vec![(sequential(), Truth::NoPlan)]);
}

#[test]
fn a_number_is_read_after_it_has_changed() {
    let domain = "(define (domain d) (:requirements :fluents :durative-actions) (:predicates (g)) (:functions (x))
     (:durative-action a :parameters () :duration (= ?duration 2) :condition () :effect (at end (increase (x) 1)))
     (:durative-action b :parameters () :duration (= ?duration 3) :condition (at start (>= (x) 1)) :effect (at end (g))))";
    let problem = "(define (problem p) (:domain d) (:init (= (x) 0)) (:goal (g)))";
    let cases = vec![
        (sequential(), best("5", "0: (a) [2], 2: (b) [3]")),
        (overlapping(), best("5.001", "0: (a) [2], 2.001: (b) [3]")),
    ];
    check("number-read", (domain, problem), cases);
}

/// A function has one design at a time. So actions with different designs do not overlap, although PDDL alone
/// would permit an overlap.
#[test]
fn a_function_has_one_design_at_a_time() {
    let domain = "(define (domain d) (:requirements :typing :durative-actions) (:types function functiondesign)
     (:predicates (fd_solve_f ?d - functiondesign ?f - function) (first ?d - functiondesign) (second ?d - functiondesign) (p) (q))
     (:durative-action a :parameters (?f - function ?d - functiondesign) :duration (= ?duration 5)
      :condition (and (at start (fd_solve_f ?d ?f)) (at start (first ?d))) :effect (at end (p)))
     (:durative-action b :parameters (?f - function ?d - functiondesign) :duration (= ?duration 5)
      :condition (and (at start (fd_solve_f ?d ?f)) (at start (second ?d))) :effect (at end (q))))";
    let problem = |second: &str| {
        format!(
            "(define (problem p) (:domain d) (:objects f - function d1 d2 - functiondesign)
             (:init (fd_solve_f d1 f) (fd_solve_f d2 f) (first d1) (second {second})) (:goal (and (p) (q))))"
        )
    };
    let apart = vec![(overlapping(), best("10", "0: (a f d1) [5], 5: (b f d2) [5]"))];
    check("designs-apart", (domain, &problem("d2")), apart);
    let together = vec![(overlapping(), best("5", "0: (a f d1) [5], 0: (b f d1) [5]"))];
    check("designs-together", (domain, &problem("d1")), together);
}

#[test]
fn n2_coefficients() {
    let domain = "(define (domain d) (:requirements :fluents) (:predicates (done) (ready)) (:functions (x) (y) (z))
     (:action bump :parameters () :precondition (not (ready))
      :effect (and (ready) (increase (x) 1) (increase (y) 1) (increase (z) 1)))
     (:action finish :parameters ()
      :precondition (and (ready) (>= (+ (* 1000000000000000000 (x)) (* 1000000000000000000 (y))) (* 1000000000000000000 (z))))
      :effect (done)))";
    let problem = "(define (problem p) (:domain d) (:init (= (x) 10) (= (y) 10) (= (z) 15)) (:goal (done)))";
    let cases = vec![
        (sequential(), best("2", "0: (bump) [0], 0: (finish) [0]")),
        (overlapping(), best("0.001", "0: (bump) [0], 0.001: (finish) [0]")),
    ];
    check("n2", (domain, problem), cases);
}

#[test]
fn n3_doublings() {
    let predicates: String = (0..71).map(|at| format!(" (c{at})")).collect();
    let action = |at: usize| {
        format!(
            "(:action s{at} :parameters () :precondition (c{at}) :effect (and (not (c{at})) (c{}) (increase (x) (x))))\n",
            at + 1
        )
    };
    let actions: String = (0..70).map(action).collect();
    let domain = format!(
        "(define (domain d) (:requirements :fluents) (:predicates{predicates}) (:functions (x)) {actions})"
    );
    let problem = "(define (problem p) (:domain d) (:init (c0) (= (x) 1)) (:goal (and (c70) (>= (x) 1))))";
    let plan: Vec<_> = (0..70).map(|at| format!("0: (s{at}) [0]")).collect();
    check("n3", (&domain, problem), vec![(sequential(), best("70", &plan.join(", ")))]);
    let (mission, problem) = read(&domain, problem).expect("it is read");
    let limits = Limits::none().with_time(Duration::from_secs(20));
    if let Ok(task) = mission.ground(&problem, &[], &limits) {
        let config = Config::default().with_horizon(75).with_limits(limits);
        let solution = planner::optimize(&task, &config, &mut |_| {});
        assert!(!matches!(solution.status, Status::UnsolvableWithinHorizon | Status::Unsolvable));
    }
}

/// A number exceeds all integer types on the only way to the goal. The overflow must not be reported as "no
/// plan".
#[test]
fn n3_more_doublings() {
    let predicates: String = (0..141).map(|at| format!(" (c{at})")).collect();
    let action = |at: usize| {
        format!(
            "(:action s{at} :parameters () :precondition (c{at}) :effect (and (not (c{at})) (c{}) (increase (x) (x))))\n",
            at + 1
        )
    };
    let actions: String = (0..140).map(action).collect();
    let domain = format!(
        "(define (domain d) (:requirements :fluents) (:predicates{predicates}) (:functions (x)) {actions})"
    );
    let problem = "(define (problem p) (:domain d) (:init (c0) (= (x) 1)) (:goal (and (c140) (>= (x) 1))))";
    let plan: Vec<_> = (0..140).map(|at| format!("0: (s{at}) [0]")).collect();
    check("n3-more", (&domain, problem), vec![(sequential(), best("140", &plan.join(", ")))]);
}

#[test]
fn n5_large_measure() {
    let domain = "(define (domain d) (:requirements :durative-actions :fluents) (:predicates (done)) (:functions (cost))
     (:durative-action dear :parameters () :duration (= ?duration 60000000000) :condition ()
      :effect (and (at end (done)) (at end (increase (cost) 5))))
     (:durative-action cheap :parameters () :duration (= ?duration 50000000000) :condition ()
      :effect (and (at end (done)) (at end (increase (cost) 7)))))";
    let problem = "(define (problem p) (:domain d) (:init (= (cost) 0)) (:goal (done))
     (:metric minimize (+ (* 1000000000 (total-time)) (cost))))";
    let truth = best("50000000000000000007", "0: (cheap) [50000000000]");
    check("n5", (domain, problem), vec![(sequential(), truth.clone()), (overlapping(), truth)]);
}
