//! Tests of commands with several results. At a time limit and at Ctrl-C, the commands show the completed
//! results and report that results are missing.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::{Value, json};
use test_resources::{Resource, missing};

#[cfg(unix)]
use crate::common::is_ignored;
use crate::common::{Outcome, metaplan, metaplan_in, root};

/// Time limits in seconds, tried in this order. On a busy machine the first limits can end before there is
/// any result.
const SECONDS: [u32; 4] = [5, 15, 60, 180];

const SIMULATE: [&str; 6] =
    ["simulate", "missions/ugv.toml", "--scenario", "kinect_comes_and_goes", "--strategy", "joint"];

#[cfg(unix)]
fn interrupted(directory: &Path, arguments: &[&str], seconds: u32) -> Outcome {
    let child = Command::new(env!("CARGO_BIN_EXE_metaplan"))
        .args(arguments)
        .current_dir(directory)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    std::thread::sleep(Duration::from_secs(seconds.into()));
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill").success());
    let output = child.wait_with_output().expect("it ends");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    Outcome {
        status: output.status.code().unwrap_or(-1),
        stdout: text(output.stdout),
        stderr: text(output.stderr),
    }
}

/// Ends a command early: once by a time limit, and once by SIGINT unless this signal is ignored. The time is
/// increased until there is a result. `count_results` counts the results of an answer. Returns the answers.
fn check(
    directory: &Path,
    arguments: &[&str],
    status: i32,
    count_results: impl Fn(&Value) -> usize,
) -> Vec<Value> {
    let json = ["--format", "json", "--quiet"];
    let by_limit = |seconds: u32| {
        let limit = seconds.to_string();
        metaplan_in(directory, &[arguments, &["--time-limit", &limit], &json].concat(), "")
    };
    let mut interruptions: Vec<Box<dyn Fn(u32) -> Outcome + '_>> = vec![Box::new(by_limit)];
    #[cfg(unix)]
    if !is_ignored(2) {
        interruptions.push(Box::new(|seconds| interrupted(directory, &[arguments, &json].concat(), seconds)));
    }
    let answers = interruptions.iter().map(|interrupt| {
        let answer_with_results = SECONDS.iter().find_map(|&seconds| {
            let outcome = interrupt(seconds);
            // While the input files are read, there is no result yet.
            let answer: Value = serde_json::from_str(&outcome.stdout).ok()?;
            let has_results = answer["format"] != "metaplan-error/1" && count_results(&answer) > 0;
            assert!(!has_results || outcome.status == status, "{outcome:#?}");
            has_results.then_some(answer)
        });
        answer_with_results.unwrap_or_else(|| panic!("{arguments:?} never shows anything"))
    });
    let answers: Vec<Value> = answers.collect();
    for answer in &answers {
        assert_eq!(answer["messages"][0]["code"], "M130", "{answer:#}");
    }
    answers
}

#[test]
fn interrupted_simulations_show_the_finished_runs() {
    let arguments = [&SIMULATE[..], &["--strategy", "none", "--runs", "100000"]].concat();
    let count = |answer: &Value| answer["runs"].as_array().map_or(0, Vec::len);
    for answer in check(&root(), &arguments, 12, count) {
        assert_eq!((&answer["complete"], &answer["missions"]), (&json!(false), &json!(200_000)));
        let runs_of = |strategy: &str| -> Vec<Value> {
            let runs = answer["runs"].as_array().expect("runs").iter();
            runs.filter(|run| run["strategy"] == strategy).cloned().collect()
        };
        // Each seed is simulated with all strategies before the next seed. The completed runs equal the first
        // runs of a simulation without a limit.
        let (joint, none) = (runs_of("joint"), runs_of("none"));
        assert!(joint.len() - none.len() <= 1, "{} and {}", joint.len(), none.len());
        let count = joint.len().min(5).to_string();
        let uninterrupted =
            metaplan(&[&SIMULATE[..], &["--runs", &count, "--format", "json", "--quiet"]].concat()).json();
        assert_eq!(uninterrupted["complete"], true);
        assert_eq!(uninterrupted["runs"].as_array().expect("runs")[..], joint[..joint.len().min(5)]);
    }
    let text_outcome = metaplan(&[&SIMULATE[..], &["--runs", "100000", "--time-limit", "3"]].concat());
    assert_eq!(text_outcome.status, 12, "{text_outcome:#?}");
    assert!(text_outcome.stderr.contains("M130"), "{text_outcome:#?}");
}

#[test]
fn interrupted_studies_can_be_resumed() {
    let folder = tempfile::tempdir().expect("a directory");
    let mission = root().join("missions/ugv.toml");
    let study = format!(
        "command = ['simulate', '{}', '--scenario', 'kinect_at_wp2', '--strategy', 'joint']\nrows = '/runs'\n\
         [vary]\nseed = {{ from = 1, to = 100000 }}\n",
        mission.display()
    );
    fs::write(folder.path().join("study.toml"), study).expect("written");
    let sweep = ["sweep", "study.toml", "--output", "results", "--resume"];
    let count = |answer: &Value| answer["done"].as_u64().map_or(0, |done| done as usize);
    let answers = check(folder.path(), &sweep, 1, count);
    // With `--resume`, a later run starts from the results of the interrupted runs.
    assert!(answers.windows(2).all(|pair| count(&pair[0]) <= count(&pair[1])), "{answers:#?}");
    // An interrupted run is not counted as a failure.
    for answer in &answers {
        assert_eq!((&answer["failed"], &answer["timed_out"]), (&json!(0), &json!(0)), "{answer:#}");
    }
    let lines = fs::read_to_string(folder.path().join("results/shard-0001-of-0001.jsonl")).expect("lines");
    for line in lines.lines().skip(1) {
        let line: Value = serde_json::from_str(line).expect("JSON");
        assert_eq!((&line["status"], &line["answer"]["complete"]), (&json!(0), &json!(true)), "{line}");
    }
}

#[test]
fn interrupted_comparisons_show_finished_results() {
    let arguments = ["compare", "missions/camara_like.toml", "--no-battery", "--pairs", "1000"];
    let count = |answer: &Value| answer["comparisons"].as_array().map_or(0, Vec::len);
    for answer in check(&root(), &arguments, 12, count) {
        assert_eq!(answer["complete"], false);
    }
}

/// Linux does not deliver signals to process 1 of a container that this process does not handle.
#[cfg(target_os = "linux")]
#[test]
fn a_signal_ends_a_command_without_partial_results_that_is_process_1() {
    let unshare = || Command::new("unshare");
    let status = unshare().args(["-rpf", "true"]).stderr(Stdio::null()).status();
    if !status.is_ok_and(|status| status.success()) {
        missing(Resource::Namespaces, "unshare cannot create a namespace of processes");
        return;
    }
    for signal in ["-INT", "-TERM", "-HUP"] {
        let mut child = unshare()
            .args(["-rpf", env!("CARGO_BIN_EXE_metaplan"), "run", "missions/ugv.toml"])
            .current_dir(root())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("a pipe")).read_line(&mut line).expect("text");
        assert!(line.contains("answer"), "{line}");
        let path = format!("/proc/{0}/task/{0}/children", child.id());
        let process = fs::read_to_string(path).expect("the child of `unshare`");
        assert!(Command::new("kill").args([signal, process.trim()]).status().expect("kill").success());
        // Without a handler, the program would end with status 0 at the end of its input.
        drop(child.stdin.take());
        assert_eq!(child.wait().expect("it ends").code(), Some(130), "{signal}");
    }
}
