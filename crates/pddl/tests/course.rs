//! Tests of the numeric trace of a plan: values after each happening, and bounds in conditions.

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

fn trace(plan: &str) -> Vec<String> {
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
    lines.extend(course.moments.iter().map(|moment| {
        let bounds = moment.bounds.iter().map(bound).collect::<Vec<_>>().concat();
        format!(
            "{} {} {}{}{bounds}",
            moment.step,
            moment.time,
            if moment.is_end { "end" } else { "start" },
            values(&moment.values)
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
        // A disjunct of a condition imposes no bound.
        "1 2 end (battery a):=90",
        "goal (battery a)>=20",
    ];
    assert_eq!(trace("0: (drive a) [2]\n2: (charge a)"), expected);
    assert_eq!(trace("(drive a)\n(charge a)"), expected, "without times one action follows the other");
    assert_eq!(
        trace("0: (drive a) [2]\n(charge a)"),
        expected,
        "a missing time makes the order of the text count"
    );
}

#[test]
fn overlapping_steps_are_traced_in_chronological_order() {
    let expected = [
        "initial (battery a):=50 (battery b):=60",
        "1 0 start (battery b):=59 (battery b)>=14 (battery b)>1",
        "0 1 start (battery a):=49 (battery a)>=14 (battery a)>1",
        "1 2 end (battery b):=53",
        "0 3 end (battery a):=43",
        "goal (battery a)>=20",
    ];
    assert_eq!(trace("1: (drive a) [2]\n0: (drive b) [2]"), expected);
}
