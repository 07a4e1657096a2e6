//! Tests with real files: knowledge bases of MROS and SUAVE, and PDDL files of the Metaplan paper.

use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::common::{metaplan, metaplan_in};
use serde_json::Value;
use test_resources::data;

pub fn real() -> Option<PathBuf> {
    data("real")
}

/// Compares the result of `metaplan reason` with that of the reference reasoner. The input is SUAVE's
/// knowledge base with the assertions of a golden case.
fn reason(case: &str) {
    let (Some(real), Some(file)) = (real(), data(format!("golden/kb/{case}.json"))) else { return };
    let text = std::fs::read_to_string(file).expect("the case");
    let case: Value = serde_json::from_str(&text).expect("JSON");
    let triple = |triple: &Value| {
        let part = |index: usize| triple[index].as_str().expect("a string").to_owned();
        let object = part(2);
        let object = if object.starts_with('"') { object } else { format!("<{object}>") };
        format!("<{}> <{}> {object} .", part(0), part(1))
    };
    let triples =
        |value: &Value| value.as_array().expect("triples").iter().map(triple).collect::<BTreeSet<_>>();
    let directory = tempfile::tempdir().expect("a temporary directory");
    let added = directory.path().join("added.nt");
    let lines: Vec<_> = triples(&case["added"]).into_iter().collect();
    std::fs::write(&added, lines.join("\n")).expect("a file");
    let real = real.display().to_string();
    let outcome = metaplan_in(
        directory.path(),
        &[
            "reason",
            &format!("{real}/owl/suave/suave.owl"),
            "--directory",
            &format!("{real}/owl/mros_ontology"),
            "--directory",
            &format!("{real}/owl/mc_mdl_tomasys"),
            "--assert",
            "added.nt",
            "--format",
            "ntriples",
            "--quiet",
        ],
        "",
    );
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let plain = |line: &str| line.replace("^^<http://www.w3.org/2001/XMLSchema#string>", "");
    let inferred: BTreeSet<_> = outcome.stdout.lines().map(plain).collect();
    let expected: BTreeSet<_> =
        triples(&case["reference"]["inferred"]).iter().map(|line| plain(line)).collect();
    assert_eq!(inferred, expected);
}

#[test]
fn suave_has_the_inferences_of_the_reference_reasoner() {
    for case in [
        "suave_04_thruster_false_no_fg",
        "suave_05_thruster_false_grounded",
        "suave_06_thruster_recovered_two_objectives",
        "suave_07_water_visibility_violation",
    ] {
        reason(case);
    }
}

#[test]
fn suave_has_27_rules() {
    let Some(real) = real() else { return };
    let owl = real.join("owl").display().to_string();
    let outcome = metaplan(&[
        "reason",
        &format!("{owl}/suave/suave.owl"),
        "--directory",
        &format!("{owl}/mros_ontology"),
        "--directory",
        &format!("{owl}/mc_mdl_tomasys"),
        "--format",
        "json",
    ]);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    assert_eq!(outcome.json()["rules"], 27);
}

#[test]
fn problem_of_the_paper_gets_a_bounded_reading() {
    let Some(real) = real() else { return };
    let file = |name: &str| real.join(format!("pddl/suave_metaplan/{name}.pddl")).display().to_string();
    let (domain, problem) = (file("suave_extended_metaplan_domain"), file("suave_extended_metaplan_problem"));
    let outcome = metaplan(&["plan", &domain, &problem, "--format", "json"]);
    assert_eq!(outcome.status, 1, "{outcome:#?}");
    let answer = outcome.json();
    assert_eq!((answer["steps"].as_array().map(Vec::len), answer["cost"].as_i64()), (Some(3), Some(6)));
    assert_eq!((answer["unbounded"].as_str(), answer["proof"]["by"].as_str()), (Some("proved"), Some("sat")));
    assert!(outcome.stderr.contains("the problem belongs to the domain `suave`"), "{outcome:#?}");
}

#[test]
fn all_errors_of_the_mismatched_problem_are_reported() {
    let Some(real) = real() else { return };
    let file = |name: &str| real.join(format!("pddl/suave_metaplan/{name}.pddl")).display().to_string();
    let (domain, problem) = (file("inspect_pl_domain"), file("inspect_pl_problem"));
    let outcome = metaplan(&["plan", &domain, &problem, "--format", "json"]);
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    let answer = outcome.json();
    let errors = answer["messages"].as_array().expect("messages").iter().filter(|m| m["severity"] == "error");
    let lines: Vec<_> = errors.filter_map(|message| message["line"].as_i64()).collect();
    assert_eq!(lines, [8, 11, 12, 13, 16, 17, 18, 19, 20, 21]);
}
