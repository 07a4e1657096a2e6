//! `metaplan plan --certificate` and `metaplan verify`.

use std::path::Path;

use serde_json::{Value, json};

use crate::common::{Outcome, metaplan, metaplan_in};

/// The directory of a fresh certificate.
fn certificate(directory: &Path, arguments: &[&str]) -> String {
    let target = directory.join("certificate").display().to_string();
    let all: Vec<&str> = arguments.iter().copied().chain(["--certificate", &target]).collect();
    let outcome = metaplan(&all);
    assert!(Path::new(&target).is_dir(), "{outcome:#?}");
    target
}

fn verify(certificate: &str) -> Outcome {
    metaplan(&["verify", certificate])
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
fn that_there_is_no_plan_has_a_certificate() {
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
    // Out of reach even if nothing is ever deleted, and reachable only so.
    for (name, goal) in [("relaxed", "(at c)"), ("searched", "(and (at a) (at b))")] {
        std::fs::write(directory.path().join("p.pddl"), problem(goal)).expect("a file");
        let arguments = ["plan", "d.pddl", "p.pddl", "--certificate", name];
        assert_eq!(metaplan_in(directory.path(), &arguments, "").status, 10);
        let outcome = metaplan_in(directory.path(), &["verify", name], "");
        assert_eq!(outcome.status, 0, "{outcome:#?}");
        assert!(outcome.stdout.contains("verified: there is no plan"), "{outcome:#?}");
    }
}

#[test]
fn a_verification_has_its_fields() {
    let directory = tempfile::tempdir().expect("a directory");
    let target = certificate(directory.path(), &["plan", "missions/ugv.toml"]);
    let answer = metaplan(&["verify", &target, "--format", "json"]).json();
    assert_eq!(answer["format"], "metaplan-verification/1");
    assert_eq!(answer["claim"], json!({ "optimal": { "metric": "408" } }));
    let parts: Vec<_> = answer["parts"].as_array().expect("parts").iter().map(|part| &part["part"]).collect();
    let expected = "files derivations knowledge task plan argument formula proof steps";
    assert_eq!(parts, expected.split(' ').collect::<Vec<_>>());
    assert_eq!(answer["verified"], true);
}

#[test]
fn the_argument_is_written_for_other_checkers() {
    let directory = tempfile::tempdir().expect("a directory");
    let target = certificate(directory.path(), &["plan", "missions/ugv.toml"]);
    let file = directory.path().join("argument.smt2").display().to_string();
    assert_eq!(metaplan(&["verify", &target, "--smt", &file]).status, 0);
    let text = std::fs::read_to_string(file).expect("a file");
    // One question for the initial state, one for goal states, and one for each of the 22 operators.
    assert_eq!(text.matches("(check-sat)").count(), 24, "{text}");
}

/// Changes a file of a certificate, and has the manifest say what the file is now.
fn change(certificate: &str, name: &str, edit: &dyn Fn(String) -> String) {
    use sha2::{Digest as _, Sha256};
    let path = Path::new(certificate).join(name);
    let text = edit(std::fs::read_to_string(&path).expect("a file"));
    let manifest = Path::new(certificate).join("manifest.json");
    let mut listed: Value =
        serde_json::from_str(&std::fs::read_to_string(&manifest).expect("a manifest")).expect("JSON");
    for file in listed["files"].as_array_mut().expect("files") {
        if file["name"] == name {
            file["bytes"] = json!(text.len());
            file["sha256"] = json!(format!("{:x}", Sha256::digest(text.as_bytes())));
        }
    }
    std::fs::write(path, text).expect("a file");
    std::fs::write(manifest, listed.to_string()).expect("a manifest");
}

#[test]
fn what_is_changed_is_rejected_with_the_first_thing_that_is_wrong() {
    type Edit = fn(String) -> String;
    let cases: [(&str, Edit, &str); 17] = [
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
            "and is missing\nknowledge   failed",
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
            "knowledge   failed: the knowledge says",
        ),
        (
            "plan.txt",
            |plan| plan.lines().skip(1).fold(String::new(), |text, line| text + line + "\n"),
            "plan        failed",
        ),
        ("problem.pddl", |text| text.replace("(fd_available fd_amcl_kinect)", ""), "plan        failed"),
        // A task that allows more stands for the files still, but the argument does not hold for it.
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
        ("proof.drat", |_| "2 0\n".to_owned(), "proof       failed: line 1 of the proof does not follow"),
        ("proof.drat", |_| "a".repeat(10_000_000), "proof       failed: line 1 of the proof is no clause"),
    ];
    for (file, edit, expected) in cases {
        let directory = tempfile::tempdir().expect("a directory");
        // The formula of the mission as it is is refuted by unit propagation alone.
        let changed = ["plan", "missions/ugv.toml", "--fail", "c_kinect", "--set", "robot_at=wp2"];
        let arguments = if file == "proof.drat" { &changed[..] } else { &changed[..2] };
        let target = certificate(directory.path(), arguments);
        change(&target, file, &edit);
        let outcome = verify(&target);
        assert_eq!(outcome.status, 30, "{file}: {outcome:#?}");
        assert!(outcome.stdout.contains(expected), "{file}, `{expected}`: {outcome:#?}");
        assert!(outcome.stdout.contains("NOT verified"), "{outcome:#?}");
    }
}

#[test]
fn certificates_that_are_none_are_rejected() {
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
    // A file of many gigabytes that takes no room, as an unpacked archive may have it.
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
        &manifest(|text| text.replace("certificate/1", "certificate/9")),
        "format `metaplan-certificate/9`",
    );
    #[cfg(unix)]
    check(
        &|directory| {
            let plan = directory.join("plan.txt");
            std::fs::rename(&plan, directory.join("moved")).expect("a file");
            std::os::unix::fs::symlink(directory.join("moved"), plan).expect("a link");
        },
        "plan.txt: is no plain file",
    );
}

/// Needs `rate`, a checker of DRAT proofs by others, named by `METAPLAN_RATE`: `cargo install rate --version 0.3.0 --root rate`,
/// then `METAPLAN_RATE=rate/bin/rate`.
#[test]
#[ignore = "needs a proof checker"]
fn an_outside_checker_accepts_the_proofs() {
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
        // Without the claim, the formula has a model, and the proof is none.
        let formula = Path::new(&target).join("formula.cnf");
        let text = std::fs::read_to_string(&formula).expect("a formula");
        let half: Vec<&str> = text.lines().take(text.lines().count() / 2).collect();
        let head = half[0].rsplit_once(' ').expect("a header").0;
        let half = format!("{head} {}\n{}\n", half.len() - 1, half[1..].join("\n"));
        std::fs::write(&formula, half).expect("a file");
        assert!(!accepts(&target), "{mission:?}");
    }
}

/// Numbers for changes, the same in every run (`SplitMix64`).
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % limit as u64) as usize
    }
}

/// Changes a text somewhere: a line goes, comes twice or changes places, or a number or a word becomes another one of the text.
fn mutate(text: &str, random: &mut Random) -> String {
    let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
    let line = random.below(lines.len());
    match random.below(6) {
        0 => drop(lines.remove(line)),
        1 => lines.insert(line, lines[line]),
        2 => {
            let other = random.below(lines.len());
            lines.swap(line, other);
        }
        _ => {
            let is_part = |c: char| c.is_alphanumeric() || "_-.".contains(c);
            let words: Vec<(usize, &str)> = text
                .match_indices(is_part)
                .filter(|(at, _)| !text[..*at].ends_with(is_part))
                .map(|(at, _)| (at, text[at..].split(|c| !is_part(c)).next().unwrap_or_default()))
                .collect();
            let (at, word) = words[random.below(words.len())];
            let digits = word.bytes().all(|byte| byte.is_ascii_digit());
            let other = words[random.below(words.len())].1.to_owned();
            let numbers = ["0", "1", "7", "-1", "9999"];
            let other = if digits { numbers[random.below(numbers.len())].to_owned() } else { other };
            return format!("{}{other}{}", &text[..at], &text[at + word.len()..]);
        }
    }
    lines.concat()
}

/// Changes a file of a certificate at random, mostly with a manifest that goes with it. What is accepted must be true:
/// planning for the files of the certificate must come to the same.
fn withstands(arguments: &[&str], seeds: std::ops::Range<u64>) {
    let directory = tempfile::tempdir().expect("a directory");
    let target = certificate(directory.path(), arguments);
    let mut names: Vec<String> = std::fs::read_dir(&target)
        .expect("files")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    let read = |name: &str| std::fs::read_to_string(Path::new(&target).join(name)).expect("a file");
    let originals: Vec<(String, String)> = names.iter().map(|name| (name.clone(), read(name))).collect();
    for seed in seeds {
        let mut random = Random(seed);
        let (name, text) = &originals[random.below(originals.len())];
        let mutant = mutate(text, &mut random);
        if name == "manifest.json" || random.below(8) == 0 {
            std::fs::write(Path::new(&target).join(name), &mutant).expect("a file");
        } else {
            change(&target, name, &|_| mutant.clone());
        }
        let outcome = verify(&target);
        assert!([0, 30].contains(&outcome.status), "{arguments:?}, seed {seed}, {name}: {outcome:#?}");
        if outcome.status == 0 {
            let files = ["domain.pddl", "problem.pddl"].map(|name| format!("{target}/{name}"));
            let answer = metaplan(&["plan", &files[0], &files[1], "--format", "json", "--quiet"]).json();
            let claim: Value = serde_json::from_str(&read("manifest.json")).expect("a manifest");
            let metric = claim["claim"]["optimal"]["metric"].as_str().map(str::to_owned);
            let found = (answer["status"] == "optimal").then(|| answer["cost"].to_string());
            assert_eq!(metric, found, "{arguments:?}, seed {seed}, {name}: {outcome:#?}");
        }
        for (name, text) in &originals {
            std::fs::write(Path::new(&target).join(name), text).expect("a file");
        }
    }
}

const MISSIONS: [&[&str]; 5] = [
    &["plan", "missions/ugv.toml"],
    &["plan", "missions/uuv.toml", "--set", "battery=15"],
    &["plan", "missions/ugv_plain.toml", "--fail", "c_kinect"],
    &["plan", "missions/uuv.toml", "--minimize", "total-time"],
    &["plan", "missions/ugv.toml", "--fail", "c_kinect", "--set", "robot_at=wp2"],
];

#[test]
fn what_is_accepted_after_a_random_change_is_true() {
    for mission in MISSIONS {
        withstands(mission, 0..20);
    }
}

#[test]
#[ignore = "minutes"]
fn what_is_accepted_after_many_random_changes_is_true() {
    for mission in MISSIONS {
        withstands(mission, 1_000..1_300);
    }
}
