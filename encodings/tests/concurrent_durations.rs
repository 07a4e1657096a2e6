//! Durations that the planner chooses: known optima, and random tasks on which no plan over a grid of times and durations, executed by the
//! validator, is better than what is found, or exists where none is claimed to.

use std::fmt::Write as _;

use metaplan_encodings::{
    GroundConfig, Limits, Plan, Solution, Status, ground_concurrent, optimize_concurrent,
};
use num_bigint::BigInt;
use num_rational::BigRational;
use pddl::ast::{Domain, Problem};
use pddl::validate::{Options, PlanText, validate};
use pddl::{Source, read};

fn rational(numerator: i128, denominator: i128) -> BigRational {
    BigRational::new(BigInt::from(numerator), BigInt::from(denominator))
}

fn parse(domain: &str, problem: &str) -> (Domain, Problem) {
    let read = read(&Source::new("domain", domain), &Source::new("problem", problem));
    let (domain, problem, _) = read.unwrap_or_else(|errors| panic!("{errors:?}\n{domain}\n{problem}"));
    (domain, problem)
}

/// The best plan, by the planner; what it claims of it, the validator confirms.
fn solve(domain: &Domain, problem: &Problem, separation: &BigRational, limits: &Limits) -> Solution {
    let task = ground_concurrent(domain, problem, &GroundConfig::default(), separation)
        .unwrap_or_else(|errors| panic!("{errors:?}"));
    let solution = optimize_concurrent(&task, limits, &mut |_| {});
    if let Some(plan) = &solution.plan {
        let text = written(plan);
        let value = metric(domain, problem, &text, separation).unwrap_or_else(|why| panic!("{why}\n{text}"));
        assert_eq!(value, plan.cost.to_rational(), "{text}");
    }
    solution
}

fn written(plan: &Plan) -> String {
    let mut text = String::new();
    for step in &plan.steps {
        let words = [std::slice::from_ref(&step.action), &step.arguments[..]].concat().join(" ");
        let _ = writeln!(text, "{}: ({words}) [{}]", step.start, step.duration);
    }
    text
}

/// What the validator says a plan costs; else why it is not valid.
fn metric(
    domain: &Domain,
    problem: &Problem,
    text: &str,
    separation: &BigRational,
) -> Result<BigRational, String> {
    let plan =
        PlanText::parse(&Source::new("plan", text)).unwrap_or_else(|errors| panic!("{errors:?}\n{text}"));
    let options = Options::default().with_concurrent(true).with_tolerance(separation.clone());
    let verdict = validate(domain, problem, &plan, &options);
    match verdict.violation {
        None => Ok(verdict.metric.unwrap_or(verdict.total_time)),
        Some(violation) => Err(violation.message),
    }
}

/// The status, the metric and the lines of the plan, with a separation of a thousandth.
fn check(name: &str, domain: &str, problem: &str, expected: (Status, Option<&str>, &[&str])) {
    let (domain, problem) = parse(domain, problem);
    let solution = solve(&domain, &problem, &rational(1, 1000), &Limits::none());
    let cost = solution.plan.as_ref().map(|plan| plan.cost.to_string());
    let text = solution.plan.as_ref().map(written).unwrap_or_default();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!((solution.status, cost.as_deref(), &lines[..]), expected, "{name}\n{text}");
}

fn durative(name: &str, duration: &str, condition: &str, effect: &str) -> String {
    format!(
        "(:durative-action {name} :parameters () :duration {duration}
           :condition (and {condition}) :effect (and {effect}))\n"
    )
}

/// Actions over some atoms and numbers.
fn domain(actions: &[String]) -> String {
    format!(
        "(define (domain d) (:predicates (p) (q) (g) (h) (busy))
           (:functions (fuel) (charge) (rate) (temperature) (total-cost)) {})",
        actions.concat()
    )
}

fn problem(init: &str, goal: &str, metric: &str) -> String {
    format!(
        "(define (problem n) (:domain d)
           (:init (= (fuel) 0) (= (charge) 0) (= (rate) 2) (= (temperature) 20) (= (total-cost) 0) {init})
           (:goal (and {goal})) (:metric minimize {metric}))"
    )
}

#[test]
fn as_much_is_charged_as_is_needed() {
    let charge = durative(
        "load",
        "(and (>= ?duration 1) (<= ?duration 10))",
        "(at start (not (busy)))",
        "(at start (busy)) (at end (not (busy))) (at end (increase (charge) (* ?duration (rate))))",
    );
    let drive = durative(
        "drive",
        "(= ?duration 3)",
        "(at start (not (busy))) (at start (>= (charge) 7))",
        "(at start (busy)) (at end (not (busy))) (at start (decrease (charge) 7)) (at end (g))",
    );
    let both = domain(&[charge.clone(), drive.clone()]);
    let time = "(total-time)";
    let lines = ["0: (load) [3.5]", "3.501: (drive) [3]"];
    check("once", &both, &problem("", "(g)", time), (Status::Optimal, Some("6.501"), &lines));
    // Ten is the most at once.
    let far = domain(&[charge, drive.replace('7', "25")]);
    let solution = {
        let (domain, problem) = parse(&far, &problem("", "(g)", time));
        solve(&domain, &problem, &rational(1, 1000), &Limits::none())
    };
    assert_eq!(
        (solution.status, solution.plan.map(|plan| plan.cost.to_string())),
        (Status::Optimal, Some("15.502".into()))
    );
}

#[test]
fn what_is_spent_at_the_start_is_paid_for() {
    // Twice as long as it takes, so much fuel; the tank has 9.
    let burn = durative(
        "burn",
        "(and (>= ?duration 2) (<= ?duration 8))",
        "(at start (>= (fuel) (* 2 ?duration)))",
        "(at start (decrease (fuel) (* 2 ?duration))) (at end (increase (temperature) (* 5 ?duration))) (at end (h))",
    );
    let all = domain(std::slice::from_ref(&burn));
    let goal = |least: &str| {
        problem("(= (fuel) 9)", &format!("(h) (>= (temperature) {least})"), "(total-time)")
            .replace("(= (fuel) 0)", "")
    };
    check("enough", &all, &goal("40"), (Status::Optimal, Some("4"), &["0: (burn) [4]"]));
    check("all", &all, &goal("42.5"), (Status::Optimal, Some("4.5"), &["0: (burn) [4.5]"]));
    let (domain, problem) = parse(&all, &goal("42.6"));
    let solution = solve(&domain, &problem, &rational(1, 1000), &Limits::none());
    assert_eq!((solution.status, solution.plan), (Status::Unsolvable, None));
}

#[test]
fn a_match_burns_as_long_as_it_is_needed_and_no_longer_than_it_can() {
    let light = |most: &str| {
        durative(
            "light",
            &format!("(and (>= ?duration 0.5) (<= ?duration {most}))"),
            "(at start (q))",
            "(at start (not (q))) (at start (p)) (at end (not (p))) (at end (increase (total-cost) (* 3 ?duration)))",
        )
    };
    let mend = |goal: &str| {
        durative(
            &format!("mend{goal}"),
            "(and (>= ?duration 2) (<= ?duration 4))",
            "(at start (not (busy))) (over all (p))",
            &format!("(at start (busy)) (at end (not (busy))) (at end ({goal}))"),
        )
    };
    let all = |most: &str| domain(&[light(most), mend("g"), mend("h")]);
    let task = problem("(q)", "(g) (h)", "(+ (total-time) (total-cost))");
    let lines = ["0: (light) [4.001]", "0: (mendg) [2]", "2.001: (mendh) [2]"];
    check("long", &all("7"), &task, (Status::Optimal, Some("16.004"), &lines));
    check("just", &all("4.001"), &task, (Status::Optimal, Some("16.004"), &lines));
    check("short", &all("4"), &task, (Status::Unsolvable, None, &[]));
}

#[test]
fn bounds_may_be_numbers_that_actions_change() {
    // No longer than the charge lasts, which another action raises.
    let run = durative(
        "run",
        "(and (>= ?duration 1) (<= ?duration (/ (charge) 2)))",
        "(at start (not (h)))",
        "(at start (h)) (at end (increase (temperature) ?duration)) (at end (g))",
    );
    let load = durative(
        "load",
        "(= ?duration 2)",
        "(at start (q))",
        "(at start (not (q))) (at end (increase (charge) 7))",
    );
    let all = domain(&[run, load]);
    let lines = ["0: (load) [2]", "2.001: (run) [3.5]"];
    check(
        "raised",
        &all,
        &problem("(q)", "(g) (>= (temperature) 23.5)", "(total-time)"),
        (Status::Optimal, Some("5.501"), &lines),
    );
    check(
        "not enough",
        &all,
        &problem("(q)", "(g) (>= (temperature) 23.6)", "(total-time)"),
        (Status::Unsolvable, None, &[]),
    );
}

/// A boiler must be warm enough all along, and cools when it is used.
#[test]
fn what_holds_over_all_rests_on_durations() {
    let heat = durative(
        "heat",
        "(and (>= ?duration 1) (<= ?duration 30))",
        "",
        "(at end (increase (temperature) (* 4 ?duration))) (at end (increase (total-cost) ?duration))",
    );
    let draw = durative(
        "draw",
        "(= ?duration 5)",
        "(at start (>= (temperature) 50)) (over all (>= (temperature) 35)) (at end (<= (temperature) 60))",
        "(at start (decrease (temperature) 20)) (at end (g))",
    );
    let all = domain(&[heat, draw]);
    let (domain, problem) = parse(&all, &problem("", "(g)", "(total-cost)"));
    let solution = solve(&domain, &problem, &rational(1, 1000), &Limits::none().with_room(1 << 22));
    // Of a condition over all that several happenings can keep up nothing is claimed.
    let cost = solution.plan.as_ref().map(|plan| plan.cost.to_string());
    assert_eq!((solution.status, cost.as_deref()), (Status::Feasible, Some("8.75")));
}
