//! Tests of the correspondence between individuals and objects: equal names, names mapped by
//! `[bindings.names]`, and names without a counterpart.

use std::path::Path;

use serde_json::{Value, json};

use crate::certificate::change;
use crate::common::{Outcome, copy_of_mission, edit, headlines, metaplan, metaplan_in, steps, verify_in};

/// Objects of the mission `uuv` that its knowledge base provides. The problem can declare them as well.
const OBJECTS: &str = "fd_speed_low fd_speed_medium fd_speed_high fd_search_low fd_search_medium fd_search_high \
    fd_follow fd_recharge - functiondesign f_maintain_motion f_generate_search_path f_follow_pipeline f_recharge - function";

const MANIFEST: &str = "missions/uuv.toml";
const PROBLEM: &str = "encodings/uuv/problem.pddl";
const KB: &str = "ontology/kb/uuv.ttl";

fn declared() -> tempfile::TempDir {
    let copy = copy_of_mission("uuv");
    edit(copy.path(), PROBLEM, "(:objects ", &format!("(:objects {OBJECTS} "));
    copy
}

/// Renames functions, designs and actions in the knowledge base, and adds `entries` to the name
/// map.
fn renamed(entries: &str) -> tempfile::TempDir {
    let copy = declared();
    let mut text = std::fs::read_to_string(copy.path().join(KB)).expect("the knowledge base");
    for (kind, prefix) in [("f", "kf"), ("fd", "kd"), ("a", "ka")] {
        for separator in [" ", "\n"] {
            text = text.replace(&format!("{separator}:{kind}_"), &format!("{separator}:{prefix}_"));
        }
    }
    std::fs::write(copy.path().join(KB), text).expect("written");
    edit(copy.path(), MANIFEST, "[planning]", &format!("[bindings.names]\n{entries}\n\n[planning]"));
    copy
}

const ENTRIES: &str = "\"kd_*\" = \"fd_*\"\n\"kf_*\" = \"f_*\"\n\"ka_*\" = \"a_*\"";

/// Runs the program and returns its output without times and digests. Renamed designs, functions and actions get
/// their names in the problem.
fn output_in_problem_names(directory: &Path, arguments: &[&str], input: &str) -> String {
    let outcome = metaplan_in(directory, arguments, input);
    assert!(
        [0, 10].contains(&outcome.status) && !outcome.stderr.contains("M22"),
        "{arguments:?}: {outcome:#?}"
    );
    let text = outcome
        .stdout
        .replace("fg_kd_", "fg_")
        .replace("kd_", "fd_")
        .replace("kf_", "f_")
        .replace("ka_", "a_");
    let strip = |line: &str| match serde_json::from_str::<Value>(line) {
        Ok(mut value) => {
            for field in ["statistics", "mission", "digest", "time", "microseconds", "due"] {
                value.as_object_mut().map(|fields| fields.remove(field));
            }
            value.to_string()
        }
        Err(_) => line.to_owned(),
    };
    text.lines().map(strip).collect::<Vec<_>>().join("\n")
}

#[test]
fn mapped_names_do_not_change_the_mission() {
    let (original, mapped) = (declared(), renamed(ENTRIES));
    let lines = [
        r#"{"event":"component_status","component":"c_thruster_3","status":"FALSE"}"#,
        r#"{"event":"measured","attribute":"water_visibility","value":1.5}"#,
        r#"{"event":"component_status","component":"c_thruster_3","status":"RECOVERED"}"#,
        r#"{"event":"action_succeeded","action":1}"#,
        r#"{"event":"measured","attribute":"battery","value":15}"#,
    ]
    .join("\n");
    for (arguments, input) in [
        (&["plan", MANIFEST][..], ""),
        (&["plan", MANIFEST, "--plan-format", "ipc"], ""),
        (&["plan", MANIFEST, "--fail", "c_thruster_3"], ""),
        (&["plan", MANIFEST, "--set", "water_visibility=1.5"], ""),
        (&["plan", MANIFEST, "--fail", "c_camera"], ""),
        (&["plan", MANIFEST, "--scenario", "battery_drop", "--alternatives", "2"], ""),
        (&["export", MANIFEST, "--to", "pddl", "--scenario", "murky_water", "--format", "json"], ""),
        (&["explain", MANIFEST], ""),
        (&["explain", MANIFEST, "fd_search_high", "--set", "water_visibility=1.5"], ""),
        (&["explain", MANIFEST, "fd_speed_high"], ""),
        (&["run", MANIFEST], &lines),
        (&["simulate", MANIFEST, "--scenario", "suave", "--runs", "2", "--csv", "-", "--quiet"], ""),
    ] {
        assert_eq!(
            output_in_problem_names(original.path(), arguments, input),
            output_in_problem_names(mapped.path(), arguments, input),
            "{arguments:?}"
        );
    }
    // The compared output contains a design, so the comparison is not vacuous.
    assert!(output_in_problem_names(original.path(), &["run", MANIFEST], &lines).contains("fd_search_low"));
    // A design can also be given by its name in the knowledge base.
    let explain = |name| output_in_problem_names(mapped.path(), &["explain", MANIFEST, name], "");
    assert_eq!(explain("kd_speed_high"), explain("fd_speed_high"));
}

#[test]
fn mapped_names_do_not_change_comparisons() {
    let copy = copy_of_mission("camara_like");
    let manifest = "missions/camara_like.toml";
    let compare = |label: &str| {
        let arguments = ["compare", manifest, "--no-battery", "--pairs", "2", "--format", "json", "--quiet"];
        let outcome = metaplan_in(copy.path(), &arguments, "");
        assert_eq!(outcome.status, 0, "{label}: {outcome:#?}");
        let mut answer = outcome.json();
        for comparison in answer["comparisons"].as_array_mut().expect("comparisons") {
            comparison["costs"] = Value::Null;
        }
        answer
    };
    let before = compare("before");
    edit(copy.path(), "ontology/kb/camara_like.ttl", ":fd_", ":way_");
    edit(copy.path(), manifest, "[planning]", "[bindings.names]\n\"way_*\" = \"fd_*\"\n\n[planning]");
    assert_eq!(compare("after"), before);
}

#[test]
fn certificates_depend_on_the_name_map() {
    let copy = renamed(ENTRIES);
    let outcome = metaplan_in(copy.path(), &["plan", MANIFEST, "--certificate", "c"], "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let verified = verify_in(copy.path(), &["c"]);
    assert_eq!(verified.status, 0, "{verified:#?}");
    let check_mission = |status: i32, words: &str| {
        let outcome = metaplan_in(copy.path(), &["verify", "c", "--mission", MANIFEST], "");
        assert_eq!(outcome.status, status, "{outcome:#?}");
        assert!(outcome.stdout.contains(words), "no `{words}`: {outcome:#?}");
    };
    check_mission(0, "it is about `uuv` as it is now");
    // With another name map the mission is a different one, although the plan is the same.
    edit(copy.path(), MANIFEST, "\"ka_*\" = \"a_*\"", "\"ka_*\" = \"a_*\"\nkd_recharge = \"fd_recharge\"");
    check_mission(30, "the bindings differ");
    // Exchanged designs in the name map contradict the problem of the certificate.
    let exchange = |text: String| {
        let mut value: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(value["names"]["kd_*"], "fd_*");
        value["names"]["kd_search_low"] = json!("fd_search_high");
        value["names"]["kd_search_high"] = json!("fd_search_low");
        value.to_string()
    };
    change(&copy.path().join("c").display().to_string(), "origin.json", &exchange);
    let outcome = verify_in(copy.path(), &["c"]);
    assert_eq!(outcome.status, 30, "{outcome:#?}");
    assert!(outcome.stdout.contains("the knowledge implies"), "{outcome:#?}");
}

fn check(entries: &str, status: i32, words: &[&str]) -> Outcome {
    let copy = renamed(entries);
    let outcome = metaplan_in(copy.path(), &["plan", MANIFEST], "");
    assert_eq!(outcome.status, status, "{entries}: {outcome:#?}");
    for word in words {
        let messages = headlines(&outcome.stderr) + &outcome.stderr;
        assert!(messages.contains(word), "{entries}: no `{word}`: {outcome:#?}");
    }
    outcome
}

#[test]
fn invalid_entries_are_reported_with_their_position() {
    let with_entry = |entry: &str| format!("{ENTRIES}\n{entry}");
    let place = |column: u32| format!("missions/uuv.toml:11:{column}: ");
    check(
        &with_entry("kd_serach_low = \"fd_search_low\""),
        3,
        &[&place(1), "M223", "`kd_serach_low`; did you mean `kd_search_low`?"],
    );
    check(
        &with_entry("\"x_*\" = \"fd_*\""),
        3,
        &[&place(1), "M223", "the pattern `x_*` matches no individual"],
    );
    check(
        &with_entry("  kd_search_low = \"fd_serach_low\""),
        3,
        &[&place(3), "M224", "there is no object `fd_serach_low`", "did you mean `fd_search_low`?"],
    );
    check(
        &with_entry("kd_search_low = \"pl1\""),
        3,
        &[
            &place(1),
            "M224",
            "`pl1` is of type `pipeline`",
            "an object of type `functiondesign` would be right",
        ],
    );
    check(
        &with_entry("kd_search_low = \"fd_search_high\""),
        3,
        &["M225", "`fd_search_high` would be `kd_search_high`, `kd_search_low`"],
    );
    check(
        &with_entry("\"kd_search_*\" = \"fd_speed_*\""),
        3,
        &[&place(1), "M225", "`kd_search_low` would be `fd_speed_low` and `fd_search_low`"],
    );
    check(
        &with_entry("\"kd_*_*\" = \"fd_*\""),
        3,
        &[&place(1), "M223", "a pattern has one star on each side"],
    );
    check(
        &with_entry("\"kd_search_*\" = \"fd_search_low\""),
        3,
        &[&place(1), "M223", "a star on both sides"],
    );
    check(&with_entry("kd_search_low = 3"), 3, &["missions/uuv.toml:11:17: ", "M104", "expected a string"]);
    let outcome =
        check(&with_entry("kd_x = \"fd_search_low\"\nkd_y = \"fd_search_low\""), 3, &["kd_x", "kd_y"]);
    assert_eq!(outcome.stderr.matches("M223").count(), 2, "{outcome:#?}");
}

#[test]
fn exact_entries_take_precedence_over_patterns() {
    let entries = "\"kd_*\" = \"fd_*\"\n\"kf_*\" = \"f_*\"\n\"ka_*\" = \"a_*\"\n\
        kd_search_high = \"fd_search_low\"\n\"http://metacontrol.org/metaplan/uuv#kd_search_low\" = \"fd_search_high\"";
    let copy = renamed(entries);
    let outcome = metaplan_in(copy.path(), &["plan", MANIFEST, "--format", "json"], "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    // The names of the two search designs are exchanged.
    assert_eq!(steps(&outcome.json())[0], "search_pipeline pl1 | fd_search_low, fd_speed_high");
}

#[test]
fn patterns_skip_individuals_without_an_object() {
    let copy = renamed(ENTRIES);
    edit(copy.path(), PROBLEM, "fd_search_medium ", "");
    let outcome = metaplan_in(copy.path(), &["plan", MANIFEST], "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    for word in
        ["warning[M226]", "missions/uuv.toml:8:1", "`kd_search_medium`", "no object `fd_search_medium`"]
    {
        assert!(outcome.stderr.contains(word), "no `{word}`: {outcome:#?}");
    }
    // The design keeps its name from the knowledge base.
    assert!(outcome.stderr.contains("in the knowledge base only: `kd_search_medium`"), "{outcome:#?}");
}

#[test]
fn unmatched_names_are_listed_from_both_sides() {
    let unmapped = renamed("kd_recharge = \"fd_recharge\"");
    let outcome = metaplan_in(unmapped.path(), &["plan", MANIFEST], "");
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    for word in [
        "error[M222]: the problem and the knowledge base have no common design of the required function \
         `kf_maintain_motion`; in the problem only: `fd_speed_low`, ",
        "in the knowledge base only: `kd_speed_high`, `kd_speed_low`, `kd_speed_medium`",
        "problem.pddl:4:13",
        "warning[M221]: the knowledge base lacks functions of the problem; in the problem only: `f_maintain_motion`",
    ] {
        assert!(outcome.stderr.contains(word), "no `{word}`: {outcome:#?}");
    }
    // If some names match, unmatched names cause only warnings.
    let misspelt = declared();
    edit(misspelt.path(), PROBLEM, "fd_search_low ", "fd_serach_low ");
    let outcome = metaplan_in(misspelt.path(), &["plan", MANIFEST], "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    for word in [
        "warning[M221]: the knowledge base lacks designs of the problem",
        "problem.pddl:4:56",
        "in the problem only: `fd_serach_low`; in the knowledge base only: `fd_search_low`",
        "write in `[bindings.names]`: fd_search_low = \"fd_serach_low\"",
    ] {
        assert!(outcome.stderr.contains(word), "no `{word}`: {outcome:#?}");
    }
    // A design that the problem does not declare, although it declares others, is reported at its position in
    // the knowledge base.
    let incomplete = declared();
    edit(incomplete.path(), PROBLEM, "fd_search_low ", "");
    let outcome = metaplan_in(incomplete.path(), &["plan", MANIFEST], "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    for word in
        ["uuv.ttl:", "M221", "the problem lacks designs of the knowledge base", "only: `fd_search_low`"]
    {
        assert!(outcome.stderr.contains(word), "no `{word}`: {outcome:#?}");
    }
    let unknown_action = declared();
    edit(
        unknown_action.path(),
        "encodings/uuv/domain.pddl",
        "a_recharge - action",
        "a_recharge a_rest - action",
    );
    let outcome = metaplan_in(unknown_action.path(), &["plan", MANIFEST], "");
    for word in ["domain.pddl:7:", "lacks actions of the problem; in the problem only: `a_rest`"] {
        assert!(outcome.stderr.contains(word), "no `{word}`: {outcome:#?}");
    }
}

#[test]
fn missions_with_optional_declarations_have_no_warnings() {
    for copy in [declared(), copy_of_mission("uuv"), copy_of_mission("ugv"), copy_of_mission("camara_like")] {
        for name in ["uuv", "ugv", "camara_like"] {
            let manifest = format!("missions/{name}.toml");
            if copy.path().join(&manifest).exists() {
                let outcome = metaplan_in(copy.path(), &["plan", &manifest], "");
                assert!(outcome.status == 0 && outcome.stderr.is_empty(), "{name}: {outcome:#?}");
            }
        }
    }
}

#[test]
fn components_have_object_and_individual_names() {
    let copy = declared();
    edit(copy.path(), "encodings/uuv/domain.pddl", "(:types pipeline", "(:types component pipeline");
    edit(copy.path(), PROBLEM, "(:objects ", "(:objects front left - component ");
    let names = "[bindings.names]\nc_thruster_3 = \"front\"\nc_sonar = \"left\"\n\n[planning]";
    edit(copy.path(), MANIFEST, "[planning]", names);
    let costs = ["front", "c_thruster_3", "http://metacontrol.org/metaplan/uuv#c_thruster_3", "left"].map(
        |component| {
            let outcome =
                metaplan_in(copy.path(), &["plan", MANIFEST, "--fail", component, "--format", "json"], "");
            outcome.json()["cost"].clone()
        },
    );
    // Without thruster 3 only the low speed remains. Without the sonar no pipeline can be followed.
    assert_eq!(costs, [json!(56), json!(56), json!(56), Value::Null]);
    let line = r#"{"event":"component_status","component":"front","status":"FALSE"}"#;
    let outcome = metaplan_in(copy.path(), &["run", MANIFEST], line);
    assert!(outcome.stdout.contains("c_status(c_thruster_3, "), "{outcome:#?}");
    let outcome = metaplan_in(copy.path(), &["plan", MANIFEST, "--fail", "frnt"], "");
    assert_eq!(outcome.status, 2, "{outcome:#?}");
}

#[test]
fn journals_depend_on_the_name_map() {
    let copy = renamed(ENTRIES);
    let run = || metaplan_in(copy.path(), &["run", MANIFEST, "--journal", "j"], "{\"event\":\"tick\"}\n");
    assert_eq!(run().status, 0);
    edit(copy.path(), MANIFEST, "[bindings.names]", "\n# The same.\n[bindings.names]");
    let resumed = run();
    assert_eq!(resumed.status, 0, "{resumed:#?}");
    edit(copy.path(), MANIFEST, "\"kd_*\" = \"fd_*\"", "\"kd_*\" = \"fd_*\"\nkd_follow = \"fd_follow\"");
    let refused = run();
    assert!(refused.status == 3 && refused.stderr.contains("M321"), "{refused:#?}");
}

#[test]
fn name_options_require_a_knowledge_base() {
    let (domain, problem) = ("encodings/uuv/domain.pddl", "encodings/uuv/problem.pddl");
    for (arguments, status, words) in [
        (&["plan", domain, problem, "--name", "a=b"][..], 2, "`--name` requires `--kb`"),
        (&["plan", "missions/uuv.toml", "--name", "a=b"], 2, "the manifest of a mission has keys for them"),
        (&["plan", domain, problem, "--kb", KB, "--name", "a"], 2, "is not of the form NAME=VALUE"),
        (&["plan", domain, problem, "--kb", KB, "--name", "a=b"], 3, "error[M223]: `--name a=b`: "),
        (
            &["plan", domain, problem, "--kb", KB, "--name", "fd_follow=pl1"],
            3,
            "error[M224]: `--name fd_follow=pl1`: `pl1` is of type `pipeline`",
        ),
    ] {
        let outcome = metaplan(arguments);
        assert_eq!(outcome.status, status, "{arguments:?}: {outcome:#?}");
        assert!(outcome.stderr.contains(words), "no `{words}`: {outcome:#?}");
    }
}
