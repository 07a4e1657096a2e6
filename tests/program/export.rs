//! Tests of `metaplan export`: the exported input for other planners has the same optimum as the mission.

use crate::common::{headlines, metaplan, metaplan_in, root};

const MISSIONS: [(&str, &[&str], i64); 4] = [
    ("missions/ugv.toml", &[], 408),
    ("missions/ugv.toml", &["--scenario", "kinect_failure"], 412),
    ("missions/uuv.toml", &[], 28),
    ("missions/uuv.toml", &["--set", "battery=15"], 60),
];

#[test]
fn exported_files_have_the_optimum_of_the_mission() {
    for (mission, situation, cost) in MISSIONS {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let target = directory.path().join("new/folder");
        let target = target.to_str().expect("UTF-8");
        let arguments = [&["export", mission, "--to", "pddl", "-o", target], situation].concat();
        let outcome = metaplan(&arguments);
        assert_eq!((outcome.status, outcome.stdout.as_str()), (0, ""), "{outcome:#?}");
        let plan =
            metaplan_in(target.as_ref(), &["plan", "domain.pddl", "problem.pddl", "--format", "json"], "");
        assert_eq!((plan.status, plan.json()["cost"].as_i64()), (0, Some(cost)), "{plan:#?}");
        assert_eq!(plan.stderr, "", "what is exported is clean");
        let verdict = metaplan_in(&root(), &[&["validate", mission, "-"], situation].concat(), &plan.stdout);
        assert_eq!(verdict.status, 0, "{verdict:#?}");
    }
}

#[test]
fn availability_and_values_are_filled_in() {
    let outcome = metaplan(&["export", "missions/ugv.toml", "--to", "pddl", "--fail", "c_kinect"]);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    for fact in ["(fd_available fd_amcl_lidar)", "(= (battery_usage fd_amcl_lidar) 4)", "(robot_at wp1)"] {
        assert!(outcome.stdout.contains(fact), "{fact} in {}", outcome.stdout);
    }
    assert!(!outcome.stdout.contains("(fd_available fd_amcl_kinect)"), "{}", outcome.stdout);
}

#[test]
fn variants_of_the_probabilistic_model_are_no_variants_of_pddl() {
    for setting in ["corrected", "published"] {
        let outcome = metaplan(&["export", "missions/ugv.toml", "--to", "pddl", "--setting", setting]);
        assert_eq!((outcome.status, outcome.stdout.as_str()), (2, ""), "{outcome:#?}");
        assert!(outcome.stderr.contains("error[M107]: `--setting` selects a variant"), "{outcome:#?}");
    }
}

/// The exported files have other contents than the files of the mission, so they must not replace them.
#[test]
fn files_of_the_mission_are_not_overwritten() {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    assert_eq!(metaplan_in(here, &["init", "m"], "").status, 0);
    let files = ["m/domain.pddl", "m/problem.pddl"];
    let texts = || files.map(|file| std::fs::read_to_string(here.join(file)).expect("text"));
    let before = texts();
    for inputs in [&["m/mission.toml"][..], &["m/domain.pddl", "./m/problem.pddl"]] {
        let arguments = [&["export", "--to", "pddl", "-o", "m"], inputs].concat();
        let outcome = metaplan_in(here, &arguments, "");
        assert_eq!(outcome.status, 3, "{outcome:#?}");
        for file in files {
            assert!(headlines(&outcome.stderr).contains(&format!("{file}: error[M133]: ")), "{outcome:#?}");
        }
    }
    assert_eq!(texts(), before);
    for fail in [&[][..], &["--fail", "c_first"]] {
        let arguments = [&["export", "m/mission.toml", "--to", "pddl", "-o", "out"], fail].concat();
        assert_eq!(metaplan_in(here, &arguments, "").status, 0, "other files are replaced");
    }
}

const DOMAIN: &str = "(define (domain d) (:types dock - place) (:constants home - dock)
 (:predicates (at ?x -place) (seen ?x - ghost))
 (:derived (seen ?x) (at ?x))
 (:action go :parameters (?x ?y - place) :precondition (and (at ?x) (not (= ?x ?y)) (exists (?z) (seen ?z)))
  :effect (and (not (at ?x)) (at ?y) (increase (total-cost) 1.5) (when (at home) (at a)))))";
const PROBLEM: &str =
    "(define (problem p) (:domain other) (:requirements :typing) (:objects home - dock a - place)
 (:init (at a) (at a) (not (at home)) (= (total-cost) 0)) (:goal (at home)) (:metric minimize (total-cost)))";

#[test]
fn exported_files_are_normalised() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    std::fs::write(directory.path().join("d.pddl"), DOMAIN).expect("a file");
    std::fs::write(directory.path().join("p.pddl"), PROBLEM).expect("a file");
    // The domain mentions `a`, which is an object of the problem. The export declares `a` as a constant.
    let arguments = ["export", "d.pddl", "p.pddl", "--to", "pddl", "--quiet", "--format", "json"];
    let outcome = metaplan_in(directory.path(), &arguments, "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let answer = outcome.json();
    assert_eq!(answer["format"], "metaplan-export/1");
    let text = |key: &str| {
        let words: Vec<_> = answer[key].as_str().unwrap_or_default().split_whitespace().collect();
        words.join(" ").replace(" )", ")")
    };
    assert_eq!(
        text("domain"),
        "(define (domain d) (:requirements :action-costs :conditional-effects :derived-predicates :equality \
         :existential-preconditions :negative-preconditions :strips :typing) (:types dock - place place) \
         (:constants home - dock a - place) (:predicates (at ?x - place) (seen ?x)) (:functions (total-cost)) \
         (:derived (seen ?x) (at ?x)) (:action go :parameters (?x ?y - place) \
         :precondition (and (at ?x) (not (= ?x ?y)) (exists (?z) (seen ?z))) \
         :effect (and (not (at ?x)) (at ?y) (increase (total-cost) 1.5) (when (at home) (at a)))))"
    );
    assert_eq!(
        text("problem"),
        "(define (problem p) (:domain d) (:init (at a) (= (total-cost) 0)) \
         (:goal (at home)) (:metric minimize (total-cost)))"
    );
}

/// Creates the warehouse mission with a replacement in its knowledge base.
fn warehouse(old: &str, new: &str) -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    assert_eq!(metaplan_in(here, &["init", "m", "--from", "warehouse"], "").status, 0);
    let robot = here.join("m/robot.ttl");
    let text = std::fs::read_to_string(&robot).expect("text");
    assert!(text.contains(old), "{old}");
    std::fs::write(robot, text.replace(old, new)).expect("written");
    directory
}

/// The predicate of a quality bound is named after the bound, whose name may have characters that PDDL does not
/// allow, as that of an anonymous bound has.
#[test]
fn bounds_with_names_outside_of_pddl_are_exported() {
    let anonymous =
        "[ a t:Requirement ; t:isQAtype :needed_light ; t:hasMaximum 0.0 ; t:inContext \"dark_aisle\" ]";
    for (old, new) in [
        (":sees_in_the_dark", "<http://example.org/r#light(0)>"),
        ("t:requiresQuality :sees_in_the_dark", &format!("t:requiresQuality {anonymous}")),
    ] {
        let directory = warehouse(old, new);
        let run = |arguments: &[&str]| {
            let outcome = metaplan_in(directory.path(), arguments, "");
            assert_eq!(outcome.status, 0, "{new}: {outcome:#?}");
            outcome
        };
        let planned = run(&["plan", "m/mission.toml", "--certificate", "proof", "--format", "json"]);
        run(&["verify", "proof"]);
        run(&["export", "m/mission.toml", "--to", "pddl", "-o", "out"]);
        let exported = std::fs::read_to_string(directory.path().join("out/domain.pddl")).expect("a domain");
        assert!(exported.contains("(fd_meets_."), "{exported}");
        let again = run(&["plan", "out/domain.pddl", "out/problem.pddl", "--format", "json"]);
        assert_eq!(planned.json()["cost"], again.json()["cost"], "{new}");
    }
}

/// PDDL files may not have numbers of more than 400 digits, so the knowledge base may not have them either.
#[test]
fn values_with_too_many_digits_are_refused() {
    let old = ":grasp_time ; t:hasValue 4.0";
    for (digits, status) in [(400, 0), (401, 3)] {
        let directory = warehouse(old, &format!(":grasp_time ; t:hasValue {}", "4".repeat(digits)));
        let outcome =
            metaplan_in(directory.path(), &["export", "m/mission.toml", "--to", "pddl", "-o", "out"], "");
        assert_eq!(outcome.status, status, "{outcome:#?}");
        let words = ["P105", "`(fd_grasp_time fd_suction)` has more than 400 digits"];
        assert!(status == 0 || words.iter().all(|word| outcome.stderr.contains(word)), "{outcome:#?}");
    }
}

#[test]
fn files_of_models_have_the_requested_format() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = directory.path().join("model.json").display().to_string();
    let arguments = ["export", "missions/camara_like.toml", "--to", "prism", "--format", "json"];
    let printed = metaplan(&arguments);
    assert_eq!(printed.json()["format"], "metaplan-export/1");
    let written = metaplan(&[&arguments[..], &["-o", &file]].concat());
    assert_eq!((written.status, written.stdout.as_str()), (0, ""), "{written:#?}");
    assert_eq!(std::fs::read_to_string(&file).expect("a file"), printed.stdout);
}

#[test]
fn unwritable_targets_are_reported() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = directory.path().join("file");
    std::fs::write(&file, "").expect("a file");
    let file = file.to_str().expect("UTF-8");
    let outcome = metaplan(&["export", "missions/ugv.toml", "--to", "pddl", "-o", file]);
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    assert!(outcome.stderr.contains("M109"), "{outcome:#?}");
    assert_eq!(metaplan(&["export", "missions/ugv.toml"]).status, 2);
}

/// LPG solves the exported files and its plans are valid, and the Unified Planning framework parses the
/// files. Needs a Python with both (`python3 -m venv peers; peers/bin/pip install unified-planning up-lpg`)
/// at the path `METAPLAN_PEERS=peers/bin/python`.
#[test]
#[ignore = "needs peers"]
fn peers_read_exported_files() {
    let Ok(python) = std::env::var("METAPLAN_PEERS") else { panic!("METAPLAN_PEERS names no Python") };
    let run = |script: &str, directory: &std::path::Path| {
        let output = std::process::Command::new(&python).args(["-c", script]).current_dir(directory).output();
        let output = output.expect("Python starts");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        assert!(output.status.success(), "{}{}", text(&output.stdout), text(&output.stderr));
    };
    let lpg = "import importlib.util as u, subprocess as s, os
lpg = os.path.join(os.path.dirname(u.find_spec('up_lpg').origin), 'lpg')
s.run([lpg, '-o', 'domain.pddl', '-f', 'problem.pddl', '-n', '1', '-out', 'plan'], check=True)";
    let reader = "from unified_planning.io import PDDLReader
assert PDDLReader().parse_problem('domain.pddl', 'problem.pddl').actions";
    for (mission, situation, cost) in MISSIONS {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let target = directory.path().to_str().expect("UTF-8");
        let outcome = metaplan(&[&["export", mission, "--to", "pddl", "-o", target], situation].concat());
        assert_eq!(outcome.status, 0, "{outcome:#?}");
        // The framework does not support metrics that combine total time with a fluent.
        if mission.contains("uuv") {
            run(reader, directory.path());
        }
        run(lpg, directory.path());
        let arguments = ["validate", "domain.pddl", "problem.pddl", "plan_1.SOL", "--format", "json"];
        let verdict = metaplan_in(directory.path(), &arguments, "");
        assert_eq!(verdict.status, 0, "{verdict:#?}");
        assert!(verdict.json()["metric"].as_i64().is_some_and(|metric| metric >= cost), "{verdict:#?}");
        let concurrent = [&arguments[..], &["--concurrent", "--tolerance", "0.0001"]].concat();
        assert_eq!(metaplan_in(directory.path(), &concurrent, "").status, 0);
        assert_eq!(
            metaplan_in(directory.path(), &[&arguments[..], &["--tolerance", "-1"]].concat(), "").status,
            2
        );
    }
}
