//! Tests of `metaplan explain`: reasons, costs of alternatives, and changes that would lead to another answer.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use crate::common::{copy_folder, metaplan, metaplan_in, root};

fn explain(arguments: &[&str]) -> Value {
    let command: Vec<&str> =
        ["explain"].iter().chain(arguments).copied().chain(["--format", "json"]).collect();
    let outcome = metaplan(&command);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let answer = outcome.json();
    assert_eq!(answer["format"], "metaplan-explain/1");
    answer
}

fn changes(answer: &Value) -> Vec<Value> {
    let change =
        |change: &Value| json!([change["name"], change["relation"], change["bound"], change["then"]["cost"]]);
    answer["changes"].as_array().expect("changes").iter().map(change).collect()
}

#[test]
fn why_not_another_design() {
    let answer = explain(&["missions/ugv.toml", "fd_amcl_lidar"]);
    let figures = json!([
        answer["available"],
        answer["best"]["cost"],
        answer["alone"]["cost"],
        answer["without"]["cost"],
        answer["used"]
    ]);
    assert_eq!(figures, json!([true, 408, 516, 408, []]));
    assert_eq!(changes(&answer), [json!(["c_lidar", "failed", null, 408])]);
    let answer = explain(&["missions/ugv.toml", "fd_amcl_kinect"]);
    // The second-best design is the other one with the Kinect.
    let figures = json!([answer["alone"]["cost"], answer["without"]["cost"], answer["used"]]);
    assert_eq!(figures, json!([408, 416, [1, 2, 3, 4]]));
    let expected = [json!(["c_kinect", "failed", null, 516]), json!(["ambient_light", "above", 0.8, 516])];
    assert_eq!(changes(&answer), expected);
}

#[test]
fn why_a_design_is_not_available() {
    let situation = ["--fail", "c_kinect", "--set", "ambient_light=0.9"];
    let arguments: Vec<&str> = ["missions/ugv.toml", "fd_amcl_kinect"].into_iter().chain(situation).collect();
    let answer = explain(&arguments);
    assert_eq!(answer["available"], false);
    let because = answer["because"].to_string();
    assert!(because.contains("c_status(c_kinect"), "{because}");
    // Both causes are listed. Removing only one of them does not make the design available.
    let expected =
        [json!(["c_kinect", "recovered", null, 516]), json!(["ambient_light", "at_most", 0.8, 516])];
    assert_eq!(changes(&answer), expected);
    assert_eq!(answer["alone"]["cost"], 408, "as if it were available");
}

#[test]
fn changes_that_affect_the_plan_are_listed() {
    assert_eq!(
        changes(&explain(&["missions/ugv.toml"])),
        [json!(["ambient_light", "above", 0.8, 516]), json!(["battery", "below", 8, null])]
    );
    let answer = explain(&["missions/uuv.toml"]);
    let changes_of_plan = changes(&answer);
    assert_eq!(changes_of_plan[0], json!(["water_visibility", "below", 3.25, 34]));
    // The plan uses 77 percent of the battery, and the reserve is 10. The bound is exact to 10^-6.
    assert_eq!(changes_of_plan[1][2], json!(87), "{answer:#}");
}

#[test]
fn bounds_of_small_values_are_found() {
    let directory = tempfile::tempdir().expect("a directory");
    let write = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).expect("written");
    let actions = "(:action a :parameters () :precondition (>= (x) 0.000495)
           :effect (and (done) (increase (c) 1)))
         (:action b :parameters () :precondition () :effect (and (done) (increase (c) 2)))";
    write(
        "domain.pddl",
        &format!(
            "(define (domain d) (:requirements :strips :numeric-fluents) (:predicates (done))
             (:functions (x) (c)) {actions})"
        ),
    );
    write(
        "problem.pddl",
        "(define (problem p) (:domain d) (:init (= (x) 0.0005) (= (c) 0)) (:goal (done))
         (:metric minimize (c)))",
    );
    let knowledge = root().join("ontology/kb/ugv.ttl");
    write(
        "m.toml",
        &format!(
            "name = 'small'\n[knowledge]\nfiles = ['{}']\n[planning]\n\
             domain = 'domain.pddl'\nproblem = 'problem.pddl'\n",
            knowledge.display()
        ),
    );
    let file = directory.path().join("m.toml");
    let answer = explain(&[file.to_str().expect("UTF-8"), "--time-limit", "120"]);
    let costs: Vec<Value> = changes(&answer).iter().map(|change| change[3].clone()).collect();
    assert_eq!(costs.iter().map(Value::as_f64).collect::<Vec<_>>(), [Some(2.0)], "{answer:#}");
}

/// A domain and a problem with options for the knowledge base are explained as the manifest with the same files.
#[test]
fn a_domain_and_a_problem_are_explained_as_a_manifest() {
    let files = ["encodings/ugv/domain.pddl", "encodings/ugv/problem.pddl", "--kb", "ontology/kb/ugv.ttl"];
    let without_name = |mut answer: Value| {
        answer["mission"] = Value::Null;
        answer
    };
    for design in [None, Some("fd_amcl_lidar")] {
        let inputs = [&files[..2], design.as_slice(), &files[2..]].concat();
        let manifest = [&["missions/ugv.toml"][..], design.as_slice()].concat();
        assert_eq!(without_name(explain(&inputs)), without_name(explain(&manifest)), "{design:?}");
    }
    let outcome = metaplan(&["explain", "encodings/ugv/domain.pddl"]);
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    assert!(outcome.stderr.contains("give the problem, too: DOMAIN PROBLEM"), "{outcome:#?}");
}

/// A design that also solves another function remains available for it. The expected costs are the smallest sums over
/// the admitted designs for `f1` (`d` or `r`) and `f2` (`r` or `e`).
#[test]
fn rivals_keep_their_other_functions() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = |name: &str, text: &str| {
        let path = directory.path().join(name);
        std::fs::write(&path, text).expect("written");
        path.display().to_string()
    };
    let domain = file(
        "domain.pddl",
        "(define (domain d) (:requirements :action-costs) (:predicates (done)) (:functions (energy) (total-cost))
          (:action work :parameters () :precondition () :effect (and (done) (increase (total-cost) (energy)))))",
    );
    let problem = file(
        "problem.pddl",
        "(define (problem p) (:domain d) (:init (= (total-cost) 0)) (:goal (done))
          (:metric minimize (total-cost)))",
    );
    // Without the import of TOMASys, where `solvesF` is functional and would make the functions of `r` equal.
    let knowledge = "@prefix : <urn:m#> .\n@prefix owl: <http://www.w3.org/2002/07/owl#> .
        @prefix t: <http://metacontrol.org/tomasys#> .\n<urn:m> a owl:Ontology .
        :energy a t:QualityAttributeType . :f1 a t:Function . :f2 a t:Function .
        :a_work a t:Action ; t:requiresF :f1 , :f2 .\n";
    let design = |name: &str, functions: &str, energy: u32| {
        format!(
            ":{name} a t:FunctionDesign ; t:solvesF {functions} ; t:hasQAestimation :e_{name} .
             :e_{name} a t:QAvalue ; t:isQAtype :energy ; t:hasValue {energy}.0 .\n"
        )
    };
    let two = knowledge.to_owned() + &design("d", ":f1", 5) + &design("r", ":f1 , :f2", 1);
    let three = two.clone() + &design("e", ":f2", 10);
    // Design, cost of the best plan with it as the only design of its functions, and cost without it.
    for (knowledge, design, alone, without) in [
        (&two, "d", json!(6), json!(2)),
        (&two, "r", json!(2), json!(null)),
        (&three, "d", json!(6), json!(2)),
        (&three, "r", json!(2), json!(15)),
        (&three, "e", json!(11), json!(2)),
    ] {
        let knowledge = file("robot.ttl", knowledge);
        let answer = explain(&[&domain, &problem, design, "--kb", &knowledge]);
        let costs = json!([answer["best"]["cost"], answer["alone"]["cost"], answer["without"]["cost"]]);
        assert_eq!(costs, json!([2, alone, without]), "{design}: {answer:#}");
        assert_eq!(answer["complete"], true, "{design}: {answer:#}");
    }
}

#[test]
fn unknown_designs_are_usage_errors() {
    let outcome = metaplan(&["explain", "missions/ugv.toml", "fd_none"]);
    assert_eq!(outcome.status, 2);
    assert!(outcome.stderr.contains("there are: fd_amcl_kinect"), "{outcome:#?}");
}

/// Own rules about `fd_first`, the cheaper one of two designs.
const FOG: &str = "[fog] t:isQAtype(?q, r:humidity) ^ t:isMeasured(?q, true) ^ t:hasValue(?q, ?h)
    ^ swrlb:greaterThan(?h, 90) -> t:fd_realisability(r:fd_first, false) .\n";
const DRIFT: &str = "[drift] t:isQAtype(?w, r:wind) ^ t:hasValue(?w, ?wind) ^ swrlb:lessThan(6, ?wind)
    ^ t:hasValue(r:obs_humidity, ?h) ^ swrlb:greaterThanOrEqual(?h, 50)
    -> t:fd_realisability(r:fd_first, false) .\n";
const COMPUTED: &str =
    "[computed] t:isQAtype(?q, r:humidity) ^ t:hasValue(?q, ?h) ^ swrlb:multiply(?d, ?h, 2)
    ^ swrlb:greaterThan(?d, 180) -> t:fd_realisability(r:fd_first, false) .\n";
const NEVER: &str = "[never] t:requiresC(?fd, r:c_first) -> t:fd_realisability(?fd, false) .\n";
const DRY_AND_CALM: &str = "[dry and calm] t:hasValue(r:obs_humidity, ?h) ^ swrlb:lessThanOrEqual(?h, 7)
    ^ t:hasValue(r:obs_wind, ?w) ^ swrlb:lessThan(?w, 7) -> t:fd_realisability(r:fd_first, false) .\n";
const WET_AND_CALM: &str = "[wet and calm] t:hasValue(r:obs_wind, ?w) ^ swrlb:lessThan(?w, 5.5)
    ^ t:hasValue(r:obs_humidity, ?h) ^ swrlb:greaterThan(?h, 8.5) -> t:fd_realisability(r:fd_first, false) .\n";

const DRY_WITHOUT_SECOND: &str = "[dry without second] t:c_status(r:c_second, \"FALSE\")
    ^ t:hasValue(r:obs_humidity, ?h) ^ swrlb:lessThan(?h, 7.5) -> t:fd_realisability(r:fd_first, false) .\n";

/// Explains, with own rules in addition to the shipped ones. `arguments` follow the mission.
fn explain_with(rules: &[&str], arguments: &str, format: &str) -> String {
    explain_statements("", rules, arguments, format)
}

/// Like [`explain_with`], with more statements in the knowledge base.
fn explain_statements(statements: &str, rules: &[&str], arguments: &str, format: &str) -> String {
    let folder = tempfile::tempdir().expect("a directory");
    copy_folder(&root().join("missions/templates/blank"), folder.path());
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("a file");
    let measured = [("humidity", 40), ("wind", 3)].map(|(name, value)| {
        format!(
            ":{name} a t:QualityAttributeType .\n:obs_{name} a t:QAvalue ; t:isQAtype :{name} ; \
             t:isMeasured true ; t:hasValue {value} .\n"
        )
    });
    write("robot.ttl", &(read("robot.ttl") + "\n" + &measured.concat() + statements));
    let manifest = read("mission.toml");
    let files = "files = [\"robot.ttl\"]\n";
    assert!(manifest.contains(files), "{manifest}");
    let with_rules = format!("{files}rules = [\"coadaptation\", \"own.swrl\"]\n");
    write("mission.toml", &manifest.replace(files, &with_rules));
    let prefixes =
        "@prefix t: <http://metacontrol.org/tomasys#> .\n@prefix r: <http://example.org/robot#> .\n";
    write("own.swrl", &(prefixes.to_owned() + &rules.concat()));
    let command: Vec<&str> = ["explain", "mission.toml"]
        .into_iter()
        .chain(arguments.split_whitespace())
        .chain(["--format", format])
        .collect();
    let outcome = metaplan_in(folder.path(), &command, "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    outcome.stdout
}

fn json_with(rules: &[&str], arguments: &str) -> Value {
    serde_json::from_str(&explain_with(rules, arguments, "json")).expect("JSON")
}

/// Checks the sets of changes that make `fd_first` available, each as text `name relation bound`.
#[track_caller]
fn check_repairs(rules: &[&str], situation: &str, expected: &[&[&str]]) -> Value {
    let answer = json_with(rules, &format!("fd_first {situation}"));
    assert_eq!(answer["available"], false, "{answer:#}");
    let list = |value: &Value| value.as_array().expect("a list").clone();
    let change = |change: &Value| {
        let name = change["name"].as_str().expect("a name");
        let relation = change["relation"].as_str().expect("a relation");
        change["bound"].as_f64().map_or(name.to_owned(), |bound| format!("{name} {relation} {bound}"))
    };
    let repairs: BTreeSet<BTreeSet<String>> = list(&answer["repairs"])
        .iter()
        .map(|repair| list(&repair["changes"]).iter().map(change).collect())
        .collect();
    let expected: BTreeSet<BTreeSet<String>> =
        expected.iter().map(|set| set.iter().map(|text| (*text).to_owned()).collect()).collect();
    assert_eq!(repairs, expected, "{answer:#}");
    answer
}

#[test]
fn bounds_in_own_rules_are_candidates_for_changes() {
    let answer = check_repairs(&[FOG], "--set humidity=95", &[&["humidity at_most 90"]]);
    assert_eq!(json!([answer["unexamined"], answer["repairs"][0]["then"]["cost"]]), json!([[], 1]));
    let situation = "--set wind=7 --set humidity=60";
    check_repairs(&[DRIFT], situation, &[&["humidity below 50"], &["wind at_most 6"]]);
}

/// Two measurements of one attribute have the same bound, so the changes differ only in the present values.
#[test]
fn changes_of_two_measurements_of_an_attribute_are_listed() {
    let second = ":obs_second a t:QAvalue ; t:isQAtype :humidity ; t:isMeasured true ; t:hasValue 42 .\n";
    let rule = FOG.replace("90", "30");
    let text = explain_statements(second, &[&rule], "fd_first", "json");
    let answer: Value = serde_json::from_str(&text).expect("JSON");
    let repairs = answer["repairs"].as_array().expect("a list");
    let bounds: Vec<&Value> = repairs.iter().map(|repair| &repair["changes"][0]["bound"]).collect();
    assert_eq!((&answer["available"], bounds), (&json!(false), vec![&json!(30), &json!(30)]), "{answer:#}");
}

/// The wind has two bounds. Only the greater one suffices alone, and it makes the change of the humidity unnecessary.
#[test]
fn each_bound_of_a_measurement_is_tried_with_the_other_changes() {
    let situation = "--set humidity=1.5 --set wind=4";
    let expected: [&[&str]; 2] = [&["humidity above 7"], &["wind at_least 7"]];
    check_repairs(&[DRY_AND_CALM, WET_AND_CALM], situation, &expected);
}

/// Rules may read the status of a component that the design does not require.
#[test]
fn components_that_only_rules_name_are_tried() {
    let expected: [&[&str]; 2] = [&["humidity at_least 7.5"], &["c_second"]];
    check_repairs(&[DRY_WITHOUT_SECOND], "--set humidity=1.5 --fail c_second", &expected);
    let text = explain_with(&[DRY_WITHOUT_SECOND], "fd_first --set humidity=1.5", "text");
    for line in ["it is not available any more if\n    c_first fails: ", "\n    c_second fails: "] {
        assert!(text.contains(line), "{line}\n{text}");
    }
}

/// A rule that cannot apply has a bound that is farther away than a sufficient one.
#[test]
fn only_the_nearest_sufficient_bound_is_listed() {
    let expected: [&[&str]; 2] = [&["humidity above 7"], &["wind at_least 7"]];
    let situation = "--set humidity=1.5 --set wind=4";
    check_repairs(&[DRY_AND_CALM, DRY_WITHOUT_SECOND], situation, &expected);
    let text = explain_with(&[FOG, &FOG.replace("fog", "mist").replace("90", "95")], "fd_first", "text");
    assert!(text.contains("    humidity above 90 (now 40)") && !text.contains("above 95"), "{text}");
}

#[test]
fn causes_by_own_rules_are_listed_with_the_others() {
    let situation = "--fail c_first --set wind=7 --set humidity=95";
    let expected: [&[&str]; 2] =
        [&["c_first", "humidity below 50"], &["c_first", "humidity at_most 90", "wind at_most 6"]];
    let because = check_repairs(&[FOG, DRIFT], situation, &expected)["because"].to_string();
    for reason in ["rule: fog", "rule: drift", "c_status(c_first"] {
        assert!(because.contains(reason), "{reason}: {because}");
    }
}

/// Only a complete search justifies the claim that nothing makes a design available.
#[test]
fn comparisons_that_are_not_examined_are_listed() {
    let answer = check_repairs(&[COMPUTED], "--set humidity=95", &[]);
    let unexamined = "comparisons of measurements in the rule `computed`";
    assert_eq!(answer["unexamined"], json!([unexamined]));
    let text = explain_with(&[COMPUTED], "fd_first --set humidity=95", "text");
    let claim = "no recovery of components and no change of measurements that was tried makes it available\n";
    assert!(text.ends_with(&format!("{claim}not examined: {unexamined}\n")), "{text}");
    assert_eq!(json_with(&[COMPUTED], "")["unexamined"], json!([unexamined]));
    let answer = check_repairs(&[NEVER], "--fail c_second", &[]);
    assert_eq!(answer["unexamined"], json!([]));
    let text = explain_with(&[NEVER], "fd_first", "text");
    let claim = "no recovery of components and no change of measurements makes it available\n";
    assert!(text.ends_with(claim), "{text}");
}

#[test]
fn bounds_in_own_rules_lead_to_another_plan() {
    let answer = json_with(&[FOG], "--set humidity=89 --fail c_second");
    assert_eq!(answer["best"]["cost"], 1);
    assert_eq!(changes(&answer), [json!(["humidity", "above", 90, null])]);
}
