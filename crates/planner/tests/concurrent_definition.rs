//! Boundary cases of the semantics of overlapping actions (see the head of `validate`): makespans and
//! unsolvability that the planner must prove. The validator checks each plan.

use std::fs::read_to_string;
use std::path::Path;

use metaplan_planner::{Limits, Status};
use num_bigint::BigInt;
use num_rational::BigRational;
use pddl::validate::{Options, PlanText, validate};
use pddl::{Source, read};
use test_resources::data;

use crate::widths;

const NONE: &str = "none";

/// Minimum metric or unsolvability, proved with a separation of 1/1000.
fn proved(domain: &str, problem: &str) -> String {
    let read = read(&Source::new("domain", domain), &Source::new("problem", problem));
    let (domain, problem, _) = read.unwrap_or_else(|errors| panic!("{errors:?}\n{domain}\n{problem}"));
    let separation = BigRational::new(BigInt::from(1), BigInt::from(1000));
    let solution = widths::solve(&domain, &problem, &separation, &Limits::none());
    let Some(plan) = &solution.plan else {
        assert_eq!(solution.status, Status::Unsolvable);
        return NONE.to_owned();
    };
    assert_eq!(solution.status, Status::Optimal);
    let lines = plan.steps.iter().map(|step| {
        let words = [std::slice::from_ref(&step.action), &step.arguments[..]].concat().join(" ");
        format!("{}: ({words}) [{}]\n", step.start, step.duration)
    });
    let text: String = lines.collect();
    let parsed = PlanText::parse(&Source::new("plan", text.clone())).expect("a plan");
    let verdict = validate(
        &domain,
        &problem,
        &parsed,
        &Options::default().with_concurrent(true).with_tolerance(separation),
    );
    assert!(verdict.valid, "{text}{:?}", verdict.violation);
    let value = verdict.metric.unwrap_or(verdict.total_time);
    assert_eq!(value, plan.cost.to_rational(), "{text}");
    plan.cost.to_string()
}

fn durative(name: &str, duration: &str, condition: &str, effect: &str) -> String {
    format!(
        "(:durative-action {name} :parameters () :duration (= ?duration {duration})
           :condition (and {condition}) :effect (and {effect}))\n"
    )
}

/// Checks the answer for a task with the atoms `p`, `q`, `r` and `g`, and the number `x`, initially 2.
fn check(actions: &[String], init: &str, goal: &str, expected: &str) {
    let domain =
        format!("(define (domain d) (:predicates (p) (q) (r) (g)) (:functions (x))\n{})", actions.concat());
    let problem = format!("(define (problem n) (:domain d) (:init (= (x) 2) {init}) (:goal (and {goal})))");
    assert_eq!(proved(&domain, &problem), expected, "{domain}\n{problem}");
}

#[test]
fn over_all_is_about_the_open_interval() {
    let a = || durative("a", "2", "(over all (p))", "(at end (g))");
    check(&[a()], "(p) (at 2 (not (p)))", "(g)", "2");
    check(&[a()], "(p) (at 1.999 (not (p)))", "(g)", NONE);
    check(&[a()], "(at 3 (p))", "(g)", "5");
    check(&[a()], "(p) (at 0 (not (p)))", "(g)", NONE);
    // The event makes the goal `(not (p))` true at the end of the action, when the over-all condition no
    // longer applies.
    check(&[a()], "(p) (at 2 (not (p)))", "(g) (not (p))", "2");
    // The over-all condition stays true only if the event, which deletes p, and the start of `b`, which
    // deletes q, are simultaneous.
    let both = durative("a", "4", "(over all (or (and (p) (q)) (and (not (p)) (not (q)))))", "(at end (g))");
    let helps = || durative("b", "1", "", "(at start (not (q)))");
    check(&[both.clone(), helps()], "(p) (q) (at 2 (not (p)))", "(g)", "4");
    check(&[both], "(p) (q) (at 2 (not (p)))", "(g)", NONE);
}

#[test]
fn events_that_interfere_lie_apart() {
    // The start reads the fact that the event adds, so it must be strictly after the event.
    check(&[durative("a", "2", "(at start (p))", "(at end (g))")], "(at 5 (p))", "(g)", "7.001");
    // The end deletes the fact that the event adds, so they must be separated.
    let deletes = || durative("a", "2", "", "(at end (g)) (at end (not (p)))");
    check(&[deletes()], "(at 2 (p))", "(g)", "2.001");
    check(&[deletes()], "(at 2.001 (p))", "(g)", "2");
    check(&[deletes()], "(at 2.0009 (p))", "(g)", "2.0019");
    check(&[deletes()], "(at 1.9995 (p))", "(g)", "2.0005");
    check(&[deletes()], "(at 1.999 (p))", "(g)", "2");
    // The end reads the fact that the second event deletes, so it must precede this event. The start must
    // follow the first event.
    let reads = || durative("a", "2", "(at start (q)) (at end (p))", "(at end (g))");
    check(&[reads()], "(p) (at 1 (q)) (at 3.002 (not (p)))", "(g)", "3.001");
    check(&[reads()], "(p) (at 1 (q)) (at 3.0019 (not (p)))", "(g)", NONE);
    // Happenings that do not interfere need no separation.
    check(&[durative("a", "2", "", "(at end (g)) (at end (p))")], "(at 2 (p))", "(g)", "2");
    check(&[durative("a", "2", "", "(at end (g)) (at end (not (p)))")], "(at 2 (not (p)))", "(g)", "2");
    check(&[durative("a", "2", "", "(at end (g))")], "(at 2 (p))", "(g) (p)", "2");
    check(&[durative("a", "2", "", "(at end (g))")], "(at 3 (p))", "(g) (p)", "3");
    check(&[durative("a", "2", "", "(at end (g))")], "(p) (at 2 (not (p)))", "(g) (p)", NONE);
    check(&[durative("a", "2", "", "(at end (g))")], "(p) (at 2.001 (not (p)))", "(g) (p)", "2");
}

#[test]
fn a_quantifier_reads_the_objects_of_its_type() {
    let proved_with = |condition: &str, event: &str| {
        let domain = format!(
            "(define (domain d) (:types part tool) (:predicates (on ?x) (pair ?x ?y) (g) (done))
               (:durative-action a :parameters (?t - tool) :duration (= ?duration 2)
                 :condition (at end (or (g) {condition})) :effect (at end (done))))"
        );
        let problem = format!(
            "(define (problem p) (:domain d) (:objects o u - part t - tool) (:init (g) (at 2 {event})) (:goal (done)))"
        );
        proved(&domain, &problem)
    };
    for (condition, event, expected) in [
        ("(exists (?x - part) (on ?x))", "(on o)", "2.001"),
        ("(exists (?x - part) (on ?x))", "(on t)", "2"),
        ("(forall (?x - part) (not (on ?x)))", "(on t)", "2"),
        ("(exists (?x - part) (pair ?x ?x))", "(pair o o)", "2.001"),
        ("(exists (?x - part) (pair ?x ?x))", "(pair o u)", "2"),
        ("(exists (?x ?y - part) (pair ?x ?y))", "(pair o u)", "2.001"),
        ("(exists (?x - part) (pair ?x ?t))", "(pair o t)", "2.001"),
        ("(exists (?x - part) (pair ?x ?t))", "(pair o u)", "2"),
    ] {
        assert_eq!(proved_with(condition, event), expected, "{condition} {event}");
    }
}

#[test]
fn a_plan_ends_with_its_last_action() {
    let a = || durative("a", "5", "", "(at end (g))");
    check(&[a()], "(at 0 (q))", "(q)", "0");
    check(&[a()], "(at 0 (q))", "(g)", "5");
    check(&[a()], "(p) (at 0 (not (p)))", "(p)", NONE);
    check(&[a()], "(at 7 (q))", "(q)", "7");
    check(&[], "(at 7 (q))", "(q)", NONE);
    // A plan may also end with an action that changes nothing relevant, or nothing at all.
    let instantaneous = |effect: &str| format!("(:action a :parameters () :effect {effect})");
    for effect in ["(r)", "(and)", "(when (p) (p))", "(not (p))"] {
        check(&[instantaneous(effect)], "(at 7 (q))", "(q)", "7");
        check(&[durative("a", "0", "", &format!("(at end {effect})"))], "(at 7 (q))", "(q)", "7");
    }
}

#[test]
fn an_action_that_takes_no_time_is_one_happening() {
    for (condition, effect, expected) in [
        ("", "(at start (p)) (at end (not (p))) (at end (g))", NONE),
        ("(over all (p))", "(at start (p)) (at end (not (p))) (at end (g))", NONE),
        ("(at end (p))", "(at start (p)) (at end (g))", NONE),
        ("(at end (r))", "(at start (r)) (at end (g))", NONE),
        ("(at end (r))", "(at start (p)) (at end (g))", "0"),
        ("(over all (p))", "(at end (g))", "0"),
        ("", "(at start (assign (x) 1)) (at end (assign (x) 1)) (at end (g))", NONE),
        ("", "(at start (increase (x) 1)) (at end (increase (x) 1)) (at end (g))", "0"),
        ("(at end (>= (x) 1))", "(at start (increase (x) 1)) (at end (g))", NONE),
    ] {
        check(&[durative("a", "0", condition, effect)], "(r)", "(g)", expected);
    }
}

#[test]
fn one_number_is_assigned_the_same_value_twice() {
    for (time, expected) in [("at start", "3"), ("at end", "3")] {
        let effect = format!("({time} (assign (x) 1)) ({time} (assign (x) 1)) (at end (g))");
        check(&[durative("a", "3", "", &effect)], "", "(g)", expected);
        let effect = format!("({time} (assign (x) 1)) ({time} (assign (x) 2)) (at end (g))");
        check(&[durative("a", "3", "", &effect)], "", "(g)", NONE);
    }
    // Assignments by different actions interfere.
    let assigns = |name: &str, atom: &str| {
        durative(name, "3", "", &format!("(at end (assign (x) 1)) (at end ({atom}))"))
    };
    check(&[assigns("a", "g"), assigns("b", "p")], "", "(g) (p)", "3.001");
}

/// A value that the start of `a` sets and its end requires may be changed and restored in between.
#[test]
fn a_value_is_left_during_an_action_and_taken_again() {
    let domain = "(define (domain f2) (:requirements :durative-actions) (:predicates (i) (x) (y) (g) (h))
      (:durative-action a :parameters () :duration (= ?duration 10) :condition (and (at start (i)) (at end (x)))
        :effect (and (at start (not (i))) (at start (x)) (at end (not (x))) (at end (g))))
      (:durative-action b :parameters () :duration (= ?duration 1) :condition (and (at start (x)) (at end (y)))
        :effect (and (at start (not (x))) (at start (y)) (at end (not (y))) (at end (x)) (at end (h))))
      (:durative-action c :parameters () :duration (= ?duration 10.5) :condition (at start (i))
        :effect (and (at start (not (i))) (at end (g)) (at end (h)))))";
    let problem = "(define (problem p) (:domain f2) (:init (i)) (:goal (and (g) (h))))";
    assert_eq!(proved(domain, problem), "10");
}

/// A landing must wait for the approach, which an event makes true. It then occupies the runway until its
/// end.
#[test]
fn an_action_that_waits_for_an_event_keeps_the_separation() {
    let domain = "(define (domain airport) (:predicates (approach) (free) (landed) (cleared) (gone))
      (:durative-action land :parameters () :duration (= ?duration 2) :condition (and (at start (approach)) (at start (free)))
        :effect (and (at start (not (free))) (at start (not (approach))) (at end (free)) (at end (landed))))
      (:durative-action leave :parameters () :duration (= ?duration 2)
        :condition (and (at start (landed)) (at start (free)) (at start (cleared)))
        :effect (and (at start (not (free))) (at end (free)) (at end (gone)))))";
    let problem = |cleared: &str| {
        format!(
            "(define (problem p) (:domain airport) (:init (free) (at 5 (approach)) (at {cleared} (cleared)))
               (:goal (gone)))"
        )
    };
    assert_eq!(proved(domain, &problem("50")), "52.001");
    assert_eq!(proved(domain, &problem("6")), "9.002");
}

#[test]
fn tasks_that_were_answered_wrongly() {
    for (domain, problem, expected) in [
        ("field/soundness/B4-over-all-event-at-end/domain.pddl", "problem.pddl", "2"),
        ("field/soundness/B4-over-all-event-at-end/domain-dear.pddl", "problem.pddl", "2"),
        ("field/soundness/random/conc-14/d.pddl", "p.pddl", "1"),
        // The event at 1 deletes the fact that the end at 1 adds, so the action must be delayed until the
        // next event.
        ("field/soundness/random/conc-30012/d.pddl", "p.pddl", "4.001"),
        ("field/soundness/random/e4.pddl", "p.pddl", "50"),
        ("real/ipc/temporal/vscode-Airport-domain.pddl/domain.pddl", "1plane.pddl", "52.001"),
    ] {
        let Some(domain) = data(domain) else { continue };
        let text = |path: &Path| read_to_string(path).expect("a file");
        assert_eq!(proved(&text(&domain), &text(&domain.with_file_name(problem))), expected);
    }
}
