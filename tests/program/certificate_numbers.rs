//! Tests of certificates of plans that are computed with fractions, of formulas with duplicate literals, and
//! of plans whose times are within the tolerance of a timed initial literal.

use crate::certificate::change;
use crate::common::{metaplan_in, verify_in};

/// Products that exceed all machine integers force the planner to compute with fractions. Such plans get
/// certificates, unless numbers are also multiplied by fractions.
#[test]
fn plans_found_in_fractions_have_certificates() {
    let directory = tempfile::tempdir().expect("a directory");
    let domain = |effect: &str| {
        format!(
            "(define (domain d) (:predicates (at ?p) (way ?a ?b)) (:functions (long ?a ?b) (rate) (share) (charge) (total-cost))
              (:action go :parameters (?a ?b)
                :precondition (and (at ?a) (way ?a ?b) (> (charge) (* (long ?a ?b) (rate) (share))))
                :effect (and (at ?b) (not (at ?a)) (decrease (charge) (* (long ?a ?b) (rate) (share)))
                  (increase (total-cost) (* (long ?a ?b) (rate) (share)))))
              (:action rest :parameters () :precondition (< (charge) 1)
                :effect (and {effect} (increase (total-cost) 0.1234567890123457))))"
        )
    };
    let problem = "(define (problem p) (:domain d) (:objects a b c)
      (:init (at a) (way a b) (way b c) (way a c) (= (long a b) 0.1234567890123451) (= (long b c) 0.2345678901234512)
        (= (long a c) 0.5678901234512345) (= (rate) 1.234567890123456) (= (share) 0.9876543210987654)
        (= (charge) 0.2000000000000001) (= (total-cost) 0))
      (:goal (at c)) (:metric minimize (total-cost)))";
    std::fs::write(directory.path().join("p.pddl"), problem).expect("a file");
    for (name, effect, covered) in
        [("c", "(assign (charge) 0.7777777777777777)", true), ("h", "(scale-up (charge) 1.5)", false)]
    {
        std::fs::write(directory.path().join("d.pddl"), domain(effect)).expect("a file");
        let arguments = ["plan", "-v", "d.pddl", "p.pddl", "--certificate", name];
        let planned = metaplan_in(directory.path(), &arguments, "");
        assert!(planned.stderr.contains("in exact numbers"), "{planned:#?}");
        assert!(planned.stdout.contains("optimal, proved"), "{planned:#?}");
        if !covered {
            assert_eq!(planned.status, 3, "{planned:#?}");
            assert!(planned.stderr.contains("`rest` multiplies a number by a fraction"), "{planned:#?}");
            continue;
        }
        assert_eq!(planned.status, 0, "{planned:#?}");
        let outcome = verify_in(directory.path(), &[name]);
        assert_eq!(outcome.status, 0, "{outcome:#?}");
        // A change of the last digit must be detected, even in numbers that exceed all machine integers.
        let target = directory.path().join(name).display().to_string();
        change(&target, "task.json", &|text| {
            let mut numbers = text.split(|character: char| !character.is_ascii_digit());
            let long_number = numbers.find(|digits| digits.len() > 39).expect("a long number");
            let last_digit = if long_number.ends_with('5') { "6" } else { "5" };
            text.replacen(long_number, &format!("{}{last_digit}", &long_number[..long_number.len() - 1]), 1)
        });
        assert_eq!(verify_in(directory.path(), &[name]).status, 30);
    }
}

/// A goal with two equal disjuncts yields a clause with a duplicate literal.
#[test]
fn duplicate_literals_are_certified() {
    let directory = tempfile::tempdir().expect("a directory");
    let domain = "(define (domain d) (:predicates (p) (seen ?a))
      (:derived (seen ?a) (p))
      (:action look :parameters () :precondition (or (p) (not (p))) :effect (p)))";
    let problem = "(define (problem p) (:domain d) (:objects a b) (:init) (:goal (exists (?a) (seen ?a))))";
    std::fs::write(directory.path().join("d.pddl"), domain).expect("a file");
    std::fs::write(directory.path().join("p.pddl"), problem).expect("a file");
    let planned = metaplan_in(directory.path(), &["plan", "d.pddl", "p.pddl", "--certificate", "c"], "");
    assert_eq!(planned.status, 0, "{planned:#?}");
    let formula = std::fs::read_to_string(directory.path().join("c/formula.cnf")).expect("a formula");
    assert!(formula.contains("\n2 2 0\n"), "{formula}");
    let outcome = verify_in(directory.path(), &["c"]);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
}

/// A start slightly before the end of the preceding action is moved to this end, and the plan is validated
/// with the moved start. A start slightly before a window of timed literals is not moved into the window.
#[test]
fn tolerance_does_not_move_plans_into_a_window() {
    let directory = tempfile::tempdir().expect("a directory");
    let domain = "(define (domain d) (:requirements :durative-actions :timed-initial-literals :fluents)
      (:predicates (ready) (open) (over)) (:functions (total-cost))
      (:durative-action prepare :parameters () :duration (= ?duration 5)
        :condition (and) :effect (and (at end (ready)) (at end (increase (total-cost) 1))))
      (:durative-action cross :parameters () :duration (= ?duration 1)
        :condition (and (at start (ready)) (at start (open)))
        :effect (and (at end (over)) (at end (increase (total-cost) 1))))
      (:durative-action swim :parameters () :duration (= ?duration 2)
        :condition (and) :effect (and (at end (over)) (at end (increase (total-cost) 9)))))";
    let problem = |init: &str| {
        format!(
            "(define (problem p) (:domain d) (:init (= (total-cost) 0) {init}) (:goal (over)) (:metric minimize (total-cost)))"
        )
    };
    std::fs::write(directory.path().join("d.pddl"), domain).expect("a file");
    let cases = [
        (
            "(at 7 (open)) (at 9 (not (open)))",
            &["6.9995", "7.000", "9.0005", "9.001"][..],
            &["7.001", "8.500"][..],
        ),
        // `prepare` ends at 5, when the way is already closed.
        ("(open) (at 4.9998 (not (open)))", &["4.9995", "4.9998", "5.000"], &[]),
        ("(open) (at 5.5 (not (open)))", &["4.9985", "5.5005"], &["4.9995", "5.000", "5.200"]),
    ];
    for (init, refused, admitted) in cases {
        std::fs::write(directory.path().join("p.pddl"), problem(init)).expect("a file");
        let starts = refused.iter().map(|start| (start, false));
        for (start, valid) in starts.chain(admitted.iter().map(|start| (start, true))) {
            let _ = std::fs::remove_dir_all(directory.path().join("c"));
            let planned =
                metaplan_in(directory.path(), &["plan", "d.pddl", "p.pddl", "--certificate", "c"], "");
            assert_eq!(planned.status, 0, "{planned:#?}");
            let target = directory.path().join("c").display().to_string();
            change(&target, "plan.txt", &|_| format!("0.000: (prepare) [5.000]\n{start}: (cross) [1.000]\n"));
            let outcome = verify_in(directory.path(), &["c"]);
            assert_eq!(
                outcome.stdout.contains("plan        failed"),
                !valid,
                "{init}, {start}: {outcome:#?}"
            );
            assert_eq!(outcome.status, if valid { 0 } else { 30 }, "{init}, {start}: {outcome:#?}");
        }
    }
}
