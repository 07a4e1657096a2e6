//! Tests of `metaplan simulate`, which runs the loop and baseline strategies in identical worlds.

use serde_json::Value;

use crate::common::{edit, metaplan, metaplan_in, root};

/// Simulates a scenario and asserts that no strategy is better than the loop. Returns for each strategy:
/// name, number of accomplished missions, and numbers of runs that are better and worse than the run of the
/// loop.
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

fn worse_runs(rows: &[(String, u64, u64, u64)], strategy: &str) -> u64 {
    rows.iter().find(|row| row.0 == strategy).expect("the strategy").3
}

fn compare(runs: usize) {
    let run_count = runs as u64;
    for (mission, scenario) in [("ugv", "kinect_at_wp2"), ("uuv", "battery_under_way")] {
        let rows = check(mission, scenario, runs);
        assert_eq!(rows[0], ("joint".to_owned(), run_count, 0, 0), "{scenario}");
        // The claim of the paper: route and designs, order and speed must be chosen together.
        for strategy in ["failure", "greedy", "random", "none"] {
            assert_eq!(worse_runs(&rows, strategy), run_count, "{strategy} in {scenario}");
        }
    }
    for (mission, scenario) in [("ugv", "kinect_comes_and_goes"), ("uuv", "suave")] {
        let rows = check(mission, scenario, runs);
        assert_eq!(rows[0], ("joint".to_owned(), run_count, 0, 0), "{scenario}");
        assert!(worse_runs(&rows, "failure") > 0 && worse_runs(&rows, "none") > 0, "{scenario}: {rows:?}");
    }
}

#[test]
fn loop_is_never_worse() {
    compare(1);
}

#[test]
#[ignore = "takes minutes"]
fn loop_is_never_worse_over_thirty_seeds() {
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
    let first_run = lines.next().expect("a run");
    assert!(
        first_run.starts_with("joint,7,true,") && first_run.contains(",True,") && first_run.ends_with(",4,0"),
        "{first_run}"
    );
    for line in log.lines() {
        let value: Value = serde_json::from_str(line).expect("JSON");
        assert!(value["event"].is_string() || value["answer"].is_string(), "{line}");
    }
    assert!(log.contains("recharge"), "{log}");
}

#[test]
fn runs_without_events_have_no_reaction_time() {
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
fn scenarios_with_a_simulation_are_suggested() {
    let outcome = metaplan(&["simulate", "missions/ugv.toml", "--scenario", "bright_sun"]);
    assert_eq!(outcome.status, 2);
    assert!(outcome.stderr.contains("kinect_at_wp2"), "{outcome:#?}");
}

/// Returns the log of a simulation of the warehouse in which the lidar fails for 10 units of time. The
/// default unit is the second.
fn simulate_lidar_outage(unit: &str, settle: u32) -> Vec<Value> {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    assert_eq!(metaplan_in(here, &["init", "m", "--from", "warehouse"], "").status, 0);
    edit(
        &here.join("m"),
        "mission.toml",
        "problem = \"problem.pddl\"",
        &format!("problem = \"problem.pddl\"{unit}"),
    );
    let scenario = format!(
        "\n[adaptation]\nsettle = {settle}\nheal_time = 0\n[scenarios.flicker.simulation]\nstep = 1\ntime_budget = 600\npatience = 5\n\
         [[scenarios.flicker.simulation.events]]\nat = 10\nfail = [\"c_lidar\"]\n\
         [[scenarios.flicker.simulation.events]]\nat = 20\nrecover = [\"c_lidar\"]\n"
    );
    let manifest = here.join("m/mission.toml");
    let text = std::fs::read_to_string(&manifest).expect("text") + &scenario;
    std::fs::write(manifest, text).expect("written");
    let arguments = [
        "simulate",
        "m/mission.toml",
        "--scenario",
        "flicker",
        "--strategy",
        "joint",
        "--log",
        "log.jsonl",
        "--csv",
        "runs.csv",
    ];
    let outcome = metaplan_in(here, &arguments, "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let log = std::fs::read_to_string(here.join("log.jsonl")).expect("a log");
    log.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

#[test]
fn clock_of_the_loop_is_in_seconds() {
    for (unit, second, settle) in [
        ("", 1.0, 30),
        ("\ntime_unit = \"seconds\"", 1.0, 30),
        ("\ntime_unit = \"minutes\"", 60.0, 30),
        ("\ntime_unit = \"minutes\"", 60.0, 1800),
        ("\ntime_unit = \"hours\"", 3600.0, 108_000),
    ] {
        let log = simulate_lidar_outage(unit, settle);
        let (mut now, mut failure_time, mut recovery_time, mut replanning_time) = (0.0, None, None, None);
        for line in &log {
            now = line["time"].as_f64().unwrap_or(now);
            if line["event"] == "component_status" {
                let place = if line["status"] == "FALSE" { &mut failure_time } else { &mut recovery_time };
                place.get_or_insert(now);
            }
            if recovery_time.is_some() && line["answer"] == "plan_requested" {
                replanning_time.get_or_insert(now);
            }
        }
        // Reports are sent at each step, here one time unit of the domain, and at the ends of actions.
        let (failure_time, recovery_time) =
            (failure_time.expect("it fails"), recovery_time.expect("it is back"));
        assert!(
            (failure_time / second - 10.0).abs() < 1.0 && (recovery_time / second - 20.0).abs() < 1.0,
            "{unit}: {failure_time}, {recovery_time}"
        );
        let replanning_time = replanning_time.expect("a better plan is looked for");
        let delay = replanning_time - recovery_time + 1e-6;
        assert!(
            delay >= f64::from(settle) && delay <= f64::from(settle) + 2.0 * second,
            "{unit}, {settle}: {delay}"
        );
    }
}

#[test]
fn units_are_shown() {
    let arguments =
        ["simulate", "missions/uuv.toml", "--scenario", "battery_under_way", "--strategy", "failure"];
    let text = metaplan(&arguments).stdout;
    assert!(text.contains("reaction (minutes)"), "{text}");
    let directory = tempfile::tempdir().expect("a directory");
    let mission = root().join("missions/uuv.toml").display().to_string();
    let arguments = [
        "simulate",
        &mission,
        "--scenario",
        "battery_under_way",
        "--strategy",
        "failure",
        "--format",
        "json",
        "--csv",
        "runs.csv",
    ];
    let answer = metaplan_in(directory.path(), &arguments, "").json();
    assert_eq!(answer["time_unit"], "minutes");
    let csv = std::fs::read_to_string(directory.path().join("runs.csv")).expect("a file");
    let row: Vec<&str> = csv.lines().nth(1).expect("a run").split(',').collect();
    let seconds = |column: usize| row[row.len() - column].parse::<f64>().expect("a number");
    for (column, figure) in [(3, "found"), (1, "reaction")] {
        let minutes = answer["runs"][0][figure].as_f64().expect("a time");
        assert!(
            minutes > 0.0 && (seconds(column) - 60.0 * minutes).abs() < 0.001,
            "{figure}: {csv} {answer}"
        );
    }
}

/// In the tutorial's knowledge base, the requirements of actions depend on their context: no light
/// in the dark aisle, and a gentle grip for fragile items. The strategies `greedy` and `random`
/// request no design that violates a requirement, and accomplish the mission.
#[test]
fn greedy_control_observes_requirements() {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    assert_eq!(metaplan_in(here, &["init", "m", "--from", "warehouse"], "").status, 0);
    for strategy in ["greedy", "random"] {
        let arguments = [
            "simulate",
            "m/mission.toml",
            "--scenario",
            "lidar_under_way",
            "--strategy",
            strategy,
            "--runs",
            "3",
            "--format",
            "json",
            "--log",
            "log.jsonl",
        ];
        let answer = metaplan_in(here, &arguments, "").json();
        assert_eq!(answer["strategies"][0]["accomplished"], 3, "{strategy}: {answer:#}");
        for line in std::fs::read_to_string(here.join("log.jsonl")).expect("a log").lines() {
            let line: Value = serde_json::from_str(line).expect("JSON");
            let (configuration, arguments) = (&line["configuration"], line["arguments"].to_string());
            if line["effect"].is_null() || configuration.is_null() {
                continue;
            }
            let is_dark = arguments.contains("crossing") && arguments.contains("far_rack");
            assert!(!is_dark || configuration["f_navigate"] != "fd_camera", "{strategy}: {line}");
            assert!(
                !arguments.contains("vase") || configuration["f_grasp"] != "fd_gripper",
                "{strategy}: {line}"
            );
        }
    }
}

/// A mission from outside the project, if available. The test lists the requirements of the mission's rooms
/// and corridors by hand.
#[test]
fn greedy_control_observes_requirements_in_a_ward() {
    let Some(ward) = test_resources::data("field3/newcomer3/ward/mission.toml") else { return };
    let directory = tempfile::tempdir().expect("a directory");
    let ward = ward.display().to_string();
    let arguments = [
        "simulate",
        &ward,
        "--scenario",
        "bad_night",
        "--strategy",
        "greedy",
        "--runs",
        "2",
        "--format",
        "json",
        "--log",
        "log.jsonl",
    ];
    let outcome = metaplan_in(directory.path(), &arguments, "");
    assert_eq!(outcome.json()["strategies"][0]["accomplished"], 2, "{outcome:#?}");
    let forbidden = [
        ("drive", ["hall", "ward_a"], "f_drive", "fd_lidar_slam"),
        ("drive", ["hall", "icu"], "f_drive", "fd_lidar_slam"),
        ("drive", ["ward_b", "lab"], "f_drive", "fd_lidar_slam"),
        ("disinfect", ["icu", "icu"], "f_disinfect", "fd_mop"),
        ("disinfect", ["lab", "lab"], "f_disinfect", "fd_mop"),
    ];
    let log = std::fs::read_to_string(directory.path().join("log.jsonl")).expect("a log");
    let mut requests = 0;
    for line in
        log.lines().filter(|line| line.contains("\"request_action\"") || line.contains("\"configuration\""))
    {
        let line: Value = serde_json::from_str(line).expect("JSON");
        requests += usize::from(!line["configuration"].is_null());
        for (action, rooms, function, design) in &forbidden {
            let arguments = line["arguments"].to_string();
            let is_in_rooms = rooms.iter().all(|room| arguments.contains(&format!("\"{room}\"")));
            let is_forbidden =
                line["name"] == *action && is_in_rooms && line["configuration"][function] == *design;
            assert!(!is_forbidden, "{line}");
        }
    }
    assert!(requests > 0, "{log}");
}

#[test]
fn repeated_strategies_and_large_seeds_are_simulated_once() {
    let mut arguments = vec!["simulate", "missions/ugv.toml", "--scenario", "kinect_at_wp2"];
    arguments.extend(["--strategy", "none", "--strategy", "none", "--seed", "18446744073709551615"]);
    arguments.extend(["--runs", "2"]);
    let outcome = metaplan(&arguments);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    assert!(outcome.stdout.contains(" of 2 "), "{outcome:#?}");
}

/// Simulates the ground vehicle in a scenario with these settings and events. Returns the run.
fn simulate_stalled(settings: &str) -> Value {
    let directory = tempfile::tempdir().expect("a directory");
    let path = |name: &str| root().join(name).display().to_string();
    let events = "[[scenarios.s.simulation.events]]";
    let text = format!(
        "name = 'm'\n[knowledge]\nfiles = ['{}']\n[planning]\ndomain = '{}'\nproblem = '{}'\n\
         time_unit = 'minutes'\n[scenarios.s]\ndescription = 'e'\n[scenarios.s.simulation]\nstep = 0.1\n\
         time_budget = 20\npatience = 0.5\n{}\n",
        path("ontology/kb/ugv.ttl"),
        path("encodings/ugv/domain.pddl"),
        path("encodings/ugv/problem.pddl"),
        settings.replace("[[event]]", events)
    );
    let file = directory.path().join("m.toml");
    std::fs::write(&file, text).expect("written");
    let arguments = ["simulate", file.to_str().expect("UTF-8"), "--scenario", "s", "--strategy", "joint"];
    let outcome = metaplan(&[&arguments[..], &["--format", "json"]].concat());
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    outcome.json()["runs"][0].clone()
}

#[test]
fn events_and_losses_do_not_need_a_working_action() {
    let fail = "[[event]]\nat = 0\nfail = ['c_kinect', 'c_lidar', 'c_camera']\n";
    let recovered = simulate_stalled(&format!(
        "{fail}[[event]]\nat = 2\nset = {{robot_at = 'wp5'}}\n[[event]]\nwhen = 'robot_at wp5'\n\
         recover = ['c_kinect', 'c_lidar', 'c_camera']\n"
    ));
    assert_eq!(recovered["accomplished"], true, "{recovered:#}");
    let lost = simulate_stalled(&format!(
        "lifeline = 'battery'\n{fail}[[event]]\nat = 0.5\nset = {{battery = '0'}}\n"
    ));
    assert_eq!(lost["lost"], true, "{lost:#}");
}

/// The loop must receive the same change of a measured attribute as the simulated world.
#[test]
fn events_that_set_an_attribute_are_measurements() {
    let dazzled = simulate_stalled("[[event]]\nat = 0.5\nset = {ambient_light = '0.9'}\n");
    assert_eq!((&dazzled["accomplished"], &dazzled["failed"]), (&true.into(), &0.into()), "{dazzled:#}");
}

#[test]
fn failed_missions_are_reported_with_the_reason() {
    let arguments =
        ["simulate", "missions/ugv.toml", "--scenario", "kinect_at_wp2", "--strategy", "none", "--runs", "2"];
    let outcome = metaplan(&arguments);
    assert!(outcome.stdout.contains("none: none of 2 accomplished; 2 gave up"), "{outcome:#?}");
}
