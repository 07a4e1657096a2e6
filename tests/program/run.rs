//! Tests of `metaplan run` with input lines.

use serde_json::Value;

use crate::common::{headlines, metaplan_in, root};

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
            "4 error",
            "4 handled",
            "5 error",
            "5 handled",
            "6 request_action",
            "6 handled",
            "7 duplicate",
            "7 handled",
            "8 inferred",
            "8 plan_kept",
            "8 handled",
        ],
    );
    let overlong_answer = answers.iter().find(|answer| answer["line"] == 4).expect("an answer");
    let message = overlong_answer["message"].as_str().expect("a message");
    assert!(message.contains("longer than 1048576 bytes"), "{message}");
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

/// The loop plans from the present state, so it refuses what depends on earlier states or on the clock.
#[test]
fn missions_that_depend_on_their_past_are_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let domain =
        "(define (domain d) (:requirements :strips :constraints :preferences :timed-initial-literals)
(:predicates (a) (b)) (:action go :parameters () :precondition () :effect (and (a) (b))))";
    std::fs::write(directory.path().join("d.pddl"), domain).expect("a file");
    let run = |init: &str, goal: &str, constraints: &str| {
        let problem = format!(
            "(define (problem p) (:domain d)\n(:init {init})\n(:goal {goal})\n(:constraints (and\n{constraints})))"
        );
        std::fs::write(directory.path().join("p.pddl"), problem).expect("a file");
        metaplan_in(directory.path(), &["run", "d.pddl", "p.pddl"], "")
    };
    let outcome = run("", "(and (a) (preference g (b)))", "(always (or (a) (not (b))))\n(at end (b))");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    assert!(outcome.stdout.contains("plan_found"), "{outcome:#?}");
    let outcome = run(
        "(at 5 (a))",
        "(a)",
        "(sometime (b))\n(always (not (a)))\n(preference p (always (not (a))))\n(at-most-once (b))",
    );
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    let lines: Vec<String> = headlines(&outcome.stderr).lines().map(ToOwned::to_owned).collect();
    let places = ["5:1", "7:1", "8:1", "2:8"].map(|place| format!("p.pddl:{place}: error[M310]"));
    assert_eq!(lines.len(), places.len(), "{outcome:#?}");
    assert!(lines.iter().zip(&places).all(|(line, place)| line.starts_with(place)), "{lines:#?}");
}

/// Runs the loop on one input line. Returns the code and the message of the error, or `None` if the line is accepted.
fn refusal(arguments: &[&str], line: &str) -> Option<(String, String)> {
    let command: Vec<&str> = ["run"].iter().chain(arguments).copied().collect();
    let outcome = metaplan_in(&root(), &command, line);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let mut answers =
        outcome.stdout.lines().map(|line| serde_json::from_str::<Value>(line).expect("an answer is JSON"));
    let error = answers.find(|answer| answer["answer"] == "error")?;
    let text = |field: &str| error[field].as_str().expect("text").to_owned();
    Some((text("code"), text("message")))
}

#[test]
fn refusals_state_the_cause_and_a_remedy() {
    let fact = |name: &str, value: &str| {
        serde_json::json!({ "event": "fact_changed", "name": name, "value": value }).to_string()
    };
    let long_number = "9".repeat(300);
    for (mission, line, code, words) in [
        ("ugv", fact("ambient_light", "0.5"), "M306", &["is an attribute", "the event `measured`"][..]),
        ("ugv", fact("safety", "0.5"), "M306", &["nothing measures it"]),
        ("ugv", fact("travel_time", "5"), "M306", &["number of its arguments: 2", "has 0"]),
        ("ugv", fact("fd_available fd_aruco", "false"), "M306", &["`component_status`", "`design_status`"]),
        ("ugv", fact("battery", &long_number), "M302", &["at most 40 characters"]),
        ("uuv", fact("pipeline_found pl1", "maybe"), "M306", &["`maybe`", "should be `true` or `false`"]),
    ] {
        let (actual_code, message) =
            refusal(&[&format!("missions/{mission}.toml")], &line).expect("a refusal");
        assert_eq!(actual_code, code, "{line}: {message}");
        assert!(words.iter().all(|word| message.contains(word)), "{line}: {message}");
        assert!(!message.contains("did you mean"), "{line}: {message}");
    }
}

#[test]
fn measurements_without_effect_are_refused() {
    let measured = r#"{"event":"measured","attribute":"safety","value":0.05}"#;
    let (code, message) = refusal(&["missions/ugv.toml"], measured).expect("a refusal");
    assert!(code == "M306" && message.contains("nothing measures it"), "{code}: {message}");
    // A rule that can read the attribute makes the measurement effective, also if it names no attribute.
    let directory = tempfile::tempdir().expect("a directory");
    let rules = directory.path().join("own.swrl");
    let pddl = ["encodings/ugv/domain.pddl", "encodings/ugv/problem.pddl", "--kb", "ontology/kb/ugv.ttl"];
    for (attribute, is_accepted) in [("ugv:safety", true), ("?type", true), ("ugv:battery_usage", false)] {
        let text = format!(
            "@prefix t: <http://metacontrol.org/tomasys#> .\n\
             @prefix ugv: <http://metacontrol.org/metaplan/ugv#> .\n\
             [own] t:isQAtype(?qa, {attribute}) ^ t:isMeasured(?qa, true) ^ t:hasValue(?qa, ?value) \
             ^ swrlb:lessThan(?value, 0.1) -> t:fd_realisability(ugv:fd_aruco, false) .\n"
        );
        std::fs::write(&rules, text).expect("written");
        let rules = rules.display().to_string();
        let arguments = [&pddl[..], &["--rules", "coadaptation", "--rules", rules.as_str()]].concat();
        assert_eq!(refusal(&arguments, measured).is_none(), is_accepted, "{attribute}");
    }
    // A bound of a design does, too.
    let bright = r#"{"event":"measured","attribute":"ambient_light","value":0.9}"#;
    assert_eq!(refusal(&["missions/ugv.toml"], bright), None);
}
