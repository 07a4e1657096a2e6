//! Actions that must not be lost: a missing case, design or value may remove only the actions that need it.
//!
//! The planner once answered tasks like these with a false "no plan exists" or a false optimum. The
//! correct result follows from the semantics in `validate`, which also executes the expected plan.

use metaplan_planner::{Config, GroundConfig, Status, ground, optimize};
use pddl::validate::{Options, PlanText, validate};
use pddl::{Source, read};

/// The metric and a plan with this metric, no plan, or a rejection with an error code.
enum Expected {
    Optimal(&'static str, &'static str),
    Unsolvable,
    Refused(&'static str),
}

use Expected::{Optimal, Refused, Unsolvable};

fn check(name: &str, domain: &str, problem: &str, expected: &Expected) {
    let read = read(&Source::new("domain", domain), &Source::new("problem", problem));
    let (domain, problem, _) = read.unwrap_or_else(|errors| panic!("{name}: {errors:?}"));
    let task = match (ground(&domain, &problem, &GroundConfig::default()), expected) {
        (Ok(task), _) => task,
        (Err(errors), Refused(code)) => {
            assert!(errors.iter().all(|error| error.code() == *code), "{name}: {errors:?}");
            return;
        }
        (Err(errors), _) => panic!("{name}: {errors:?}"),
    };
    let solution = optimize(&task, &Config::default(), &mut |_| {});
    match expected {
        Optimal(metric, plan) => {
            assert_eq!(solution.status, Status::Optimal, "{name}");
            let found = solution.plan.expect("an optimal solution has a plan");
            assert_eq!(found.cost.to_string(), *metric, "{name}");
            let plan = PlanText::parse(&Source::new("plan", *plan)).expect("a plan");
            let verdict = validate(&domain, &problem, &plan, &Options::default());
            assert!(verdict.valid, "{name}: {:?}", verdict.violation);
        }
        Unsolvable => assert_eq!(solution.status, Status::Unsolvable, "{name}"),
        Refused(code) => panic!("{name}: {code} expected"),
    }
}

/// A domain with two actions. The first has duration 2 and further effects; the second has duration
/// 100 and also achieves the goal.
fn conditional(effects: &str) -> String {
    format!(
        "(define (domain d) (:requirements :durative-actions :fluents :conditional-effects) (:predicates (p) (q) (r)) (:functions (f) (g) (h))
          (:durative-action a :parameters () :duration (= ?duration 2) :condition (and)
            :effect (and (at start (q)) {effects}))
          (:durative-action dear :parameters () :duration (= ?duration 100) :condition (and) :effect (at end (q))))"
    )
}

const FLAT: &str = "(define (problem x) (:domain d) (:init (= (f) 1) (= (h) 1)) (:goal (q)) (:metric minimize (total-time)))";

#[test]
fn a_case_that_cannot_be_takes_only_itself() {
    for (name, effects) in [
        ("assigned and increased", "(at start (increase (f) 5)) (when (at start (p)) (at start (assign (f) 0)))"),
        ("increased and assigned", "(at start (assign (f) 0)) (when (at start (p)) (at start (increase (f) 5)))"),
        ("scaled and increased", "(at start (scale-up (f) 2)) (when (at start (p)) (at start (increase (f) 5)))"),
        ("two values", "(at start (assign (f) 1)) (when (at start (p)) (at start (assign (f) 0)))"),
        (
            "two conditions",
            "(when (at start (p)) (at start (assign (f) 1))) (when (at start (p)) (at start (assign (f) 0)))",
        ),
        ("no value", "(when (at start (p)) (at start (assign (f) (g))))"),
        ("assigned and increased at end", "(at end (increase (f) 5)) (when (at end (p)) (at end (assign (f) 0)))"),
        (
            "contrary conditions",
            "(when (at start (p)) (at start (assign (f) (h)))) (when (at start (not (p))) (at start (assign (f) (+ (h) 1))))
             (at end (increase (h) 1))",
        ),
    ] {
        check(name, &conditional(effects), FLAT, &Optimal("2", "0: (a) [2]"));
    }
    // In states in which the condition holds, the action cannot be executed.
    let held = FLAT.replace("(:init", "(:init (p)");
    let both = conditional("(at start (increase (f) 5)) (when (at start (p)) (at start (assign (f) 0)))");
    check("the condition holds", &both, &held, &Optimal("100", "0: (dear) [100]"));
}

#[test]
fn a_design_without_a_value_is_lost_only_where_the_value_is_needed() {
    let domain = "(define (domain d) (:requirements :typing :fluents :conditional-effects) (:types design function)
      (:constants f1 - function) (:predicates (fd_solve_f ?d - design ?f - function) (p) (g)) (:functions (extra ?d - design) (total-cost))
      (:action go :parameters (?d - design) :precondition (fd_solve_f ?d f1)
        :effect (and (g) (increase (total-cost) 1) (when (p) (increase (total-cost) (extra ?d)))))
      (:action prepare :parameters () :precondition (and) :effect (and (p) (increase (total-cost) 7))))";
    let problem = |goal: &str| {
        format!(
            "(define (problem x) (:domain d) (:objects d1 d2 - design) (:init (fd_solve_f d1 f1) (fd_solve_f d2 f1) (= (extra d2) 5)
              (= (total-cost) 0)) (:goal {goal}) (:metric minimize (total-cost)))"
        )
    };
    check("either design", domain, &problem("(g)"), &Optimal("1", "(go d1)"));
    check("one design first", domain, &problem("(and (g) (p))"), &Optimal("8", "(go d1)\n(prepare)"));
}

#[test]
fn missing_values_below_quantifiers_are_missing_everywhere() {
    let domain = "(define (domain d) (:requirements :typing :fluents :derived-predicates :adl) (:types t) (:functions (f ?x - t)) (:predicates (ok) (g))
      (:derived (ok) (forall (?x - t) (> (f ?x) 3)))
      (:action do :parameters () :precondition (not (ok)) :effect (g)))";
    let problem = |values: &str| {
        format!("(define (problem x) (:domain d) (:objects o1 o2 - t) (:init {values}) (:goal (g)))")
    };
    check("one is missing", domain, &problem("(= (f o1) 5)"), &Optimal("1", "(do)"));
    check("none is missing", domain, &problem("(= (f o1) 5) (= (f o2) 4)"), &Unsolvable);
}

#[test]
fn durations_that_would_be_chosen_as_nothing_are_refused() {
    let domain = |bound: &str| {
        format!(
            "(define (domain d) (:requirements :durative-actions :duration-inequalities :fluents) (:predicates (g)) (:functions (need))
              (:durative-action act :parameters () :duration (>= ?duration {bound}) :condition () :effect (at end (g))))"
        )
    };
    let problem =
        "(define (problem x) (:domain d) (:init (= (need) 2)) (:goal (g)) (:metric minimize (total-time)))";
    check("below 0", &domain("(- (need) 5)"), problem, &Refused("E301"));
    check("0", &domain("(- (need) 2)"), problem, &Refused("E301"));
    check("above 0", &domain("(- (need) 1)"), problem, &Optimal("1", "0: (act) [1]"));
}

#[test]
fn start_and_end_of_an_action_without_duration_are_one() {
    let domain = |conditions: &str, effects: &str| {
        format!(
            "(define (domain d) (:requirements :durative-actions :fluents :negative-preconditions) (:predicates (p) (q) (g)) (:functions (time))
              (:durative-action a :parameters () :duration (= ?duration (time)) :condition (and {conditions}) :effect (and {effects} (at end (g)))))"
        )
    };
    let problem = |time: &str| {
        format!(
            "(define (problem x) (:domain d) (:init (= (time) {time})) (:goal (g)) (:metric minimize (total-time)))"
        )
    };
    let cases: [(&str, &str, &str, Expected, Expected); 4] = [
        ("nothing over all", "(over all (p))", "", Optimal("0", "0: (a) [0]"), Unsolvable),
        ("no start before the end", "(at end (p))", "(at start (p))", Unsolvable, Optimal("1", "0: (a) [1]")),
        ("they interfere", "", "(at start (p)) (at end (not (p)))", Unsolvable, Optimal("1", "0: (a) [1]")),
        (
            "they agree",
            "",
            "(at start (p)) (at end (p))",
            Optimal("0", "0: (a) [0]"),
            Optimal("1", "0: (a) [1]"),
        ),
    ];
    for (name, conditions, effects, without, with) in cases {
        check(name, &domain(conditions, effects), &problem("0"), &without);
        check(name, &domain(conditions, effects), &problem("1"), &with);
    }
}

#[test]
fn a_negative_duration_is_no_duration() {
    let domain = |duration: &str| {
        format!(
            "(define (domain d) (:requirements :durative-actions :fluents) (:predicates (g)) (:functions (short) (long))
              (:durative-action a :parameters () :duration (= ?duration {duration}) :condition (and) :effect (at end (g)))
              (:durative-action dear :parameters () :duration (= ?duration 100) :condition (and) :effect (at end (g))))"
        )
    };
    let problem = "(define (problem x) (:domain d) (:init (= (short) 1) (= (long) 3)) (:goal (g)) (:metric minimize (total-time)))";
    for (duration, time, plan) in [
        ("(- (short) (long))", "100", "0: (dear) [100]"),
        ("-1", "100", "0: (dear) [100]"),
        ("(- (short) 1)", "0", "0: (a) [0]"),
        ("(- (long) (short))", "2", "0: (a) [2]"),
    ] {
        check(duration, &domain(duration), problem, &Optimal(time, plan));
    }
}
