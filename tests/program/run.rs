//! Tests of `metaplan run` with input lines.

use serde_json::Value;

use crate::common::{metaplan_in, root};

/// Runs the loop on input lines and compares the line number and the kind of each answer with `expected`.
/// Line 0 is the start. Returns the answers.
fn check(arguments: &[&str], input: &str, expected: &[&str]) -> Vec<Value> {
    let command: Vec<&str> = ["run"].iter().chain(arguments).copied().collect();
    let outcome = metaplan_in(&root(), &command, input);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let answers: Vec<Value> =
        outcome.stdout.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(answers[0]["answer"], "ready");
    assert_eq!(answers[0]["format"], "metaplan-events/1");
    let kinds: Vec<String> = answers[1..]
        .iter()
        .map(|answer| format!("{} {}", answer["line"], answer["answer"].as_str().expect("a kind")))
        .collect();
    assert_eq!(kinds, expected, "{answers:#?}");
    answers
}

#[test]
fn invalid_lines_are_reported_and_skipped() {
    let overlong = format!("{{\"event\":\"{}\"}}", "x".repeat(2_000_000));
    let input = [
        "nonsense",
        r#"{"event":"measured","attribute":"ambient_light","value":0.5}"#,
        "",
        overlong.as_str(),
        "\u{0}",
        r#"{"event":"action_succeeded","action":1,"seq":5}"#,
        r#"{"event":"action_succeeded","action":2,"seq":5}"#,
        r#"{"event":"component_status","component":"c_flashlight","status":false}"#,
    ]
    .join("\n");
    let answers = check(
        &["missions/ugv.toml"],
        &input,
        &[
            "0 plan_requested",
            "0 plan_found",
            "0 reconfigure",
            "0 request_action",
            "0 handled",
            "1 error",
            "1 handled",
            "2 handled",
            "3 error",
            "3 handled",
            "4 error",
            "4 handled",
            "5 request_action",
            "5 handled",
            "6 duplicate",
            "6 handled",
            "7 inferred",
            "7 plan_kept",
            "7 handled",
        ],
    );
    let last_answer = answers.last().expect("an answer");
    assert!(last_answer["microseconds"].as_u64().is_some(), "{last_answer}");
}

#[test]
fn planning_resumes_after_an_unsolvable_situation() {
    let input = [
        r#"{"event":"component_status","component":"c_lidar","status":"RECOVERED"}"#,
        r#"{"event":"action_succeeded","action":1}"#,
    ]
    .join("\n");
    check(
        &["missions/ugv.toml", "--fail", "c_kinect", "--fail", "c_lidar", "--fail", "c_camera"],
        &input,
        &[
            "0 plan_requested",
            "0 plan_none",
            "0 handled",
            "1 inferred",
            "1 plan_requested",
            "1 plan_found",
            "1 reconfigure",
            "1 request_action",
            "1 handled",
            "2 request_action",
            "2 handled",
        ],
    );
}

#[test]
fn events_can_come_from_files_and_missions_from_pddl() {
    let directory = tempfile::tempdir().expect("a directory");
    let events = directory.path().join("events.jsonl");
    std::fs::write(&events, "{\"event\":\"tick\"}\n").expect("a file");
    let events = events.display().to_string();
    check(
        &[
            "encodings/uuv/domain.pddl",
            "encodings/uuv/problem.pddl",
            "--kb",
            "ontology/kb/uuv.ttl",
            "--events",
            &events,
        ],
        "",
        &[
            "0 plan_requested",
            "0 plan_found",
            "0 reconfigure",
            "0 reconfigure",
            "0 request_action",
            "0 handled",
            "1 handled",
        ],
    );
}
