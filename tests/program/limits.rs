//! Tests of limits and signals in early phases, and of certificates: write errors, and statements about the
//! scope of a certificate.

#[cfg(unix)]
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::certificate::{certificate, change};
#[cfg(unix)]
use crate::common::is_ignored;
use crate::common::{copy_of_mission, edit, metaplan, metaplan_in, outcome, root, verifier, verify_in};

/// Waits up to 20 s for the program to end. If it does not end, kills it and returns `None`.
fn wait(child: &mut Child) -> Option<std::process::ExitStatus> {
    let started = Instant::now();
    while started.elapsed() < Duration::from_secs(20) {
        if let Some(status) = child.try_wait().expect("it is ours") {
            return Some(status);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let _ = child.kill();
    None
}

fn start(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_metaplan"))
        .args(arguments)
        .current_dir(root())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts")
}

#[cfg(unix)]
#[test]
fn signals_end_the_program_while_it_reads() {
    use std::os::unix::process::ExitStatusExt as _;

    use test_resources::{Resource, missing};
    for arguments in
        [&["plan", "-", "encodings/ugv/problem.pddl"][..], &["plan", "encodings/ugv/domain.pddl", "-"]]
    {
        for (name, number) in [("-INT", 2), ("-TERM", 15)] {
            if is_ignored(number) {
                missing(Resource::Signals, &format!("the signal {name} is ignored"));
                continue;
            }
            // Standard input stays open, so the program keeps reading.
            let mut child = start(arguments);
            std::thread::sleep(Duration::from_millis(300));
            let status = Command::new("kill").args([name, &child.id().to_string()]).status().expect("kill");
            assert!(status.success());
            let status = wait(&mut child).unwrap_or_else(|| panic!("{arguments:?} goes on after {name}"));
            assert_eq!(status.signal(), Some(number), "{status:?}");
        }
    }
}

/// A round trip whose optimum takes long to prove. Returns the domain and the problem.
#[cfg(unix)]
pub fn round_trip(places: u32) -> (String, String) {
    use std::fmt::Write as _;
    let domain = "(define (domain trip) (:requirements :action-costs) (:predicates (at ?p) (seen ?p)) (:functions (far ?a ?b) (total-cost))
        (:action go :parameters (?a ?b) :precondition (at ?a)
          :effect (and (not (at ?a)) (at ?b) (seen ?b) (increase (total-cost) (far ?a ?b)))))";
    let (mut objects, mut init, mut goal) = (String::new(), String::new(), String::new());
    let place = |number: u32| (number * 37 % 101, number * 59 % 97);
    for from in 0..places {
        let _ = write!(objects, " p{from}");
        let _ = write!(goal, " (seen p{from})");
        for to in (0..places).filter(|to| *to != from) {
            let ((x, y), (u, v)) = (place(from), place(to));
            let distance = x.abs_diff(u) + y.abs_diff(v);
            let _ = write!(init, " (= (far p{from} p{to}) {distance})");
        }
    }
    let problem = format!(
        "(define (problem p) (:domain trip) (:objects{objects}) (:init (at p0) (= (total-cost) 0){init})
           (:goal (and{goal} (at p0))) (:metric minimize (total-cost)))"
    );
    (domain.to_owned(), problem)
}

/// At the soft limit of processor time, the answer is the best plan found by then.
#[cfg(unix)]
#[test]
fn soft_cpu_limit_of_the_shell_is_respected() {
    let directory = tempfile::tempdir().expect("a directory");
    let (domain, problem) = round_trip(24);
    std::fs::write(directory.path().join("domain.pddl"), domain).expect("a file");
    std::fs::write(directory.path().join("problem.pddl"), problem).expect("a file");
    let mut child = Command::new("sh")
        .args([
            "-c",
            "ulimit -St 2 && exec \"$0\" plan domain.pddl problem.pddl --format json --time-limit 60",
        ])
        .arg(env!("CARGO_BIN_EXE_metaplan"))
        .current_dir(directory.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("a shell");
    let status = wait(&mut child).expect("it ends in 20 seconds");
    let mut output = String::new();
    std::io::Read::read_to_string(&mut child.stdout.take().expect("a pipe"), &mut output).expect("text");
    let answer: Value =
        serde_json::from_str(&output).unwrap_or_else(|error| panic!("{error}: {status} {output}"));
    assert_eq!((status.code(), &answer["status"]), (Some(1), &json!("feasible")), "{output}");
}

#[test]
fn time_limit_includes_reading() {
    let mut child = start(&["plan", "-", "encodings/ugv/problem.pddl", "--time-limit", "0.3"]);
    let status = wait(&mut child).expect("it ends");
    assert_eq!(status.code(), Some(12));
}

#[test]
fn comparisons_at_a_limit_show_finished_results() {
    let outcome = metaplan(&["compare", "missions/camara_like.toml", "--time-limit", "0"]);
    assert_eq!(outcome.status, 12, "{outcome:#?}");
    assert!(outcome.stderr.contains("M130") && outcome.stdout.is_empty(), "{outcome:#?}");
    let directory = tempfile::tempdir().expect("a directory");
    let table = directory.path().join("table.csv").display().to_string();
    let arguments = ["compare", "missions/camara_like.toml", "--no-battery", "--format", "json"];
    let complete_answer = metaplan(&[&arguments[..], &["--pairs", "2"]].concat());
    let complete_answer: Value = serde_json::from_str(&complete_answer.stdout).expect("JSON");
    assert_eq!((&complete_answer["complete"], &complete_answer["messages"]), (&json!(true), &json!([])));
    let mut rows = 0;
    // 1,000 pairs cannot all be compared within any of these limits.
    for time in ["4", "16", "64"] {
        let limits = ["--pairs", "1000", "--time-limit", time, "--csv", &table];
        let outcome = metaplan(&[&arguments[..], &limits].concat());
        assert_eq!(outcome.status, 12, "{outcome:#?}");
        let answer: Value = serde_json::from_str(&outcome.stdout).expect("JSON");
        let text = answer["messages"][0]["message"].as_str().expect("a sentence");
        assert!(answer["messages"][0]["code"] == "M130" && text.contains("the comparison"), "{answer:#}");
        assert!(answer["format"] == "metaplan-error/1" || answer["complete"] == false, "{answer:#}");
        let Some(comparisons) = answer["comparisons"].as_array() else { continue };
        for comparison in &comparisons[..comparisons.len().saturating_sub(1)] {
            assert_eq!(comparison["complete"], true);
        }
        rows = comparisons
            .iter()
            .map(|comparison| comparison["candidates"].as_array().map_or(0, Vec::len))
            .sum();
        if rows > 0 {
            let written = std::fs::read_to_string(&table).expect("the table");
            assert_eq!(written.lines().count(), rows + 1, "{written}");
            break;
        }
    }
    assert!(rows > 0, "nothing was ever shown");
}

#[test]
fn incomplete_comparisons_are_reported_in_text_output() {
    for time in ["8", "32", "128"] {
        let arguments = ["compare", "missions/camara_like.toml", "--no-battery"];
        let outcome = metaplan(&[&arguments[..], &["--pairs", "1000", "--time-limit", time]].concat());
        assert_eq!(outcome.status, 12, "{outcome:#?}");
        assert!(outcome.stderr.contains("M130"), "{outcome:#?}");
        if !outcome.stdout.is_empty() {
            assert!(outcome.stderr.contains("the results are incomplete"), "{outcome:#?}");
            assert!(outcome.stdout.contains("best policy by penalised time"), "{outcome:#?}");
            return;
        }
    }
    panic!("nothing was ever shown");
}

/// A directory that cannot become a certificate is refused before planning.
#[test]
fn unwritable_certificates_are_errors() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("full/a");
    std::fs::create_dir(directory.path().join("full")).expect("a directory");
    std::fs::write(&file, "").expect("a file");
    for (name, reason) in
        [("full", "directory not empty"), ("full/a", "not a directory"), ("no/such", "not found")]
    {
        let target = directory.path().join(name).display().to_string();
        for options in [&[][..], &["-q"], &["--format", "json"], &["-q", "--format", "json"]] {
            let arguments = ["plan", "missions/ugv.toml", "--certificate", &target];
            let outcome = metaplan(&[&arguments[..], options].concat());
            assert_eq!(outcome.status, 3, "{outcome:#?}");
            let text = outcome.stdout + &outcome.stderr;
            assert!(text.contains("M109") && text.contains(reason), "{name}: {text}");
            assert!(!text.contains("408"), "{name}: it is planned: {text}");
        }
    }
    let names = std::fs::read_dir(directory.path().join("full")).expect("a directory");
    assert_eq!(names.map(|entry| entry.expect("an entry").path()).collect::<Vec<_>>(), [file]);
}

#[test]
fn verification_respects_the_time_limit() {
    let directory = tempfile::tempdir().expect("a directory");
    let target = certificate(directory.path(), &["plan", "missions/ugv.toml"]);
    // What is verified before the limit is noticed depends on the machine, so the two outcomes may differ.
    let outcomes = [
        metaplan_in(&root(), &["verify", &target, "--time-limit", "0"], ""),
        outcome(verifier(), &root(), &[&target, "--time-limit", "0"], ""),
    ];
    for outcome in outcomes {
        assert_eq!(outcome.status, 30, "{outcome:#?}");
        assert!(outcome.stdout.contains("limits      failed"), "{outcome:#?}");
    }
}

/// A task with many instances of actions and a short plan. Returns the domain and the problem.
#[cfg(unix)]
pub fn doors(places: u32) -> (String, String) {
    let domain = "(define (domain doors) (:requirements :action-costs) (:predicates (at ?p) (open ?p)) (:functions (total-cost))
        (:action go :parameters (?a ?b) :precondition (and (at ?a) (open ?b))
          :effect (and (not (at ?a)) (at ?b) (increase (total-cost) 2)))
        (:action unlock :parameters (?p) :precondition (not (open ?p))
          :effect (and (open ?p) (increase (total-cost) 1))))";
    let objects: Vec<_> = (0..places).map(|number| format!("p{number}")).collect();
    let objects = objects.join(" ");
    let problem = format!(
        "(define (problem p) (:domain doors) (:objects {objects}) (:init (at p0) (= (total-cost) 0)) (:goal (at p1))
           (:metric minimize (total-cost)))"
    );
    (domain.to_owned(), problem)
}

/// Asserts that the directory has no certificate, or one that is verified, and no temporary files. Removes the
/// certificate `c`. Returns `true` if there was one.
#[cfg(unix)]
pub fn assert_no_incomplete_certificate(directory: &Path) -> bool {
    let names = std::fs::read_dir(directory).expect("a directory");
    let names: Vec<_> = names.map(|entry| entry.expect("an entry").file_name()).collect();
    let is_temporary = |name: &std::ffi::OsString| name.to_string_lossy().starts_with('.');
    assert!(!names.iter().any(is_temporary), "{names:?}");
    let exists = directory.join("c").exists();
    if exists {
        let outcome = verify_in(directory, &["c"]);
        assert_eq!(outcome.status, 0, "{outcome:#?}");
        std::fs::remove_dir_all(directory.join("c")).expect("a certificate");
    }
    exists
}

/// The plan is shown before its certificate is written.
#[cfg(unix)]
#[test]
fn signals_leave_no_incomplete_certificate() {
    use std::io::Read as _;

    use test_resources::{Resource, missing};
    if is_ignored(2) {
        missing(Resource::Signals, "the signal -INT is ignored");
        return;
    }
    let directory = tempfile::tempdir().expect("a directory");
    let (domain, problem) = doors(80);
    std::fs::write(directory.path().join("domain.pddl"), domain).expect("a file");
    std::fs::write(directory.path().join("problem.pddl"), problem).expect("a file");
    let mut interrupted = 0;
    for delay in [0, 50, 400, 1_600] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_metaplan"))
            .args(["plan", "domain.pddl", "problem.pddl", "--certificate", "c"])
            .current_dir(directory.path())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut output = child.stdout.take().expect("a pipe");
        output.read_exact(&mut [0]).expect("the plan");
        std::thread::sleep(Duration::from_millis(delay));
        let status = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
        assert!(status.success());
        let status = wait(&mut child).unwrap_or_else(|| panic!("it continues after {delay} ms and -INT"));
        let mut messages = String::new();
        child.stderr.take().expect("a pipe").read_to_string(&mut messages).expect("text");
        let exists = assert_no_incomplete_certificate(directory.path());
        let expected = if exists { 0 } else { 3 };
        assert_eq!(status.code(), Some(expected), "after {delay} ms: {messages}");
        assert!(exists || messages.contains("M120"), "after {delay} ms: {messages}");
        interrupted += usize::from(!exists);
    }
    assert!(interrupted > 0, "every certificate was written before the signal");
}

/// A certificate with an additional rule proves a different claim. Its rule file must not be reported as
/// shipped, regardless of its name.
#[test]
fn modified_rules_are_not_reported_as_shipped() {
    let directory = tempfile::tempdir().expect("a directory");
    let target = certificate(directory.path(), &["plan", "missions/ugv.toml"]);
    let outcome = verify_in(&root(), &[&target]);
    assert!(outcome.stdout.contains("`coadaptation` (shipped)"), "{outcome:#?}");

    let copy = copy_of_mission("ugv");
    let rules = std::fs::read_to_string(root().join("rules/swrl/coadaptation.swrl")).expect("the rules");
    let extra_rule = "[more] t:FunctionDesign(?fd) ^ t:requiresC(?fd, ?c) ^ t:solvesF(?fd, ?f) -> t:fd_efficacy(?fd, 1) .\n";
    std::fs::write(copy.path().join("missions/my.swrl"), rules + extra_rule).expect("written");
    edit(copy.path(), "missions/ugv.toml", "[planning]", "rules = [\"my.swrl\"]\n\n[planning]");
    let planned = metaplan_in(copy.path(), &["plan", "missions/ugv.toml", "--certificate", "c"], "");
    assert_eq!(planned.status, 0, "{planned:#?}");
    let outcome = verify_in(copy.path(), &["c"]);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    assert!(outcome.stdout.contains("`my.swrl` (not shipped"), "{outcome:#?}");

    // Both files that name the rules are relabelled, with updated hashes.
    let target_of_copy = copy.path().join("c").display().to_string();
    let relabel = |text: String| {
        let mut value: Value = serde_json::from_str(&text).expect("JSON");
        let rename = |name: &mut Value| {
            if name.as_str().is_some_and(|name| name.ends_with("my.swrl")) {
                *name = "coadaptation".into();
            }
        };
        value["rules"].as_array_mut().expect("rules").iter_mut().for_each(|rule| {
            if rule.is_array() { rename(&mut rule[0]) } else { rename(&mut rule["source"]) }
        });
        value.to_string()
    };
    change(&target_of_copy, "origin.json", &relabel);
    change(&target_of_copy, "derivations.json", &relabel);
    let outcome = verify_in(copy.path(), &["c"]);
    assert!(outcome.stdout.contains("`coadaptation` (NOT the shipped rules"), "{outcome:#?}");
}

#[test]
fn certificates_are_compared_with_missions() {
    let directory = tempfile::tempdir().expect("a directory");
    let situation = ["--fail", "c_kinect", "--set", "robot_at=wp2"];
    let plan: Vec<&str> = ["plan", "missions/ugv.toml"].into_iter().chain(situation).collect();
    let target = certificate(directory.path(), &plan);
    let check = |mission_arguments: &[&str], status: i32, words: &str| {
        let command: Vec<&str> = ["verify", target.as_str(), "--mission"]
            .into_iter()
            .chain(mission_arguments.iter().copied())
            .collect();
        let outcome = metaplan(&command);
        assert_eq!(outcome.status, status, "{outcome:#?}");
        assert!(outcome.stdout.contains(words), "{outcome:#?}");
    };
    let same_situation: Vec<&str> = ["missions/ugv.toml"].into_iter().chain(situation).collect();
    check(&same_situation, 0, "it is about `ugv` as it is now");
    check(&["missions/ugv.toml", "--scenario", "kinect_failure"], 0, "it is about `ugv` as it is now");
    check(&["missions/ugv.toml"], 30, "the situation");
    check(&["missions/uuv.toml"], 30, "not about `uuv`");
}
