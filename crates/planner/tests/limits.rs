//! Limits must end every stage soon, and must never lead to a false answer.
#![expect(clippy::print_stdout, reason = "times are what some of these tests are for")]

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use metaplan_planner::{
    Config, Engine, Error, GroundConfig, Limits, Status, Thresholds, alternatives, ground, ground_concurrent,
    optimize, optimize_concurrent,
};
use num_rational::BigRational;
use pddl::ast::{Domain, Problem};

use crate::concurrent::parse;
use crate::concurrent_jobs;

/// A robot transports parcels on a ring of places. Each move needs a design for each of two
/// functions. Every design suits both functions, but the two designs of a move must differ.
fn depot(places: usize, parcels: usize, designs: usize) -> (Domain, Problem) {
    let domain = "(define (domain depot) (:requirements :typing :fluents :equality :negative-preconditions)
      (:types place parcel design function) (:constants f1 f2 - function)
      (:predicates (at ?p - place) (way ?a ?b - place) (lies ?x - parcel ?p - place) (held ?x - parcel) (free)
        (fd_solve_f ?d - design ?f - function))
      (:functions (total-cost) (bat) (use ?d - design) (price ?d - design))
      (:action go :parameters (?a ?b - place ?c ?d - design)
        :precondition (and (at ?a) (way ?a ?b) (fd_solve_f ?c f1) (fd_solve_f ?d f2) (not (= ?c ?d)) (>= (bat) (use ?c)))
        :effect (and (not (at ?a)) (at ?b) (decrease (bat) (use ?c)) (increase (total-cost) (price ?d))))
      (:action take :parameters (?x - parcel ?p - place) :precondition (and (at ?p) (lies ?x ?p) (free))
        :effect (and (held ?x) (not (free)) (not (lies ?x ?p)) (increase (total-cost) 1)))
      (:action put :parameters (?x - parcel ?p - place) :precondition (and (at ?p) (held ?x))
        :effect (and (not (held ?x)) (free) (lies ?x ?p) (increase (total-cost) 1))))";
    let mut text = String::from("(define (problem p) (:domain depot) (:objects");
    (0..places).for_each(|index| _ = write!(text, " p{index}"));
    text.push_str(" - place");
    (0..parcels).for_each(|index| _ = write!(text, " x{index}"));
    text.push_str(" - parcel");
    (0..designs).for_each(|index| _ = write!(text, " d{index}"));
    text.push_str(" - design) (:init (at p0) (free) (= (bat) 1000000) (= (total-cost) 0)");
    for index in 0..places {
        let _ = write!(text, " (way p{index} p{0}) (way p{0} p{index})", (index + 1) % places);
    }
    (0..parcels).for_each(|index| _ = write!(text, " (lies x{index} p{})", index * 7 % places));
    for index in 0..designs {
        let _ = write!(
            text,
            " (fd_solve_f d{index} f1) (fd_solve_f d{index} f2) (= (use d{index}) {}) (= (price d{index}) {})",
            1 + index % 3,
            2 + index % 5
        );
    }
    text.push_str(") (:goal (and");
    (0..parcels)
        .for_each(|index| _ = write!(text, " (lies x{index} p{})", (index * 7 + places / 2) % places));
    text.push_str(")) (:metric minimize (total-cost)))");
    parse(domain, &text)
}

/// Grounds, plans and computes alternatives. Returns the status (`None` if grounding was not
/// finished) and the time taken.
fn run(domain: &Domain, problem: &Problem, limit: Duration, engine: Engine) -> (Option<Status>, Duration) {
    let started = Instant::now();
    let limits = Limits::none().with_time(limit);
    let config = GroundConfig::default().with_limits(limits.clone());
    let task = match ground(domain, problem, &config) {
        Ok(task) => task,
        Err(errors) => {
            assert!(matches!(errors[..], [Error::Interrupted]), "{errors:?}");
            return (None, started.elapsed());
        }
    };
    let config = Config::default().with_engine(engine).with_limits(limits);
    let solution = optimize(&task, &config, &mut |_| {});
    if let Some(others) = alternatives(&task, &solution, 2, &config) {
        assert!(others.plans.len() <= 2);
    }
    (Some(solution.status), started.elapsed())
}

/// The task is solvable, so it must not be reported as unsolvable at any time limit.
#[test]
fn wherever_time_is_up_there_is_no_false_answer() {
    let (domain, problem) = depot(4, 2, 3);
    for engine in [Engine::Auto, Engine::Sat] {
        // The time limit increases by a fifth each time, from before the end of grounding until the proof or to 3 s.
        let mut microseconds = 100.0_f64;
        while microseconds < 3e6 {
            let limit = Duration::from_secs_f64(microseconds / 1e6);
            let (status, _) = run(&domain, &problem, limit, engine);
            let honest = [None, Some(Status::Unknown), Some(Status::Feasible), Some(Status::Optimal)];
            assert!(honest.contains(&status), "{status:?} after {limit:?}");
            if status == Some(Status::Optimal) {
                break;
            }
            microseconds *= 1.2;
        }
    }
    let (status, _) = run(&domain, &problem, Duration::MAX, Engine::Auto);
    assert_eq!(status, Some(Status::Optimal));
}

fn check_overrun(name: &str, (domain, problem): &(Domain, Problem)) {
    for seconds in [1, 3, 8] {
        for engine in [Engine::Auto, Engine::Sat] {
            let limit = Duration::from_secs(seconds);
            let (status, passed) = run(domain, problem, limit, engine);
            println!("{name}, {engine:?}, limit {seconds} s: {passed:.1?}, {status:?}");
            let most = limit + Duration::from_secs(1);
            assert!(passed <= most, "{name}, {engine:?}: {passed:?} with a limit of {limit:?}");
            assert_ne!(status, Some(Status::Unsolvable), "{name}");
        }
    }
}

fn names(prefix: &str, count: usize) -> Vec<String> {
    (0..count).map(|index| format!("{prefix}{index}")).collect()
}

/// Each conclusion follows from the previous one without any action.
fn chain(length: usize) -> (Domain, Problem) {
    let domain = "(define (domain d) (:requirements :adl :derived-predicates)
      (:predicates (start ?x) (link ?x ?y) (hot ?x) (reached ?x))
      (:derived (reached ?x) (or (start ?x) (hot ?x) (exists (?y) (and (link ?y ?x) (reached ?y)))))
      (:action heat :parameters (?x) :effect (hot ?x)))";
    let objects = names("o", length);
    let links: Vec<_> = objects.windows(2).map(|pair| format!("(link {} {})", pair[0], pair[1])).collect();
    let links = links.concat();
    let last = &objects[length - 1];
    let objects = objects.join(" ");
    let problem = format!(
        "(define (problem p) (:domain d) (:objects {objects}) (:init (start o0) {links})
          (:goal (and (reached {last}) (hot o0))))"
    );
    parse(domain, &problem)
}

/// Each derived atom has two rules, so none is replaced by the body of its rule.
fn alternatives_of_atoms(count: usize) -> (Domain, Problem) {
    let domain = "(define (domain d) (:requirements :adl :derived-predicates) (:predicates (hot ?x) (lit ?x) (warm ?x))
      (:derived (warm ?x) (or (hot ?x) (lit ?x)))
      (:action heat :parameters (?x) :effect (hot ?x))
      (:action light :parameters (?x) :effect (lit ?x)))";
    let objects = names("o", count).join(" ");
    let problem = format!(
        "(define (problem p) (:domain d) (:objects {objects}) (:init) (:goal (forall (?x) (warm ?x))))"
    );
    parse(domain, &problem)
}

/// About half of the pairs of designs are forbidden.
fn forbidden_pairs(designs: usize) -> (Domain, Problem) {
    let domain = "(define (domain d) (:requirements :typing :fluents) (:types design function)
      (:constants f1 f2 - function)
      (:predicates (done) (fd_solve_f ?d - design ?f - function)) (:functions (use ?d - design))
      (:action work :parameters (?c ?d - design)
        :precondition (and (fd_solve_f ?c f1) (fd_solve_f ?d f2) (<= (+ (use ?c) (use ?d)) 1000)) :effect (done)))";
    let designs = names("d", designs);
    let each = |(index, name): (usize, &String)| {
        let amount = index * 1_000 / designs.len();
        format!("(fd_solve_f {name} f1) (fd_solve_f {name} f2) (= (use {name}) {amount})")
    };
    let init: String = designs.iter().enumerate().map(each).collect();
    let objects = designs.join(" ");
    let problem = format!(
        "(define (problem p) (:domain d) (:objects {objects} - design) (:init {init}) (:goal (done)))"
    );
    parse(domain, &problem)
}

/// With a quadratic number of steps, the chain takes more than five minutes.
#[test]
fn grounding_does_not_take_quadratic_time() {
    let check = |name: &str, (domain, problem): (Domain, Problem)| {
        let started = Instant::now();
        let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
        let passed = started.elapsed();
        println!("{name}: {passed:.1?}");
        assert!(task.unreachable().is_none());
        assert!(passed < Duration::from_secs(60), "{name}: {passed:?}");
    };
    check("a chain of conclusions", chain(40_000));
    check("derived atoms with two rules", alternatives_of_atoms(60_000));
    check("forbidden pairs of designs", forbidden_pairs(700));
}

/// The first node has as many successors as there are switches.
#[test]
fn expansion_of_a_temporal_node_with_many_successors_ends_at_the_limit() {
    let names: Vec<String> = (0..12_000).map(|index| format!("k{index}")).collect();
    let each = |text: &str| names.iter().map(|name| ["(", text, " ", name, ")"].concat()).collect::<String>();
    let domain = "(define (domain d) (:requirements :durative-actions) (:predicates (on ?x) (off ?x))
      (:durative-action switch :parameters (?x) :duration (= ?duration 2) :condition (at start (off ?x))
        :effect (and (at start (not (off ?x))) (at end (on ?x)))))";
    let problem = format!(
        "(define (problem n) (:domain d) (:objects {}) (:init {}) (:goal (and {})))",
        names.join(" "),
        each("off"),
        each("on")
    );
    let (domain, problem) = parse(domain, &problem);
    let separation = BigRational::new(1.into(), 1000.into());
    let started = Instant::now();
    let task = ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation).expect("a task");
    let grounding = started.elapsed();
    let started = Instant::now();
    let limit = Duration::from_millis(300);
    let limits = Limits::none().with_time(limit);
    let solution = optimize_concurrent(&task, &limits, &mut |_| {});
    let passed = started.elapsed();
    println!("{passed:?}, grounding {grounding:?}");
    assert!([Status::Unknown, Status::Feasible].contains(&solution.status));
    // The time of grounding is a measure of the speed of the machine.
    let most = limit + Duration::from_secs(1).max(grounding * 2);
    assert!(passed < most, "{passed:?}, grounding {grounding:?}");
}

/// Three robots that can do any of nine jobs, for which no search can prove a makespan with little memory.
fn jobs() -> (Domain, Problem) {
    let lengths: Vec<i64> = (0..9).map(|place| 10 + place * place % 7).collect();
    parse(concurrent_jobs::DOMAIN, &concurrent_jobs::problem(3, &lengths))
}

#[test]
fn searches_begin_again_until_the_deadline_when_memory_is_full() {
    let (domain, problem) = jobs();
    let separation = BigRational::new(1.into(), 1000.into());
    let task = ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation).expect("a task");
    let thresholds = Thresholds::NONE;
    let run = |limits: Limits| {
        let started = Instant::now();
        let solution = optimize_concurrent(&task, &limits.with_thresholds(thresholds), &mut |_| {});
        (solution, started.elapsed())
    };
    // Without a deadline, the search ends.
    let (solution, passed) = run(Limits::none().with_room(1 << 18));
    assert_eq!(solution.status, Status::Feasible);
    let cost = solution.plan.expect("a plan").cost;
    let time = Duration::from_secs(2).max(passed * 3);
    let (solution, passed) = run(Limits::none().with_room(1 << 18).with_time(time));
    println!("{passed:?} {:?}", solution.statistics.restarts);
    assert!(solution.status == Status::Feasible && passed >= time, "{passed:?}");
    assert!(solution.plan.expect("a plan").cost <= cost);
}

#[test]
#[ignore = "takes minutes; in release"]
fn large_tasks_end_within_a_second_of_the_limit() {
    check_overrun("20,000 operators", &depot(400, 25, 3));
    check_overrun("1,000 designs for each of two functions", &depot(20, 3, 1_000));
    check_overrun("65,000 designs for each of two functions", &depot(3, 1, 65_000));
}
