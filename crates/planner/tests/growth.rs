//! Costs, times and numbers that exceed their types while actions are executed: nothing may panic, and no
//! false claim may result.

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use metaplan_planner::{
    Config, Exact, GroundConfig, Limits, Solution, Status, Task, ground, ground_concurrent, lexicographic,
    optimize, optimize_concurrent,
};
use num_bigint::BigInt;
use num_rational::BigRational;
use pddl::ast::Direction;
use pddl::{Source, read_objective};

use crate::concurrent::parse;

/// A number close to the limit of 2^118 for numbers of a task. `MANY` times this number overflows
/// 128 bits.
const LARGE: &str = "330000000000000000000000000000000000";
const MANY: usize = 520;

fn task(domain: &str, problem: &str) -> Task {
    let (domain, problem) = parse(domain, problem);
    ground(&domain, &problem, &GroundConfig::default()).unwrap_or_else(|errors| panic!("{errors:?}"))
}

fn solve(task: &Task) -> Solution {
    let limits = Limits::none().with_time(Duration::from_secs(60));
    optimize(task, &Config::default().with_limits(limits), &mut |_| {})
}

/// The cheap plan would need numbers beyond every formula, so the formulas cannot decide whether it exists.
#[test]
fn a_formula_that_cannot_be_built_is_not_tried_for_ever() {
    let domain = "(define (domain d) (:requirements :numeric-fluents) (:predicates (g)) (:functions (x) (y) (total-cost))
      (:action double :parameters () :precondition ()
        :effect (and (scale-up (x) 2) (scale-up (y) 2) (increase (total-cost) 1)))
      (:action cheap :parameters () :precondition (= (x) (y)) :effect (and (g) (increase (total-cost) 1)))
      (:action go :parameters () :precondition () :effect (and (g) (increase (total-cost) 1000))))";
    let problem = "(define (problem p) (:domain d) (:init (= (x) 1) (= (y) 3) (= (total-cost) 0)) (:goal (g))
      (:metric minimize (total-cost)))";
    let started = Instant::now();
    let solution = solve(&task(domain, problem));
    assert!(started.elapsed() < Duration::from_secs(50), "it ended at the limit only");
    let cost = solution.plan.map(|plan| plan.cost.to_string());
    assert_eq!((solution.status, cost.as_deref()), (Status::Feasible, Some("1000")));
}

fn large(times: usize) -> BigRational {
    BigRational::from_integer(LARGE.parse::<BigInt>().expect("a number") * BigInt::from(times))
}

/// A robot must move through `places` places in a row. Each move has the cost effect `cost`.
fn corridor(places: usize, cost: &str, metric: &str) -> Task {
    let domain = format!(
        "(define (domain d) (:requirements :typing :numeric-fluents) (:types place)
          (:predicates (at ?p - place) (next ?p ?q - place)) (:functions (total-cost) (energy))
          (:action move :parameters (?p ?q - place) :precondition (and (at ?p) (next ?p ?q))
            :effect (and (not (at ?p)) (at ?q) {cost})))"
    );
    let mut problem = String::from("(define (problem p) (:domain d) (:objects");
    (0..places).for_each(|place| write!(problem, " p{place}").expect("a string"));
    problem.push_str(" - place) (:init (at p0) (= (total-cost) 0) (= (energy) 0)");
    (1..places).for_each(|place| write!(problem, " (next p{} p{place})", place - 1).expect("a string"));
    write!(problem, ") (:goal (at p{})) {metric})", places - 1).expect("a string");
    task(&domain, &problem)
}

#[test]
fn a_plan_whose_cost_does_not_fit_is_not_called_cheapest_nor_impossible() {
    let task = corridor(MANY, &format!("(increase (total-cost) {LARGE})"), "(:metric minimize (total-cost))");
    let solution = solve(&task);
    assert_eq!((solution.status, solution.proof), (Status::Unknown, None));
}

#[test]
fn rewards_whose_sum_does_not_fit_lead_to_no_claim() {
    let reward = format!("(decrease (total-cost) {LARGE})");
    let solution = solve(&corridor(MANY, &reward, "(:metric minimize (total-cost))"));
    assert_eq!((solution.status, solution.proof), (Status::Unknown, None));
}

#[test]
fn the_metric_of_a_situation_is_exact_however_large_it_is() {
    let cost = format!("(increase (total-cost) {LARGE})");
    let places = 516;
    let task = corridor(places, &cost, &format!("(:metric minimize (+ {LARGE} (total-cost)))"));
    let mut situation = task.start();
    for _ in 1..places {
        let [next] = &task.transitions(&situation).expect("numbers that fit")[..] else { panic!("one way") };
        situation = next.after.clone();
    }
    assert_eq!(task.metric(&situation).to_rational(), large(places));
}

#[test]
fn a_sum_of_operator_costs_may_exceed_128_bits() {
    // Two robots, each with many routes of equal cost to its goal.
    let domain = "(define (domain d) (:requirements :typing :action-costs) (:types place robot)
        (:predicates (at ?r - robot ?p - place) (next ?p ?q - place)) (:functions (total-cost) (cost ?p - place))
        (:action move :parameters (?r - robot ?p ?q - place) :precondition (and (at ?r ?p) (next ?p ?q))
          :effect (and (not (at ?r ?p)) (at ?r ?q) (increase (total-cost) (cost ?p)))))";
    let mut problem = String::from("(define (problem p) (:domain d) (:objects a b - robot hub end");
    (0..MANY).for_each(|place| write!(problem, " p{place}").expect("a string"));
    write!(
        problem,
        " - place) (:init (at a hub) (at b hub) (= (total-cost) 0) (= (cost hub) {LARGE}) (= (cost end) 0)"
    )
    .expect("a string");
    for place in 0..MANY {
        write!(problem, " (next hub p{place}) (next p{place} end) (= (cost p{place}) 1)").expect("a string");
    }
    problem.push_str(") (:goal (and (at a end) (at b end))) (:metric minimize (total-cost)))");
    let solution = solve(&task(domain, &problem));
    assert_eq!(solution.status, Status::Optimal, "{:?}", solution.proof);
    let cost = large(2) + BigRational::from_integer(2.into());
    assert_eq!(solution.plan.expect("a plan").cost.to_rational(), cost);
}

const WORK: &str = "(define (domain d) (:requirements :durative-actions :numeric-fluents :action-costs)
    (:functions (done) (total-cost) (long))
    (:durative-action work :parameters () :duration (= ?duration (long)) :condition (at start (>= (done) 0))
      :effect (and (at end (increase (done) 1)) (at end (increase (total-cost) 1)))))";

fn work(metric: &str) -> String {
    format!(
        "(define (problem p) (:domain d) (:init (= (done) 0) (= (total-cost) 0) (= (long) {LARGE}))
          (:goal (>= (done) {MANY})) (:metric minimize {metric}))"
    )
}

#[test]
fn starts_are_exact_however_late_they_are() {
    let solution = solve(&task(WORK, &work("(total-cost)")));
    assert_eq!(solution.status, Status::Optimal, "{:?}", solution.proof);
    assert_eq!(solution.plan.expect("a plan").makespan().to_rational(), large(MANY));
}

#[test]
fn an_objective_whose_sum_does_not_fit_is_shown_and_not_proved() {
    let (domain, problem) = parse(WORK, &work("(total-cost)"));
    let objective = |text: &str| {
        let source = Source::new("objective", text);
        read_objective(Direction::Minimize, &source, &domain, &problem).expect("an objective")
    };
    let objectives = vec![objective("(total-cost)"), objective("(total-time)")];
    let task = ground(&domain, &problem, &GroundConfig::default().with_objectives(objectives));
    let task = task.expect("a task");
    // On a slow machine, the plan takes longer.
    let points = [10, 100].into_iter().map(|seconds| {
        let limits = Limits::none().with_time(Duration::from_secs(seconds));
        lexicographic(&task, &Config::default().with_limits(limits), &mut |_| {})
    });
    let point = points.into_iter().find(|point| point.solution.plan.is_some()).expect("a plan");
    assert_eq!(point.solution.status, Status::Feasible);
    let values: Vec<_> = point.values.iter().map(Exact::to_rational).collect();
    assert_eq!(values, [BigRational::from_integer(MANY.into()), large(MANY)]);
}

#[test]
fn the_least_number_of_the_type_is_too_large_as_well() {
    // The number grows from 2^112 to 2^124, the greatest admitted number, and then becomes -2^127.
    let domain =
        "(define (domain d) (:requirements :numeric-fluents) (:predicates (a) (b) (c)) (:functions (x))
        (:action grow :parameters () :precondition (a) :effect (and (not (a)) (b) (scale-up (x) 4096)))
        (:action flip :parameters () :precondition (b) :effect (and (not (b)) (c) (scale-up (x) -8))))";
    let problem = "(define (problem p) (:domain d) (:init (a) (= (x) 5192296858534827628530496329220096))
        (:goal (and (c) (<= (x) 0))))";
    let solution = solve(&task(domain, problem));
    assert_eq!((solution.status, solution.proof), (Status::Unknown, None));
}

#[test]
fn a_metric_whose_offset_is_too_large_for_128_bits_is_exact() {
    let domain = "(define (domain d) (:requirements :durative-actions :numeric-fluents) (:predicates (a))
        (:functions (total-cost))
        (:durative-action act :parameters () :duration (= ?duration 1) :condition (and)
          :effect (and (at end (a)) (at end (increase (total-cost) 20000000000000000000000000000000000)))))";
    let problem = format!(
        "(define (problem p) (:domain d) (:init (= (total-cost) 0)) (:goal (a))
          (:metric minimize (+ {LARGE} (+ (* 0.002 (total-time)) (total-cost)))))"
    );
    let (domain, problem) = parse(domain, &problem);
    let separation = BigRational::from_integer(1.into());
    let task = ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation).expect("a task");
    let solution = optimize_concurrent(&task, &Limits::none(), &mut |_| {});
    let cost = solution.plan.as_ref().map(|plan| plan.cost.to_rational());
    let offset: BigInt = LARGE.parse().expect("a number");
    let expected =
        BigRational::from_integer(offset + BigInt::from(20_000_000_000_000_000_000_000_000_000_000_000_i128))
            + BigRational::new(2.into(), 1000.into());
    assert_eq!((solution.status, cost), (Status::Optimal, Some(expected)));
}
