//! Actions that overlap with other runs of the same action: tests of plans and of claims.

use crate::concurrent::{check, metric, parse, rational, solve, written};

#[test]
fn actions_overlap_with_themselves() {
    let domain = |action: &str| {
        format!(
            "(define (domain d) (:requirements :durative-actions) (:predicates (ready) (p) (q) (r)) (:functions (x) (y))
               {action})"
        )
    };
    let problem = |goal: &str| {
        format!("(define (problem p) (:domain d) (:init (= (x) 2) (= (y) 0) (ready)) (:goal (and {goal})))")
    };
    let react = |condition: &str, effect: &str| {
        domain(&format!(
            "(:durative-action react :parameters () :duration (= ?duration 5)
               :condition (and {condition}) :effect (and {effect}))"
        ))
    };
    // Simultaneous increases by several runs count separately.
    let own = react("", "(at end (increase (y) 1))");
    let plan = ["0: (react) [5]", "0: (react) [5]", "0: (react) [5]"];
    check("at one time", &own, &problem("(>= (y) 3)"), (1, 1000), Some(("5", &plan)));
    // Starts that read a number that they change must be separated. The amount suffices for two runs.
    let own = react("(at start (>= (x) 1))", "(at start (decrease (x) 1)) (at end (increase (y) 1))");
    let plan = ["0: (react) [5]", "0.001: (react) [5]"];
    check("apart", &own, &problem("(>= (y) 2)"), (1, 1000), Some(("5.001", &plan)));
    check("too little", &own, &problem("(>= (y) 3)"), (1, 1000), None);
    // A second run cannot start, because its start requires the fact that the first run has deleted.
    let own =
        react("(at start (ready))", "(at start (not (ready))) (at end (ready)) (at end (increase (y) 1))");
    let plan = ["0: (react) [5]", "5.001: (react) [5]"];
    check("taken", &own, &problem("(>= (y) 2)"), (1, 1000), Some(("10.001", &plan)));
    // All runs start before one of them ends.
    let own = react("(at start (ready))", "(at end (not (ready))) (at end (increase (y) 1))");
    let plan = ["0: (react) [5]", "0: (react) [5]", "0: (react) [5]"];
    check("before the first end", &own, &problem("(>= (y) 3)"), (1, 1000), Some(("5", &plan)));
    // The fact that the end of a run adds is consumed. The end of a second run, which started slightly later,
    // adds it again.
    let own = domain(
        "(:durative-action charge :parameters () :duration (= ?duration 10) :condition () :effect (at end (p)))
         (:durative-action use :parameters () :duration (= ?duration 6)
           :condition (at start (p)) :effect (and (at start (not (p))) (at end (q))))
         (:durative-action spend :parameters () :duration (= ?duration 7)
           :condition (at start (p)) :effect (and (at start (not (p))) (at end (r))))",
    );
    let plan = ["0: (charge) [10]", "0.002: (charge) [10]", "10.001: (spend) [7]", "10.003: (use) [6]"];
    check("used up", &own, &problem("(q) (r)"), (1, 1000), Some(("17.001", &plan)));
    // The light is on until the first run ends, and each run needs it throughout. Two runs must therefore
    // start and end together.
    let own = domain(
        "(:durative-action light :parameters () :duration (= ?duration 5)
           :condition (over all (p)) :effect (and (at start (p)) (at end (not (p)))))
         (:durative-action work :parameters () :duration (= ?duration 7) :condition (over all (p)) :effect (at end (q)))",
    );
    check("light", &own, &problem("(q)"), (1, 1000), None);
}

/// A battery is charged by overlapping runs. `first`, `second` and `third` must be executed in this order,
/// and each consumes one unit at its end.
#[test]
fn a_battery_can_be_charged_by_overlapping_runs() {
    let domain = |others: &str| {
        let work = |name: &str, needs: &str, gives: &str| {
            format!(
                "(:durative-action {name} :parameters () :duration (= ?duration 1)
                   :condition (and (at start (>= (battery) 1)) {needs})
                   :effect (and (at end (decrease (battery) 1)) (at end ({gives}))))"
            )
        };
        format!(
            "(define (domain d) (:requirements :durative-actions :fluents) (:predicates (p) (q) (r)) (:functions (battery))
               (:durative-action charge :parameters () :duration (= ?duration 10)
                 :condition () :effect (at end (assign (battery) 1))) {} {} {} {others})",
            work("first", "", "p"),
            work("second", "(at start (p))", "q"),
            work("third", "(at start (q))", "r"),
        )
    };
    let problem = |goal: &str| {
        format!(
            "(define (problem p) (:domain d) (:init (= (battery) 0)) (:goal (and {goal})) (:metric minimize (total-time)))"
        )
    };
    // Each of the three actions consumes the effect of one run of `charge`; the three runs of `charge`
    // overlap.
    let plan = [
        "0: (charge) [10]",
        "1.002: (charge) [10]",
        "2.004: (charge) [10]",
        "10.001: (first) [1]",
        "11.003: (second) [1]",
        "12.005: (third) [1]",
    ];
    check("three", &domain(""), &problem("(r)"), (1, 1000), Some(("13.005", &plan)));
    // `first` is executed twice, because `undo` deletes its effect in between.
    let undo = "(:durative-action undo :parameters () :duration (= ?duration 1)
      :condition (at start (p)) :effect (and (at end (not (p))) (at end (r))))";
    let plan = [
        "0: (charge) [10]",
        "1.002: (charge) [10]",
        "10.001: (first) [1]",
        "11.002: (undo) [1]",
        "11.003: (first) [1]",
    ];
    check("twice", &domain(undo), &problem("(p) (r)"), (1, 1000), Some(("12.003", &plan)));
}

#[test]
fn runs_whose_duration_the_state_decides() {
    // A run that starts after `grow` takes longer. Both runs can start before.
    let domain =
        "(define (domain d) (:requirements :durative-actions) (:predicates (go)) (:functions (x) (y))
      (:durative-action react :parameters () :duration (= ?duration (x))
        :condition () :effect (and (at start (increase (y) 1))))
      (:action grow :parameters () :precondition (go) :effect (and (not (go)) (increase (x) 2))))";
    let problem = "(define (problem p) (:domain d) (:init (= (x) 5) (= (y) 0) (go)) (:goal (and (>= (y) 2) (= (x) 7))))";
    let (domain, problem) = parse(domain, problem);
    let separation = rational(1, 1000);
    let solution = solve(&domain, &problem, &separation);
    let plan = solution.plan.expect("a plan");
    // Two runs start at 0, and the number grows after their starts.
    assert_eq!(metric(&domain, &problem, &written(&plan), &separation), Ok(rational(5, 1)));
}
