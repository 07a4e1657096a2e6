//! `metaplan lint`: everything that is wrong or questionable about a mission, in one answer.

use std::path::Path;

use crate::common::{Outcome, edit, metaplan, metaplan_in};

/// The warehouse mission with changes, as `lint` sees it.
fn check(changes: &[(&str, &str, &str)], status: i32, words: &[&str]) -> Outcome {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    assert_eq!(metaplan_in(here, &["init", "m", "--from", "warehouse"], "").status, 0);
    for (file, old, new) in changes {
        edit(&here.join("m"), file, old, new);
    }
    let outcome = metaplan_in(here, &["lint", "m/mission.toml"], "");
    assert_eq!(outcome.status, status, "{outcome:#?}");
    assert!(outcome.stderr.is_empty(), "{outcome:#?}");
    for word in words {
        assert!(outcome.stdout.contains(word), "no `{word}`: {}", outcome.stdout);
    }
    let json = metaplan_in(here, &["lint", "m/mission.toml", "--format", "json"], "");
    let answer = json.json();
    let count = |severity: &str| {
        let messages = answer["messages"].as_array().expect("messages");
        messages.iter().filter(|message| message["severity"] == severity).count()
    };
    assert_eq!((json.status, answer["format"].as_str()), (status, Some("metaplan-lint/1")));
    assert_eq!(answer["errors"], count("error"));
    assert_eq!(answer["warnings"], count("warning"));
    outcome
}

#[test]
fn templates_and_shipped_missions_are_clean() {
    for template in ["blank", "ugv", "warehouse"] {
        let directory = tempfile::tempdir().expect("a directory");
        assert_eq!(metaplan_in(directory.path(), &["init", "m", "--from", template], "").status, 0);
        let outcome = metaplan_in(directory.path(), &["lint", "m/mission.toml"], "");
        assert_eq!(
            (outcome.status, outcome.stdout.as_str()),
            (0, "nothing to complain about\n"),
            "{template}"
        );
    }
    for mission in ["ugv", "ugv_plain", "uuv", "uuv_plain", "camara_like"] {
        let outcome = metaplan(&["lint", &format!("missions/{mission}.toml")]);
        assert_eq!(outcome.status, 0, "{outcome:#?}");
    }
    let outcome = metaplan(&["lint", "encodings/ugv/plain.pddl", "encodings/ugv/problem.pddl"]);
    assert_eq!(
        outcome.status, 1,
        "without a knowledge base nothing gives `battery_usage` a value: {outcome:#?}"
    );
    let with =
        ["lint", "encodings/ugv/plain.pddl", "encodings/ugv/problem.pddl", "--kb", "ontology/kb/ugv.ttl"];
    assert_eq!(metaplan(&with).status, 0);
}

#[test]
fn what_meets_nothing_is_a_warning() {
    check(&[("robot.ttl", ":a_pick a t:Action", ":a_pickup a t:Action")], 1, &["M205", "if it is `pick`"]);
    check(
        &[("robot.ttl", "t:requiresC :c_lidar ;", "t:requiresC :c_lidra ;")],
        1,
        &["M207", "did you mean `c_lidar`?"],
    );
    check(
        &[("robot.ttl", ":c_arm a t:Component .", ":c_arm a t:Component .\n:c_horn a t:Component .")],
        1,
        &["M208", "c_horn"],
    );
    check(&[("robot.ttl", ":grasp_time", ":grasping_time")], 1, &["M206", "`grasp_time`"]);
    check(
        &[("mission.toml", "[report]", "[bindings]\ngrasp_time = \"chosen:grasp_tme\"\n\n[report]")],
        1,
        &["M227", "`grasp_time` is bound to `chosen:grasp_tme`", "did you mean `grasp_time`?"],
    );
}

#[test]
fn all_errors_of_all_files_are_told_at_once() {
    let broken = ("robot.ttl", ":f_grasp a t:Function .", ":f_grasp a t:Function");
    let outcome = check(
        &[broken, ("problem.pddl", "(:goal (and", "(:gaol (and")],
        3,
        &["O102", "robot.ttl:", "P109", "problem.pddl:"],
    );
    assert!(outcome.stdout.contains("error"), "{}", outcome.stdout);
    check(
        &[
            ("problem.pddl", "(hand_is_free)", "(hand_is_fre)"),
            ("problem.pddl", "(robot_at near_rack)", "(robot_at near_rak)"),
        ],
        3,
        &["P121", "P123", "2 errors, 0 warnings"],
    );
    check(
        &[
            ("mission.toml", "fail = [\"c_suction_cup\"]", "fail = [\"c_suction\"]"),
            ("mission.toml", "air_dust = \"0.8\"", "air_dust = \"much\""),
            (
                "mission.toml",
                "fail = [\"c_lidar\"]\n\n[scenarios.suction",
                "fail = [\"c_lidar\"]\n\n[scenarios.suction",
            ),
            ("mission.toml", "step = 1 ", "step = 0 "),
            ("places.csv", "far_rack,16,0", "far_rack,sixteen,0"),
        ],
        3,
        &[
            "scenario `suction_fails`: ",
            "scenario `dusty`: ",
            "scenario `lidar_under_way`: `step` is 0, but should be positive",
            "M141",
            "4 errors, 0 warnings",
        ],
    );
}

#[test]
fn what_cannot_be_planned_with_is_told_without_planning() {
    check(
        &[
            ("domain.pddl", "(= ?duration (grasp_time))", "(= ?duration (battery))"),
            ("domain.pddl", "(= ?duration 3)", "(= ?duration (+ 3 (battery)))"),
        ],
        3,
        &["E301", "depends on the state", "2 errors, 0 warnings"],
    );
}

#[test]
fn a_contradiction_is_an_error() {
    let outcome = check(
        &[("robot.ttl", ":c_lamp a t:Component .", ":c_lamp a t:Component , t:Function .")],
        3,
        &["M110", "inconsistent"],
    );
    assert!(outcome.stdout.ends_with("0 warnings\n"), "{}", outcome.stdout);
}

#[test]
fn what_cannot_be_read_is_an_error_and_what_cannot_be_meant_is_usage() {
    let outcome = metaplan_in(Path::new("/"), &["lint", "no/such.toml"], "");
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    assert!(outcome.stdout.contains("M101"), "{outcome:#?}");
    assert_eq!(metaplan(&["lint", "missions/ugv.toml", "--scenario", "none"]).status, 2);
}
