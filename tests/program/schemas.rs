//! Tests of the JSON Schemas: valid outputs and inputs conform to the schemas, and invalid ones do not.

use jsonschema::Validator;
use metaplan::mapek::Observation;
use metaplan::schemas::{FORMATS, schema};
use serde_json::{Value, json};

use crate::common::{metaplan, metaplan_in, root};

fn validator(format: &str) -> Validator {
    let schema = schema(format).unwrap_or_else(|| panic!("no schema of {format}"));
    jsonschema::validator_for(&schema).unwrap_or_else(|error| panic!("{format}: {error}"))
}

fn validate(format: &str, document: &Value) -> Result<(), String> {
    let faults: Vec<String> = validator(format)
        .iter_errors(document)
        .map(|error| format!("{}: {error}", error.instance_path()))
        .collect();
    if faults.is_empty() { Ok(()) } else { Err(format!("{format}: {}\n{document:#}", faults.join("\n"))) }
}

fn format_of(document: &Value) -> &str {
    let format = document["format"].as_str().expect("a format");
    format.strip_prefix("metaplan-").and_then(|name| name.split('/').next()).expect("a name and a version")
}

#[test]
fn answers_conform_to_their_schemas() {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    let json = ["--format", "json"];
    let mission = "m/mission.toml";
    let commands: [&[&str]; 21] = [
        &["init", "m", "--from", "warehouse"],
        &["plan", mission],
        &["plan", mission, "--fail", "c_arm"],
        &["plan", "none.toml"],
        &["lint", mission],
        &["lint", "m/domain.pddl", "m/problem.pddl"],
        &["explain", "M118"],
        &["explain", mission],
        &["explain", mission, "fd_lidar"],
        &["reason", "m/robot.ttl"],
        &["reason", "m/robot.ttl", "--why", "c_arm a t:Component"],
        &["reason", "m/robot.ttl", "--schema"],
        &["reason", "m/robot.ttl", "--entails", "m/robot.ttl"],
        &["configure", "m/robot.ttl", "--objective", "f_grasp", "--least", "grasp_energy"],
        &["export", mission, "--to", "pddl"],
        &["simulate", mission, "--scenario", "lidar_under_way", "--strategy", "joint"],
        &["check", "m.prism", "Pmax=? [ F s=1 ]"],
        &["validate", mission, "plan"],
        &["verify", "proof"],
        &["journal", "check", "none"],
        &["sweep", "study.toml", "--output", "results"],
    ];
    std::fs::write(here.join("m.prism"), "mdp\nmodule m\n s : [0..1];\n [] s=0 -> (s'=1);\nendmodule\n")
        .expect("written");
    std::fs::write(here.join("study.toml"), "command = ['plan', 'm/mission.toml']\n").expect("written");
    std::fs::write(here.join("plan"), "(pick box near_rack fd_suction)\n").expect("written");
    let mut covered_formats = std::collections::BTreeSet::new();
    for command in commands {
        let answer = metaplan_in(here, &[command, &json].concat(), "");
        let document = answer.json();
        covered_formats.insert(format_of(&document).to_owned());
        let checked = validate(format_of(&document), &document);
        assert!(checked.is_ok(), "{command:?}: {}", checked.unwrap_err());
    }
    metaplan_in(here, &["run", mission, "--journal", "j"], "");
    let journal = metaplan_in(here, &["journal", "show", "j", "--format", "json"], "").json();
    covered_formats.insert(format_of(&journal).to_owned());
    assert_eq!(validate(format_of(&journal), &journal), Ok(()));
    for command in [
        &["plan", "missions/ugv.toml", "--pareto", "total-time,battery_used"][..],
        &["plan", "missions/ugv.toml", "--minimize", "total-time", "--minimize", "battery_used"],
        &["plan", "missions/ugv.toml", "--alternatives", "2"],
    ] {
        let document = metaplan(&[command, &json].concat()).json();
        covered_formats.insert(format_of(&document).to_owned());
        assert_eq!(validate(format_of(&document), &document), Ok(()), "{command:?}");
    }
    let camara = ["compare", "missions/camara_like.toml", "--no-battery"];
    for (command, complete) in [
        (["compare", "missions/ugv.toml", "--loss", "c_kinect=0.1"].to_vec(), true),
        ([&camara[..], &["--pairs", "2"]].concat(), true),
        ([&camara[..], &["--pairs", "100000", "--time-limit", "8"]].concat(), false),
    ] {
        let document = metaplan(&[&command[..], &json].concat()).json();
        covered_formats.insert(format_of(&document).to_owned());
        assert_eq!(validate(format_of(&document), &document), Ok(()), "{command:?}");
        assert!(format_of(&document) == "error" || document["complete"] == complete, "{command:?}");
    }
    std::fs::write(here.join("map.json"), crate::maps::map()).expect("written");
    let places = ["import", "camara-map", "map.json", "--start", "h1", "--goal", "h4", "-o", "out"];
    let imported = metaplan_in(here, &[&places[..], &json].concat(), "").json();
    covered_formats.insert(format_of(&imported).to_owned());
    assert_eq!(validate("import", &imported), Ok(()));
    // Other tests validate manifests, events and answers of the loop. No test validates studies.
    let uncovered_formats: Vec<&str> = FORMATS
        .iter()
        .map(|(format, ..)| *format)
        .filter(|format| !covered_formats.contains(*format))
        .collect();
    assert_eq!(uncovered_formats, ["manifest", "study", "event", "answer"]);
}

#[test]
fn schemas_refuse_other_formats() {
    let plan = metaplan(&["plan", "missions/ugv.toml", "--format", "json"]).json();
    assert!(validate("plan", &plan).is_ok());
    for field in plan.as_object().expect("an object").keys() {
        let mut changed = plan.clone();
        changed[field] = json!({ "no": ["such", "value"] });
        assert!(validate("plan", &changed).is_err(), "{field} may be anything");
    }
    for format in ["lint", "verdict", "init"] {
        assert!(validate(format, &plan).is_err(), "{format}");
    }
}

fn manifest(path: &std::path::Path) -> Value {
    let text = std::fs::read_to_string(path).expect("a manifest");
    toml::from_str(&text).expect("TOML")
}

#[test]
fn manifests_conform_and_unknown_keys_are_refused() {
    let mut paths: Vec<_> = std::fs::read_dir(root().join("missions"))
        .expect("missions")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.extend(
        ["blank", "ugv", "warehouse"]
            .map(|name| root().join("missions/templates").join(name).join("mission.toml")),
    );
    let mut count = 0;
    for path in paths.iter().filter(|path| path.extension().is_some_and(|extension| extension == "toml")) {
        let valid_manifest = manifest(path);
        assert_eq!(validate("manifest", &valid_manifest), Ok(()), "{}", path.display());
        // Each table gets an unknown key in turn. Tables that map names accept any key and are therefore
        // excluded.
        for pointer in [
            "",
            "/knowledge",
            "/planning",
            "/report",
            "/scenarios/dusty",
            "/scenarios/undisturbed/simulation",
        ] {
            let mut changed = valid_manifest.clone();
            let Some(table) = changed.pointer_mut(pointer).and_then(Value::as_object_mut) else { continue };
            table.insert("no_such_key".to_owned(), json!(1));
            assert!(validate("manifest", &changed).is_err(), "{} {pointer}", path.display());
            count += 1;
        }
    }
    assert!(count > 20, "{count}");
    for (section, key, invalid_value) in [
        ("adaptation", "settle", json!(-1)),
        ("adaptation", "settle", json!([1])),
        ("bindings", "battery", json!(3)),
        ("report", "positions", json!(["x"])),
        ("probabilistic", "battery_unit", json!("one")),
    ] {
        let mut changed = manifest(&root().join("missions/ugv.toml"));
        changed[section] = json!({ key: invalid_value });
        assert!(validate("manifest", &changed).is_err(), "{section} {key}");
    }
    let mut valid_manifest = manifest(&root().join("missions/ugv.toml"));
    valid_manifest["adaptation"] = json!({ "settle": "0.5", "time_limit": 2, "stay_close": true });
    valid_manifest["bindings"] = json!({ "battery": "measured:battery", "names": { "a": "b" } });
    assert_eq!(validate("manifest", &valid_manifest), Ok(()));
}

#[test]
fn event_schema_agrees_with_the_parser() {
    let events = [
        json!({"event": "measured", "attribute": "a", "value": 0.5, "seq": 1, "time": 0.25}),
        json!({"event": "measured", "attribute": "a", "value": "0.5"}),
        json!({"event": "component_status", "component": "c", "status": "FALSE"}),
        json!({"event": "component_status", "component": "c", "status": true}),
        json!({"event": "action_started", "action": 1}),
        json!({"event": "action_succeeded", "action": 1}),
        json!({"event": "action_failed", "action": 1, "reason": "slipped"}),
        json!({"event": "action_cancelled", "action": 1}),
        json!({"event": "action_progress", "action": 1, "fraction": 0.5}),
        json!({"event": "goal_changed", "goal": "(p)"}),
        json!({"event": "fact_changed", "name": "battery", "value": 3}),
        json!({"event": "fact_changed", "name": "p a", "value": true}),
        json!({"event": "acknowledged", "effect": 1}),
        json!({"event": "reconfiguration_failed", "effect": 1}),
        json!({"event": "design_status", "design": "d", "realisable": false}),
        json!({"event": "configuration_observed", "function": "f", "design": null}),
        json!({"event": "objective_added", "objective": "o", "function": "f", "requirements": {"a": 1.5}, "always_improve": true}),
        json!({"event": "objective_removed", "objective": "o"}),
        json!({"event": "tick"}),
        json!({"event": "note", "text": "t"}),
    ];
    let validator = validator("event");
    let is_accepted = |event: &Value| {
        let is_parsed = Observation::parse(&event.to_string()).events.iter().all(Result::is_ok);
        assert_eq!(validator.is_valid(event), is_parsed, "{event}");
        is_parsed
    };
    let optional = ["seq", "time", "reason", "requirements", "always_improve"];
    for event in &events {
        assert!(is_accepted(event), "{event}");
        for field in event.as_object().expect("an object").keys() {
            let mut incomplete = event.clone();
            incomplete.as_object_mut().expect("an object").remove(field);
            assert_eq!(
                is_accepted(&incomplete),
                optional.contains(&field.as_str()),
                "{event} without {field}"
            );
            let mut changed = event.clone();
            changed[field] = json!([[]]);
            assert!(!is_accepted(&changed), "{changed}");
        }
        let mut extended = event.clone();
        extended["no_such_field"] = json!(1);
        assert!(!is_accepted(&extended), "{extended}");
    }
    assert!(!is_accepted(&json!({"event": "measrued"})));
    assert!(!is_accepted(&json!({"event": "measured", "attribute": "a", "value": "much"})));
    for (fraction, is_valid) in [
        (json!(0), true),
        (json!(1), true),
        (json!("0.25"), true),
        (json!("1.0"), true),
        (json!(1.5), false),
        (json!(-0.5), false),
        (json!("1.5"), false),
        (json!("2"), false),
    ] {
        let event = json!({"event": "action_progress", "action": 1, "fraction": fraction});
        assert_eq!(is_accepted(&event), is_valid, "{event}");
    }
}

#[test]
fn answers_of_the_loop_conform() {
    // The action becomes overdue, which is no effect.
    let lines = r#"{"event":"component_status","component":"c_kinect","status":"FALSE"}
{"event":"zzz"}
{"event":"action_started","action":1,"time":0}
{"event":"tick","time":1000}
"#;
    let outcome = metaplan_in(&root(), &["run", "missions/ugv.toml"], lines);
    assert!(outcome.stdout.lines().count() > 5, "{outcome:#?}");
    assert!(outcome.stdout.contains("\"effect\":null"), "{outcome:#?}");
    let configure = ["run", "--configure", "ontology/kb/uuv.ttl", "--rules", "coadaptation"];
    let without_plan = metaplan_in(&root(), &configure, "{\"event\":\"tick\",\"time\":1}\n");
    assert!(without_plan.stdout.contains("\"objectives\":[\""), "{without_plan:#?}");
    for line in outcome.stdout.lines().chain(without_plan.stdout.lines()) {
        let answer: Value = serde_json::from_str(line).expect("JSON");
        assert_eq!(validate("answer", &answer), Ok(()));
    }
}

#[test]
fn schemas_are_printed_by_the_command() {
    let listed = metaplan(&["schema"]).stdout;
    for (format, ..) in FORMATS {
        assert!(listed.contains(format), "{format}: {listed}");
        let printed = metaplan(&["schema", format]);
        assert_eq!((printed.status, printed.stderr.as_str()), (0, ""), "{format}");
        assert_eq!(Some(printed.json()), schema(format), "{format}");
    }
    let unknown = metaplan(&["schema", "manifst"]);
    assert!(unknown.status == 2 && unknown.stderr.contains("did you mean `manifest`?"), "{unknown:#?}");
}
