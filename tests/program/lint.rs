//! Tests of `metaplan lint`: all errors and warnings about a mission in one answer.

use std::path::Path;

use crate::common::{Outcome, edit, metaplan, metaplan_in};

fn check(changes: &[(&str, &str, &str)], status: i32, words: &[&str]) -> Outcome {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    assert_eq!(metaplan_in(here, &["init", "m", "--from", "warehouse"], "").status, 0);
    for (file, old, new) in changes {
        edit(&here.join("m"), file, old, new);
    }
    let outcome = metaplan_in(here, &["lint", "m/mission.toml"], "");
    assert_eq!(outcome.status, status, "{outcome:#?}");
    assert!(outcome.stderr.is_empty(), "{outcome:#?}");
    for word in words {
        assert!(outcome.stdout.contains(word), "no `{word}`: {}", outcome.stdout);
    }
    let json = metaplan_in(here, &["lint", "m/mission.toml", "--format", "json"], "");
    let answer = json.json();
    let count = |severity: &str| {
        let messages = answer["messages"].as_array().expect("messages");
        messages.iter().filter(|message| message["severity"] == severity).count()
    };
    assert_eq!((json.status, answer["format"].as_str()), (status, Some("metaplan-lint/1")));
    assert_eq!(answer["errors"], count("error"));
    assert_eq!(answer["warnings"], count("warning"));
    outcome
}

#[test]
fn templates_and_shipped_missions_are_clean() {
    for template in ["blank", "ugv", "warehouse"] {
        let directory = tempfile::tempdir().expect("a directory");
        assert_eq!(metaplan_in(directory.path(), &["init", "m", "--from", template], "").status, 0);
        let outcome = metaplan_in(directory.path(), &["lint", "m/mission.toml"], "");
        assert_eq!((outcome.status, outcome.stdout.as_str()), (0, "no problems found\n"), "{template}");
    }
    for mission in ["ugv", "ugv_plain", "uuv", "uuv_plain", "camara_like"] {
        let outcome = metaplan(&["lint", &format!("missions/{mission}.toml")]);
        assert_eq!(outcome.status, 0, "{outcome:#?}");
    }
    let outcome = metaplan(&["lint", "encodings/ugv/plain.pddl", "encodings/ugv/problem.pddl"]);
    assert_eq!(
        outcome.status, 1,
        "without a knowledge base nothing gives `battery_usage` a value: {outcome:#?}"
    );
    let with_knowledge_base =
        ["lint", "encodings/ugv/plain.pddl", "encodings/ugv/problem.pddl", "--kb", "ontology/kb/ugv.ttl"];
    assert_eq!(metaplan(&with_knowledge_base).status, 0);
}

#[test]
fn impossible_actions_do_not_lead_to_warnings() {
    let directory = tempfile::tempdir().expect("a directory");
    let domain = "(define (domain d) (:requirements :durative-actions :fluents) (:predicates (magic) (done)) \
        (:durative-action jump :parameters () :duration (= ?duration -1) :condition (at start (magic)) \
        :effect (at end (done))))";
    std::fs::write(directory.path().join("d.pddl"), domain).expect("written");
    for (init, status) in [("", 0), ("(magic)", 1)] {
        let problem = format!("(define (problem p) (:domain d) (:init {init}) (:goal (done)))");
        std::fs::write(directory.path().join("p.pddl"), problem).expect("written");
        let outcome = metaplan_in(directory.path(), &["lint", "d.pddl", "p.pddl"], "");
        assert_eq!((outcome.status, outcome.stdout.contains("M232")), (status, status == 1), "{outcome:#?}");
    }
}

#[test]
fn mistakes_in_the_section_probabilistic_are_errors() {
    let section = "[probabilistic]\nlocation = \"nowhere\"\nbattery_unit = 0\nloss_component = \"c_lidr\"\n\
                   loss_rate = -0.1\n\n[planning]\n";
    let words =
        ["`location` is `nowhere`", "`battery_unit` is 0", "did you mean `c_lidar`?", "`loss_rate` is -0.1"];
    let outcome = check(&[("mission.toml", "[planning]\n", section)], 3, &words);
    assert!(outcome.stdout.contains("4 errors, 0 warnings"), "{outcome:#?}");
}

#[test]
fn unused_and_unknown_names_are_reported() {
    check(
        &[("robot.ttl", ":a_pick a t:Action", ":a_pickup a t:Action")],
        1,
        &["M205", "if it corresponds to `pick`"],
    );
    check(
        &[("robot.ttl", "t:requiresC :c_lidar ;", "t:requiresC :c_lidra ;")],
        1,
        &["M207", "did you mean `c_lidar`?"],
    );
    check(
        &[("robot.ttl", ":c_arm a t:Component .", ":c_arm a t:Component .\n:c_horn a t:Component .")],
        1,
        &["M208", "c_horn"],
    );
    check(&[("robot.ttl", ":grasp_time", ":grasping_time")], 1, &["M206", "`grasp_time`"]);
    check(
        &[("mission.toml", "[report]", "[bindings]\ngrasp_time = \"chosen:grasp_tme\"\n\n[report]")],
        1,
        &["M227", "`grasp_time` is bound to `chosen:grasp_tme`", "did you mean `grasp_time`?"],
    );
    check(
        &[("mission.toml", "[report]", "[bindings]\nbattery = \"chosen:grasp_time\"\n\n[report]")],
        3,
        &["M233", "`battery` is bound to `chosen:grasp_time`, but the problem gives it a value"],
    );
}

/// A message about a name or object of the knowledge base explains where it comes from, and does not point to a
/// declaration that is in no file.
#[test]
fn contributions_of_the_knowledge_base_are_explained() {
    check(
        &[("problem.pddl", ":metric minimize (total-time)", ":metric minimize (grasp_time)")],
        3,
        &["P122", "`grasp_time` is a sum over the designs", "problem.pddl:32:22", "in effects"],
    );
    let outcome = check(
        &[("problem.pddl", "box vase - item", "box vase f_grasp - item")],
        3,
        &["P127", "the object `f_grasp` is a constant of another type", "problem.pddl:10:"],
    );
    assert!(!outcome.stdout.contains("domain.pddl:1:1"), "{outcome:#?}");
}

#[test]
fn bindings_fit_their_symbols() {
    let bound = |binding: &str, words: &[&str]| {
        let section = format!("[bindings]\n{binding}\n\n[report]");
        check(
            &[("mission.toml", "[report]", &section)],
            3,
            &[&["M235", "mission.toml:"][..], words].concat(),
        );
    };
    bound("grasp_time = \"estimation:grasp_time\"", &["a numeric function with 1 parameter, a design"]);
    bound("battery = \"class:Component\"", &["`battery` is bound to `class:Component`", "for a type"]);
    bound("robot_at = \"solves\"", &["it is a predicate with 1 parameter;"]);
    bound("move = \"available\"", &["it is an action"]);
    let explicit = crate::common::copy_of_mission("ugv");
    for (binding, status) in [
        ("fd_available = \"solves\"", 3),
        ("battery_usage = \"chosen:safety\"", 3),
        ("fd_available = \"available\"", 0),
        // The class can be given by its name or IRI.
        ("functiondesign = \"class:FunctionDesign\"", 0),
        ("functiondesign = \"class:http://metacontrol.org/tomasys#FunctionDesign\"", 0),
    ] {
        let manifest = std::fs::read_to_string(explicit.path().join("missions/ugv.toml")).expect("text");
        let manifest = format!("{manifest}\n[bindings]\n{binding}\n");
        std::fs::write(explicit.path().join("missions/bound.toml"), manifest).expect("written");
        let outcome = metaplan_in(explicit.path(), &["lint", "missions/bound.toml"], "");
        assert_eq!(outcome.status, status, "{binding}: {outcome:#?}");
        assert_eq!(outcome.stdout.contains("M235"), status == 3, "{binding}: {outcome:#?}");
    }
}

#[test]
fn functions_of_positions_exist() {
    let positions = |names: &str| {
        let written = format!("positions = {names}");
        check(
            &[
                ("mission.toml", "positions = \"places.csv\"", &written),
                ("domain.pddl", "(:functions", "(:functions (east ?place - place) (north ?place - place)"),
            ],
            3,
            &["M141"],
        )
    };
    let outcome = positions("[\"esat\", \"North\"]");
    for word in
        ["no function `esat` with one parameter", "did you mean `east`?", "mission.toml:16:14", "1 error,"]
    {
        assert!(outcome.stdout.contains(word), "no `{word}`: {}", outcome.stdout);
    }
    // `battery` has no parameter.
    let outcome = positions("[\"up\", \"battery\"]");
    assert!(outcome.stdout.contains("`up`") && outcome.stdout.contains("2 errors,"), "{}", outcome.stdout);
}

/// By default, only a function of designs gets the values of the attribute that has its name.
#[test]
fn functions_of_places_may_have_names_of_attributes() {
    for functions in ["(needed_light ?place - place)", "(fd_needed_light ?place - (either place item))"] {
        let functions = format!("(:functions {functions}");
        check(&[("domain.pddl", "(:functions", &functions)], 0, &["no problems found"]);
    }
}

/// Objects without a type are accepted with a warning, so the function has values for the designs.
#[test]
fn functions_of_designs_have_values_for_objects_without_a_type() {
    let directory = tempfile::tempdir().expect("a directory");
    let write = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).expect("a file");
    let design = |name: &str, speed: u32| {
        format!(
            ":{name} a t:FunctionDesign ; t:solvesF :f ;
               t:hasQAestimation [ a t:QAvalue ; t:isQAtype :speed ; t:hasValue {speed} ] .\n"
        )
    };
    let prefixes = "@prefix : <http://e.org/k#> .\n@prefix owl: <http://www.w3.org/2002/07/owl#> .\n\
                    @prefix t: <http://metacontrol.org/tomasys#> .\n";
    let head = "<http://e.org/k> a owl:Ontology ; owl:imports <http://metacontrol.org/tomasys> .\n\
                :speed a t:QualityAttributeType .\n:f a t:Function .\n";
    write("kb.ttl", &[prefixes, head, &design("fd_a", 3), &design("fd_b", 2)].concat());
    write(
        "domain.pddl",
        "(define (domain d) (:requirements :typing :numeric-fluents) (:types design)
           (:predicates (done) (fd_solve_f ?d ?f) (fd_available ?d))
           (:functions (speed ?d - design) (total-cost))
           (:action go :parameters (?d ?f) :precondition (and (fd_solve_f ?d ?f) (fd_available ?d))
             :effect (and (done) (increase (total-cost) (speed ?d)))))",
    );
    write(
        "problem.pddl",
        "(define (problem p) (:domain d) (:objects fd_a fd_b f) (:init (= (total-cost) 0)) (:goal (done))
           (:metric minimize (total-cost)))",
    );
    let outcome =
        metaplan_in(directory.path(), &["plan", "domain.pddl", "problem.pddl", "--kb", "kb.ttl"], "");
    assert!(outcome.status == 0 && outcome.stdout.contains("cost 2: optimal"), "{outcome:#?}");
}

#[test]
fn missing_and_negative_numbers_are_warnings() {
    let misspelt = (
        "robot.ttl",
        ":fd_lidar a t:FunctionDesign ; t:solvesF :f_navigate ;\n    t:requiresC :c_lidar ;\n    t:hasQAestimation\n        \
         [ a t:QAvalue ; t:isQAtype :time_per_metre ; t:hasValue 1.0 ] ,\n        [ a t:QAvalue ; t:isQAtype :energy_per_metre",
        ":fd_lidar a t:FunctionDesign ; t:solvesF :f_navigate ;\n    t:requiresC :c_lidar ;\n    t:hasQAestimation\n        \
         [ a t:QAvalue ; t:isQAtype :time_per_metre ; t:hasValue 1.0 ] ,\n        [ a t:QAvalue ; t:isQAtype :energy_per_meter",
    );
    check(
        &[misspelt],
        1,
        &[
            "M229",
            "energy_per_meter> is only mentioned",
            "M230",
            "`fd_lidar` has no estimation of `energy_per_metre`, which `move` needs",
            "did you mean `energy_per_meter`?",
            "robot.ttl:",
            "0 errors, 2 warnings",
        ],
    );
    let distance = "(= (distance dock packing) 4)";
    check(
        &[("problem.pddl", distance, "")],
        1,
        &["M231", "`(distance dock packing)` has no value", "`move`", "problem.pddl:", "0 errors, 1 warning"],
    );
    check(
        &[("problem.pddl", "(= (battery) 12)", "")],
        1,
        &["M231", "`(battery)` has no value", "`move`, `pick`", "0 errors, 1 warning"],
    );
    check(
        &[("robot.ttl", ":grasp_time ; t:hasValue 10.0", ":grasp_time ; t:hasValue -10.0")],
        1,
        &[
            "M232",
            "the duration of `pick` would be -10",
            "fd_soft_fingers",
            "robot.ttl:",
            "0 errors, 1 warning",
        ],
    );
    check(
        &[("domain.pddl", "(= ?duration 3)", "(= ?duration (- 3 5))")],
        1,
        &["M232", "the duration of `put` would be -2", "domain.pddl:"],
    );
}

#[test]
fn missing_numbers_are_listed_if_there_is_no_plan() {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    assert_eq!(metaplan_in(here, &["init", "m", "--from", "warehouse"], "").status, 0);
    edit(&here.join("m"), "problem.pddl", "(= (battery) 12)", "");
    edit(
        &here.join("m"),
        "robot.ttl",
        ":time_per_metre ; t:hasValue 0.8",
        ":time_per_meter ; t:hasValue 0.8",
    );
    let outcome = metaplan_in(here, &["plan", "m/mission.toml"], "");
    assert_eq!(outcome.status, 10, "{outcome:#?}");
    for words in [
        "designs are not the cause",
        "    (battery), for move, pick, in m/problem.pddl",
        "    the estimation of time_per_metre of fd_camera, for move, in m/robot.ttl",
    ] {
        assert!(outcome.stdout.contains(words), "no `{words}`: {outcome:#?}");
    }
    let answer = metaplan_in(here, &["plan", "m/mission.toml", "--format", "json"], "").json();
    let missing = answer["missing_values"].as_array().expect("a list");
    let battery = missing.iter().find(|value| value["function"] == "(battery)").expect("the battery");
    assert_eq!(
        (&battery["needed_by"], &battery["file"]),
        (&serde_json::json!(["move", "pick"]), &"m/problem.pddl".into())
    );
    let outcome = metaplan_in(here, &["explain", "m/mission.toml", "fd_camera"], "");
    let words = "it has no estimation of time_per_metre, which move needs";
    assert!(outcome.stdout.contains(words), "{outcome:#?}");
}

/// A problem may omit values on purpose: distances between places without a way, and from a place to itself.
#[test]
fn unneeded_missing_numbers_are_not_reported() {
    let domain = "(define (domain d) (:requirements :typing :numeric-fluents) (:types place)
        (:predicates (at ?p - place) (road ?a ?b - place)) (:functions (far ?a ?b - place) (spent) (toll ?a ?b - place) (started))
        (:action go :parameters (?a ?b - place) :precondition (and (at ?a) (road ?a ?b))
          :effect (and (not (at ?a)) (at ?b) (increase (spent) (far ?a ?b))))
        (:action fly :parameters (?a ?b - place) :precondition (and (at ?a) (> (toll ?a ?b) 0))
          :effect (and (not (at ?a)) (at ?b) (assign (started) 3)))
        (:action end :parameters (?a - place) :precondition (and (at ?a) (> (started) 2)) :effect (not (at ?a))))";
    let problem = "(define (problem p) (:domain d) (:objects x y z - place)
        (:init (at x) (road x y) (road y z) (road z y) (= (far z y) 2) (= (far x y) 3) (= (far y z) 2) (= (spent) 0)
          (= (toll x y) 1) (= (toll y x) 1) (= (toll x z) 1) (= (toll z x) 1) (= (toll y z) 1) (= (toll z y) 1))
        (:goal (at z)) (:metric minimize (spent)))";
    let directory = tempfile::tempdir().expect("a directory");
    let lint = |problem: &str| {
        std::fs::write(directory.path().join("d.pddl"), domain).expect("written");
        std::fs::write(directory.path().join("p.pddl"), problem).expect("written");
        metaplan_in(directory.path(), &["lint", "d.pddl", "p.pddl"], "")
    };
    let outcome = lint(problem);
    assert_eq!((outcome.status, outcome.stdout.as_str()), (0, "no problems found\n"), "{outcome:#?}");
    for (missing, action) in [("(= (far y z) 2)", "go"), ("(= (toll z y) 1)", "fly")] {
        let outcome = lint(&problem.replace(missing, ""));
        assert_eq!(outcome.status, 1, "{missing}: {outcome:#?}");
        assert!(
            outcome.stdout.contains("M231") && outcome.stdout.contains(&format!("`{action}`")),
            "{outcome:#?}"
        );
    }
}

#[test]
fn errors_of_all_files_are_reported_together() {
    let broken = ("robot.ttl", ":f_grasp a t:Function .", ":f_grasp a t:Function");
    let outcome = check(
        &[broken, ("problem.pddl", "(:goal (and", "(:gaol (and")],
        3,
        &["O102", "robot.ttl:", "P109", "problem.pddl:"],
    );
    assert!(outcome.stdout.contains("error"), "{}", outcome.stdout);
    check(
        &[
            ("problem.pddl", "(hand_is_free)", "(hand_is_fre)"),
            ("problem.pddl", "(robot_at near_rack)", "(robot_at near_rak)"),
        ],
        3,
        &["P121", "P123", "2 errors, 0 warnings"],
    );
    check(
        &[
            ("mission.toml", "fail = [\"c_suction_cup\"]", "fail = [\"c_suction\"]"),
            ("mission.toml", "air_dust = \"0.8\"", "air_dust = \"much\""),
            ("mission.toml", "step = 1 ", "step = 0 "),
            ("places.csv", "far_rack,16,0", "far_rack,sixteen,0"),
        ],
        3,
        &[
            "scenario `suction_fails`: ",
            "scenario `dusty`: ",
            "scenario `lidar_under_way`: `step` is 0, but should be positive",
            "M141",
            "4 errors, 0 warnings",
        ],
    );
}

#[test]
fn unsupported_features_are_reported_without_planning() {
    check(
        &[
            ("domain.pddl", "(= ?duration (grasp_time))", "(= ?duration (battery))"),
            ("domain.pddl", "(= ?duration 3)", "(= ?duration (+ 3 (battery)))"),
        ],
        3,
        &["E301", "depends on the state", "2 errors, 0 warnings"],
    );
}

#[test]
fn inconsistent_knowledge_is_an_error() {
    let outcome = check(
        &[("robot.ttl", ":c_lamp a t:Component .", ":c_lamp a t:Component , t:Function .")],
        20,
        &["M110", "inconsistent"],
    );
    assert!(outcome.stdout.ends_with("0 warnings\n"), "{}", outcome.stdout);
}

#[test]
fn unreadable_files_are_errors_and_unknown_scenarios_are_usage_errors() {
    let outcome = metaplan_in(Path::new("/"), &["lint", "no/such.toml"], "");
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    assert!(outcome.stdout.contains("M101"), "{outcome:#?}");
    assert_eq!(metaplan(&["lint", "missions/ugv.toml", "--scenario", "none"]).status, 2);
}

#[test]
fn a_similar_manifest_is_suggested() {
    for (written, expected) in [
        ("missions/ugv", "(os error 2); did you mean `ugv.toml`?"),
        ("missions/ugv.tml", "(os error 2); did you mean `ugv.toml`?"),
        ("missions/ugw.toml", "(os error 2); did you mean `ugv.toml`?"),
        ("missions/uvu_plain.toml", "(os error 2); did you mean `uuv_plain.toml`?"),
        ("missions/nothing_like_it.toml", "(os error 2)"),
        ("missions", "is a directory"),
    ] {
        let outcome = metaplan(&["lint", written, "--format", "json"]);
        assert_eq!(outcome.status, 3, "{outcome:#?}");
        let answer = outcome.json();
        let message = &answer["messages"][0];
        assert_eq!(message["code"], "M101", "{outcome:#?}");
        let text = message["message"].as_str().expect("a message");
        assert!(text.ends_with(expected), "{written}: {text}");
    }
}
