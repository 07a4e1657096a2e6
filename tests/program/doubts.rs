//! Tests of warnings and rejections: models that mean less than intended, files of the wrong kind, hostile
//! files.

use std::path::Path;

use crate::common::{Outcome, copy_of_mission, edit, metaplan, metaplan_in, root};

/// Standard error must contain all `words`.
fn check(mission: &str, (file, old, new): (&str, &str, &str), words: &[&str]) -> Outcome {
    let copy = copy_of_mission(mission.trim_end_matches("_plain"));
    for plain in [
        format!("missions/{mission}.toml"),
        format!("encodings/{}/plain.pddl", mission.trim_end_matches("_plain")),
    ] {
        let from = root().join(&plain);
        if from.exists() {
            std::fs::copy(from, copy.path().join(&plain)).expect("a copy");
        }
    }
    edit(copy.path(), file, old, new);
    let outcome = metaplan_in(copy.path(), &["plan", &format!("missions/{mission}.toml")], "");
    for word in words {
        assert!(outcome.stderr.contains(word), "no `{word}`: {outcome:#?}");
    }
    outcome
}

#[test]
fn unused_names_are_reported_with_their_position() {
    let kb = "ontology/kb/ugv.ttl";
    check(
        "ugv",
        (kb, "t:requiresC :c_kinect ;", "t:requiresC :c_kinetc ;"),
        &["M207", "ugv.ttl:", "did you mean `c_kinect`?"],
    );
    check(
        "ugv",
        (kb, ":c_camera a owl", ":c_spare a owl:NamedIndividual , t:Component .\n:c_camera a owl"),
        &["M208", "c_spare", "ugv.ttl:"],
    );
    check(
        "ugv",
        (kb, ":safety a owl", ":beauty a t:QualityAttributeType .\n:safety a owl"),
        &["M209", "beauty", "ugv.ttl:"],
    );
    let outcome = check(
        "ugv",
        (
            kb,
            "t:isQAtype :minimum_illuminance ; t:hasMaximum 0.0",
            "t:isQAtype :minimum_iluminance ; t:hasMaximum 0.0",
        ),
        &["M210", "minimum_iluminance", "did you mean `minimum_illuminance`?"],
    );
    assert_eq!(outcome.status, 0, "{outcome:#?}");
}

#[test]
fn names_in_imported_files_have_a_position() {
    let copy = copy_of_mission("ugv");
    let path = copy.path().join("ontology/kb/ugv.ttl");
    let text = std::fs::read_to_string(&path)
        .expect("text")
        .replace("t:requiresC :c_kinect ;", "t:requiresC :c_kinetc ;");
    std::fs::write(copy.path().join("ontology/kb/own.ttl"), text).expect("written");
    let importing = "@prefix owl: <http://www.w3.org/2002/07/owl#> .\n\
        <http://example.org/main> a owl:Ontology ; owl:imports <own.ttl> .\n";
    std::fs::write(&path, importing).expect("written");
    let outcome = metaplan_in(copy.path(), &["plan", "missions/ugv.toml"], "");
    assert!(outcome.stderr.contains("M207") && outcome.stderr.contains("own.ttl:"), "{outcome:#?}");
}

#[test]
fn unbound_names_of_plain_domains_are_reported() {
    let kb = "ontology/kb/ugv.ttl";
    check(
        "ugv_plain",
        (kb, ":a_move a", ":a_mvoe a"),
        &["M205", "a_mvoe", "if it corresponds to `move`", "ugv.ttl:"],
    );
    let domain = "encodings/ugv/plain.pddl";
    let text = std::fs::read_to_string(root().join(domain)).expect("a domain");
    let old = ["(battery_usage)", "(battery_usage )"]
        .into_iter()
        .find(|old| text.contains(old))
        .expect("the function");
    check("ugv_plain", (domain, old, "(batery_usage)"), &["M206", "batery_usage", "plain.pddl"]);
}

/// Creates the ground vehicle's mission with a plain domain, in which a function counts the battery usage of
/// newly chosen designs.
fn changing_mission() -> tempfile::TempDir {
    let copy = copy_of_mission("ugv");
    let read = |file: &str| std::fs::read_to_string(root().join(file)).expect("text");
    let manifest = read("missions/ugv_plain.toml").replace("../", "");
    let manifest = manifest.replace("encodings/ugv/plain.pddl", "plain.pddl");
    let manifest = format!("{manifest}\n[bindings]\nchange = \"reconfigured:battery_usage\"\n");
    let domain =
        read("encodings/ugv/plain.pddl").replace("    (battery_used))", "    (change)\n    (battery_used))");
    for (file, text) in [("mission.toml", manifest), ("plain.pddl", domain)] {
        std::fs::write(copy.path().join(file), text).expect("written");
    }
    copy
}

/// Costs of design changes are supported in increase and decrease effects. Elsewhere they would have no
/// effect and are rejected.
#[test]
fn design_change_costs_are_counted_or_refused() {
    let outcome = |place: &str, replacement: &str| {
        let copy = changing_mission();
        edit(copy.path(), "plain.pddl", place, replacement);
        metaplan_in(copy.path(), &["plan", "mission.toml"], "")
    };
    let duration = "(= ?duration (travel_time ?from ?to))";
    let arrival = "(at end (robot_at ?to))";
    let added = |amount: &str| format!("{arrival} (at end (increase (battery_used) {amount}))");
    // The amount for a sum over two designs is the sum of the amounts only if it is linear.
    for (place, replacement) in [
        (duration, "(= ?duration (+ (travel_time ?from ?to) (change)))".to_owned()),
        (arrival, added("(* (change) (change))")),
        (arrival, added("(* 2 (+ 1 (* (change) (- (change) 1))))")),
        (arrival, added("(/ 20 (+ (change) 10))")),
    ] {
        let refused = outcome(place, &replacement);
        assert_eq!(refused.status, 3, "{refused:#?}");
        assert!(refused.stderr.contains("M228") && refused.stderr.contains("`(change)`"), "{refused:#?}");
    }
    for amount in ["(change)", "(- (* 2 (change)) (/ (change) 2))"] {
        let counted = outcome(arrival, &added(amount));
        assert_eq!((counted.status, counted.stderr.as_str()), (0, ""), "{counted:#?}");
    }
}

#[test]
fn shipped_missions_have_no_warnings() {
    for mission in ["ugv", "uuv", "ugv_plain", "uuv_plain", "camara_like"] {
        let outcome = metaplan(&["plan", &format!("missions/{mission}.toml")]);
        assert!(!outcome.stderr.contains("warning"), "{mission}: {outcome:#?}");
    }
}

#[test]
fn misspelt_names_get_a_suggestion() {
    let ugv = "missions/ugv.toml";
    for (arguments, suggestion) in [
        (&["plan", ugv, "--fail", "c_kinct"][..], "c_kinect"),
        (&["plan", ugv, "--set", "batery=3"], "battery"),
        (&["plan", ugv, "--set", "ambient_ligt=3"], "ambient_light"),
        (&["plan", ugv, "--set", "robot_att=wp2"], "robot_at"),
        (&["plan", ugv, "--scenario", "bright_sum"], "bright_sun"),
        (&["explain", ugv, "fd_amcl_kinct"], "fd_amcl_kinect"),
    ] {
        let outcome = metaplan(arguments);
        assert!(outcome.stderr.contains(&format!("did you mean `{suggestion}`?")), "{outcome:#?}");
    }
    let copy = copy_of_mission("ugv");
    edit(copy.path(), ugv, "[planning]", "[plannning]");
    let outcome = metaplan_in(copy.path(), &["plan", ugv], "");
    assert!(outcome.stderr.contains("did you mean `planning`?"), "{outcome:#?}");
    let lines = "{\"event\":\"mesured\",\"attribute\":\"x\",\"value\":1}\n{\"event\":\"measured\",\"attribute\":\"batery\",\"value\":1}\n";
    let outcome = metaplan_in(&root(), &["run", ugv], lines);
    for suggestion in ["measured", "battery"] {
        assert!(outcome.stdout.contains(&format!("did you mean `{suggestion}`?")), "{outcome:#?}");
    }
}

#[test]
fn the_wrong_kind_of_file_is_recognised() {
    let (domain, problem) = ("encodings/ugv/domain.pddl", "encodings/ugv/problem.pddl");
    for (arguments, words) in [
        (&["plan", domain][..], "this should be a mission's manifest, but is a PDDL domain"),
        (&["plan", "ontology/kb/ugv.ttl"], "this should be a mission's manifest, but is a knowledge base"),
        (&["plan", problem, domain], "this should be a PDDL domain, but is a PDDL problem"),
        (
            &["plan", "missions/ugv.toml", problem],
            "this should be a PDDL domain, but is a mission's manifest",
        ),
    ] {
        let outcome = metaplan(arguments);
        assert_eq!(outcome.status, 3, "{outcome:#?}");
        assert!(outcome.stderr.contains(words), "{outcome:#?}");
    }
}

#[test]
fn hostile_manifests_read_no_secrets_and_do_not_block() {
    let copy = copy_of_mission("ugv");
    let secret = copy.path().join("secret");
    std::fs::write(&secret, "root:*:20228:0:99999:7:::\ndaemon:*:20228:0:99999:7:::\n").expect("a file");
    let manifest = "missions/ugv.toml";
    let plan = |directory: &Path, case: &str| {
        let outcome = metaplan_in(directory, &["plan", manifest, "--time-limit", "300"], "");
        assert!(outcome.status == 3, "{case}: {outcome:#?}");
        let leaks = ["20228", "root", "daemon"].iter().any(|word| outcome.stderr.contains(word));
        assert!(!leaks, "{case}: {outcome:#?}");
    };
    let text = std::fs::read_to_string(copy.path().join(manifest)).expect("text");
    let parts = ["../ontology/kb/ugv.ttl", "../encodings/ugv/domain.pddl", "../encodings/ugv/problem.pddl"];
    for old in parts {
        for new in ["../secret", "/dev/zero", "/dev/tty"] {
            std::fs::write(copy.path().join(manifest), text.replace(old, new)).expect("written");
            plan(copy.path(), &format!("{new} for {old}"));
        }
    }
    std::fs::write(copy.path().join(manifest), &text).expect("written");
    edit(
        copy.path(),
        "ontology/kb/ugv.ttl",
        "owl:imports <http",
        &format!("owl:imports <file://{}> , <http", secret.display()),
    );
    plan(copy.path(), "an import");
}

#[test]
fn control_characters_in_names_are_escaped() {
    let copy = copy_of_mission("ugv");
    edit(copy.path(), "missions/ugv.toml", "name = \"ugv\"", "name = \"u\\u001b[31mg\\u202ev\"");
    for format in ["text", "json"] {
        let outcome = metaplan_in(copy.path(), &["plan", "missions/ugv.toml", "--format", format], "");
        assert_eq!(outcome.status, 0, "{outcome:#?}");
        assert!(!outcome.stdout.contains(['\u{1b}', '\u{202e}']), "{outcome:#?}");
        assert!(outcome.stdout.contains("202e"), "{outcome:#?}");
    }
    let outcome = metaplan_in(copy.path(), &["run", "missions/ugv.toml"], "");
    assert!(outcome.stdout.contains("\\u202e") && !outcome.stdout.contains('\u{202e}'), "{outcome:#?}");
}

#[test]
fn duplicate_fields_and_missing_simulations_are_reported() {
    let doubled = "{\"event\":\"tick\",\"event\":\"tick\"}\n";
    let outcome = metaplan_in(&root(), &["run", "missions/ugv.toml"], doubled);
    assert!(outcome.stdout.contains("the field `event` is repeated"), "{outcome:#?}");
    let outcome = metaplan(&["simulate", "missions/ugv.toml", "--scenario", "bright_sun"]);
    assert!(outcome.stderr.contains("has no `simulation` section; these can: "), "{outcome:#?}");
}
