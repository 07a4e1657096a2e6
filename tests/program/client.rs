//! Tests of the protocol of `metaplan run`: the progress answers during planning.

use std::fmt::Write as _;

use serde_json::Value;

use crate::common::metaplan_in;

const DOMAIN: &str = "(define (domain d) (:requirements :typing) (:types place item)
  (:predicates (at ?p - place) (way ?a ?b - place) (lies ?i - item ?p - place) (has ?i - item) (free))
  (:action go :parameters (?a ?b - place) :precondition (and (at ?a) (way ?a ?b))
    :effect (and (not (at ?a)) (at ?b)))
  (:action take :parameters (?i - item ?p - place) :precondition (and (at ?p) (lies ?i ?p) (free))
    :effect (and (has ?i) (not (lies ?i ?p)) (not (free))))
  (:action put :parameters (?i - item ?p - place) :precondition (and (at ?p) (has ?i))
    :effect (and (lies ?i ?p) (not (has ?i)) (free))))";

/// Returns a problem that takes more than a few seconds to solve: 14 parcels on a grid, carried one at a
/// time.
fn parcels() -> String {
    let (side, count) = (9, 14);
    let mut text = "(define (problem p) (:domain d) (:objects".to_owned();
    let place = |x: usize, y: usize| format!("p{x}_{y}");
    let cells = || (0..side).flat_map(move |x| (0..side).map(move |y| (x, y)));
    for (x, y) in cells() {
        let _ = write!(text, " {}", place(x, y));
    }
    text += " - place";
    for item in 0..count {
        let _ = write!(text, " i{item}");
    }
    let _ = write!(text, " - item) (:init (at {}) (free)", place(0, 0));
    for (x, y) in cells() {
        for (other_x, other_y) in [(x + 1, y), (x, y + 1)] {
            if other_x < side && other_y < side {
                let (a, b) = (place(x, y), place(other_x, other_y));
                let _ = write!(text, " (way {a} {b}) (way {b} {a})");
            }
        }
    }
    let spot = |number: usize| place(number * 5 % side, number * 7 % side);
    for item in 0..count {
        let _ = write!(text, " (lies i{item} {})", spot(item));
    }
    text += ") (:goal (and";
    for item in 0..count {
        let _ = write!(text, " (lies i{item} {})", spot(3 * item + 4));
    }
    text + ")))"
}

#[test]
fn ready_is_followed_by_progress_during_search() {
    let directory = tempfile::tempdir().expect("a directory");
    let manifest = "name = \"parcels\"\n[knowledge]\nfiles = [\"kb.ttl\"]\n[planning]\ndomain = \"d.pddl\"\n\
        problem = \"p.pddl\"\n[adaptation]\ntime_limit = 2.6\n";
    let knowledge = "<http://example.org/m> a <http://www.w3.org/2002/07/owl#Ontology> .\n";
    for (name, text) in
        [("m.toml", manifest), ("kb.ttl", knowledge), ("d.pddl", DOMAIN), ("p.pddl", &parcels())]
    {
        std::fs::write(directory.path().join(name), text).expect("a file");
    }
    let outcome = metaplan_in(directory.path(), &["run", "m.toml"], "{\"event\":\"tick\"}\n");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let answers: Vec<Value> =
        outcome.stdout.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let kinds: Vec<&str> = answers.iter().filter_map(|answer| answer["answer"].as_str()).collect();
    assert_eq!(kinds[..3], ["ready", "planning", "planning"], "{kinds:?}");
    assert_eq!(answers[2]["seconds"], 2, "{answers:#?}");
    // Bound and cost are reported only after grounding, when the search has begun.
    for planning in answers.iter().filter(|answer| answer["answer"] == "planning") {
        let (bound, cost) = (planning["lower_bound"].as_f64(), planning["cost"].as_f64());
        assert!(bound.is_none_or(|bound| bound > 0.0), "{planning}");
        assert!(cost.is_none_or(|cost| bound <= Some(cost)), "{planning}");
    }
    assert_eq!(kinds.iter().filter(|kind| **kind == "handled").count(), 2, "{kinds:?}");
    let end = kinds.iter().position(|kind| *kind == "handled").expect("line 0 ends");
    assert_eq!(answers[end]["line"], 0);
    assert!(kinds[..end].contains(&"plan_requested"), "{kinds:?}");
}

const WIDE: &str = "(define (domain wide) (:predicates (p ?a ?b) (q ?a ?b ?c ?d) (done))
    (:action a :parameters (?a ?b ?c ?d) :precondition (and (p ?a ?b) (p ?c ?d)) :effect (q ?a ?b ?c ?d))
    (:action b :parameters (?a ?b ?c ?d) :precondition (q ?a ?b ?c ?d) :effect (done)))";

#[test]
fn progress_is_reported_during_grounding() {
    let directory = tempfile::tempdir().expect("a directory");
    let names: Vec<String> = (0..20).map(|number| format!("o{number}")).collect();
    let mut problem = format!("(define (problem p) (:domain wide) (:objects {}) (:init", names.join(" "));
    for (a, b) in names.iter().flat_map(|a| names.iter().map(move |b| (a, b))) {
        let _ = write!(problem, " (p {a} {b})");
    }
    problem += ") (:goal (done)))";
    let manifest = "name = \"wide\"\n[knowledge]\nfiles = [\"kb.ttl\"]\n[planning]\ndomain = \"d.pddl\"\nproblem = \"p.pddl\"\n\
        [adaptation]\ntime_limit = 2.6\n";
    let knowledge = "<http://example.org/m> a <http://www.w3.org/2002/07/owl#Ontology> .\n";
    for (name, text) in [("m.toml", manifest), ("kb.ttl", knowledge), ("d.pddl", WIDE), ("p.pddl", &problem)]
    {
        std::fs::write(directory.path().join(name), text).expect("a file");
    }
    let outcome = metaplan_in(directory.path(), &["run", "m.toml"], "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let answers: Vec<Value> =
        outcome.stdout.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let failure = answers.iter().find(|answer| answer["answer"] == "plan_none").expect("there is no time");
    assert_eq!(failure["because"], "a limit was reached while grounding", "{outcome:#?}");
    let planning: Vec<&Value> = answers.iter().filter(|answer| answer["answer"] == "planning").collect();
    assert!(planning.len() >= 2, "{outcome:#?}");
    for (number, answer) in (1..).zip(planning) {
        assert_eq!(answer["seconds"], number, "{outcome:#?}");
        assert!(answer["cost"].is_null() && answer["lower_bound"].is_null(), "{outcome:#?}");
    }
}
