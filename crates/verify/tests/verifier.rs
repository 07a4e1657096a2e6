//! Tests of the program `metaplan-verify`. The tests of `metaplan`, which can create certificates,
//! compare the output of `metaplan-verify` with that of `metaplan verify`.

use std::process::Command;

use metaplan_verify::plan::plan;
use pddl::{Source, read};

/// Runs the program. Returns the exit status, the standard output and the standard error.
fn run(arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_metaplan-verify")).args(arguments).output();
    let output = output.expect("the program runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn a_directory_without_certificate_is_not_verified() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().display().to_string();
    let (status, text, _) = run(&[&path]);
    assert_eq!(status, Some(30));
    assert!(text.starts_with("files       failed: manifest.json: cannot be read"), "{text}");
    assert!(text.ends_with("NOT verified: nothing is claimed\n"), "{text}");
    let (status, answer, _) = run(&[&path, "--format", "json"]);
    let answer: serde_json::Value = serde_json::from_str(&answer).expect("JSON");
    assert_eq!((status, &answer["verified"]), (Some(30), &false.into()));
}

#[test]
fn verification_conditions_require_a_certificate() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().display().to_string();
    let file = directory.path().join("conditions.smt2");
    let (status, text, message) = run(&[&path, "--smt", &file.display().to_string()]);
    assert_eq!((status, text.as_str()), (Some(3), ""));
    assert!(message.contains("error[M121]: manifest.json"), "{message}");
    assert!(!file.exists());
}

#[test]
fn wrong_arguments_are_reported() {
    for arguments in [&[][..], &["c", "--format", "turtle"], &["c", "--time-limit", "-1"]] {
        let (status, text, message) = run(arguments);
        assert_eq!((status, text.as_str()), (Some(2), ""), "{arguments:?}");
        assert!(message.starts_with("error: "), "{message}");
    }
}

/// VAL and the proved checker read all lines of the plan of a certificate.
#[test]
fn steps_before_an_announced_plan_are_not_skipped() {
    let domain = "(define (domain d) (:predicates (p) (g)) (:functions (total-cost))
      (:action waste :parameters () :precondition () :effect (and (p) (increase (total-cost) 9)))
      (:action go :parameters () :precondition () :effect (and (g) (increase (total-cost) 1))))";
    let problem = "(define (problem p) (:domain d) (:init (= (total-cost) 0)) (:goal (g))
      (:metric minimize (total-cost)))";
    let read = read(&Source::new("domain", domain), &Source::new("problem", problem));
    let (domain, problem, _) = read.expect("PDDL");
    let check = |text: &str, claimed: &str| {
        plan(&domain, &problem, false, text, claimed, &|| false).map(|(summary, _)| summary)
    };
    assert_eq!(check("(waste)\n(go)\n", "10"), Ok("2 steps, valid, metric 10".to_owned()));
    assert_eq!(check("; (waste)\n(go)\n", "1"), Ok("1 step, valid, metric 1".to_owned()));
    for text in ["(waste)\n; Solution Found\n(go)\n", "Solution Found\n(go)\n"] {
        assert_eq!(check(text, "1"), Err("plan.txt contains `Solution Found`".to_owned()), "{text}");
    }
}
