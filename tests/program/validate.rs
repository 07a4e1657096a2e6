//! Tests of `metaplan validate`: the fields of the answer, the positions of messages, and plans in two
//! formats.

use serde_json::{Value, json};

use crate::common::{Outcome, metaplan, metaplan_in, root};

const DOMAIN: &str = "(define (domain survey)
  (:requirements :typing :fluents :durative-actions)
  (:types place)
  (:predicates (at ?p - place) (seen ?p - place))
  (:functions (battery) (distance ?a ?b - place))
  (:durative-action go :parameters (?a ?b - place)
    :duration (= ?duration (* 2 (distance ?a ?b)))
    :condition (and (at start (at ?a)) (at start (>= (battery) (distance ?a ?b))))
    :effect (and (at start (not (at ?a))) (at end (at ?b)) (at end (decrease (battery) (distance ?a ?b)))))
  (:durative-action look :parameters (?p - place) :duration (= ?duration 0.5)
    :condition (over all (at ?p)) :effect (at end (seen ?p))))";

const PROBLEM: &str = "(define (problem p) (:domain survey)
  (:objects a b - place)
  (:init (at a) (= (battery) 3) (= (distance a b) 2.5) (= (distance b a) 2.5))
  (:goal (seen b)) (:metric minimize (+ total-time (* 0.1 (battery)))))";

fn validate(domain: &str, problem: &str, plan: &str, arguments: &[&str]) -> Outcome {
    let directory = tempfile::tempdir().expect("a temporary directory");
    for (name, text) in [("domain.pddl", domain), ("problem.pddl", problem), ("plan.txt", plan)] {
        std::fs::write(directory.path().join(name), text).expect("a file");
    }
    let command = ["validate", "domain.pddl", "problem.pddl", "plan.txt"].iter().chain(arguments);
    metaplan_in(directory.path(), &command.copied().collect::<Vec<_>>(), "")
}

fn check(plan: &str, status: i32, expected: &Value) {
    let outcome = validate(DOMAIN, PROBLEM, plan, &["--format", "json"]);
    assert_eq!((outcome.status, &outcome.json()), (status, expected), "{plan}");
}

#[test]
fn verdicts_have_the_documented_fields() {
    check(
        "0: (go a b) [5]\n5: (look b) [0.5]",
        0,
        &json!({
            "format": "metaplan-verdict/1", "valid": true, "metric": 5.55, "total_time": 5.5,
            "values": { "(battery)": 0.5 }, "violation": null,
        }),
    );
    check(
        "0: (go a b) [5]\n5: (go b a) [5]",
        30,
        &json!({
            "format": "metaplan-verdict/1", "valid": false, "metric": null, "total_time": 5,
            "values": { "(battery)": 0.5 },
            "violation": {
                "step": 2, "action": "(go b a)", "time": 5, "kind": "at_start",
                "message": "a condition at start of (go b a) does not hold",
                "unmet": [{
                    "condition": "(>= (battery) (distance b a))",
                    "values": { "(battery)": 0.5, "(distance b a)": 2.5 },
                }],
            },
        }),
    );
}

#[test]
fn messages_have_a_position_and_a_suggestion() {
    let typo = DOMAIN.replace("(at start (at ?a))", "(at start (att ?a))");
    let outcome = validate(&typo, PROBLEM, "0: (go a b) [5]", &["--format", "json"]);
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    let answer = outcome.json();
    assert_eq!(answer["format"], "metaplan-error/1");
    let message = &answer["messages"][0];
    let place = json!([message["severity"], message["file"], message["line"], message["column"]]);
    assert_eq!(place, json!(["error", "domain.pddl", 8, 32]), "{message}");
    for field in ["code", "message", "help"] {
        assert!(message[field].is_string(), "{field}: {message}");
    }
    assert!(message["help"].as_str().is_some_and(|help| help.contains("`at`")), "{message}");
}

#[test]
fn plans_are_valid_as_ipc_and_as_json() {
    for mission in ["ugv", "ugv_plain", "uuv", "uuv_plain"] {
        let file = format!("missions/{mission}.toml");
        let cost = metaplan(&["plan", &file, "--format", "json"]).json()["cost"].to_string();
        for format in ["ipc", "json"] {
            let plan = metaplan(&["plan", &file, "--plan-format", format]).stdout;
            let outcome = metaplan_in(&root(), &["validate", &file, "-"], &plan);
            assert_eq!(outcome.status, 0, "{mission}, {format}: {outcome:?}\n{plan}");
            assert!(outcome.stdout.starts_with(&format!("valid, metric {cost},")), "{mission}: {outcome:?}");
        }
    }
}
