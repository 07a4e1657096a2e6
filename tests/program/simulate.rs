//! `metaplan simulate`: the loop beside other ways of control, in the same worlds.

use serde_json::Value;

use crate::common::{metaplan, metaplan_in, root};

/// Runs a scenario; by strategy: how many missions were accomplished, and were better and worse than the loop's.
fn check(mission: &str, scenario: &str, runs: usize) -> Vec<(String, u64, u64, u64)> {
    let (file, count) = (format!("missions/{mission}.toml"), runs.to_string());
    let arguments =
        ["simulate", &file, "--scenario", scenario, "--runs", &count, "--format", "json", "--quiet"];
    let outcome = metaplan(&arguments);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let answer = outcome.json();
    assert_eq!(answer["format"], "metaplan-simulate/1");
    let number = |value: &Value| value.as_u64().expect("a number");
    let row = |row: &Value| {
        let name = row["strategy"].as_str().expect("a name").to_owned();
        let better = number(&row["better_than_joint"]);
        assert_eq!(better, 0, "{name} is better than the loop in {scenario}");
        (name, number(&row["accomplished"]), better, number(&row["worse_than_joint"]))
    };
    answer["strategies"].as_array().expect("strategies").iter().map(row).collect()
}

fn worse(rows: &[(String, u64, u64, u64)], strategy: &str) -> u64 {
    rows.iter().find(|row| row.0 == strategy).expect("the strategy").3
}

/// The comparison over some seeds.
fn compare(runs: usize) {
    let all = runs as u64;
    for (mission, scenario) in [("ugv", "kinect_at_wp2"), ("uuv", "battery_under_way")] {
        let rows = check(mission, scenario, runs);
        assert_eq!(rows[0], ("joint".to_owned(), all, 0, 0), "{scenario}");
        // The paper's argument: route and design, order and speed, only fit together.
        for strategy in ["failure", "greedy", "random", "none"] {
            assert_eq!(worse(&rows, strategy), all, "{strategy} in {scenario}");
        }
    }
    for (mission, scenario) in [("ugv", "kinect_comes_and_goes"), ("uuv", "suave")] {
        let rows = check(mission, scenario, runs);
        assert_eq!(rows[0], ("joint".to_owned(), all, 0, 0), "{scenario}");
        assert!(worse(&rows, "failure") > 0 && worse(&rows, "none") > 0, "{scenario}: {rows:?}");
    }
}

#[test]
fn the_loop_is_never_worse() {
    compare(1);
}

#[test]
#[ignore = "takes minutes"]
fn the_loop_is_never_worse_over_thirty_seeds() {
    compare(30);
}

#[test]
fn simulations_are_repeatable_and_logged() {
    let directory = tempfile::tempdir().expect("a directory");
    let mission = root().join("missions/uuv.toml").display().to_string();
    let run = |name: &str| {
        let (log, csv) = (format!("{name}.log"), format!("{name}.csv"));
        let outcome = metaplan_in(
            directory.path(),
            &[
                "simulate",
                &mission,
                "--scenario",
                "battery_under_way",
                "--strategy",
                "joint",
                "--runs",
                "2",
                "--seed",
                "7",
                "--log",
                &log,
                "--csv",
                &csv,
            ],
            "",
        );
        assert_eq!(outcome.status, 0, "{outcome:#?}");
        let read = |name: &str| std::fs::read_to_string(directory.path().join(name)).expect("a file");
        (outcome.stdout, read(&log), read(&csv))
    };
    let (text, log, csv) = run("one");
    assert_eq!(run("two"), (text, log.clone(), csv.clone()));
    let mut lines = csv.lines();
    let header = lines.next().expect("a header");
    let suave = "pipeline found,time searching pipeline (s),distance inspected (m),mean reaction time (s)";
    assert!(header.ends_with(suave), "{header}");
    let first = lines.next().expect("a run");
    assert!(
        first.starts_with("joint,7,true,") && first.contains(",True,") && first.ends_with(",4,0"),
        "{first}"
    );
    for line in log.lines() {
        let value: Value = serde_json::from_str(line).expect("JSON");
        assert!(value["event"].is_string() || value["answer"].is_string(), "{line}");
    }
    assert!(log.contains("recharge"), "{log}");
}

#[test]
fn no_event_is_not_a_reaction_at_once() {
    let directory = tempfile::tempdir().expect("a directory");
    let mission = root().join("missions/ugv.toml").display().to_string();
    let arguments = [
        "simulate",
        &mission,
        "--scenario",
        "undisturbed",
        "--strategy",
        "joint",
        "--csv",
        "runs.csv",
        "--quiet",
    ];
    let outcome = metaplan_in(directory.path(), &arguments, "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let csv = std::fs::read_to_string(directory.path().join("runs.csv")).expect("a file");
    assert!(csv.trim_end().ends_with(",,,,no event"), "{csv}");
}

#[test]
fn scenarios_without_simulation_are_named() {
    let outcome = metaplan(&["simulate", "missions/ugv.toml", "--scenario", "bright_sun"]);
    assert_eq!(outcome.status, 2);
    assert!(outcome.stderr.contains("kinect_at_wp2"), "{outcome:#?}");
}
