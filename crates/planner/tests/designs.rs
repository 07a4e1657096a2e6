//! Tasks with many designs, dependent designs, and expressions that combine designs and fluents. Claims must
//! agree with results computed by hand from the definition of a plan.

use std::fmt::Write as _;

use metaplan_planner::{Config, GroundConfig, Solution, Status, ground, optimize};
use pddl::{Source, read};

fn solve(domain: &str, problem: &str) -> Solution {
    let (domain, problem, _) =
        read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    optimize(&task, &Config::default(), &mut |_| {})
}

fn answer(solution: &Solution) -> Option<(String, Vec<String>)> {
    let plan = solution.plan.as_ref()?;
    let step = |step: &metaplan_planner::Step| {
        let words = std::iter::once(&step.action).chain(&step.arguments);
        words.map(String::as_str).collect::<Vec<_>>().join(" ")
    };
    Some((plan.cost.to_string(), plan.steps.iter().map(step).collect()))
}

#[allow(clippy::unnecessary_wraps)]
fn found(cost: &str, steps: &[&str]) -> Option<(String, Vec<String>)> {
    Some((cost.to_owned(), steps.iter().map(|step| (*step).to_owned()).collect()))
}

/// Each of the `count` designs solves `f1` and `f2`. `value` returns further facts about a design.
fn designs(count: usize, value: impl Fn(usize) -> String) -> String {
    let mut text = String::from("(define (problem p) (:domain d) (:objects");
    for index in 0..count {
        let _ = write!(text, " d{index}");
    }
    text.push_str(" - design) (:init (= (bat) 10) (= (total-cost) 0)");
    for index in 0..count {
        let _ = write!(text, " (fd_solve_f d{index} f1) (fd_solve_f d{index} f2) {}", value(index));
    }
    text.push_str(") (:goal (done)) (:metric minimize (total-cost)))");
    text
}

/// Two functions need different designs, and only the last of 400 designs consumes little.
#[test]
fn no_combination_of_many_designs_is_forgotten() {
    let domain = "(define (domain d) (:requirements :typing :fluents :equality :negative-preconditions)
      (:types design function) (:constants f1 f2 - function)
      (:predicates (fd_solve_f ?d - design ?f - function) (done))
      (:functions (bat) (total-cost) (use ?d - design))
      (:action run :parameters (?a ?b - design)
        :precondition (and (fd_solve_f ?a f1) (fd_solve_f ?b f2) (not (= ?a ?b)) (>= (bat) (use ?a)))
        :effect (and (done) (decrease (bat) (use ?a)) (increase (total-cost) 1)))
      (:action sleep :parameters () :precondition () :effect (and (done) (increase (total-cost) 50))))";
    let value = |index| format!("(= (use d{index}) {})", if index == 399 { 1 } else { 100 });
    let problem = designs(400, value);
    // Without the action `sleep`, every plan uses `run`.
    let without = domain.split("(:action sleep").next().map(|text| format!("{text})")).unwrap_or_default();
    for domain in [domain, &without] {
        let solution = solve(domain, &problem);
        assert_eq!(answer(&solution), found("1", &["run d399 d0"]), "{solution:?}");
        assert_eq!(solution.status, Status::Optimal);
    }
}

/// A design that solves another design: its function is known only after the other design is selected.
#[test]
fn a_function_may_be_a_design_itself() {
    let action = |name: &str, solves: &str, cost: u32| {
        format!(
            "(:action {name} :parameters (?a ?b ?c) :precondition (and {solves}) :effect (and (g) (increase (total-cost) {cost})))"
        )
    };
    let problem = "(define (problem p) (:domain d) (:objects o1 o2 o3)
      (:init (fd_solve_f o1 o2) (fd_solve_f o2 o3) (= (total-cost) 0)) (:goal (g)) (:metric minimize (total-cost)))";
    let chains = [
        "(fd_solve_f ?a ?b) (fd_solve_f ?b ?c)",
        "(fd_solve_f ?b ?c) (fd_solve_f ?a ?b)",
        "(fd_solve_f ?a ?b) (fd_solve_f ?b ?c) (not (fd_solve_f ?c ?a))",
    ];
    for chain in chains {
        let domain = format!(
            "(define (domain d) (:requirements :fluents :negative-preconditions) (:predicates (fd_solve_f ?x ?y) (g))
              (:functions (total-cost)) {} {})",
            action("go", chain, 1),
            action("detour", "(fd_solve_f ?a ?b) (= ?b ?c)", 7)
        );
        let solution = solve(&domain, problem);
        assert_eq!(answer(&solution), found("1", &["go o1 o2 o3"]), "{chain}: {solution:?}");
    }
    // Each design is the function of the other design.
    let domain = format!(
        "(define (domain d) (:requirements :fluents) (:predicates (fd_solve_f ?x ?y) (g)) (:functions (total-cost)) {})",
        action("go", "(fd_solve_f ?a ?b) (fd_solve_f ?b ?a)", 1)
    );
    let both = problem.replace("(fd_solve_f o2 o3)", "(fd_solve_f o2 o1)");
    assert_eq!(answer(&solve(&domain, &both)), found("1", &["go o2 o1 o1"]));
    assert_eq!(solve(&domain, problem).status, Status::Unsolvable);
}

#[test]
fn factors_of_a_design_and_of_a_fluent_may_meet() {
    let task = |precondition: &str, effect: &str| {
        format!(
            "(define (domain d) (:requirements :typing :fluents) (:types design function) (:constants f1 - function)
              (:predicates (fd_solve_f ?d - design ?f - function) (done))
              (:functions (bat) (x) (total-cost) (f ?d - design) (g ?d - design) (speed ?d - design))
              (:action run :parameters (?d - design) :precondition (and (fd_solve_f ?d f1) {precondition})
                :effect (and (increase (total-cost) (f ?d)) {effect}))
              (:action grow :parameters () :effect (and (increase (total-cost) 1) (increase (x) 3)))
              (:action fin :parameters () :precondition (<= (bat) 4) :effect (done)))"
        )
    };
    let problem = "(define (problem p) (:domain d) (:objects a b - design)
      (:init (fd_solve_f a f1) (fd_solve_f b f1) (= (bat) 10) (= (x) 3) (= (total-cost) 0)
        (= (f a) 2) (= (f b) 3) (= (g a) 1) (= (g b) 2) (= (speed a) 2) (= (speed b) 1))
      (:goal (done)) (:metric minimize (total-cost)))";
    let check = |precondition: &str, effect: &str, expected: Option<(&str, &[&str])>| {
        let solution = solve(&task(precondition, effect), problem);
        let expected = expected.and_then(|(cost, steps)| found(cost, steps));
        assert_eq!(answer(&solution), expected, "{precondition} {effect}: {solution:?}");
        assert!(matches!(solution.status, Status::Optimal | Status::Unsolvable), "{solution:?}");
    };
    // 10 - 2 * 1 * 3 = 4 with design a; 10 - 3 * 2 * 3 < 4 with design b, which costs more.
    check("", "(decrease (bat) (* (f ?d) (* (g ?d) (x))))", Some(("2", &["run a", "fin"])));
    // The consumption is 0 with design a; design b charges the battery.
    check("", "(decrease (bat) (* (* (f ?d) (x)) (- 1 (g ?d))))", None);
    // With design a, x must grow before run is applied twice. Design b costs 3 each time.
    let twice: &[&str] = &["grow", "run a", "run a", "fin"];
    check("(>= (/ (x) (speed ?d)) 3)", "(decrease (bat) 3)", Some(("5", twice)));
    check("(>= (x) (* 3 (speed ?d)))", "(decrease (bat) 3)", Some(("5", twice)));
    check("(or (>= (x) (* 3 (speed ?d))) (>= (f ?d) (x)))", "(decrease (bat) 3)", Some(("5", twice)));
    // The remaining amounts are 10 - 3 * 2 and 10 - 3 * 1.
    check("", "(decrease (bat) (* (x) (speed ?d)))", Some(("2", &["run a", "fin"])));
}

fn falling_costs(count: usize) -> (String, String) {
    let domain = "(define (domain d) (:requirements :typing :fluents) (:types design function) (:constants f1 f2 - function)
      (:predicates (fd_solve_f ?d - design ?f - function) (done)) (:functions (bat) (total-cost) (cost ?d - design))
      (:action run :parameters (?a - design) :precondition (fd_solve_f ?a f1)
        :effect (and (done) (increase (total-cost) (cost ?a)))))";
    (domain.to_owned(), designs(count, |index| format!("(= (cost d{index}) {})", 1_000_000 - index)))
}

/// There are more designs than 16 bits can number.
#[test]
#[ignore = "takes 10 s in debug"]
fn the_best_of_66_000_designs_is_found() {
    let (domain, problem) = falling_costs(66_000);
    let solution = solve(&domain, &problem);
    assert_eq!(answer(&solution), found("934001", &["run d65999"]), "{:?}", solution.status);
    assert_eq!(solution.status, Status::Optimal);
}

/// A disjunction with a comparison becomes an axiom. The comparison must not depend on a design there.
#[test]
fn numbers_that_a_design_changes_at_start_may_be_compared_at_the_end() {
    let problem = "(define (problem p) (:domain d)
      (:init (fd_solve_f d1 f1) (fd_solve_f d2 f1) (= (use d1) 1) (= (use d2) 2) (= (b) 3)) (:goal (g)))";
    for (condition, effect) in [
        ("", "(when (> (b) 1) (g))"),
        ("(at end (or (> (b) 1) (g)))", "(g)"),
        ("(over all (not (= (b) 1)))", "(g)"),
    ] {
        let domain = format!(
            "(define (domain d) (:requirements :adl :fluents :durative-actions) (:types fd fn)
               (:constants d1 d2 - fd f1 - fn) (:predicates (fd_solve_f ?x - fd ?y - fn) (g))
               (:functions (use ?x - fd) (b))
               (:durative-action go :parameters (?d - fd) :duration (= ?duration 1)
                 :condition (and (at start (fd_solve_f ?d f1)) {condition})
                 :effect (and (at start (decrease (b) (use ?d))) (at end {effect}))))"
        );
        // With d2, the number is 1 at the end.
        assert_eq!(answer(&solve(&domain, problem)), found("1", &["go d1"]), "{condition} {effect}");
    }
}
