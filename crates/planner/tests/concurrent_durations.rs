//! Durations that the planner chooses: tasks with known optima, and random tasks. On the latter, the
//! validator executes all plans over a grid of times and durations. None of them may be better than the
//! planner's plan or contradict a claim of unsolvability.

use std::fmt::Write as _;
use std::time::Duration;

use metaplan_planner::{GroundConfig, Limits, Solution, Status, ground_concurrent, optimize_concurrent};
use num_rational::BigRational;
use pddl::ast::{Domain, Problem};
use testing::random::Random;

use crate::concurrent::{metric, parse, rational, written};
use crate::tally::with_enough_time;

/// Plans with chosen durations. The validator checks the plan and its metric.
pub fn solve(domain: &Domain, problem: &Problem, separation: &BigRational, limits: &Limits) -> Solution {
    let config = GroundConfig::default().with_limits(limits.clone());
    let task =
        ground_concurrent(domain, problem, &config, separation).unwrap_or_else(|errors| panic!("{errors:?}"));
    let solution = optimize_concurrent(&task, limits, &mut |_| {});
    if let Some(plan) = &solution.plan {
        let text = written(plan);
        let value = metric(domain, problem, &text, separation).unwrap_or_else(|why| panic!("{why}\n{text}"));
        assert_eq!(value, plan.cost.to_rational(), "{text}");
    }
    solution
}

/// Checks status, metric and steps of the solution, with a separation of 1/1000.
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
    // A single run charges at most 20 units (10 units of time at rate 2), so two runs are needed.
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

/// Auxiliary fluents that hold durations must not be confused with fluents of the domain.
#[test]
fn a_function_may_be_called_duration() {
    for (function, objects) in [("duration ?a ?b", "of b"), ("chosen ?a ?b ?c", "duration of b")] {
        let (name, _) = function.split_once(' ').unwrap();
        let fluent = format!("({name} {objects})");
        let domain = format!(
            "(define (domain d) (:constants {objects}) (:predicates (g)) (:functions ({function}))
               (:durative-action work :parameters () :duration (= ?duration 5) :condition (and)
                 :effect (and (at start (increase {fluent} 1)) (at end (g)))))"
        );
        let problem = format!(
            "(define (problem n) (:domain d) (:init (= {fluent} 0))
               (:goal (and (g) (>= {fluent} 1))) (:metric minimize (total-time)))"
        );
        check(name, &domain, &problem, (Status::Optimal, Some("5"), &["0: (work) [5]"]));
    }
}

#[test]
fn consumption_at_the_start_counts() {
    // The fuel consumption is twice the duration; the tank has 9.
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
    let twice = ["0: (burn) [2]", "0.001: (burn) [2]"];
    check("enough for two at once", &all, &goal("40"), (Status::Optimal, Some("2.001"), &twice));
    let once = domain(&[burn
        .replace("(at start (>=", "(at start (q)) (at start (>=")
        .replace("(at start (decrease", "(at start (not (q))) (at start (decrease")]);
    let goal_of_one = |least: &str| goal(least).replace("(= (fuel) 9)", "(= (fuel) 9) (q)");
    check("enough", &once, &goal_of_one("40"), (Status::Optimal, Some("4"), &["0: (burn) [4]"]));
    check("all", &once, &goal_of_one("42.5"), (Status::Optimal, Some("4.5"), &["0: (burn) [4.5]"]));
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
    // The duration is bounded by the charge, which another action increases.
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

/// Plans are written with decimals and must be valid as written.
#[test]
fn durations_are_decimals() {
    let load = durative(
        "load",
        "(and (>= ?duration 1) (<= ?duration 10))",
        "(at start (q))",
        "(at start (not (q))) (at end (increase (charge) (* 1.5 ?duration))) (at end (g))",
    );
    let all = domain(&[load]);
    let (domain, problem) = parse(&all, &problem("(q)", "(g) (>= (charge) 5)", "(total-time)"));
    let solution = solve(&domain, &problem, &rational(1, 1000), &Limits::none());
    let plan = solution.plan.expect("a plan");
    // The optimum would be 10/3. Plans are written in decimals and rounded up, so optimality is not claimed.
    assert_eq!((solution.status, plan.cost.to_string()), (Status::Feasible, "3.333334".to_owned()));
    assert_eq!(solution.lower_bound.map(|bound| bound.to_string()), Some("10/3".to_owned()));
}

#[test]
fn more_than_a_number_is_a_little_more() {
    let load = durative(
        "load",
        "(and (> ?duration 2) (< ?duration 3))",
        "(at start (q))",
        "(at start (not (q))) (at end (increase (charge) ?duration)) (at end (g))",
    );
    let all = domain(&[load]);
    let goal =
        |most: &str| problem("(q)", &format!("(g) (> (charge) 2.5) (< (charge) {most})"), "(total-time)");
    check("between", &all, &goal("3"), (Status::Feasible, Some("2.500001"), &["0: (load) [2.500001]"]));
    let (domain, problem) = parse(&all, &goal("2.5"));
    let limits = Limits::none().with_room(1 << 20);
    assert_eq!(solve(&domain, &problem, &rational(1, 1000), &limits).status, Status::Unknown);
}

/// The search for chosen durations does not count violated preferences, so they are refused instead of ignored.
#[test]
fn preferences_with_durations_in_effects_are_refused() {
    let domain =
        "(define (domain d) (:requirements :fluents :durative-actions :duration-inequalities :preferences)
      (:predicates (p) (g)) (:functions (n))
      (:durative-action a :parameters () :duration (and (>= ?duration 1) (<= ?duration 3))
        :condition (at start (p)) :effect (at end (and (g) (decrease (n) ?duration)))))";
    let separation = rational(1, 1000);
    for (goal, constraints, is_refused) in [
        ("(and (g) (preference w (not (p))))", "", true),
        ("(g)", "(:constraints (preference w (sometime (not (p)))))", true),
        ("(g)", "(:constraints (preference w (within 1 (g))))", true),
        ("(g)", "(:constraints (sometime (not (g))))", false),
    ] {
        let metric = if is_refused { "(+ (total-time) (is-violated w))" } else { "(total-time)" };
        let problem = format!(
            "(define (problem p) (:domain d) (:init (p) (= (n) 0)) (:goal {goal}) {constraints}
              (:metric minimize {metric}))"
        );
        let (domain, problem) = parse(domain, &problem);
        let task = ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation);
        assert_eq!(task.is_err(), is_refused, "{goal} {constraints}: {:?}", task.err());
    }
}

/// The planner does not consider durations between 0 and the separation. If they are allowed, it claims no optimality.
#[test]
fn no_positive_duration_is_below_the_separation() {
    for (bounds, status, cost, plan) in [
        ("(>= ?duration 0.001)", Status::Optimal, "0.001", "0: (a) [0.001]"),
        ("(>= ?duration 0.0001)", Status::Feasible, "0.001", "0: (a) [0.001]"),
        ("(>= ?duration 0)", Status::Feasible, "0", "0: (a) [0]"),
        ("()", Status::Feasible, "0", "0: (a) [0]"),
    ] {
        let all = domain(&[durative("a", bounds, "(at start (q))", "(at start (not (q))) (at end (g))")]);
        check(bounds, &all, &problem("(q)", "(g)", "(total-time)"), (status, Some(cost), &[plan]));
    }
}

/// A boiler must stay warm enough throughout, and cools when it is used.
#[test]
fn conditions_over_all_may_depend_on_durations() {
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
    // If several happenings can maintain an over-all condition, the planner claims nothing.
    let cost = solution.plan.as_ref().map(|plan| plan.cost.to_string());
    assert_eq!((solution.status, cost.as_deref()), (Status::Feasible, Some("8.75")));
}

fn literal(random: &mut Random) -> String {
    let atom = ["(p)", "(q)", "(h)"][random.below(3) as usize];
    if random.below(3) == 0 { format!("(not {atom})") } else { atom.to_owned() }
}

fn condition(random: &mut Random) -> String {
    match random.below(6) {
        0 => format!("(<= (fuel) {})", 1 + random.below(3)),
        1 | 2 => format!("(>= (fuel) {})", 1 + random.below(4)),
        _ => literal(random),
    }
}

fn effect(random: &mut Random, is_durative: bool) -> String {
    match random.below(9) {
        0 | 1 if is_durative => format!("(increase (fuel) (* {} ?duration))", 1 + random.below(3)),
        2 if is_durative => "(decrease (fuel) ?duration)".to_owned(),
        3 if is_durative => "(assign (charge) (- 4 ?duration))".to_owned(),
        4 => format!("(decrease (fuel) {})", 1 + random.below(2)),
        5 => format!("(increase (charge) {})", 1 + random.below(2)),
        _ => literal(random),
    }
}

fn timed(random: &mut Random, times: &[&str], part: &mut dyn FnMut(&mut Random) -> String) -> String {
    let count = 1 + random.below(2);
    let parts = (0..count).map(|_| {
        let time = times[random.below(times.len() as u64) as usize];
        format!("({time} {})", part(random))
    });
    parts.collect::<Vec<_>>().join(" ")
}

/// Three actions with their possible durations; the list is empty for an instantaneous action.
fn sample(random: &mut Random) -> (String, String, [Vec<i128>; 3]) {
    let mut durations = [const { Vec::new() }; 3];
    let mut actions = Vec::new();
    for (index, allowed) in durations.iter_mut().enumerate() {
        if index == 2 && random.below(2) == 0 {
            actions.push(format!(
                "(:action a{index} :parameters () :precondition (and {})
                   :effect (and {} {} (increase (total-cost) 2)))",
                condition(random),
                effect(random, false),
                literal(random)
            ));
            continue;
        }
        let least = i128::from(1 + random.below(2));
        let most = least + i128::from(random.below(3));
        *allowed = (least..=most).collect();
        let upper = if random.below(4) == 0 { "(+ (charge) 1)".to_owned() } else { most.to_string() };
        let bounds = format!("(and (>= ?duration {least}) (<= ?duration {upper}))");
        if upper.contains("charge") {
            *allowed = (least..=4).collect();
        }
        let conditions = timed(random, &["at start", "over all", "at end"], &mut condition);
        let times = ["at start", "at end"];
        let effects = timed(random, &times, &mut |random| effect(random, true));
        let more = timed(random, &times, &mut literal);
        let cost = ["2", "?duration", "(* 2 ?duration)"][random.below(3) as usize];
        let effects = format!("{effects} {more} (at end (increase (total-cost) {cost}))");
        actions.push(durative(&format!("a{index}"), &bounds, &conditions, &effects));
    }
    let mut init = format!("(= (fuel) {})", random.below(3));
    for atom in ["(p)", "(q)", "(h)"] {
        if random.below(2) == 0 {
            let _ = write!(init, " {atom}");
        }
    }
    if random.below(4) == 0 {
        let _ = write!(init, " (at {} {})", 1 + random.below(4), literal(random));
    }
    let goal = format!("{} {} {}", literal(random), condition(random), condition(random));
    let metric = ["(total-time)", "(+ (total-time) (total-cost))"][random.below(2) as usize];
    let problem = problem(&init, &goal, metric).replacen("(= (fuel) 0)", "", 1);
    (domain(&actions), problem, durations)
}

const LAST: i128 = 4;

/// Returns the best metric over all plans with up to three actions that start no later than [`LAST`]. Starts
/// and durations are multiples of the separation.
fn brute_force(durations: &[Vec<i128>; 3], domain: &Domain, problem: &Problem) -> Option<BigRational> {
    let separation = rational(1, 1);
    let mut best: Option<BigRational> = None;
    let mut open: Vec<Vec<(i128, usize, i128)>> = vec![Vec::new()];
    while let Some(plan) = open.pop() {
        let mut text = String::new();
        for (start, action, duration) in &plan {
            let _ = writeln!(text, "{start}: (a{action}) [{duration}]");
        }
        if let Ok(value) = metric(domain, problem, &text, &separation)
            && best.as_ref().is_none_or(|best| value < *best)
        {
            best = Some(value);
        }
        if plan.len() == 3 {
            continue;
        }
        let last = plan.last().copied().unwrap_or((0, 0, 0));
        for start in last.0..=LAST {
            for (action, allowed) in durations.iter().enumerate() {
                let instant = if allowed.is_empty() { &[0][..] } else { &[] };
                for duration in allowed.iter().chain(instant) {
                    if (start, action, *duration) >= last {
                        open.push([&plan[..], &[(start, action, *duration)]].concat());
                    }
                }
            }
        }
    }
    best
}

/// Compares the planner with brute force. Returns `true` if the planner decided the task.
fn agree(seed: u64, time: Duration) -> bool {
    let (domain, problem, durations) = sample(&mut Random(seed));
    let (read_domain, read_problem) = parse(&domain, &problem);
    let limits = Limits::none().with_time(time).with_room(1 << 24);
    let solution = solve(&read_domain, &read_problem, &rational(1, 1), &limits);
    if solution.status == Status::Unknown {
        return false;
    }
    let expected = brute_force(&durations, &read_domain, &read_problem);
    let found = solution.plan.as_ref().map(|plan| plan.cost.to_rational());
    let context = || format!("seed {seed}: {found:?}, {expected:?}\n{domain}\n{problem}");
    let bound = solution.lower_bound.as_ref().map(metaplan_planner::Exact::to_rational);
    if let (Some(bound), Some(expected)) = (bound, &expected) {
        assert!(bound <= *expected, "{}", context());
    }
    match solution.status {
        Status::Unsolvable => assert_eq!(expected, None, "{}", context()),
        Status::Optimal => {
            assert!(expected.as_ref().is_none_or(|best| found.as_ref() <= Some(best)), "{}", context());
        }
        _ => return false,
    }
    true
}

fn all_agree(seeds: std::ops::Range<u64>, at_least: usize) {
    with_enough_time(Duration::from_secs(1), |time| {
        let decided = seeds.clone().filter(|seed| agree(*seed, time)).count();
        if decided >= at_least { Ok(()) } else { Err(format!("{decided} decided")) }
    });
}

#[test]
fn no_plan_on_a_grid_is_better() {
    all_agree(0..60, 20);
}

#[test]
#[ignore = "half an hour"]
fn no_plan_on_a_grid_is_better_on_many() {
    let from = std::env::var("FROM").ok().and_then(|text| text.parse().ok()).unwrap_or(1_000);
    all_agree(from..from + 1_000, 300);
}
