//! Tests of mistakes in scenarios, situations and studies, such as unknown names: all errors are reported
//! with their positions, and nothing is simulated.

use std::fs;

use crate::common::{edit, metaplan_in};

/// Runs `lint` and `simulate` on the warehouse mission after textual changes and checks the errors. Each
/// expected error begins at the given text and contains the given words.
fn check(changes: &[(&str, &str, &str)], expected: &[(&str, &[&str])]) {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    assert_eq!(metaplan_in(here, &["init", "m", "--from", "warehouse"], "").status, 0);
    for (file, old, new) in changes {
        edit(&here.join("m"), file, old, new);
    }
    let text = fs::read_to_string(here.join("m/mission.toml")).expect("text");
    let simulate = [
        "simulate",
        "m/mission.toml",
        "--scenario",
        "lidar_under_way",
        "--strategy",
        "joint",
        "--format",
        "json",
    ];
    for arguments in [&["lint", "m/mission.toml", "--format", "json"][..], &simulate] {
        let outcome = metaplan_in(here, arguments, "");
        assert_eq!(outcome.status, 3, "{arguments:?}: {outcome:#?}");
        let answer = outcome.json();
        let messages = answer["messages"].as_array().expect("messages");
        let errors = messages.iter().filter(|message| message["severity"] == "error");
        assert_eq!(errors.count(), expected.len(), "{arguments:?}: {answer:#}");
        for (place, words) in expected {
            // The position of an error is the first occurrence of the text in the manifest.
            let offset = text.find(place).unwrap_or_else(|| panic!("no {place}"));
            let line = text[..offset].matches('\n').count() + 1;
            let column = offset - text[..offset].rfind('\n').map_or(0, |end| end + 1) + 1;
            let is_at_place = |message: &&serde_json::Value| {
                message["line"] == line && message["column"] == column && message["file"] == "m/mission.toml"
            };
            let error = messages
                .iter()
                .find(is_at_place)
                .unwrap_or_else(|| panic!("nothing at {line}:{column}: {answer:#}"));
            let error_text = error.to_string();
            for word in *words {
                assert!(error_text.contains(word), "no `{word}`: {error:#}");
            }
        }
    }
}

const MISSION: &str = "mission.toml";
const WHEN: &str = "when = \"robot_at dock\"";

#[test]
fn unknown_names_in_event_conditions_are_reported() {
    for (new, place, words) in [
        ("when = \"robot_a dock\"", "robot_a dock", &["P121", "`robot_a`", "did you mean `robot_at`?"][..]),
        ("when = \"robot_at dok\"", "dok\"", &["`dok`", "did you mean `dock`?"]),
        ("when = \"(robot_at dok)\"", "dok)", &["`dok`", "did you mean `dock`?"]),
        ("when = \"robot_at dock crossing\"", "robot_at dock crossing", &["P125", "takes 1 argument"]),
        ("when = \"robot_at box\"", "box\"", &["P126", "`box`"]),
        ("when = \"(robot_at dock\"", "\"(robot_at dock\"", &["M135", "parentheses"]),
        ("when = \"\"", "\"\"\nwithin", &["M135", "is not a condition"]),
        ("when = \"(< (batery) 3)\"", "(batery)", &["P122", "did you mean `battery`?"]),
    ] {
        // The position of an atom's error is the position of its predicate, after the parenthesis.
        let place = if place == "(batery)" { "batery" } else { place };
        check(&[(MISSION, WHEN, new)], &[(place, words)]);
    }
}

#[test]
fn events_have_a_time_or_a_condition_and_do_something() {
    let event = "[[scenarios.lidar_under_way.simulation.events]]";
    check(&[(MISSION, WHEN, "")], &[(event, &["M135", "neither `at` nor `when`"])]);
    check(
        &[(MISSION, WHEN, "at = 3\nwhen = \"robot_at dock\"")],
        &[("\"robot_at dock\"", &["both `at` and `when`"])],
    );
    check(&[(MISSION, WHEN, "at = 700")], &[("700", &["`time_budget`", "never takes place"])]);
    check(&[(MISSION, "within = 70\nfail = [\"c_lidar\"]", "within = 70")], &[(event, &["does nothing"])]);
}

#[test]
fn simulations_have_a_limited_time_and_number_of_failures() {
    let event = "[[scenarios.lidar_under_way.simulation.events]]";
    let failure = "[[scenarios.lidar_under_way.simulation.failures]]\ncomponent = \"c_lidar\"\n\
                   mean_time = 1e-7\nrecovery = 0\n";
    check(
        &[(MISSION, event, &format!("{failure}{event}"))],
        &[("1e-7", &["M135", "more than a million times"])],
    );
    check(
        &[(MISSION, "step = 1 ", "step = 1e7 "), (MISSION, "time_budget = 600", "time_budget = 1e12")],
        &[("1e12", &["M135", "at most 1e9"])],
    );
}

#[test]
fn all_unknown_names_of_a_scenario_are_reported_together() {
    check(
        &[
            (MISSION, "patience = 5 ", "lifeline = \"batery\"\npatience = 0 "),
            (
                MISSION,
                "within = 70\nfail = [\"c_lidar\"]",
                "within = -1\nfail = [\"c_lidra\"]\nset = { robot_at = \"dok\" }",
            ),
        ],
        &[
            ("batery", &["P122", "did you mean `battery`?"]),
            ("0      # seconds that", &["`patience` is 0, but should be positive"]),
            ("-1", &["`within` is -1"]),
            ("\"c_lidra\"", &["did you mean `c_lidar`?"]),
            ("\"dok\"", &["`dok`", "did you mean `dock`?"]),
        ],
    );
    let extra_sections = "\n[[scenarios.lidar_under_way.simulation.signals]]\nattribute = \"air_dst\"\nmean = 0.3\namplitude = 0.1\nperiod = -5\n\
        [[scenarios.lidar_under_way.simulation.failures]]\ncomponent = \"c_arn\"\nmean_time = 9\n\
        [scenarios.lidar_under_way.simulation.suave]\nfound = \"carries vas\"\ninspect = \"mve\"\nlength = \"distanc dock packing\"\n";
    check(
        &[(
            MISSION,
            "within = 70\nfail = [\"c_lidar\"]",
            &format!("within = 70\nfail = [\"c_lidar\"]{extra_sections}"),
        )],
        &[
            ("\"air_dst\"", &["did you mean `air_dust`?"]),
            ("-5", &["`period` is -5"]),
            ("\"c_arn\"", &["did you mean `c_arm`?"]),
            ("vas\"", &["did you mean `vase`?"]),
            ("\"mve\"", &["did you mean `move`?"]),
            ("distanc dock", &["did you mean `distance`?"]),
        ],
    );
}

#[test]
fn all_errors_of_a_situation_are_reported_together() {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    assert_eq!(metaplan_in(here, &["init", "m", "--from", "warehouse"], "").status, 0);
    edit(
        &here.join("m"),
        MISSION,
        "set = { air_dust = \"0.8\" }",
        "set = { air_dst = \"0.8\", robot_at = \"dok\" }",
    );
    for command in ["plan", "run"] {
        let outcome = metaplan_in(here, &[command, "m/mission.toml", "--scenario", "dusty"], "");
        assert_eq!(outcome.status, 3, "{outcome:#?}");
        for words in
            ["scenario `dusty`: ", "did you mean `air_dust`?", "did you mean `dock`?", "mission.toml:"]
        {
            assert!(outcome.stderr.contains(words), "no `{words}`: {outcome:#?}");
        }
    }
}

#[test]
fn parentheses_of_conditions_are_optional() {
    let costs = [
        "robot_at dock",
        "(robot_at dock)",
        " ( robot_at  dock ) ",
        "(and (robot_at dock) (<= (battery) 100))",
    ]
    .map(|condition| {
        let directory = tempfile::tempdir().expect("a directory");
        let here = directory.path();
        assert_eq!(metaplan_in(here, &["init", "m", "--from", "warehouse"], "").status, 0);
        edit(&here.join("m"), MISSION, WHEN, &format!("when = \"{condition}\""));
        let arguments = [
            "simulate",
            "m/mission.toml",
            "--scenario",
            "lidar_under_way",
            "--strategy",
            "joint",
            "--format",
            "json",
        ];
        let outcome = metaplan_in(here, &arguments, "");
        assert_eq!(outcome.status, 0, "{outcome:#?}");
        let run = outcome.json()["runs"][0].clone();
        // The event must take place: without it, there is no failure and the mission is cheaper.
        assert_eq!(run["accomplished"], true);
        run["cost"].as_f64().expect("a cost")
    });
    assert!(costs.iter().all(|cost| (cost - costs[0]).abs() < 1e-9 && *cost > 111.0), "{costs:?}");
}

#[test]
fn unknown_names_in_studies_are_reported() {
    for (study, place, words) in [
        ("command = [\"simulte\", \"m/mission.toml\"]\n", "command", &["simulte", "simulate"][..]),
        (
            "command = [\"simulate\", \"m/mission.toml\", \"--scenario\", \"lidar_under_wa\"]\n",
            "",
            &["M108", "did you mean `lidar_under_way`?"],
        ),
        (
            "command = [\"simulate\", \"m/mission.toml\", \"--scenario\", \"lidar_under_way\"]\n[vary]\nstrategy = [\"joint\", \"gredy\"]\n",
            "\"gredy\"",
            &["M150", "greedy"],
        ),
        (
            "command = [\"simulate\", \"m/mission.toml\", \"--scenario\", \"lidar_under_way\"]\n[vary]\nsede = [1, 2]\n",
            "[\"simulate",
            &["M150", "--sede", "--seed"],
        ),
        (
            "command = [\"plan\", \"m/mission.toml\", \"--set\", \"battery={battry}\"]\n[vary]\nbattery = [12, 13]\n",
            "\"battery={",
            &["M150", "did you mean `battery`?"],
        ),
        (
            "command = [\"plan\", \"m/mission.toml\"]\nrepetitions = [\"horzon\"]\n[vary]\nhorizon = [12, 13]\n",
            "\"horzon\"",
            &["M150", "did you mean `horizon`?"],
        ),
    ] {
        let directory = tempfile::tempdir().expect("a directory");
        let here = directory.path();
        assert_eq!(metaplan_in(here, &["init", "m", "--from", "warehouse"], "").status, 0);
        fs::write(here.join("study.toml"), study).expect("written");
        let outcome = metaplan_in(here, &["sweep", "study.toml", "--output", "results"], "");
        assert_eq!(outcome.status, 3, "{outcome:#?}");
        for word in words {
            assert!(outcome.stderr.contains(word), "no `{word}`: {outcome:#?}");
        }
        if !place.is_empty() && place != "command" {
            let offset = study.find(place).expect("the place");
            let line = study[..offset].matches('\n').count() + 1;
            assert!(outcome.stderr.contains(&format!("study.toml:{line}:")), "line {line}: {outcome:#?}");
        }
        assert!(!here.join("results").exists(), "{study}");
    }
}

/// A JSON pointer to nonexistent rows would yield a table without figures, so it is an error.
#[test]
fn nonexistent_rows_are_an_error() {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    assert_eq!(metaplan_in(here, &["init", "m", "--from", "warehouse"], "").status, 0);
    fs::write(here.join("study.toml"), "command = [\"plan\", \"m/mission.toml\"]\nrows = \"/step\"\n")
        .expect("written");
    assert_eq!(metaplan_in(here, &["sweep", "study.toml", "--output", "results"], "").status, 0);
    let outcome = metaplan_in(here, &["sweep", "study.toml", "--output", "results", "--merge"], "");
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    assert!(
        outcome.stderr.contains("study.toml:2:") && outcome.stderr.contains("did you mean `/steps`?"),
        "{outcome:#?}"
    );
}

#[test]
fn unknown_time_units_are_an_error() {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    assert_eq!(metaplan_in(here, &["init", "m", "--from", "warehouse"], "").status, 0);
    edit(
        &here.join("m"),
        MISSION,
        "problem = \"problem.pddl\"",
        "problem = \"problem.pddl\"\ntime_unit = \"minute\"",
    );
    let outcome = metaplan_in(here, &["lint", "m/mission.toml"], "");
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    assert!(
        outcome.stdout.contains("did you mean `minutes`?") && outcome.stdout.contains("mission.toml:"),
        "{outcome:#?}"
    );
}
