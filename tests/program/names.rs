//! Names of individuals and names of objects: the same ones, others that are mapped, and those that meet nothing.

use std::path::Path;

use serde_json::{Value, json};

use crate::certificate::change;
use crate::common::{Outcome, copy_of_mission, edit, headlines, metaplan, metaplan_in, steps, verify_in};

/// The objects that the problem of the mission `uuv` may declare, and gets from its knowledge base otherwise.
const OBJECTS: &str = "fd_speed_low fd_speed_medium fd_speed_high fd_search_low fd_search_medium fd_search_high \
    fd_follow fd_recharge - functiondesign f_maintain_motion f_generate_search_path f_follow_pipeline f_recharge - function";

const MANIFEST: &str = "missions/uuv.toml";
const PROBLEM: &str = "encodings/uuv/problem.pddl";
const KB: &str = "ontology/kb/uuv.ttl";

/// A copy of the mission `uuv` whose problem declares functions and designs.
fn declared() -> tempfile::TempDir {
    let copy = copy_of_mission("uuv");
    edit(copy.path(), PROBLEM, "(:objects ", &format!("(:objects {OBJECTS} "));
    copy
}

/// The same with a knowledge base that has other names for functions, designs and actions, and a manifest that maps them.
fn renamed(entries: &str) -> tempfile::TempDir {
    let copy = declared();
    let mut text = std::fs::read_to_string(copy.path().join(KB)).expect("the knowledge base");
    for (kind, other) in [("f", "kf"), ("fd", "kd"), ("a", "ka")] {
        for before in [" ", "\n"] {
            text = text.replace(&format!("{before}:{kind}_"), &format!("{before}:{other}_"));
        }
    }
    std::fs::write(copy.path().join(KB), text).expect("written");
    edit(copy.path(), MANIFEST, "[planning]", &format!("[bindings.names]\n{entries}\n\n[planning]"));
    copy
}

const ENTRIES: &str = "\"kd_*\" = \"fd_*\"\n\"kf_*\" = \"f_*\"\n\"ka_*\" = \"a_*\"";

/// What the program says, in the names of the problem, without times.
fn said(directory: &Path, arguments: &[&str], input: &str) -> String {
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
            for timed in ["statistics", "mission", "digest", "time", "microseconds", "due"] {
                value.as_object_mut().map(|own| own.remove(timed));
            }
            value.to_string()
        }
        Err(_) => line.to_owned(),
    };
    text.lines().map(strip).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_mission_with_mapped_names_is_the_same_mission() {
    let (one, other) = (declared(), renamed(ENTRIES));
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
        assert_eq!(said(one.path(), arguments, input), said(other.path(), arguments, input), "{arguments:?}");
    }
    // Not because nothing happens.
    assert!(said(one.path(), &["run", MANIFEST], &lines).contains("fd_search_low"));
    // A design has its name in the knowledge base, too.
    let explain = |name| said(other.path(), &["explain", MANIFEST, name], "");
    assert_eq!(explain("kd_speed_high"), explain("fd_speed_high"));
}

#[test]
fn configurations_with_mapped_names_are_compared_alike() {
    let copy = copy_of_mission("camara_like");
    let manifest = "missions/camara_like.toml";
    let compare = |what: &str| {
        let arguments = ["compare", manifest, "--no-battery", "--pairs", "2", "--format", "json", "--quiet"];
        let outcome = metaplan_in(copy.path(), &arguments, "");
        assert_eq!(outcome.status, 0, "{what}: {outcome:#?}");
        let mut answer = outcome.json();
        for own in answer["comparisons"].as_array_mut().expect("comparisons") {
            own["costs"] = Value::Null;
        }
        answer
    };
    let before = compare("before");
    edit(copy.path(), "ontology/kb/camara_like.ttl", ":fd_", ":way_");
    edit(copy.path(), manifest, "[planning]", "[bindings.names]\n\"way_*\" = \"fd_*\"\n\n[planning]");
    assert_eq!(compare("after"), before);
}

#[test]
fn certificates_hold_for_mapped_names_only_with_them() {
    let copy = renamed(ENTRIES);
    let outcome = metaplan_in(copy.path(), &["plan", MANIFEST, "--certificate", "c"], "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let verified = verify_in(copy.path(), &["c"]);
    assert_eq!(verified.status, 0, "{verified:#?}");
    let about = |status: i32, words: &str| {
        let outcome = metaplan_in(copy.path(), &["verify", "c", "--mission", MANIFEST], "");
        assert_eq!(outcome.status, status, "{outcome:#?}");
        assert!(outcome.stdout.contains(words), "no `{words}`: {outcome:#?}");
    };
    about(0, "it is about `uuv` as it is now");
    // The same plan under other entries is another mission's.
    edit(copy.path(), MANIFEST, "\"ka_*\" = \"a_*\"", "\"ka_*\" = \"a_*\"\nkd_recharge = \"fd_recharge\"");
    about(30, "the bindings differ");
    // A certificate in which two designs are exchanged speaks of another problem.
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
    assert!(outcome.stdout.contains("the knowledge says"), "{outcome:#?}");
}

/// Plans the renamed mission with these entries; standard error must have these words.
fn check(entries: &str, status: i32, words: &[&str]) -> Outcome {
    let copy = renamed(entries);
    let outcome = metaplan_in(copy.path(), &["plan", MANIFEST], "");
    assert_eq!(outcome.status, status, "{entries}: {outcome:#?}");
    for word in words {
        let said = headlines(&outcome.stderr) + &outcome.stderr;
        assert!(said.contains(word), "{entries}: no `{word}`: {outcome:#?}");
    }
    outcome
}

#[test]
fn entries_that_are_wrong_have_their_place() {
    let with = |more: &str| format!("{ENTRIES}\n{more}");
    let place = |column: u32| format!("missions/uuv.toml:11:{column}: ");
    check(
        &with("kd_serach_low = \"fd_search_low\""),
        3,
        &[&place(1), "M223", "`kd_serach_low`; did you mean `kd_search_low`?"],
    );
    check(&with("\"x_*\" = \"fd_*\""), 3, &[&place(1), "M223", "the pattern `x_*` meets no individual"]);
    check(
        &with("  kd_search_low = \"fd_serach_low\""),
        3,
        &[&place(3), "M224", "there is no object `fd_serach_low`", "did you mean `fd_search_low`?"],
    );
    check(
        &with("kd_search_low = \"pl1\""),
        3,
        &[
            &place(1),
            "M224",
            "`pl1` is of type `pipeline`",
            "an object of type `functiondesign` would be right",
        ],
    );
    check(
        &with("kd_search_low = \"fd_search_high\""),
        3,
        &["M225", "`fd_search_high` would be `kd_search_high`, `kd_search_low`"],
    );
    check(
        &with("\"kd_search_*\" = \"fd_speed_*\""),
        3,
        &[&place(1), "M225", "`kd_search_low` would be `fd_speed_low` and `fd_search_low`"],
    );
    check(&with("\"kd_*_*\" = \"fd_*\""), 3, &[&place(1), "M223", "a pattern has one star on each side"]);
    check(&with("\"kd_search_*\" = \"fd_search_low\""), 3, &[&place(1), "M223", "a star on both sides"]);
    check(&with("kd_search_low = 3"), 3, &["missions/uuv.toml:11:17: ", "M104", "expected a string"]);
    let all = check(&with("kd_x = \"fd_search_low\"\nkd_y = \"fd_search_low\""), 3, &["kd_x", "kd_y"]);
    assert_eq!(all.stderr.matches("M223").count(), 2, "{all:#?}");
}

#[test]
fn an_exact_entry_counts_before_a_pattern() {
    let entries = "\"kd_*\" = \"fd_*\"\n\"kf_*\" = \"f_*\"\n\"ka_*\" = \"a_*\"\n\
        kd_search_high = \"fd_search_low\"\n\"http://metacontrol.org/metaplan/uuv#kd_search_low\" = \"fd_search_high\"";
    let copy = renamed(entries);
    let outcome = metaplan_in(copy.path(), &["plan", MANIFEST, "--format", "json"], "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    // The quick design is the other one now.
    assert_eq!(steps(&outcome.json())[0], "search_pipeline pl1 | fd_search_low, fd_speed_high");
}

#[test]
fn a_pattern_leaves_what_has_no_object() {
    let copy = renamed(ENTRIES);
    edit(copy.path(), PROBLEM, "fd_search_medium ", "");
    let outcome = metaplan_in(copy.path(), &["plan", MANIFEST], "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    for word in
        ["warning[M226]", "missions/uuv.toml:8:1", "`kd_search_medium`", "no object `fd_search_medium`"]
    {
        assert!(outcome.stderr.contains(word), "no `{word}`: {outcome:#?}");
    }
    // It is a design like others, under its own name.
    assert!(outcome.stderr.contains("in the knowledge base only: `kd_search_medium`"), "{outcome:#?}");
}

#[test]
fn names_that_meet_nothing_are_listed_from_both_sides() {
    let without = renamed("kd_recharge = \"fd_recharge\"");
    let outcome = metaplan_in(without.path(), &["plan", MANIFEST], "");
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    for word in [
        "error[M222]: no design of the required function `kf_maintain_motion` is known to both sides; in the problem only: \
         `fd_speed_low`, ",
        "in the knowledge base only: `kd_speed_high`, `kd_speed_low`, `kd_speed_medium`",
        "problem.pddl:4:13",
        "warning[M221]: the knowledge base does not know all functions of the problem; in the problem only: `f_maintain_motion`",
    ] {
        assert!(outcome.stderr.contains(word), "no `{word}`: {outcome:#?}");
    }
    // Some of them meet: warnings.
    let some = declared();
    edit(some.path(), PROBLEM, "fd_search_low ", "fd_serach_low ");
    let outcome = metaplan_in(some.path(), &["plan", MANIFEST], "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    for word in [
        "warning[M221]: the knowledge base does not know all designs of the problem",
        "problem.pddl:4:56",
        "in the problem only: `fd_serach_low`; in the knowledge base only: `fd_search_low`",
        "write in `[bindings.names]`: fd_search_low = \"fd_serach_low\"",
    ] {
        assert!(outcome.stderr.contains(word), "no `{word}`: {outcome:#?}");
    }
    // A design that the problem never names, though it names others, has its place in the knowledge base.
    let fewer = declared();
    edit(fewer.path(), PROBLEM, "fd_search_low ", "");
    let outcome = metaplan_in(fewer.path(), &["plan", MANIFEST], "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    for word in ["uuv.ttl:", "M221", "the problem names designs, but not all", "only: `fd_search_low`"] {
        assert!(outcome.stderr.contains(word), "no `{word}`: {outcome:#?}");
    }
    let strange = declared();
    edit(strange.path(), "encodings/uuv/domain.pddl", "a_recharge - action", "a_recharge a_rest - action");
    let outcome = metaplan_in(strange.path(), &["plan", MANIFEST], "");
    for word in ["domain.pddl:7:", "does not know all actions of the problem; in the problem only: `a_rest`"]
    {
        assert!(outcome.stderr.contains(word), "no `{word}`: {outcome:#?}");
    }
}

#[test]
fn what_nobody_has_to_know_is_not_warned_of() {
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

/// Components may be objects, too; the knowledge base's own names come first.
#[test]
fn components_are_named_either_way() {
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
    // With two thrusters only the low speed is left; without the sonar nothing can be followed.
    assert_eq!(costs, [json!(56), json!(56), json!(56), Value::Null]);
    let line = r#"{"event":"component_status","component":"front","status":"FALSE"}"#;
    let outcome = metaplan_in(copy.path(), &["run", MANIFEST], line);
    assert!(outcome.stdout.contains("c_status(c_thruster_3, "), "{outcome:#?}");
    let outcome = metaplan_in(copy.path(), &["plan", MANIFEST, "--fail", "frnt"], "");
    assert_eq!(outcome.status, 2, "{outcome:#?}");
}

/// A journal goes on under the same entries, wherever they stand, and under no others.
#[test]
fn journals_are_of_missions_with_these_names() {
    let copy = renamed(ENTRIES);
    let run = || metaplan_in(copy.path(), &["run", MANIFEST, "--journal", "j"], "{\"event\":\"tick\"}\n");
    assert_eq!(run().status, 0);
    edit(copy.path(), MANIFEST, "[bindings.names]", "\n# The same.\n[bindings.names]");
    let again = run();
    assert_eq!(again.status, 0, "{again:#?}");
    edit(copy.path(), MANIFEST, "\"kd_*\" = \"fd_*\"", "\"kd_*\" = \"fd_*\"\nkd_follow = \"fd_follow\"");
    let other = run();
    assert!(other.status == 3 && other.stderr.contains("M321"), "{other:#?}");
}

#[test]
fn names_on_the_command_line_go_with_a_knowledge_base() {
    let (domain, problem) = ("encodings/uuv/domain.pddl", "encodings/uuv/problem.pddl");
    for (arguments, status, words) in [
        (&["plan", domain, problem, "--name", "a=b"][..], 2, "`--name` goes with `--kb`"),
        (&["plan", "missions/uuv.toml", "--name", "a=b"], 2, "a mission's manifest names its own"),
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
