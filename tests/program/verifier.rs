//! Tests that `metaplan verify` and `metaplan-verify` agree. Most other tests of certificates also run both programs,
//! see [`verify_in`].

use std::path::Path;

use serde_json::{Value, json};

use crate::certificate::{certificate, change};
use crate::common::{metaplan, outcome, program, root, verify_in};

#[test]
fn both_programs_give_the_same_refusals() {
    let directory = tempfile::tempdir().expect("a directory");
    let target = certificate(directory.path(), &["plan", "missions/uuv_plain.toml"]);
    let (nowhere, file) = (format!("{target}/nowhere"), format!("{target}/argument.smt2"));
    let unwritable = format!("{nowhere}/argument.smt2");
    let [target, nowhere, file, unwritable] = [&target, &nowhere, &file, &unwritable].map(String::as_str);
    for (arguments, status) in [
        (&[nowhere][..], 30),
        (&[nowhere, "--smt", file], 3),
        (&[nowhere, "--smt", file, "--format", "json"], 3),
        (&[target, "--smt", unwritable], 3),
        (&[target, "--format", "json"], 0),
        (&["/dev/null"], 30),
    ] {
        let outcome = verify_in(&root(), arguments);
        assert_eq!(outcome.status, status, "{arguments:?}: {outcome:#?}");
    }
    // The speed of the machine decides which parts are reported, so the programs are not compared.
    let outcome = metaplan(&["verify", target, "--time-limit", "0", "--format", "json"]);
    assert_eq!(outcome.status, 30, "{outcome:#?}");
}

/// The knowledge files can be removed from the manifest of a certificate. The certificate then covers only
/// its PDDL files, and the verdict states this. If a mission is given, the certificate must be about this
/// mission.
#[test]
fn verdicts_state_the_subject_of_the_certificate() {
    use sha2::{Digest as _, Sha256};
    let directory = tempfile::tempdir().expect("a directory");
    let target = certificate(directory.path(), &["plan", "missions/ugv.toml"]);
    let verdict = |arguments: &[&str]| {
        let outcome = verify_in(&root(), &[&[target.as_str()], arguments].concat());
        outcome.stdout.lines().last().unwrap_or_default().to_owned()
    };
    let optimal = "verified: the plan is optimal, metric 408, for";
    let full_verdict = format!("{optimal} these PDDL files and their knowledge base; not checked: mission");
    assert_eq!(verdict(&[]), full_verdict);
    // The digest is the hash of the output of `sha256sum` for the certificate's input files.
    let lines = ["domain.pddl", "problem.pddl", "knowledge.nt", "origin.json"].map(|name| {
        let text = std::fs::read(Path::new(&target).join(name)).expect("a file");
        format!("{:x}  {name}\n", Sha256::digest(text))
    });
    let digest = format!("{:x}", Sha256::digest(lines.concat()));
    let answer = verify_in(&root(), &[&target, "--format", "json"]).json();
    assert_eq!(answer["subject"]["digest"], digest.as_str());
    let of_mission = metaplan(&["verify", &target, "--mission", "missions/ugv.toml"]);
    let last = of_mission.stdout.lines().last().unwrap_or_default();
    assert_eq!(last, format!("{optimal} the mission `ugv` with digest {}", &digest[..12]));
    let manifest = Path::new(&target).join("manifest.json");
    let mut document: Value =
        serde_json::from_str(&std::fs::read_to_string(&manifest).expect("a manifest")).expect("JSON");
    let files = document["files"].as_array_mut().expect("files");
    files.retain(|file| {
        !["knowledge.nt", "origin.json", "derivations.json"]
            .contains(&file["name"].as_str().unwrap_or_default())
    });
    std::fs::write(&manifest, document.to_string()).expect("a manifest");
    change(&target, "problem.pddl", &|text| text.replace("(define (problem ", "(define (problem another-"));
    assert_eq!(
        verdict(&[]),
        format!("{optimal} these PDDL files only; not checked: knowledge base, mission")
    );
    let answer = verify_in(&root(), &[&target, "--format", "json"]).json();
    assert_eq!(answer["subject"]["not_checked"], json!(["knowledge", "mission"]));
    let of_mission = metaplan(&["verify", &target, "--mission", "missions/ugv.toml"]);
    assert!(
        of_mission.stdout.ends_with("NOT verified: the plan is optimal, metric 408\n"),
        "{of_mission:#?}"
    );
}

/// The optimum of another metric says nothing about the mission. The metric does not matter if there is no plan.
#[test]
fn certificates_of_other_metrics_are_not_about_the_mission() {
    let of_mission = "(+ (* 100 (total-time)) (battery_used))";
    for (metric, situation, is_about_mission) in [
        (of_mission, &[][..], true),
        ("battery_used", &[], false),
        ("battery_used", &["--set", "battery=7"], true),
    ] {
        let directory = tempfile::tempdir().expect("a directory");
        let arguments = [&["plan", "missions/ugv.toml", "--minimize", metric], situation].concat();
        let target = certificate(directory.path(), &arguments);
        assert_eq!(verify_in(&root(), &[&target]).status, 0, "{metric} {situation:?}");
        let arguments = [&["verify", target.as_str(), "--mission", "missions/ugv.toml"], situation].concat();
        let outcome = metaplan(&arguments);
        assert_eq!(outcome.status == 0, is_about_mission, "{outcome:#?}");
        let reason = "failed: it is not about `ugv` as it is now: the metric differs (`--minimize`)";
        assert_eq!(!outcome.stdout.contains(reason), is_about_mission, "{outcome:#?}");
    }
}

/// Temporary files would remain if the verification ended at a limit, and a certificate can contain any number of rule
/// files.
#[test]
#[cfg(unix)]
fn certificates_are_verified_without_temporary_files() {
    let directory = tempfile::tempdir().expect("a directory");
    let target = certificate(directory.path(), &["plan", "missions/ugv.toml"]);
    let program = program().display().to_string();
    let verify = ["TMPDIR=/dev/null", &program, "verify", &target];
    let outcome = outcome(Path::new("env"), &root(), &verify, "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
}
