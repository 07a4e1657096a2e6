//! Tests of `metaplan configure` and `metaplan run --configure`, and of rejected arguments.

use std::fmt::Write as _;

use test_resources::data;

use crate::common::{metaplan, metaplan_in, root};

#[test]
fn suave_is_configured() {
    let Some(real) = data("real/owl") else { return };
    let (directory, file) = (real.display().to_string(), real.join("suave/suave.owl").display().to_string());
    let choose = |options: &[&str]| {
        let arguments =
            [&["configure", &file, "--directory", &directory, "--format", "json"], options].concat();
        let outcome = metaplan(&arguments);
        let answer = outcome.json();
        let choices = answer["choices"].as_array().expect("choices");
        let designs = choices.iter().map(|choice| choice["design"].as_str().unwrap_or("none").to_owned());
        (outcome.status, designs.collect::<Vec<_>>())
    };
    assert_eq!(choose(&[]), (0, vec_of(["fd_follow_pipeline", "fd_spiral_high", "fd_all_thrusters"])));
    assert_eq!(
        choose(&["--set", "water_visibility=1.5", "--fail", "c_thruster_1"]),
        (0, vec_of(["fd_follow_pipeline", "fd_spiral_low", "fd_recover_thrusters"]))
    );
    let path = ["--objective", "f_generate_search_path"];
    assert_eq!(choose(&[&path[..], &["--set", "water_visibility=0.5"]].concat()), (10, vec_of(["none"])));
    assert_eq!(choose(&path), (0, vec_of(["fd_spiral_high"])));
}

fn vec_of<const N: usize>(names: [&str; N]) -> Vec<String> {
    names.map(ToOwned::to_owned).to_vec()
}

#[test]
fn all_unknown_names_are_reported() {
    let base = ["configure", "ontology/kb/ugv.ttl", "--rules", "coadaptation"];
    let wrong_arguments = [
        &base[..],
        &["--objective", "f_localisation", "--exclusive", "c_kinekt", "--budget", "energi=3"],
        &["--require", "f_move.safety=0.5"],
    ]
    .concat();
    let outcome = metaplan(&wrong_arguments);
    assert_eq!(outcome.status, 2);
    for part in ["c_kinect", "`energi`", "f_localization", "`--require f_move"] {
        assert!(outcome.stderr.contains(part), "{part}: {}", outcome.stderr);
    }
    for (options, part) in [
        (&["--budget", "safety"][..], "NAME=VALUE"),
        (&["--budget", "safety=many"], "decimal number"),
        (&["--budget", "safety=-1"], "the budget of `safety` is -1, but should not be negative"),
        (&["--budget", "safety=-0.001", "--budget", "safety=3"], "M142"),
        (&["--require", "safety=1"], "FUNCTION.ATTRIBUTE=BOUND, such as `f_move.safety=0.5`"),
        (&["--require", "f_localization.safety"], "FUNCTION.ATTRIBUTE=BOUND"),
        (&["--require", "f_localization.safety=high"], "`high` is not a decimal number"),
        (&["--require", "f_localisation.safety=0.5"], "M140"),
        (&["--require", "f_localisation.safety=0.5"], "did you mean `f_localization`?"),
        (&["--most", "safety", "--least", "safety"], "cannot be used with"),
        (&["--set", "safety=x"], "not a decimal number"),
        (&["--fail", "c_none"], "c_none"),
    ] {
        let outcome = metaplan(&[&base[..], options].concat());
        assert_eq!(outcome.status, 2, "{options:?}: {}", outcome.stderr);
        assert!(outcome.stderr.contains(part), "{options:?}: {}", outcome.stderr);
    }
    for arguments in [
        &["run", "missions/ugv.toml", "--budget", "safety=1"][..],
        &["run", "--configure", "ontology/kb/ugv.ttl", "--scenario", "x"],
        &["run", "--configure", "ontology/kb/ugv.ttl", "--name", "a=b"],
        &["run", "--configure", "ontology/kb/ugv.ttl", "--snapshot-every", "9"],
    ] {
        assert_eq!(metaplan(arguments).status, 2, "{arguments:?}");
    }
}

#[test]
fn a_requirement_needs_an_objective_of_the_command() {
    let directory = tempfile::tempdir().expect("a directory");
    let objective = directory.path().join("objective.ttl");
    let text =
        "@prefix t: <http://metacontrol.org/tomasys#> . @prefix u: <http://metacontrol.org/metaplan/ugv#> .
        u:o_localization a t:Objective ; t:typeF u:f_localization .";
    std::fs::write(&objective, text).expect("a file");
    let objective = objective.display().to_string();
    let base = ["configure", "ontology/kb/ugv.ttl", &objective, "--rules", "coadaptation"];
    let require = ["--require", "f_localization.safety=0.5"];
    assert_eq!(metaplan(&base).status, 0);
    let outcome = metaplan(&[&base[..], &require].concat());
    assert_eq!(outcome.status, 2, "{}", outcome.stderr);
    for part in [
        "M107",
        "`--require f_localization.safety` needs `--objective f_localization`",
        "it states",
        "help: add",
    ] {
        assert!(outcome.stderr.contains(part), "{part}: {}", outcome.stderr);
    }
    // An objective of the command for another function does not suffice.
    let outcome = metaplan(&[&base[..], &["--objective", "f_motion"], &require].concat());
    assert_eq!(outcome.status, 2, "{}", outcome.stderr);
    for part in ["needs `--objective f_localization`", "the functions of `--objective` are: f_motion"] {
        assert!(outcome.stderr.contains(part), "{part}: {}", outcome.stderr);
    }
    let outcome = metaplan(&[&base[..], &["--objective", "f_localization"], &require].concat());
    assert_eq!(outcome.status, 0, "{}", outcome.stderr);
}

/// Runs `configure` on a small knowledge base with the statements and compares the status. Then compares the objectives
/// with their designs in the JSON answer, and searches the text and the messages for `parts`.
fn check(statements: &str, options: &[&str], status: i32, designs: &[(&str, Option<&str>)], parts: &[&str]) {
    let directory = tempfile::tempdir().expect("a directory");
    let knowledge = format!(
        "@prefix : <http://x.org/k#> . @prefix owl: <http://www.w3.org/2002/07/owl#> .
        @prefix t: <http://metacontrol.org/tomasys#> .
        <http://x.org/k> a owl:Ontology ; owl:imports <http://metacontrol.org/tomasys> . {statements}"
    );
    std::fs::write(directory.path().join("kb.ttl"), knowledge).expect("written");
    let arguments = [&["configure", "kb.ttl", "--rules", "coadaptation"], options].concat();
    let outcome = metaplan_in(directory.path(), &arguments, "");
    assert_eq!(outcome.status, status, "{options:?}: {outcome:#?}");
    for part in parts {
        let is_in = outcome.stdout.contains(part) || outcome.stderr.contains(part);
        assert!(is_in, "{part}: {options:?}: {outcome:#?}");
    }
    let answer = metaplan_in(directory.path(), &[&arguments[..], &["--format", "json"]].concat(), "").json();
    let choices = answer["choices"].as_array().expect("choices").iter();
    let choices: Vec<_> = choices
        .map(|choice| (choice["objective"].as_str().expect("a name"), choice["design"].as_str()))
        .collect();
    assert_eq!(choices, designs, "{options:?}: {answer:#}");
    assert_eq!(answer["served"], status == 0, "{options:?}: {answer:#}");
}

#[test]
fn a_function_that_no_design_solves_is_not_served() {
    let knowledge = ":f0 a t:Function . :f1 a t:Function . :fd_0 a t:FunctionDesign ; t:solvesF :f0 .";
    let unserved = [("o_f0", Some("fd_0")), ("o_f1", None)];
    check(knowledge, &[], 10, &unserved, &["none can be used"]);
    check(knowledge, &["--objective", "f0", "--objective", "f1"], 10, &unserved, &["none can be used"]);
    check(knowledge, &["--objective", "f0"], 0, &unserved[..1], &[]);
}

/// The designs in use for two objectives both use `c` and need 4 of `e` in total.
#[test]
fn objectives_that_need_no_design_keep_theirs() {
    let estimations = |e: &str, u: &str| {
        format!(
            "t:hasQAestimation [ a t:QAvalue ; t:isQAtype :e ; t:hasValue {e} ] ,
            [ a t:QAvalue ; t:isQAtype :u ; t:hasValue {u} ] ."
        )
    };
    let (large, small) = (estimations("2.0", "2.0"), estimations("0.5", "1.0"));
    let designs = format!(
        ":e a t:QualityAttributeType . :u a t:QualityAttributeType . :c a t:Component .
        :f0 a t:Function . :f1 a t:Function .
        :fd_0 a t:FunctionDesign ; t:solvesF :f0 ; t:requiresC :c ; {large}
        :fd_0b a t:FunctionDesign ; t:solvesF :f0 ; {small}
        :fd_1 a t:FunctionDesign ; t:solvesF :f1 ; t:requiresC :c ; {large}
        :o0 a t:Objective ; t:typeF :f0 . :g0 a t:FunctionGrounding ; t:typeFD :fd_0 ; t:solvesO :o0 .
        :o1 a t:Objective ; t:typeF :f1 .\n"
    );
    let joint = ["--most", "u", "--exclusive", "c"];
    let grounded = format!("{designs}:g1 a t:FunctionGrounding ; t:typeFD :fd_1 ; t:solvesO :o1 .");
    let warned = ["M146", "fd_0 and fd_1 use c, which only one", "e is 4 in total; the budget is 3"];
    check(&grounded, &[&joint[..], &["--budget", "e=3"]].concat(), 0, &[], &warned);
    let scope = ["proved: no choice for these objectives is better", "fd_0 uses c, which only one design"];
    check(&designs, &joint, 10, &[("o1", None)], &scope);
    let improved = format!("{designs}:o0 t:o_always_improve true .");
    let chosen = [("o0", Some("fd_0b")), ("o1", Some("fd_1"))];
    check(&improved, &joint, 0, &chosen, &["proved: no choice is better"]);
}

#[test]
fn a_design_of_two_objectives_uses_its_components_and_budgets_once() {
    let shared = ":e a t:QualityAttributeType . :c a t:Component . :f0 a t:Function .
        :fd a t:FunctionDesign ; t:solvesF :f0 ; t:requiresC :c ;
        t:hasQAestimation [ a t:QAvalue ; t:isQAtype :e ; t:hasValue 3 ] .
        :o0 a t:Objective ; t:typeF :f0 . :o1 a t:Objective ; t:typeF :f0 .\n";
    let (both, none) = ([("o0", Some("fd")), ("o1", Some("fd"))], [("o0", None), ("o1", None)]);
    check(shared, &["--exclusive", "c", "--budget", "e=5"], 0, &both, &[]);
    check(shared, &["--exclusive", "c", "--budget", "e=2"], 10, &none, &[]);
    // The first objective keeps the design.
    let kept = format!("{shared}:g0 a t:FunctionGrounding ; t:typeFD :fd ; t:solvesO :o0 .");
    check(&kept, &["--exclusive", "c", "--budget", "e=5"], 0, &both[1..], &[]);
}

#[test]
fn designs_without_an_estimation_are_reported() {
    let designs = ":u a t:QualityAttributeType . :e a t:QualityAttributeType . :f0 a t:Function .
        :fd_known a t:FunctionDesign ; t:solvesF :f0 ; t:hasQAestimation [ a t:QAvalue ; t:isQAtype :u ; t:hasValue 1.0 ] ,
        [ a t:QAvalue ; t:isQAtype :e ; t:hasValue 1.0 ] .
        :fd_unknown a t:FunctionDesign ; t:solvesF :f0 .";
    let warning = |attribute: &str| {
        format!("warning[M147]: the design `fd_unknown` has no estimation of `{attribute}`, so 0 is assumed")
    };
    let (u, e) = (warning("u"), warning("e"));
    let (known, unknown) = ([("o_f0", Some("fd_known"))], [("o_f0", Some("fd_unknown"))]);
    check(designs, &["--least", "u"], 0, &unknown, &[&u]);
    check(designs, &["--most", "u"], 0, &known, &[&u]);
    check(designs, &["--most", "u", "--budget", "e=0.5"], 0, &unknown, &[&u, &e]);
}

#[test]
fn the_loop_reconfigures() {
    let arguments =
        ["run", "--configure", "ontology/kb/ugv.ttl", "--rules", "coadaptation", "--most", "safety"];
    let events = "{\"event\":\"component_status\",\"component\":\"c_kinect\",\"status\":\"FALSE\"}\nx\n";
    let outcome = metaplan_in(&root(), &arguments, events);
    assert_eq!(outcome.status, 0, "{}", outcome.stderr);
    let lines =
        outcome.stdout.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).expect("JSON"));
    let answers: Vec<(String, Option<String>)> = lines
        .map(|line| {
            (line["answer"].as_str().expect("a kind").to_owned(), line["to"].as_str().map(ToOwned::to_owned))
        })
        .collect();
    let kinds: Vec<&str> = answers.iter().map(|(kind, _)| kind.as_str()).collect();
    let expected = [
        "ready",
        "reconfigure",
        "handled",
        "inferred",
        "reconfigure",
        "inferred",
        "handled",
        "error",
        "handled",
    ];
    assert_eq!(kinds, expected);
    assert_eq!(answers[1].1.as_deref(), Some("fd_amcl_kinect"));
    assert_eq!(answers[4].1.as_deref(), Some("fd_aruco"));
}

/// If two consecutive changes fail, the robot still has the design before both of them.
#[test]
fn failed_changes_restore_the_design_that_the_robot_has() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("kb.ttl");
    let mut knowledge = "@prefix : <http://x.org/k#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix t: <http://metacontrol.org/tomasys#> .
<http://x.org/k> a owl:Ontology ; owl:imports <http://metacontrol.org/tomasys> .
:f_move a owl:NamedIndividual , t:Function .\n"
        .to_owned();
    for number in 1..=3 {
        let _ = write!(
            knowledge,
            ":c_{number} a owl:NamedIndividual , t:Component .\n:fd_{number} a owl:NamedIndividual , \
             t:FunctionDesign ; t:solvesF :f_move ; t:requiresC :c_{number} .\n"
        );
    }
    std::fs::write(&file, knowledge).expect("written");
    let events = [
        r#"{"event":"acknowledged","effect":1,"time":0}"#,
        r#"{"event":"component_status","component":"c_1","status":"FALSE","time":1}"#,
        r#"{"event":"component_status","component":"c_2","status":"FALSE","time":2}"#,
        r#"{"event":"reconfiguration_failed","effect":2,"time":3}"#,
        r#"{"event":"reconfiguration_failed","effect":3,"time":4}"#,
        r#"{"event":"component_status","component":"c_2","status":"RECOVERED","time":5}"#,
        r#"{"event":"tick","time":15}"#,
        r#"{"event":"design_status","design":"fd_2","realisable":true,"time":16}"#,
        r#"{"event":"tick","time":17}"#,
    ];
    let kb = file.to_str().expect("UTF-8");
    let arguments = ["run", kb, "--configure", "--rules", "coadaptation", "--objective", "f_move"];
    let outcome = metaplan_in(&root(), &arguments, &(events.join("\n") + "\n"));
    let answers: Vec<serde_json::Value> =
        outcome.stdout.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let changes = answers.iter().filter(|answer| answer["answer"] == "reconfigure");
    let changes: Vec<_> = changes.map(|change| (change["from"].as_str(), change["to"].as_str())).collect();
    assert_eq!(changes.last(), Some(&(Some("fd_1"), Some("fd_2"))), "{outcome:#?}");
}
