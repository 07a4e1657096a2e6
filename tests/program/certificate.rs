//! `metaplan plan --certificate` and `metaplan verify`.

use std::path::Path;

use serde_json::{Value, json};

use crate::common::{Outcome, metaplan, metaplan_in};

/// The directory of a fresh certificate.
fn certificate(directory: &Path, arguments: &[&str]) -> String {
    let target = directory.join("certificate").display().to_string();
    let all: Vec<&str> = arguments.iter().copied().chain(["--certificate", &target]).collect();
    let outcome = metaplan(&all);
    assert!(Path::new(&target).is_dir(), "{outcome:#?}");
    target
}

fn verify(certificate: &str) -> Outcome {
    metaplan(&["verify", certificate])
}

#[test]
fn missions_have_certificates() {
    for arguments in [
        &["plan", "missions/ugv.toml"][..],
        &["plan", "missions/ugv.toml", "--fail", "c_kinect", "--set", "robot_at=wp2"],
        &["plan", "missions/ugv.toml", "--minimize", "total-time"],
        &["plan", "missions/uuv.toml"],
        &["plan", "missions/ugv_plain.toml"],
        &["plan", "missions/uuv_plain.toml", "--plan-format", "plansys2"],
        &["plan", "missions/uuv.toml", "--set", "battery=15"],
    ] {
        let directory = tempfile::tempdir().expect("a directory");
        let outcome = verify(&certificate(directory.path(), arguments));
        assert_eq!(outcome.status, 0, "{arguments:?}: {outcome:#?}");
        assert!(outcome.stdout.contains("verified: the plan is optimal"), "{outcome:#?}");
    }
}

#[test]
fn that_there_is_no_plan_has_a_certificate() {
    let directory = tempfile::tempdir().expect("a directory");
    let domain = "(define (domain d) (:predicates (at ?p) (way ?a ?b) (key))
      (:action go :parameters (?a ?b) :precondition (and (at ?a) (way ?a ?b)) :effect (and (at ?b) (not (at ?a))))
      (:action drop :parameters () :precondition (key) :effect (not (key))))";
    let problem = |goal: &str| {
        format!(
            "(define (problem p) (:domain d) (:objects a b c) (:init (at a) (key) (way a b) (way b a)) (:goal {goal}))"
        )
    };
    std::fs::write(directory.path().join("d.pddl"), domain).expect("a file");
    // Out of reach even if nothing is ever deleted, and reachable only so.
    for (name, goal) in [("relaxed", "(at c)"), ("searched", "(and (at a) (at b))")] {
        std::fs::write(directory.path().join("p.pddl"), problem(goal)).expect("a file");
        let arguments = ["plan", "d.pddl", "p.pddl", "--certificate", name];
        assert_eq!(metaplan_in(directory.path(), &arguments, "").status, 10);
        let outcome = metaplan_in(directory.path(), &["verify", name], "");
        assert_eq!(outcome.status, 0, "{outcome:#?}");
        assert!(outcome.stdout.contains("verified: there is no plan"), "{outcome:#?}");
    }
}

#[test]
fn a_verification_has_its_fields() {
    let directory = tempfile::tempdir().expect("a directory");
    let target = certificate(directory.path(), &["plan", "missions/ugv.toml"]);
    let answer = metaplan(&["verify", &target, "--format", "json"]).json();
    assert_eq!(answer["format"], "metaplan-verification/1");
    assert_eq!(answer["claim"], json!({ "optimal": { "metric": "408" } }));
    let parts: Vec<_> = answer["parts"].as_array().expect("parts").iter().map(|part| &part["part"]).collect();
    assert_eq!(parts, ["files", "knowledge", "plan", "task", "argument"]);
    assert_eq!(answer["verified"], true);
}

/// Changes a file of a certificate, and has the manifest say what the file is now.
fn change(certificate: &str, name: &str, edit: &dyn Fn(String) -> String) {
    use sha2::{Digest as _, Sha256};
    let path = Path::new(certificate).join(name);
    let text = edit(std::fs::read_to_string(&path).expect("a file"));
    let manifest = Path::new(certificate).join("manifest.json");
    let mut listed: Value =
        serde_json::from_str(&std::fs::read_to_string(&manifest).expect("a manifest")).expect("JSON");
    for file in listed["files"].as_array_mut().expect("files") {
        if file["name"] == name {
            file["bytes"] = json!(text.len());
            file["sha256"] = json!(format!("{:x}", Sha256::digest(text.as_bytes())));
        }
    }
    std::fs::write(path, text).expect("a file");
    std::fs::write(manifest, listed.to_string()).expect("a manifest");
}

#[test]
fn what_is_changed_is_rejected_with_the_first_thing_that_is_wrong() {
    type Edit = fn(String) -> String;
    let cases: [(&str, Edit, &str); 9] = [
        (
            "knowledge.nt",
            |text| text.replace("fd_aruco>", "fd_marker>"),
            "knowledge failed: the knowledge says",
        ),
        (
            "origin.json",
            |text| text.replacen("\"added\":[]", "\"added\":[7]", 1),
            "knowledge failed: origin.json",
        ),
        (
            "problem.pddl",
            |text| text.replace("(fd_available fd_aruco)", ""),
            "knowledge failed: the knowledge says",
        ),
        (
            "plan.txt",
            |plan| plan.lines().skip(1).fold(String::new(), |text, line| text + line + "\n"),
            "plan      failed",
        ),
        ("problem.pddl", |text| text.replace("(fd_available fd_amcl_kinect)", ""), "plan      failed"),
        ("task.json", |text| text.replacen("\"constant\":", "\"constant\":1", 1), "task      failed"),
        ("argument.json", |text| text.replacen("\"values\":[", "\"values\":[9999,", 1), "argument  failed"),
        ("argument.json", |_| "[".repeat(100_000), "argument  failed"),
        ("domain.pddl", |text| text.replace(":effect", ":efect"), "files     failed"),
    ];
    for (file, edit, expected) in cases {
        let directory = tempfile::tempdir().expect("a directory");
        let target = certificate(directory.path(), &["plan", "missions/ugv.toml"]);
        change(&target, file, &edit);
        let outcome = verify(&target);
        assert_eq!(outcome.status, 30, "{file}: {outcome:#?}");
        assert!(outcome.stdout.contains(expected), "{file}, `{expected}`: {outcome:#?}");
        assert!(outcome.stdout.contains("NOT verified"), "{outcome:#?}");
    }
}

#[test]
fn certificates_that_are_none_are_rejected() {
    let check = |edit: &dyn Fn(&Path), expected: &str| {
        let directory = tempfile::tempdir().expect("a directory");
        let target = certificate(directory.path(), &["plan", "missions/ugv.toml"]);
        edit(Path::new(&target));
        let outcome = verify(&target);
        assert_eq!(outcome.status, 30, "{outcome:#?}");
        assert!(outcome.stdout.contains(expected), "`{expected}`: {outcome:#?}");
    };
    let manifest = |edit: fn(String) -> String| {
        move |directory: &Path| {
            let file = directory.join("manifest.json");
            let text = edit(std::fs::read_to_string(&file).expect("a manifest"));
            std::fs::write(file, text).expect("a manifest");
        }
    };
    check(
        &|directory| std::fs::remove_file(directory.join("manifest.json")).expect("a file"),
        "manifest.json: cannot",
    );
    check(
        &|directory| std::fs::remove_file(directory.join("plan.txt")).expect("a file"),
        "plan.txt: cannot be read",
    );
    check(
        &|directory| std::fs::write(directory.join("task.json"), "").expect("a file"),
        "task.json: has 0 bytes",
    );
    check(&manifest(|text| text[..text.len() / 2].to_owned()), "manifest.json: EOF");
    check(
        &manifest(|text| text.replace("\"plan.txt\"", "\"../../plan.txt\"")),
        "manifest.json: lists ../../plan.txt",
    );
    check(&manifest(|text| text.replacen("\"bytes\": ", "\"bytes\": 99999999999", 1)), "larger than");
    check(
        &manifest(|text| text.replace("certificate/1", "certificate/9")),
        "format `metaplan-certificate/9`",
    );
    #[cfg(unix)]
    check(
        &|directory| {
            let plan = directory.join("plan.txt");
            std::fs::rename(&plan, directory.join("moved")).expect("a file");
            std::os::unix::fs::symlink(directory.join("moved"), plan).expect("a link");
        },
        "plan.txt: is no plain file",
    );
}
