//! Tests of `metaplan explain`: reasons, costs of alternatives, and changes that would lead to another answer.

use serde_json::{Value, json};

use crate::common::metaplan;

fn explain(arguments: &[&str]) -> Value {
    let command: Vec<&str> =
        ["explain"].iter().chain(arguments).copied().chain(["--format", "json"]).collect();
    let outcome = metaplan(&command);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let answer = outcome.json();
    assert_eq!(answer["format"], "metaplan-explain/1");
    answer
}

fn changes(answer: &Value) -> Vec<Value> {
    let change =
        |change: &Value| json!([change["name"], change["relation"], change["bound"], change["then"]["cost"]]);
    answer["changes"].as_array().expect("changes").iter().map(change).collect()
}

#[test]
fn why_not_another_design() {
    let answer = explain(&["missions/ugv.toml", "fd_amcl_lidar"]);
    let figures = json!([
        answer["available"],
        answer["best"]["cost"],
        answer["alone"]["cost"],
        answer["without"]["cost"],
        answer["used"]
    ]);
    assert_eq!(figures, json!([true, 408, 516, 408, []]));
    assert_eq!(changes(&answer), [json!(["c_lidar", "failed", null, 408])]);
    let answer = explain(&["missions/ugv.toml", "fd_amcl_kinect"]);
    // The second-best design is the other one with the Kinect.
    let figures = json!([answer["alone"]["cost"], answer["without"]["cost"], answer["used"]]);
    assert_eq!(figures, json!([408, 416, [1, 2, 3, 4]]));
    let expected = [json!(["c_kinect", "failed", null, 516]), json!(["ambient_light", "above", 0.8, 516])];
    assert_eq!(changes(&answer), expected);
}

#[test]
fn why_a_design_is_not_available() {
    let situation = ["--fail", "c_kinect", "--set", "ambient_light=0.9"];
    let arguments: Vec<&str> = ["missions/ugv.toml", "fd_amcl_kinect"].into_iter().chain(situation).collect();
    let answer = explain(&arguments);
    assert_eq!(answer["available"], false);
    let because = answer["because"].to_string();
    assert!(because.contains("c_status(c_kinect"), "{because}");
    // Both causes are listed. Removing only one of them does not make the design available.
    let expected =
        [json!(["c_kinect", "recovered", null, 516]), json!(["ambient_light", "at_most", 0.8, 516])];
    assert_eq!(changes(&answer), expected);
    assert_eq!(answer["alone"]["cost"], 408, "as if it were available");
}

#[test]
fn changes_that_affect_the_plan_are_listed() {
    assert_eq!(
        changes(&explain(&["missions/ugv.toml"])),
        [json!(["ambient_light", "above", 0.8, 516]), json!(["battery", "below", 8, null])]
    );
    let answer = explain(&["missions/uuv.toml"]);
    let changes_of_plan = changes(&answer);
    assert_eq!(changes_of_plan[0], json!(["water_visibility", "below", 3.25, 34]));
    // The plan uses 77 percent of the battery, and the reserve is 10. The bound is exact to 10^-6.
    assert_eq!(changes_of_plan[1][2], json!(87), "{answer:#}");
}

#[test]
fn bounds_of_small_values_are_found() {
    let directory = tempfile::tempdir().expect("a directory");
    let write = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).expect("written");
    let actions = "(:action a :parameters () :precondition (>= (x) 0.000495)
           :effect (and (done) (increase (c) 1)))
         (:action b :parameters () :precondition () :effect (and (done) (increase (c) 2)))";
    write(
        "domain.pddl",
        &format!(
            "(define (domain d) (:requirements :strips :numeric-fluents) (:predicates (done))
             (:functions (x) (c)) {actions})"
        ),
    );
    write(
        "problem.pddl",
        "(define (problem p) (:domain d) (:init (= (x) 0.0005) (= (c) 0)) (:goal (done))
         (:metric minimize (c)))",
    );
    let knowledge = crate::common::root().join("ontology/kb/ugv.ttl");
    write(
        "m.toml",
        &format!(
            "name = 'small'\n[knowledge]\nfiles = ['{}']\n[planning]\n\
             domain = 'domain.pddl'\nproblem = 'problem.pddl'\n",
            knowledge.display()
        ),
    );
    let file = directory.path().join("m.toml");
    let answer = explain(&[file.to_str().expect("UTF-8"), "--time-limit", "120"]);
    let costs: Vec<Value> = changes(&answer).iter().map(|change| change[3].clone()).collect();
    assert_eq!(costs.iter().map(Value::as_f64).collect::<Vec<_>>(), [Some(2.0)], "{answer:#}");
}

#[test]
fn unknown_designs_are_usage_errors() {
    let outcome = metaplan(&["explain", "missions/ugv.toml", "fd_none"]);
    assert_eq!(outcome.status, 2);
    assert!(outcome.stderr.contains("there are: fd_amcl_kinect"), "{outcome:#?}");
}
