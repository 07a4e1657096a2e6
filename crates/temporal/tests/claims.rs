//! Tasks with a plan that is valid by definition and that a search could overlook. The search must not claim that
//! no plan exists, or that a worse plan is optimal.

use std::time::Duration;

use num_bigint::BigInt;
use num_rational::BigRational;
use pddl::validate::{Options, PlanText, validate};
use pddl::{Source, ast};
use task::ground::GroundConfig;
use task::limits::Limits;
use task::plan::solution::{Solution, Status};

use metaplan_temporal::{ground_concurrent, optimize_concurrent};

fn read(domain: &str, problem: &str) -> (ast::Domain, ast::Problem) {
    let read = pddl::read(&Source::new("domain", domain), &Source::new("problem", problem));
    let (domain, problem, _) = read.unwrap_or_else(|errors| panic!("{errors:?}\n{domain}\n{problem}"));
    (domain, problem)
}

/// Distance between interfering happenings: 1/1000.
fn separation() -> BigRational {
    BigRational::new(BigInt::from(1), BigInt::from(1000))
}

/// Metric of a plan, or the violation that makes it invalid.
fn metric(domain: &ast::Domain, problem: &ast::Problem, plan: &str) -> Result<BigRational, String> {
    let parsed = PlanText::parse(&Source::new("plan", plan)).expect("a plan");
    let options = Options::default().with_concurrent(true).with_tolerance(separation());
    let verdict = validate(domain, problem, &parsed, &options);
    match verdict.violation {
        None => Ok(verdict.metric.unwrap_or(verdict.total_time)),
        Some(violation) => Err(violation.message),
    }
}

fn solve(domain: &ast::Domain, problem: &ast::Problem) -> Solution {
    let limits = Limits::none().with_time(Duration::from_secs(60));
    let config = GroundConfig::default().with_limits(limits.clone());
    let task = ground_concurrent(domain, problem, &config, &separation())
        .unwrap_or_else(|errors| panic!("{errors:?}"));
    optimize_concurrent(&task, &limits, &mut |_| {})
}

fn written(solution: &Solution) -> Option<String> {
    let steps = solution.plan.as_ref()?.steps.iter();
    let line = |words: String, start: String, duration: String| format!("{start}: ({words}) [{duration}]\n");
    let words =
        |action: &String, arguments: &[String]| [std::slice::from_ref(action), arguments].concat().join(" ");
    let lines = steps.map(|step| {
        line(words(&step.action, &step.arguments), step.start.to_string(), step.duration.to_string())
    });
    Some(lines.collect())
}

/// Checks that the validator accepts `witness` and that the solution does not contradict it. Returns the status
/// and the metric of the plan.
fn solved(domain: &str, problem: &str, witness: &str) -> (Status, Option<String>) {
    let (parsed_domain, parsed_problem) = read(domain, problem);
    let value = metric(&parsed_domain, &parsed_problem, witness);
    let value = value.unwrap_or_else(|why| panic!("the witness is invalid: {why}\n{domain}\n{problem}"));
    let solution = solve(&parsed_domain, &parsed_problem);
    assert_ne!(solution.status, Status::Unsolvable, "{domain}\n{problem}");
    let plan = written(&solution);
    if let Some(plan) = &plan {
        let least = metric(&parsed_domain, &parsed_problem, plan);
        let least = least.unwrap_or_else(|why| panic!("{why}\n{plan}\n{domain}\n{problem}"));
        assert!(solution.status != Status::Optimal || least <= value, "{plan}\n{domain}\n{problem}");
    }
    (solution.status, solution.plan.map(|plan| plan.cost.to_string()))
}

fn durative(name: &str, duration: &str, condition: &str, effect: &str) -> String {
    format!(
        "(:durative-action {name} :parameters () :duration {duration}
           :condition (and {condition}) :effect (and {effect}))\n"
    )
}

fn domain(predicates: &str, functions: &str, actions: &[String]) -> String {
    format!(
        "(define (domain d) (:predicates {predicates}) (:functions {functions} (total-cost))\n{})",
        actions.concat()
    )
}

fn problem(init: &str, goal: &str, metric: &str) -> String {
    format!(
        "(define (problem n) (:domain d) (:init (= (total-cost) 0) {init}) (:goal (and {goal}))
           (:metric minimize {metric}))"
    )
}

const FROM_1_TO_5: &str = "(and (>= ?duration 1) (<= ?duration 5))";

fn optimal(metric: &str) -> (Status, Option<String>) {
    (Status::Optimal, Some(metric.into()))
}

/// Each end deletes the condition over all of the other action, so the ends are simultaneous.
#[test]
fn chosen_durations_let_actions_end_together() {
    let action = |name: &str, held: &str, changed: &str| {
        durative(
            name,
            FROM_1_TO_5,
            &format!("(at start (r{name})) (over all ({held}))"),
            &format!("(at start (not (r{name}))) (at end (not ({changed}))) (at end (d{name}))"),
        )
    };
    let pair = [action("a", "p", "q"), action("x", "q", "p")];
    let predicates = "(p) (q) (ra) (rx) (da) (dx)";
    let init = "(p) (q) (ra) (rx)";
    let both = problem(init, "(da) (dx)", "(total-time)");
    let witness = "0: (a) [1]\n0: (x) [1]\n";
    assert_eq!(solved(&domain(predicates, "", &pair), &both, witness), optimal("1"));
    // A detour makes the goal reachable at a higher cost.
    let detour = "(:action detour :parameters () :precondition (da)
       :effect (and (dx) (increase (total-cost) 9)))";
    let with_detour = domain(predicates, "", &[&pair[..], &[detour.into()]].concat());
    let costs = problem(init, "(da) (dx)", "(+ (total-time) (total-cost))");
    assert_eq!(solved(&with_detour, &costs, witness), optimal("1"));
    // The minimum durations differ, so the search must choose equal ones.
    let longer = [pair[0].clone(), pair[1].replace("?duration 1", "?duration 3")];
    let witness = "0: (a) [3]\n0: (x) [3]\n";
    assert_eq!(solved(&domain(predicates, "", &longer), &both, witness), optimal("3"));
    let staggered = [
        pair[0].clone(),
        pair[1].replace("?duration 5", "?duration 9").replace("?duration 1", "?duration 6"),
    ];
    // `a` can start later than `x`, so different durations suffice.
    let witness = "5: (a) [1]\n0: (x) [6]\n";
    assert_eq!(solved(&domain(predicates, "", &staggered), &both, witness), optimal("6"));
}

/// Each start adds the condition over all of the other action.
#[test]
fn chosen_durations_let_actions_start_together() {
    let action = |name: &str, held: &str, changed: &str| {
        durative(
            name,
            FROM_1_TO_5,
            &format!("(over all ({held}))"),
            &format!("(at start ({changed})) (at end (not ({changed}))) (at end (d{name}))"),
        )
    };
    let pair = [action("a", "p", "q"), action("x", "q", "p")];
    let both = problem("", "(da) (dx)", "(total-time)");
    let witness = "0: (a) [1]\n0: (x) [1]\n";
    assert_eq!(solved(&domain("(p) (q) (da) (dx)", "", &pair), &both, witness), optimal("1"));
}

/// Two runs of one action both end by deleting their condition over all.
#[test]
fn chosen_durations_let_runs_of_an_action_end_together() {
    let action = durative(
        "a",
        "(and (>= ?duration 1) (<= ?duration (limit)))",
        "(over all (p))",
        "(at end (not (p))) (at end (increase (count) 1))",
    );
    let twice = problem("(p) (= (count) 0) (= (limit) 5)", "(>= (count) 2)", "(total-time)");
    let witness = "0: (a) [1]\n0: (a) [1]\n";
    let (status, cost) = solved(&domain("(p)", "(count) (limit)", &[action]), &twice, witness);
    assert!(status != Status::Optimal || cost.as_deref() == Some("1"), "{cost:?}");
}

/// The start changes the fluent that its duration reads.
fn work(condition: &str, effect: &str) -> String {
    durative(
        "work",
        "(= ?duration (need))",
        &format!("(at start (ready)) {condition}"),
        &format!("(at start (not (ready))) (at start (assign (need) 1)) (at end (done)) {effect}"),
    )
}

#[test]
fn the_duration_is_read_at_the_start() {
    let ready = |goal: &str| problem("(ready) (= (need) 5) (= (x) 0) (= (y) 0)", goal, "(total-time)");
    let with = |action: String| domain("(ready) (done)", "(need) (x) (y)", &[action]);
    let witness = "0: (work) [5]\n";
    let done = ready("(done)");
    for condition in [
        "(at end (>= ?duration 3))",
        "(over all (>= ?duration 3))",
        "(at end (or (>= (x) 3) (>= ?duration 3)))",
        "(at end (<= (need) 2))",
        "(over all (<= (need) 2))",
    ] {
        assert_eq!(solved(&with(work(condition, "")), &done, witness), optimal("5"), "{condition}");
    }
    let conditional = "(at end (when (>= ?duration 3) (increase (x) 1)))";
    let (status, _) = solved(&with(work("", conditional)), &ready("(done) (>= (x) 1)"), witness);
    assert!(matches!(status, Status::Optimal | Status::Feasible), "{status:?}");
}

/// A fluent at the end has the value at the end, even if it was also the duration.
#[test]
fn only_the_duration_is_read_at_the_start() {
    let ready = |goal: &str| problem("(ready) (= (need) 5) (= (x) 0) (= (y) 0)", goal, "(total-time)");
    let effect = "(at end (increase (x) ?duration)) (at end (increase (y) (need)))";
    let task = domain("(ready) (done)", "(need) (x) (y)", &[work("", effect)]);
    let witness = "0: (work) [5]\n";
    assert_eq!(solved(&task, &ready("(done) (<= (y) 2) (>= (x) 5)"), witness), optimal("5"));
}

/// A duration of 0 makes start and end one happening, which reads the state before.
#[test]
fn a_duration_of_0_that_depends_on_the_state() {
    let end = "(at end (<= ?duration 0)) (at end (>= (need) 0))";
    let action =
        durative("work", "(= ?duration (need))", &format!("(at start (ready)) {end}"), "(at end (done))");
    let task = domain(
        "(ready) (done)",
        "(need)",
        &[action, "(:action reset :parameters () :effect (assign (need) 0))".into()],
    );
    let ready = problem("(ready) (= (need) 5)", "(done)", "(total-time)");
    assert_eq!(solved(&task, &ready, "0: (reset) [0]\n0.001: (work) [0]\n"), optimal("0.001"));
}

#[test]
fn a_chosen_duration_may_be_0() {
    let act = |duration: &str| {
        let action = durative("act", duration, "(at start (a)) (over all (z))", "(at end (g))");
        domain("(a) (z) (g)", "", &[action])
    };
    let goal = problem("(a)", "(g)", "(total-time)");
    for duration in ["(<= ?duration 10)", "(and (>= ?duration 0) (<= ?duration 10))", "(and)"] {
        let (status, cost) = solved(&act(duration), &goal, "0: (act) [0]\n");
        assert_eq!(cost.as_deref(), Some("0"), "{duration}");
        assert!(matches!(status, Status::Optimal | Status::Feasible), "{status:?}");
    }
    let (domain, problem) = read(&act("(and (>= ?duration 1) (<= ?duration 10))"), &goal);
    assert_eq!(solve(&domain, &problem).status, Status::Unsolvable);
}

/// At duration 0, an action cannot change what its end reads.
#[test]
fn start_and_end_of_a_chosen_duration_of_0_must_not_interfere() {
    let act = durative("act", "(<= ?duration 10)", "(at end (p))", "(at start (p)) (at end (g))");
    let goal = problem("(p)", "(g)", "(total-time)");
    let (status, cost) = solved(&domain("(p) (g)", "", &[act]), &goal, "0: (act) [0.001]\n");
    assert_eq!(cost.as_deref(), Some("0.001"), "{status:?}");
}

/// At duration 0, the start and the end cannot both set a number. Longer durations are possible.
#[test]
fn start_and_end_may_set_one_number() {
    for (start, end) in [
        ("(assign (x) 1)", "(increase (x) ?duration)"),
        ("(assign (x) (y))", "(assign (x) (+ (y) ?duration))"),
    ] {
        let effect = format!("(at start (not (r))) (at start {start}) (at end {end}) (at end (g))");
        let act = durative("act", "(<= ?duration 10)", "(at start (r))", &effect);
        let goal = problem("(r) (= (x) 0) (= (y) 1)", "(g) (>= (x) 4)", "(total-time)");
        let (_, cost) = solved(&domain("(r) (g)", "(x) (y)", &[act]), &goal, "0: (act) [3]\n");
        assert_eq!(cost.as_deref(), Some("3"));
    }
}

/// An effect of duration 0 is an effect with the duration 0.
#[test]
fn the_effects_of_a_chosen_duration_of_0_read_0() {
    let effect = "(at end (increase (x) (+ ?duration 1))) (at end (g))";
    let act = durative("act", "(<= ?duration 10)", "(over all (z))", effect);
    let goal = |goal: &str| problem("(= (x) 0)", goal, "(total-time)");
    let task = domain("(z) (g)", "(x)", &[act]);
    let (_, cost) = solved(&task, &goal("(g) (<= (x) 1) (>= (x) 1)"), "0: (act) [0]\n");
    assert_eq!(cost.as_deref(), Some("0"));
}

/// Preferences require the shortest durations, and the plan needs a longer one.
#[test]
fn the_shortest_duration_need_not_be_best() {
    let long = |duration: &str| {
        let a = durative("a", duration, "(at end (p))", "(at start (r)) (at end (g))");
        let b = "(:action b :parameters () :precondition (r) :effect (p))";
        domain("(p) (r) (g)", "", &[a, b.into()])
    };
    let preferred = "(define (problem n) (:domain d) (:init (= (total-cost) 0)) (:goal (g))
       (:constraints (preference n (sometime (p)))) (:metric minimize (is-violated n)))";
    let witness = "0: (a) [1]\n0.5: (b)\n";
    let (status, _) = solved(&long("(and (>= ?duration 0) (<= ?duration 10))"), preferred, witness);
    assert_ne!(status, Status::Optimal);
    let number = "(and (>= ?duration (least)) (<= ?duration 10))";
    let task = long(number).replace("(:functions", "(:functions (least)");
    let preferred = preferred.replace("(:init", "(:init (= (least) 0)");
    let (status, _) = solved(&task, &preferred, witness);
    assert_ne!(status, Status::Optimal);
}

/// Overlapping runs of one action have different durations. Both last until the limit rises, so both have to reach it.
#[test]
fn overlapping_runs_compare_their_own_durations() {
    let action = durative(
        "a",
        FROM_1_TO_5,
        "(at start (>= (tickets) 1)) (over all (>= ?duration (limit))) (at end (changed))",
        "(at start (decrease (tickets) 1)) (at end (increase (x) ?duration)) (at end (increase (count) 1))",
    );
    let change = durative(
        "change",
        "(= ?duration 1)",
        "(at start (ready))",
        "(at start (not (ready))) (at end (increase (limit) 3)) (at end (changed))",
    );
    let task = domain("(ready) (changed)", "(limit) (x) (count) (tickets)", &[action, change]);
    let init = "(ready) (= (limit) 0) (= (x) 0) (= (count) 0) (= (tickets) 2)";
    let goal = problem(init, "(changed) (>= (count) 2)", "(+ (total-time) (x))");
    let (_, cost) = solved(&task, &goal, "0: (a) [3]\n0.001: (a) [3]\n0: (change) [1]\n");
    assert_eq!(cost.as_deref(), Some("9.001"));
}
