//! Tests of answers at a time limit and of alternative plans: they contain the results found by then, and no
//! false claims.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::{Value, json};
use test_resources::data;

use crate::common::{copy_folder, edit, metaplan, metaplan_in, root};

fn ward(large: bool) -> Option<tempfile::TempDir> {
    let folder = data("field3/newcomer3/ward")?;
    let directory = tempfile::tempdir().expect("a directory");
    copy_folder(&folder, directory.path());
    if large {
        edit(directory.path(), "mission.toml", "problem.pddl", "problem-large.pddl");
    }
    Some(directory)
}

fn missions() -> Vec<(PathBuf, &'static str)> {
    let ward = ward(false).map(|directory| (directory.keep(), "mission.toml"));
    let shipped = ["missions/templates/warehouse/mission.toml", "missions/ugv.toml", "missions/uuv.toml"];
    shipped.map(|mission| (root(), mission)).into_iter().chain(ward).collect()
}

fn plan(directory: &Path, arguments: &[&str]) -> Value {
    let command = [&["plan"][..], arguments, &["--format", "json"]].concat();
    metaplan_in(directory, &command, "").json()
}

/// Each alternative plan is valid, distinct, and as cheap as the first plan. There are three alternatives
/// unless the program proves that fewer exist.
#[test]
fn three_alternatives_are_found_within_the_limit() {
    for (directory, mission) in missions() {
        let answer = plan(&directory, &[mission, "--alternatives", "3", "--time-limit", "60"]);
        let alternatives = &answer["alternatives"];
        let plans = alternatives["plans"].as_array().unwrap_or_else(|| panic!("{mission}: {answer:#}"));
        assert!(plans.len() == 3 || alternatives["complete"] == true, "{mission}: {answer:#}");
        assert!(!alternatives["forced"].is_null(), "{mission}: {answer:#}");
        let mut distinct_plans = vec![answer["steps"].clone()];
        for steps in plans {
            let file = tempfile::NamedTempFile::new().expect("a file");
            let mut answer_with_steps = answer.clone();
            answer_with_steps["steps"] = steps.clone();
            std::fs::write(file.path(), answer_with_steps.to_string()).expect("a file");
            let file = file.path().display().to_string();
            let verdict =
                metaplan_in(&directory, &["validate", mission, &file, "--format", "json"], "").json();
            assert_eq!((&verdict["valid"], &verdict["metric"]), (&json!(true), &answer["cost"]), "{mission}");
            assert!(!distinct_plans.contains(steps), "{mission}: a plan is listed twice");
            distinct_plans.push(steps.clone());
        }
    }
}

/// The sequential plan, with gaps between its actions, is also a concurrent plan. So an optimal concurrent
/// plan must not cost more.
#[test]
fn overlapping_plans_cost_no_more_than_the_sequential_one() {
    for (directory, mission) in missions() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        let sequential = metaplan_in(&directory, &["plan", mission, "--plan-format", "plansys2"], "");
        std::fs::write(file.path(), sequential.stdout).expect("a file");
        let file = file.path().display().to_string();
        let validate = ["validate", mission, &file, "--concurrent", "--format", "json"];
        let verdict = metaplan_in(&directory, &validate, "").json();
        let Some(bound) = verdict["metric"].as_f64().filter(|_| verdict["valid"] == true) else { continue };
        let answer = plan(&directory, &[mission, "--concurrent", "--time-limit", "10"]);
        let cost = answer["cost"].as_f64().unwrap_or_else(|| panic!("{mission}: {answer:#}"));
        assert!(cost <= bound + 1e-9, "{mission}: {cost} > {bound}");
    }
}

#[test]
fn reasons_are_explained_before_planning() {
    let Some(directory) = ward(true) else { return };
    let query = ["explain", "mission.toml", "fd_uv", "--fail", "c_uv_lamp", "--time-limit", "2"];
    let outcome = metaplan_in(directory.path(), &query, "");
    assert_eq!(outcome.status, 1, "{outcome:#?}");
    let why = "fd_uv (f_disinfect) is not available\n";
    assert!(outcome.stdout.starts_with(why), "{outcome:#?}");
    assert!(outcome.stdout.contains("it is available again if\n    c_uv_lamp works again: "), "{outcome:#?}");
    assert!(outcome.stdout.contains("not proved"), "{outcome:#?}");
    let answer = metaplan_in(directory.path(), &[&query[..], &["--format", "json"]].concat(), "").json();
    assert_eq!((&answer["complete"], &answer["available"]), (&json!(false), &json!(false)), "{answer:#}");
}

#[cfg(unix)]
#[test]
fn partial_explanations_are_printed_on_a_signal() {
    let Some(directory) = ward(true) else { return };
    let mut child = Command::new(env!("CARGO_BIN_EXE_metaplan"))
        .args(["explain", "mission.toml", "fd_uv", "--fail", "c_uv_lamp"])
        .current_dir(directory.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    // The sleep suffices for the reasons, which are computed first, but not for planning.
    std::thread::sleep(Duration::from_secs(3));
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("kill");
    let status = child.wait().expect("it ends");
    let mut text = String::new();
    std::io::Read::read_to_string(&mut child.stdout.take().expect("a pipe"), &mut text).expect("text");
    assert_eq!(status.code(), Some(1), "{text}");
    assert!(text.starts_with("fd_uv (f_disinfect) is not available\n"), "{text}");
    assert!(text.contains("not proved"), "{text}");
}

#[test]
fn fronts_at_a_limit_are_not_claimed_to_be_complete() {
    let Some(directory) = ward(true) else { return };
    let front = ["mission.toml", "--pareto", "(total-time),(waited)", "--time-limit", "2"];
    let answer = plan(directory.path(), &front);
    assert!(answer["status"] != "optimal" && answer["points"].is_array(), "{answer:#}");
}

/// At a limit of 0 there is no result, so each command reports an error.
#[test]
fn a_time_limit_of_zero_is_reported_as_an_error() {
    let ugv = "ontology/kb/ugv.ttl";
    let commands: [&[&str]; 6] = [
        &["reason", ugv],
        &["lint", "missions/ugv.toml"],
        &["convert", ugv, "--to", "turtle"],
        &["export", "missions/ugv.toml", "--to", "pddl"],
        &["validate", "missions/ugv.toml", "missions/ugv.toml"],
        &["explain", "missions/ugv.toml"],
    ];
    for command in commands {
        let outcome = metaplan(&[command, &["--time-limit", "0"]].concat());
        assert_eq!(outcome.status, 12, "{command:?}: {outcome:#?}");
        assert!(outcome.stderr.contains("M130") && outcome.stdout.is_empty(), "{command:?}: {outcome:#?}");
    }
}
