//! Planning with narrow and with wide integers for times, which must give equal answers, and tasks whose times
//! need wide integers.

use std::fmt::Write as _;

use metaplan_planner::{GroundConfig, Limits, Solution, Status, ground_concurrent, optimize_concurrent};
use num_bigint::BigInt;
use num_rational::BigRational;
use pddl::ast::{Domain, Problem};

use crate::concurrent::{parse, rational, written};

/// Times are wide, unless a duration is chosen.
fn wide(limits: &Limits) -> Limits {
    let mut thresholds = *limits.thresholds();
    thresholds.narrow_times = 0;
    limits.clone().with_thresholds(thresholds)
}

/// Plans with the narrowest integers for times, and with wide integers. The answers must be equal.
pub fn solve(domain: &Domain, problem: &Problem, separation: &BigRational, limits: &Limits) -> Solution {
    let plan = |limits: &Limits| {
        let config = GroundConfig::default().with_limits(limits.clone());
        let task = ground_concurrent(domain, problem, &config, separation);
        optimize_concurrent(&task.unwrap_or_else(|errors| panic!("{errors:?}")), limits, &mut |_| {})
    };
    let (narrow, wide) = (plan(limits), plan(&wide(limits)));
    let answer = |solution: &Solution| {
        let bound = solution.lower_bound.as_ref().map(ToString::to_string);
        (solution.status, solution.plan.as_ref().map(written), bound, solution.proof.clone())
    };
    assert_eq!(format!("{:?}", answer(&narrow)), format!("{:?}", answer(&wide)), "{domain:?}\n{problem:?}");
    narrow
}

fn primes() -> impl Iterator<Item = i128> {
    (101_i128..).filter(|number| {
        (2..*number).take_while(|factor| factor * factor <= *number).all(|factor| number % factor > 0)
    })
}

/// The speed of each design is a different prime number.
fn speeds(count: usize) -> (Domain, Problem) {
    let domain = "(define (domain speeds) (:requirements :typing :durative-actions :numeric-fluents)
      (:types place design) (:predicates (at ?p - place)) (:functions (dist ?a ?b - place) (speed ?d - design))
      (:durative-action move :parameters (?d - design ?a ?b - place) :duration (= ?duration (/ (dist ?a ?b) (speed ?d)))
        :condition (at start (at ?a)) :effect (and (at start (not (at ?a))) (at end (at ?b)))))";
    let (mut names, mut speeds) = (String::new(), String::new());
    for prime in primes().take(count) {
        let _ = write!(names, " s{prime}");
        let _ = write!(speeds, " (= (speed s{prime}) {prime})");
    }
    let pairs = ["a b", "a c", "b a", "b c", "c a", "c b"];
    let distances: String = pairs.iter().map(|pair| ["(= (dist ", pair, ") 1000)"].concat()).collect();
    let problem = format!(
        "(define (problem p) (:domain speeds) (:objects a b c - place {names} - design)
          (:init (at a) {distances} {speeds}) (:goal (at c)) (:metric minimize (total-time)))"
    );
    parse(domain, &problem)
}

#[test]
fn many_distinct_speeds_are_planned_exactly() {
    let separation = rational(1, 1000);
    for count in [1, 8, 12, 24, 40] {
        let (domain, problem) = speeds(count);
        let solution = solve(&domain, &problem, &separation, &Limits::none());
        let fastest = primes().nth(count - 1).expect("a prime");
        let plan = solution.plan.expect("a plan");
        assert_eq!((solution.status, plan.cost.to_rational()), (Status::Optimal, rational(1000, fastest)));
    }
}

/// The end of one action must be within the other action, by a margin of one part in 10^80.
#[test]
fn differences_of_a_tiny_fraction_decide() {
    let separation = rational(1, 1000);
    let tiny = BigRational::new(BigInt::from(1), BigInt::from(10).pow(80));
    let status = |longer: &BigRational| {
        let domain = "(define (domain d) (:requirements :durative-actions :numeric-fluents)
          (:predicates (fresh) (lit) (g)) (:functions (burns) (works))
          (:durative-action light :parameters () :duration (= ?duration (burns)) :condition (at start (fresh))
            :effect (and (at start (not (fresh))) (at start (lit)) (at end (not (lit)))))
          (:durative-action work :parameters () :duration (= ?duration (works)) :condition (and (at start (lit)) (at end (lit)))
            :effect (at end (g))))";
        let decimals = |number: &BigRational| {
            let digits = (number * BigRational::from_integer(BigInt::from(10).pow(80))).to_integer();
            let digits = format!("{digits:0>81}");
            format!("{}.{}", &digits[..digits.len() - 80], &digits[digits.len() - 80..])
        };
        let (works, burns) = (rational(1, 1), rational(1002, 1000) + longer);
        let problem = format!(
            "(define (problem p) (:domain d) (:init (fresh) (= (burns) {}) (= (works) {})) (:goal (g)) (:metric minimize (total-time)))",
            decimals(&burns),
            decimals(&works),
        );
        let (domain, problem) = parse(domain, &problem);
        solve(&domain, &problem, &separation, &Limits::none()).status
    };
    // `work` starts one separation after the start of `light`, and `light` ends one separation
    // after the end of `work`.
    assert_eq!(status(&BigRational::from_integer(0.into())), Status::Optimal);
    assert_eq!(status(&tiny), Status::Optimal);
    assert_eq!(status(&-tiny), Status::Unsolvable);
}
