//! The course of numbers through a plan: what they are after each happening, and what conditions demand of them.

use metaplan_pddl::Source;
use metaplan_pddl::validate::{NumberBound, PlanText, course};
use metaplan_pddl::{parse_domain, parse_problem};

const DOMAIN: &str = "(define (domain d) (:requirements :typing :fluents :durative-actions) (:types robot)
    (:predicates (there ?r - robot))
    (:functions (battery ?r - robot) (speed) (reserve))
    (:durative-action drive :parameters (?r - robot) :duration (= ?duration (speed))
        :condition (and (at start (>= (battery ?r) (+ 4 (reserve)))) (over all (< 1 (battery ?r))) (over all (> (speed) 0)))
        :effect (and (at start (decrease (battery ?r) 1)) (at end (decrease (battery ?r) (* 3 ?duration))) (at end (there ?r))))
    (:action charge :parameters (?r - robot) :precondition (or (< (battery ?r) 50) (there ?r))
        :effect (assign (battery ?r) 90)))";

const PROBLEM: &str = "(define (problem p) (:domain d) (:objects a b - robot)
    (:init (= (battery a) 50) (= (battery b) 60) (= (speed) 2) (= (reserve) 10))
    (:goal (and (there a) (>= (battery a) 20))))";

/// One line for each moment: the step, the time, what is changed, and what is demanded.
fn told(plan: &str) -> Vec<String> {
    let (domain, problem) = (Source::new("d", DOMAIN), Source::new("p", PROBLEM));
    let (domain, problem) =
        (parse_domain(&domain).0.expect("a domain"), parse_problem(&problem).0.expect("a problem"));
    let plan = PlanText::parse(&Source::new("plan", plan)).expect("a plan");
    let course = course(&domain, &problem, &plan).expect("a course");
    let bound = |bound: &NumberBound| format!(" {}{}{}", bound.number, bound.relation.symbol(), bound.bound);
    let values = |values: &[(String, _)]| {
        values.iter().map(|(name, value)| format!(" {name}:={value}")).collect::<Vec<_>>().concat()
    };
    let mut lines = vec![format!("initial{}", values(&course.initial))];
    lines.extend(course.moments.iter().map(|own| {
        let bounds = own.bounds.iter().map(bound).collect::<Vec<_>>().concat();
        format!(
            "{} {} {}{}{bounds}",
            own.step,
            own.time,
            if own.is_end { "end" } else { "start" },
            values(&own.values)
        )
    }));
    lines.push(format!("goal{}", course.goal.iter().map(bound).collect::<Vec<_>>().concat()));
    lines
}

#[test]
fn numbers_change_at_starts_and_ends() {
    let expected = [
        "initial (battery a):=50 (battery b):=60",
        "0 0 start (battery a):=49 (battery a)>=14 (battery a)>1",
        "0 2 end (battery a):=43",
        // What one of several conditions demands is demanded by none.
        "1 2 end (battery a):=90",
        "goal (battery a)>=20",
    ];
    assert_eq!(told("0: (drive a) [2]\n2: (charge a)"), expected);
    assert_eq!(told("(drive a)\n(charge a)"), expected, "without times one action follows the other");
}

#[test]
fn what_overlaps_takes_place_in_the_order_of_time() {
    let expected = [
        "initial (battery a):=50 (battery b):=60",
        "1 0 start (battery b):=59 (battery b)>=14 (battery b)>1",
        "0 1 start (battery a):=49 (battery a)>=14 (battery a)>1",
        "1 2 end (battery b):=53",
        "0 3 end (battery a):=43",
        "goal (battery a)>=20",
    ];
    assert_eq!(told("1: (drive a) [2]\n0: (drive b) [2]"), expected);
}
