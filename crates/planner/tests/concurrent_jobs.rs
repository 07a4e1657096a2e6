//! Several robots at once: makespans compared with longest-job-first and with brute force, and lower
//! bounds that no plan beats.
//!
//! Robots start at a base, drive for 5 to a place and work there; the duration depends on the
//! place. An independent oracle assigns the longest job to the robot with the smallest load. The
//! smallest tasks are solved by brute force over all assignments.

use std::fmt::Write as _;
use std::sync::atomic::Ordering;
use std::time::Duration;

use metaplan_planner::{GroundConfig, Limits, Solution, Status, ground_concurrent, optimize_concurrent};
use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::ToPrimitive as _;
use testing::random::Random;

use crate::concurrent::{metric, parse, rational, written};

const DRIVE: i64 = 5;

pub(crate) const DOMAIN: &str = "(define (domain jobs) (:requirements :typing :durative-actions :numeric-fluents)
  (:types robot place) (:predicates (at ?r - robot ?p - place) (free ?r - robot) (done ?p - place))
  (:functions (length ?p - place))
  (:durative-action drive :parameters (?r - robot ?a ?b - place) :duration (= ?duration 5)
    :condition (and (at start (at ?r ?a)) (at start (free ?r)))
    :effect (and (at start (not (at ?r ?a))) (at start (not (free ?r))) (at end (at ?r ?b)) (at end (free ?r))))
  (:durative-action work :parameters (?r - robot ?p - place) :duration (= ?duration (length ?p))
    :condition (and (at start (free ?r)) (over all (at ?r ?p)))
    :effect (and (at start (not (free ?r))) (at end (free ?r)) (at end (done ?p)))))";

pub(crate) fn problem(robots: usize, lengths: &[i64]) -> String {
    let mut text = String::from("(define (problem p) (:domain jobs) (:objects");
    for robot in 0..robots {
        let _ = write!(text, " r{robot}");
    }
    text += " - robot base";
    for place in 0..lengths.len() {
        let _ = write!(text, " p{place}");
    }
    text += " - place) (:init (= (length base) 1)";
    for robot in 0..robots {
        let _ = write!(text, " (at r{robot} base) (free r{robot})");
    }
    for (place, length) in lengths.iter().enumerate() {
        let _ = write!(text, " (= (length p{place}) {length})");
    }
    text += ") (:goal (and";
    for place in 0..lengths.len() {
        let _ = write!(text, " (done p{place})");
    }
    text + ")) (:metric minimize (total-time)))"
}

fn lengths(jobs: usize, seed: u64) -> Vec<i64> {
    let mut random = Random(seed);
    (0..jobs).map(|_| 10 + random.below(31)).collect()
}

/// Returns the makespan of an assignment of jobs to robots, in thousandths, with a thousandth
/// between two actions of a robot.
fn makespan(robots: usize, lengths: &[i64], assignment: impl Iterator<Item = usize>) -> i64 {
    let mut loads = vec![0; robots];
    for (length, robot) in lengths.iter().zip(assignment) {
        loads[robot] += 1000 * (length + DRIVE) + 2;
    }
    loads.into_iter().max().unwrap_or(0) - 1
}

fn longest_job_first(robots: usize, lengths: &[i64]) -> i64 {
    let mut order: Vec<usize> = (0..lengths.len()).collect();
    order.sort_by_key(|job| std::cmp::Reverse(lengths[*job]));
    let mut loads = vec![0; robots];
    let mut assignment = vec![0; lengths.len()];
    for job in order {
        let robot = (0..robots).min_by_key(|robot| loads[*robot]).expect("a robot");
        loads[robot] += lengths[job] + DRIVE;
        assignment[job] = robot;
    }
    makespan(robots, lengths, assignment.into_iter())
}

fn optimum(robots: usize, lengths: &[i64]) -> i64 {
    let count = robots.pow(u32::try_from(lengths.len()).expect("few jobs"));
    let digits = |code: usize| (0..lengths.len()).map(move |job| code / robots.pow(job as u32) % robots);
    (0..count).map(|code| makespan(robots, lengths, digits(code))).min().expect("an assignment")
}

fn thousandths(value: &BigRational) -> i64 {
    (value * BigRational::from(BigInt::from(1000))).ceil().to_integer().to_i64().expect("small")
}

/// Plans until the makespan is at most `target` thousandths, it is proved optimal, or ten minutes
/// are over. The validator executes the plan. Also returns its makespan.
fn solve(robots: usize, lengths: &[i64], target: i64) -> (Solution, i64) {
    let (domain, problem) = parse(DOMAIN, &problem(robots, lengths));
    let separation = rational(1, 1000);
    let limits = Limits::none().with_time(Duration::from_secs(600));
    let task = ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation).expect("a task");
    let interrupt = limits.interrupt();
    let solution = optimize_concurrent(&task, &limits, &mut |improvement| {
        if thousandths(&improvement.cost.to_rational()) <= target {
            interrupt.store(true, Ordering::Relaxed);
        }
    });
    let text = written(solution.plan.as_ref().expect("a plan"));
    let value = metric(&domain, &problem, &text, &separation).unwrap_or_else(|why| panic!("{why}\n{text}"));
    (solution, thousandths(&value))
}

fn check(robots: usize, lengths: &[i64]) {
    let target = longest_job_first(robots, lengths);
    let (solution, makespan) = solve(robots, lengths, target);
    assert!(makespan <= target, "{robots} {lengths:?}: {makespan} > {target}");
    let bound = thousandths(&solution.lower_bound.expect("a bound").to_rational());
    assert!(bound <= makespan, "{robots} {lengths:?}: {bound} > {makespan}");
    let work: i64 = lengths.iter().map(|length| 1000 * (length + DRIVE)).sum();
    assert!(bound >= work / robots as i64, "{robots} {lengths:?}: {bound}");
}

#[test]
fn no_makespan_is_worse_than_longest_job_first() {
    check(5, &lengths(20, 1));
    check(8, &lengths(32, 1));
    for seed in 0..6 {
        let mut random = Random(seed);
        let robots = 2 + random.below(5) as usize;
        let jobs = robots * (2 + random.below(3) as usize);
        check(robots, &lengths(jobs, seed));
    }
}

#[test]
#[ignore = "takes minutes: 200 tasks"]
fn no_makespan_of_200_is_worse_than_longest_job_first() {
    for seed in 100..300 {
        let mut random = Random(seed);
        let robots = 2 + random.below(7) as usize;
        let jobs = robots * (2 + random.below(3) as usize);
        check(robots, &lengths(jobs, seed));
    }
}

#[test]
fn optimal_makespans_and_bounds_agree_with_brute_force() {
    for seed in 0..12 {
        let mut random = Random(seed);
        let robots = 2 + random.below(2) as usize;
        let lengths = lengths(3 + random.below(4) as usize, seed);
        let optimum = optimum(robots, &lengths);
        let (solution, makespan) = solve(robots, &lengths, optimum);
        assert_eq!(makespan, optimum, "{robots} {lengths:?}");
        let bound = thousandths(&solution.lower_bound.expect("a bound").to_rational());
        assert!(bound <= optimum, "{robots} {lengths:?}: {bound}");
        assert!(solution.status == Status::Optimal || solution.status == Status::Feasible);
    }
}

/// Two robots share six equal jobs: the work per robot is three jobs, the longest job is one.
#[test]
fn the_bound_counts_the_work_of_all_robots() {
    let (solution, makespan) = solve(2, &[40; 6], 0);
    // Three jobs of 45 each, and five gaps.
    assert_eq!((solution.status, makespan), (Status::Optimal, 135_005));
}
