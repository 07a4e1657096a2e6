//! Tests of `metaplan plan --certificate` and `metaplan verify`.

use std::path::Path;
use std::sync::atomic::Ordering;

use metaplan::planner::{Limits, Planner};
use metaplan::setup::Setup;
use serde_json::{Value, json};

use crate::common::{Outcome, headlines, metaplan, metaplan_in, root, verify_in};

pub fn certificate(directory: &Path, arguments: &[&str]) -> String {
    let target = directory.join("certificate").display().to_string();
    let plan_arguments: Vec<&str> = arguments.iter().copied().chain(["--certificate", &target]).collect();
    let outcome = metaplan(&plan_arguments);
    assert!(Path::new(&target).is_dir(), "{outcome:#?}");
    target
}

pub fn verify(certificate: &str) -> Outcome {
    verify_in(&root(), &[certificate])
}

#[test]
fn missions_have_certificates() {
    for arguments in [
        &["plan", "missions/ugv.toml"][..],
        &["plan", "missions/ugv.toml", "--fail", "c_kinect", "--set", "robot_at=wp2"],
        &["plan", "missions/ugv.toml", "--minimize", "total-time"],
        &["plan", "missions/uuv.toml"],
        &["plan", "missions/ugv_plain.toml"],
        &["plan", "missions/uuv_plain.toml", "--plan-format", "plansys2"],
        &["plan", "missions/uuv.toml", "--set", "battery=15"],
    ] {
        let directory = tempfile::tempdir().expect("a directory");
        let outcome = verify(&certificate(directory.path(), arguments));
        assert_eq!(outcome.status, 0, "{arguments:?}: {outcome:#?}");
        assert!(outcome.stdout.contains("verified: the plan is optimal"), "{outcome:#?}");
    }
}

#[test]
fn unsolvability_has_a_certificate() {
    let directory = tempfile::tempdir().expect("a directory");
    let domain = "(define (domain d) (:predicates (at ?p) (way ?a ?b) (key))
      (:action go :parameters (?a ?b) :precondition (and (at ?a) (way ?a ?b)) :effect (and (at ?b) (not (at ?a))))
      (:action drop :parameters () :precondition (key) :effect (not (key))))";
    let problem = |goal: &str| {
        format!(
            "(define (problem p) (:domain d) (:objects a b c) (:init (at a) (key) (way a b) (way b a)) (:goal {goal}))"
        )
    };
    std::fs::write(directory.path().join("d.pddl"), domain).expect("a file");
    // The first goal is unreachable even in the delete relaxation; the second goal is unreachable only
    // because of deletions.
    for (name, goal) in [("relaxed", "(at c)"), ("searched", "(and (at a) (at b))")] {
        std::fs::write(directory.path().join("p.pddl"), problem(goal)).expect("a file");
        let arguments = ["plan", "d.pddl", "p.pddl", "--certificate", name];
        assert_eq!(metaplan_in(directory.path(), &arguments, "").status, 10);
        let outcome = verify_in(directory.path(), &[name]);
        assert_eq!(outcome.status, 0, "{outcome:#?}");
        assert!(outcome.stdout.contains("verified: there is no plan"), "{outcome:#?}");
    }
}

/// If grounding finds the goal unreachable, the task is only partly pruned: an operator can be missing although its
/// variables or numbers remain. The actions add atoms that always hold, or change a number that nothing reads.
#[test]
fn unreachable_goals_have_certificates() {
    let directory = tempfile::tempdir().expect("a directory");
    let always = "(:predicates (done ?x) (at ?x) (cb ?x) (cd ?x) (dpa ?x ?y) (pa ?x ?y))
      (:derived (cb ?x) (exists (?y) (dpa ?x ?y)))
      (:derived (dpa ?x ?y) (pa ?x ?y))
      (:action a1 :parameters (?x) :precondition (at ?x) :effect (done ?x))
      (:action a2 :parameters (?x ?y) :precondition (exists (?q) (cb ?y)) :effect (and (pa ?y ?x) (at ?x)))";
    let unread = "(:predicates (cb ?x) (cc ?x) (cd ?x) (ce ?x)) (:functions (total-cost))
      (:derived (cc ?x) (ce ?x))
      (:derived (ce ?x) (cb ?x))
      (:action a0 :parameters (?x ?y) :precondition (and) :effect (and (cb ?x) (increase (total-cost) 0)))
      (:action a2 :parameters (?x ?y) :precondition (cc ?x) :effect (increase (total-cost) 3))";
    for (name, body, init) in
        [("always", always, "(at i0) (pa i0 i0)"), ("unread", unread, "(= (total-cost) 0)")]
    {
        let domain = format!("(define (domain d) {body})");
        let problem =
            format!("(define (problem p) (:domain d) (:objects i0 o0) (:init {init}) (:goal (cd o0)))");
        std::fs::write(directory.path().join("d.pddl"), domain).expect("a file");
        std::fs::write(directory.path().join("p.pddl"), problem).expect("a file");
        let arguments = ["plan", "d.pddl", "p.pddl", "--certificate", name];
        let planned = metaplan_in(directory.path(), &arguments, "");
        assert!(planned.status == 10 && !planned.stderr.contains("M120"), "{planned:#?}");
        let outcome = verify_in(directory.path(), &[name]);
        assert_eq!(outcome.status, 0, "{outcome:#?}");
        assert!(outcome.stdout.contains("verified: there is no plan"), "{outcome:#?}");
    }
}

#[test]
fn fronts_have_certificates() {
    let directory = tempfile::tempdir().expect("a directory");
    let plan = |domain: &str, problem: &str, objectives: &str, name: &str| {
        let target = directory.path().join(name).display().to_string();
        let outcome = metaplan(&["plan", domain, problem, "--pareto", objectives, "--certificate", &target]);
        (outcome, target)
    };
    let [domain, problem] =
        ["domain", "problem"].map(|name| format!("crates/verify/tests/certificates/front/{name}.pddl"));
    let (planned, front) = plan(&domain, &problem, "cost,risk", "front");
    assert_eq!((planned.status, planned.stderr.as_str()), (0, ""), "{planned:#?}");
    let outcome = verify(&front);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let last = "verified: the front of (cost) and (risk) has exactly 4 points, for these PDDL files only";
    assert!(outcome.stdout.contains(last), "{outcome:#?}");
    let answer = verify_in(&root(), &[&front, "--format", "json"]).json();
    let points = json!([["6.5", "6.5"], ["8.5", "3.5"], ["9", "3"], ["11", "0"]]);
    let claim = json!({ "front": { "objectives": ["(cost)", "(risk)"], "points": points } });
    assert_eq!(answer["claim"], claim);
    // A front without one of its points, and one with a point that does not exist.
    for (old, new, part) in
        [("9 3\n", "", "point       failed: 3"), ("\n9 3", "\n9 2", "point       failed: 3")]
    {
        change(&front, "front.txt", &|text| text.replace(old, new));
        let outcome = verify(&front);
        assert_eq!(outcome.status, 30, "{outcome:#?}");
        assert!(outcome.stdout.contains(part) && outcome.stdout.contains("\nNOT verified: "), "{outcome:#?}");
        change(&front, "front.txt", &|_| {
            "minimize (cost)\nminimize (risk)\n6.5 6.5\n8.5 3.5\n9 3\n11 0\n".to_owned()
        });
    }
    assert_eq!(verify(&front).status, 0);
    // The certificate of another problem does not become that of this front.
    let member = Path::new(&front).join("3").display().to_string();
    change(&member, "problem.pddl", &|text| text.replace("(< (risk) 3.5)", "(< (risk) 3)"));
    let outcome = verify(&front);
    assert!(outcome.stdout.contains("point       failed: 3: problem.pddl is not that of"), "{outcome:#?}");
    // A goal cannot limit the total time, so the objectives are exchanged, or there is no certificate.
    let ugv = |objectives: &str, name: &str| {
        let target = directory.path().join(name).display().to_string();
        (metaplan(&["plan", "missions/ugv.toml", "--pareto", objectives, "--certificate", &target]), target)
    };
    let (planned, front) = ugv("battery_used,total-time", "exchanged");
    assert_eq!(planned.status, 0, "{planned:#?}");
    let outcome = verify(&front);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    assert!(
        outcome.stdout.contains("the front of (total-time) and (battery_used) has exactly"),
        "{outcome:#?}"
    );
    let (planned, front) = ugv("total-time,(+ 1 (* 2 total-time))", "twice");
    assert_eq!(planned.status, 3, "{planned:#?}");
    assert!(planned.stderr.contains("error[M120]: no certificate: both objectives depend on the total time"));
    assert!(!Path::new(&front).exists());
    // Without a plan, the certificate is an ordinary one.
    let unsolvable = directory.path().join("unsolvable.pddl").display().to_string();
    let text = std::fs::read_to_string(root().join(&problem)).expect("a problem");
    let text = text.replace("(road shop work)", "").replace("(alley shop work)", "");
    std::fs::write(&unsolvable, text).expect("a file");
    let (planned, certificate) = plan(&domain, &unsolvable, "cost,risk", "unsolvable");
    assert_eq!(planned.status, 10, "{planned:#?}");
    let outcome = verify(&certificate);
    assert!(outcome.stdout.contains("\nverified: there is no plan"), "{outcome:#?}");
}

/// A limit during the certificate of a point is not reported as a fault of the task (E306).
#[test]
fn fronts_without_time_for_their_certificates_have_none() {
    let setup = Setup::read(&root().join("missions/ugv.toml")).expect("a mission");
    let limits = Limits::none();
    let planner = Planner::new(&setup.mission).expect("it can be planned").limits(limits.clone());
    let front = planner.pareto(["battery_used", "total-time"]).expect("a front");
    limits.interrupt().store(true, Ordering::Relaxed);
    let directory = tempfile::tempdir().expect("a directory");
    let target = directory.path().join("front");
    let message = front.certify(&target).expect_err("a limit is reached");
    assert_eq!(message.code, "M120", "{message}");
    assert!(message.message.contains("a limit was reached"), "{message}");
    assert!(!target.exists());
}

#[test]
fn verification_json_has_the_documented_fields() {
    let directory = tempfile::tempdir().expect("a directory");
    let target = certificate(directory.path(), &["plan", "missions/ugv.toml"]);
    let answer = verify_in(&root(), &[&target, "--format", "json"]).json();
    assert_eq!(answer["format"], "metaplan-verification/1");
    assert_eq!(answer["claim"], json!({ "optimal": { "metric": "408" } }));
    let parts: Vec<_> = answer["parts"].as_array().expect("parts").iter().map(|part| &part["part"]).collect();
    let expected = "files derivations knowledge task plan argument formula proof steps";
    assert_eq!(parts, expected.split(' ').collect::<Vec<_>>());
    assert_eq!(answer["verified"], true);
    let subject = &answer["subject"];
    assert_eq!((&subject["kind"], &subject["mission"]), (&json!("knowledge"), &Value::Null));
    assert_eq!(subject["not_checked"], json!(["mission"]));
}

#[test]
fn argument_is_exported_as_smt_lib() {
    let directory = tempfile::tempdir().expect("a directory");
    let target = certificate(directory.path(), &["plan", "missions/ugv.toml"]);
    let file = directory.path().join("argument.smt2").display().to_string();
    assert_eq!(verify_in(&root(), &[&target, "--smt", &file]).status, 0);
    let text = std::fs::read_to_string(file).expect("a file");
    // One query for the initial state, one for goal states, and one for each of the 22 operators.
    assert_eq!(text.matches("(check-sat)").count(), 24, "{text}");
}

/// Edits a file of a certificate and updates its size and hash in the manifest.
pub fn change(certificate: &str, name: &str, edit: &dyn Fn(String) -> String) {
    use sha2::{Digest as _, Sha256};
    let path = Path::new(certificate).join(name);
    let text = edit(std::fs::read_to_string(&path).expect("a file"));
    let manifest = Path::new(certificate).join("manifest.json");
    let mut document: Value =
        serde_json::from_str(&std::fs::read_to_string(&manifest).expect("a manifest")).expect("JSON");
    for file in document["files"].as_array_mut().expect("files") {
        if file["name"] == name {
            file["bytes"] = json!(text.len());
            file["sha256"] = json!(format!("{:x}", Sha256::digest(text.as_bytes())));
        }
    }
    std::fs::write(path, text).expect("a file");
    std::fs::write(manifest, document.to_string()).expect("a manifest");
}

/// Returns a short XML text that expands to 10^12 characters ("billion laughs").
fn bomb() -> String {
    let entity = |level: u32| format!("<!ENTITY a{} \"{}\">", level + 1, format!("&a{level};").repeat(10));
    let entities: String = (0..11).map(entity).collect();
    format!(
        "<?xml version=\"1.0\"?><!DOCTYPE r [<!ENTITY a0 \"aaaaaaaaaa\">{entities}]><rdf:RDF \
         xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\" xmlns:a=\"a:\"><rdf:Description \
         rdf:about=\"x:y\"><a:c>&a11;</a:c></rdf:Description></rdf:RDF>"
    )
}

#[test]
fn modified_certificates_are_rejected_with_the_first_error() {
    type Edit = fn(String) -> String;
    let cases: [(&str, Edit, &str); 22] = [
        (
            "knowledge.nt",
            |text| text.replace("fd_aruco>", "fd_marker>"),
            "derivations failed: derivations.json: step",
        ),
        (
            "derivations.json",
            |text| {
                let mut document: Value = serde_json::from_str(&text).expect("JSON");
                let steps = document["steps"].as_array_mut().expect("steps");
                let derived = steps.iter().rposition(|step| step["rule"].is_number()).expect("a conclusion");
                steps.remove(derived);
                document.to_string()
            },
            "but is missing\nknowledge   failed",
        ),
        (
            "derivations.json",
            |text| text.replacen("\"rule\":0", "\"rule\":1", 1),
            "derivations failed: derivations.json: step",
        ),
        (
            "origin.json",
            |text| text.replacen("\"added\":[]", "\"added\":[7]", 1),
            "derivations failed: origin.json",
        ),
        (
            "problem.pddl",
            |text| text.replace("(fd_available fd_aruco)", ""),
            "knowledge   failed: the knowledge implies",
        ),
        (
            "plan.txt",
            |plan| plan.lines().skip(1).fold(String::new(), |text, line| text + line + "\n"),
            "plan        failed",
        ),
        ("problem.pddl", |text| text.replace("(fd_available fd_amcl_kinect)", ""), "plan        failed"),
        // A relaxed task still agrees with the PDDL files, but the argument (the proof of the bound) does not
        // hold for it.
        ("task.json", |text| text.replacen("\"constant\":", "\"constant\":1", 1), "argument    failed"),
        (
            "task.json",
            |text| text.replacen("\"number_scale\":", "\"number_scale\":1", 1),
            "task        failed",
        ),
        ("argument.json", |text| text.replacen("\"values\":[", "\"values\":[9999,", 1), "argument    failed"),
        ("argument.json", |_| "[".repeat(100_000), "argument    failed"),
        ("domain.pddl", |text| text.replace(":effect", ":efect"), "files       failed"),
        ("formula.cnf", |text| text.replacen(" 2 ", " -2 ", 1), "formula     failed: line"),
        ("legend.txt", |text| text.replacen("wp1", "wp2", 1), "formula     failed: line"),
        ("proof.drat", |_| String::new(), "proof       failed: the proof ends before the empty clause"),
        (
            "proof.drat",
            |_| "2 0\n".to_owned(),
            "proof       failed: line 1 of the proof does not follow by its hints",
        ),
        (
            "hints.txt",
            |_| String::new(),
            "proof       failed: line 1 of the proof has hints that name no clauses",
        ),
        (
            "hints.txt",
            |_| "1 0\n".to_owned(),
            "proof       failed: line 1 of the proof does not follow by its hints",
        ),
        (
            "knowledge.nt",
            |text| text + "<urn:o> <http://www.w3.org/2002/07/owl#imports> <file:///etc/hostname> .\n",
            "derivations failed: knowledge.nt: contains owl:imports; a certificate may not import",
        ),
        ("knowledge.nt", |_| bomb(), "derivations failed: not well-formed Turtle"),
        (
            "knowledge.nt",
            |text| text + "@prefix a: <urn:a> .\na:b a:c a:d .\n",
            "derivations failed: not well-formed Turtle",
        ),
        ("proof.drat", |_| "a".repeat(10_000_000), "proof       failed: line 1 of the proof is not a clause"),
    ];
    for (file, edit, expected) in cases {
        let directory = tempfile::tempdir().expect("a directory");
        // The formula of the unchanged mission is refuted by unit propagation alone, so its proof is too short to be modified.
        let situation_arguments =
            ["plan", "missions/ugv.toml", "--fail", "c_kinect", "--set", "robot_at=wp2"];
        let arguments =
            if file == "proof.drat" { &situation_arguments[..] } else { &situation_arguments[..2] };
        let target = certificate(directory.path(), arguments);
        change(&target, file, &edit);
        let outcome = verify(&target);
        assert_eq!(outcome.status, 30, "{file}: {outcome:#?}");
        assert!(outcome.stdout.contains(expected), "{file}, `{expected}`: {outcome:#?}");
        assert!(outcome.stdout.contains("NOT verified"), "{outcome:#?}");
    }
}

#[test]
fn malformed_certificates_are_rejected() {
    let check = |edit: &dyn Fn(&Path), expected: &str| {
        let directory = tempfile::tempdir().expect("a directory");
        let target = certificate(directory.path(), &["plan", "missions/ugv.toml"]);
        edit(Path::new(&target));
        let outcome = verify(&target);
        assert_eq!(outcome.status, 30, "{outcome:#?}");
        assert!(outcome.stdout.contains(expected), "`{expected}`: {outcome:#?}");
    };
    let manifest = |edit: fn(String) -> String| {
        move |directory: &Path| {
            let file = directory.join("manifest.json");
            let text = edit(std::fs::read_to_string(&file).expect("a manifest"));
            std::fs::write(file, text).expect("a manifest");
        }
    };
    check(
        &|directory| std::fs::remove_file(directory.join("manifest.json")).expect("a file"),
        "manifest.json: cannot",
    );
    check(
        &|directory| std::fs::remove_file(directory.join("plan.txt")).expect("a file"),
        "plan.txt: cannot be read",
    );
    check(
        &|directory| std::fs::write(directory.join("task.json"), "").expect("a file"),
        "task.json: has 0 bytes",
    );
    check(
        &|directory| std::fs::write(directory.join("proof.drat"), "0\n").expect("a file"),
        "proof.drat: has 2 bytes",
    );
    check(
        &|directory| std::fs::remove_file(directory.join("legend.txt")).expect("a file"),
        "legend.txt: cannot be read",
    );
    // A sparse file of 1 TiB, as an archive could contain.
    check(
        &|directory| {
            let file = std::fs::File::create(directory.join("proof.drat")).expect("a file");
            file.set_len(1 << 40).expect("a length");
        },
        "proof.drat: has 1099511627776 bytes, more than",
    );
    check(
        &manifest(|text| text.replace("\"formula.cnf\"", "\"/dev/zero\"")),
        "manifest.json: lists /dev/zero",
    );
    check(&manifest(|text| text[..text.len() / 2].to_owned()), "manifest.json: EOF");
    check(
        &manifest(|text| text.replace("\"plan.txt\"", "\"../../plan.txt\"")),
        "manifest.json: lists ../../plan.txt",
    );
    check(&manifest(|text| text.replacen("\"bytes\": ", "\"bytes\": 99999999999", 1)), "larger than");
    check(
        &manifest(|text| text.replace("certificate/3", "certificate/9")),
        "format `metaplan-certificate/9`",
    );
    check(&manifest(|_| "[".repeat(500_000)), "manifest.json: ");
    check(
        &manifest(|text| text.replacen("\"plan.txt\"", "\"task.json\"", 1)),
        "manifest.json: lists argument.json, ",
    );
    check(
        &manifest(|text| {
            let entry = "{ \"name\": \"a\", \"bytes\": 1, \"sha256\": \"\" }, ";
            text.replacen("\"files\": [", &format!("\"files\": [{}", entry.repeat(1_000_000)), 1)
        }),
        "manifest.json: has ",
    );
    check(
        &|directory| {
            let plan = std::fs::read(directory.join("plan.txt")).expect("a plan");
            std::fs::write(directory.join("plan.txt"), vec![0xff; plan.len()]).expect("a file");
        },
        "plan.txt: cannot be read: stream did not contain valid UTF-8",
    );
    #[cfg(unix)]
    for name in ["manifest.json", "task.json", "proof.drat", "hints.txt"] {
        // A named pipe without a writer: opening it would block forever.
        let pipe = |directory: &Path| {
            let file = directory.join(name);
            std::fs::remove_file(&file).expect("a file");
            let status = std::process::Command::new("mkfifo").arg(file).status().expect("mkfifo runs");
            assert!(status.success());
        };
        check(&pipe, &format!("{name}: is not a plain file"));
    }
    #[cfg(unix)]
    check(
        &|directory| {
            let plan = directory.join("plan.txt");
            std::fs::rename(&plan, directory.join("moved")).expect("a file");
            std::os::unix::fs::symlink(directory.join("moved"), plan).expect("a link");
        },
        "plan.txt: is not a plain file",
    );
}

/// The proofs are accepted by `rate`, an independent checker of DRAT proofs. The test needs `rate` at the
/// path `METAPLAN_RATE`: `cargo install rate --version 0.3.0 --root rate`, then
/// `METAPLAN_RATE=rate/bin/rate`.
#[test]
#[ignore = "needs a proof checker"]
fn external_checker_accepts_the_proofs() {
    let Ok(checker) = std::env::var("METAPLAN_RATE") else { panic!("METAPLAN_RATE names no checker") };
    let accepts = |certificate: &str| {
        let files = ["formula.cnf", "proof.drat"].map(|name| format!("{certificate}/{name}"));
        let output = std::process::Command::new(&checker).args(&files).output().expect("the checker runs");
        String::from_utf8_lossy(&output.stdout).contains("s VERIFIED")
    };
    for mission in MISSIONS {
        let directory = tempfile::tempdir().expect("a directory");
        let target = certificate(directory.path(), mission);
        assert!(accepts(&target), "{mission:?}");
        // Without the clauses of the claim, the formula is satisfiable, so the proof must be rejected.
        let formula = Path::new(&target).join("formula.cnf");
        let text = std::fs::read_to_string(&formula).expect("a formula");
        let first_half: Vec<&str> = text.lines().take(text.lines().count() / 2).collect();
        let head = first_half[0].rsplit_once(' ').expect("a header").0;
        let first_half = format!("{head} {}\n{}\n", first_half.len() - 1, first_half[1..].join("\n"));
        std::fs::write(&formula, first_half).expect("a file");
        assert!(!accepts(&target), "{mission:?}");
    }
}

pub const MISSIONS: [&[&str]; 5] = [
    &["plan", "missions/ugv.toml"],
    &["plan", "missions/uuv.toml", "--set", "battery=15"],
    &["plan", "missions/ugv_plain.toml", "--fail", "c_kinect"],
    &["plan", "missions/uuv.toml", "--minimize", "total-time"],
    &["plan", "missions/ugv.toml", "--fail", "c_kinect", "--set", "robot_at=wp2"],
];

#[test]
fn claims_must_use_the_metric_of_the_files() {
    let directory = tempfile::tempdir().expect("a directory");
    let domain = "(define (domain d) (:predicates (at ?p) (way ?a ?b))
      (:action go :parameters (?a ?b) :precondition (and (at ?a) (way ?a ?b)) :effect (and (at ?b) (not (at ?a)))))";
    let problem = "(define (problem p) (:domain d) (:objects a b c)
      (:init (at a) (way a b) (way b c) (way a c)) (:goal (at c)))";
    std::fs::write(directory.path().join("d.pddl"), domain).expect("a file");
    std::fs::write(directory.path().join("p.pddl"), problem).expect("a file");
    let arguments = ["plan", "d.pddl", "p.pddl", "--quiet", "--certificate", "proof"];
    assert_eq!(metaplan_in(directory.path(), &arguments, "").status, 0);
    let target = directory.path().join("proof").display().to_string();
    let manifest = directory.path().join("proof/manifest.json");
    let text = std::fs::read_to_string(&manifest).expect("a manifest");
    let mut document: Value = serde_json::from_str(&text).expect("JSON");
    document["files"].as_array_mut().expect("files").retain(|file| {
        ["formula.cnf", "legend.txt", "proof.drat", "hints.txt"].iter().all(|name| file["name"] != *name)
    });
    document["refutation"] = json!({ "none": "taken away" });
    std::fs::write(&manifest, document.to_string()).expect("a manifest");
    assert_eq!(verify(&target).status, 0);
    // No action has a duration, so the longer path would be equally good if total time were the metric.
    change(&target, "plan.txt", &|_| "(go a b)\n(go b c)\n".to_owned());
    change(&target, "task.json", &|text| {
        text.replace("\"cost\":{\"constant\":1}", "\"cost\":{\"constant\":0}")
    });
    let argument = r#"{"format":"metaplan-argument/1","potentials":[{"pattern":[],"values":[0]}],"needs":[],"labels":[]}"#;
    change(&target, "argument.json", &|_| argument.to_owned());
    let text = std::fs::read_to_string(&manifest).expect("a manifest");
    std::fs::write(&manifest, text.replace("\"metric\":\"1\"", "\"metric\":\"0\"")).expect("a manifest");
    let outcome = verify(&target);
    assert_eq!(outcome.status, 30, "{outcome:#?}");
    // A task with lower costs still yields valid lower bounds, but no plan of the files attains such a cost.
    assert!(outcome.stdout.contains("plan        failed: its metric is 2"), "{outcome:#?}");
}

/// A certificate can describe an arbitrarily large task. Limits bound the work of the checker.
#[test]
fn verification_of_a_huge_task_terminates() {
    let directory = tempfile::tempdir().expect("a directory");
    let objects: Vec<String> = (0..200).map(|number| format!("o{number}")).collect();
    let problem = format!(
        "(define (problem p) (:domain d) (:objects {}) (:init) (:goal (met o1 o2)))",
        objects.join(" ")
    );
    let domain = "(define (domain d) (:predicates (met ?a ?b) (far ?a ?b))
      (:action meet :parameters () :precondition () :effect (met o1 o2)))";
    let domain = domain.replace("(:predicates", "(:constants o1 o2) (:predicates");
    std::fs::write(directory.path().join("d.pddl"), domain).expect("a file");
    std::fs::write(directory.path().join("p.pddl"), problem.replace(" o1 o2 o3", " o3")).expect("a file");
    let arguments = ["plan", "d.pddl", "p.pddl", "--certificate", "c"];
    let outcome = metaplan_in(directory.path(), &arguments, "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let certificate = directory.path().join("c").display().to_string();
    let action = "(:action wait :parameters (?a ?b ?c ?d ?e ?f ?g ?h)
      :precondition (not (and (far ?a ?b) (far ?c ?d) (far ?e ?f) (far ?g ?h))) :effect (far ?a ?h)))";
    change(&certificate, "domain.pddl", &|text| {
        let text = text.trim_end();
        format!("{} {action}", &text[..text.len() - 1])
    });
    let outcome = verify_in(&root(), &[&certificate, "--time-limit", "1"]);
    assert_eq!(outcome.status, 30, "{outcome:#?}");
    assert!(outcome.stdout.contains("ends at 400000 instances of wait"), "{outcome:#?}");
}

#[test]
fn unsupported_features_get_no_certificate() {
    let directory = tempfile::tempdir().expect("a directory");
    let domain = "(define (domain d) (:predicates (p) (q) (r)) (:functions (p) (total-cost))
      (:derived (r) (not (p)))
      (:action a :parameters () :precondition (not (r)) :effect (and (q) (increase (total-cost) (p)))))";
    let problem = "(define (problem x) (:domain d) (:init (p) (= (p) 3) (= (total-cost) 0)) (:goal (q))
      (:metric minimize (total-cost)))";
    std::fs::write(directory.path().join("d.pddl"), domain).expect("a file");
    std::fs::write(directory.path().join("p.pddl"), problem).expect("a file");
    let outcome = metaplan_in(directory.path(), &["plan", "d.pddl", "p.pddl", "--certificate", "c"], "");
    assert!(outcome.stderr.contains("M120"), "{outcome:#?}");
    assert!(outcome.stderr.contains("does not cover derived predicates beside"), "{outcome:#?}");
    assert!(!directory.path().join("c").exists());
}

#[test]
fn only_the_reason_that_applies_is_reported() {
    let directory = tempfile::tempdir().expect("a directory");
    let check = |domain: &str, problem: &str, options: &[&str], reason: &str| {
        let domain = format!("(define (domain d) {domain})");
        std::fs::write(directory.path().join("d.pddl"), domain).expect("a file");
        let problem = format!("(define (problem x) (:domain d) {problem})");
        std::fs::write(directory.path().join("p.pddl"), problem).expect("a file");
        let arguments = [&["plan", "d.pddl", "p.pddl", "--certificate", "c"], options].concat();
        let outcome = metaplan_in(directory.path(), &arguments, "");
        assert_eq!(outcome.status, 3, "{outcome:#?}");
        let expected = format!("error[M120]: no certificate: {reason}");
        assert!(headlines(&outcome.stderr).lines().any(|line| line == expected), "{reason}: {outcome:#?}");
        assert!(!directory.path().join("c").exists());
    };
    let two_steps = "(:predicates (ready) (done))
      (:action prepare :parameters () :precondition () :effect (ready))
      (:action work :parameters () :precondition (ready) :effect (done))";
    check(
        two_steps,
        "(:init) (:goal (done))",
        &["--horizon", "1"],
        "nothing is proved for plans of any length",
    );
    let costs = "(:init (= (cost) 0) (= (level) 1)) (:goal (done))";
    check(
        "(:predicates (done)) (:functions (cost) (level))
          (:action work :parameters () :precondition () :effect (and (done) (increase (cost) 1) (increase (level) 2)))",
        costs,
        &["--minimize", "cost", "--minimize", "level"],
        "certificates support a single objective",
    );
    check(
        "(:predicates (done) (charged)) (:functions (cost) (level))
          (:action charge :parameters () :precondition (not (charged))
            :effect (and (charged) (increase (level) 1)))
          (:action work :parameters () :precondition () :effect (and (done) (increase (cost) (level))))",
        costs,
        &["--minimize", "cost"],
        "the metric reads (cost), which actions change by amounts that depend on the state",
    );
    // No action adds `done`.
    check(
        "(:predicates (done) (paid)) (:functions (cost) (level))
          (:action earn :parameters () :precondition () :effect (and (paid) (decrease (cost) 1)))",
        costs,
        &["--minimize", "cost"],
        "`earn` can improve the metric",
    );
    // Only `look` reads the recursive predicate, and nothing reads the effect of `look`.
    check(
        "(:constants b c) (:predicates (at ?x) (edge ?x ?y) (reach ?x) (seen) (done))
          (:derived (reach ?x) (or (at ?x) (exists (?y) (and (reach ?y) (edge ?y ?x)))))
          (:action enter :parameters () :precondition () :effect (at b))
          (:action look :parameters () :precondition (reach c) :effect (seen))
          (:action work :parameters () :precondition () :effect (done))",
        "(:init (edge b c) (edge c b)) (:goal (done))",
        &[],
        "the comparison of the task with the files does not cover (reach c), which depends on itself and is not a \
         variable of the task; it occurs in (look)",
    );
}

/// A conflict between a conditional and an unconditional start effect excludes only the case in
/// which the condition holds. If the grounder loses the whole action, no certificate may be
/// written.
#[test]
fn a_lost_action_is_never_certified() {
    let action = "(:durative-action a :parameters () :duration (= ?duration 2) :condition (and)
      :effect (and (at start (q)) (at start (p)) (at start (increase (f) 5)) (at start (when (p) (assign (f) 0)))))";
    let costly_action = "(:durative-action dear :parameters () :duration (= ?duration 100) :condition (and) :effect (at end (q)))";
    for alternative in ["", costly_action] {
        let directory = tempfile::tempdir().expect("a directory");
        let domain =
            format!("(define (domain d) (:predicates (p) (q)) (:functions (f)) {action} {alternative})");
        let problem = "(define (problem p) (:domain d) (:init (= (f) 2)) (:goal (q)))";
        std::fs::write(directory.path().join("d.pddl"), domain).expect("a file");
        std::fs::write(directory.path().join("p.pddl"), problem).expect("a file");
        let outcome = metaplan_in(directory.path(), &["plan", "d.pddl", "p.pddl", "--certificate", "c"], "");
        if directory.path().join("c").exists() {
            let verified = verify_in(directory.path(), &["c"]);
            assert!(
                verified
                    .stdout
                    .contains("verified: the plan is optimal, metric 2, for these PDDL files only;"),
                "{verified:#?}"
            );
        } else {
            assert!(outcome.stderr.contains("M120") && outcome.stderr.contains("(a)"), "{outcome:#?}");
        }
    }
}
