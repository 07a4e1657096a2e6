//! Tests of `metaplan verify --proved`, and of the page that checks a certificate in a browser. Programs of a
//! few lines of shell take the place of the proved checker where its answer has to be wrong.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Value, json};
use test_resources::{Resource, program};

use crate::browser::{browser, open};
use crate::certificate::{certificate, change};
use crate::common::{Outcome, copy_folder, metaplan_in, root};

const STORED: &str = "crates/verify/tests/certificates";

fn has_checker() -> bool {
    program(Resource::Proved, &["metaplan-proved-check"]).is_some()
}

fn verify(arguments: &[&str]) -> Outcome {
    metaplan_in(&root(), &[&["verify"], arguments].concat(), "")
}

#[test]
fn theorem_covers_the_parts_about_the_pddl_files() {
    if !has_checker() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let ugv = certificate(folder.path(), &["plan", "missions/ugv.toml"]);
    let covers = "proved: theorem `optimal` covers the parts task, plan, argument\n";
    let no_plan = "proved: theorem `unsolvable` covers the parts task, argument\n";
    let timed = "proved: theorem `timed_optimal` covers the parts task, plan, argument\n";
    let with_knowledge = format!(
        "proved: theorem `knowledge` covers the part derivations\nproved: theorem `mission_optimal` covers the part \
         knowledge\n{covers}"
    );
    for (certificate, status, line) in [
        (ugv.as_str(), 0, with_knowledge.as_str()),
        ("proved/tests/battery", 0, covers),
        (&format!("{STORED}/designs"), 0, covers),
        (&format!("{STORED}/stuck"), 0, no_plan),
        ("proved/tests/flat", 0, no_plan),
        ("proved/tests/morning", 0, no_plan),
        ("proved/tests/far", 0, no_plan),
        ("proved/tests/curfew", 0, "proved: theorem `timed_optimal` covers the parts task, argument\n"),
        (&format!("{STORED}/front"), 0, "proved: theorem `front_optimal` covers the parts point, front\n"),
        (&format!("{STORED}/oven"), 0, timed),
    ] {
        let outcome = verify(&[certificate, "--proved"]);
        assert_eq!((outcome.status, outcome.stderr.as_str()), (status, ""), "{certificate}: {outcome:#?}");
        assert!(outcome.stdout.ends_with(line), "{certificate}: {outcome:#?}");
        let verified = verify(&[certificate]);
        assert_eq!(outcome.stdout.strip_suffix(line), Some(verified.stdout.as_str()), "{certificate}");
    }
    let battery = "proved/tests/battery";
    let answer = verify(&[battery, "--proved", "--format", "json"]).json();
    let message = "proved: the plan of 2 steps is optimal, metric 2";
    let theorem =
        json!({"proved": true, "name": "optimal", "parts": ["task", "plan", "argument"], "message": message});
    assert_eq!(answer["theorem"], theorem, "{answer:#}");
    let answer = verify(&["proved/tests/flat", "--proved", "--format", "json"]).json();
    let theorem = json!({"proved": true, "name": "unsolvable", "parts": ["task", "argument"], "message": "proved: there is no plan"});
    assert_eq!(answer["theorem"], theorem, "{answer:#}");
    assert_eq!(verify(&[battery, "--format", "json"]).json().get("theorem"), None);
    let answer = verify(&[&ugv, "--proved", "--format", "json"]).json();
    let message = "proved: exactly the 130 facts hold, 9 of them by rules";
    assert_eq!(answer["theorem"]["derivations"], json!({"proved": true, "message": message}), "{answer:#}");
    let message = "proved: for the problem that follows from the knowledge base: the plan of 4 steps is optimal, metric 408";
    assert_eq!(answer["theorem"]["knowledge"], json!({"proved": true, "message": message}), "{answer:#}");
}

#[test]
fn theorem_covers_missions_with_explicit_and_plain_domains() {
    if !has_checker() {
        return;
    }
    let line = "\nproved: theorem `mission_optimal` covers the part knowledge\n";
    for mission in [
        "missions/uuv.toml",
        "missions/ugv_plain.toml",
        "missions/uuv_plain.toml",
        "missions/camara_like.toml",
        "missions/templates/warehouse/mission.toml",
        "integrations/ros/examples/nav2/mission.toml",
        "tests/program/greenhouse/mission.toml",
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let certificate = certificate(folder.path(), &["plan", mission]);
        let outcome = verify(&[&certificate, "--proved"]);
        assert!(outcome.status == 0 && outcome.stdout.contains(line), "{mission}: {outcome:#?}");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let other = ["plan", "missions/ugv.toml", "--minimize", "battery_used"];
    let certificate = certificate(folder.path(), &other);
    let answer = verify(&[&certificate, "--proved", "--format", "json"]).json();
    let message = answer["theorem"]["knowledge"]["message"].as_str().unwrap_or_default();
    assert!(message.contains("with another metric than the mission's"), "{answer:#}");
    let folder = tempfile::tempdir().expect("a folder");
    let front = folder.path().join("front").display().to_string();
    let objectives = "total-time,battery_used";
    let outcome = metaplan_in(
        &root(),
        &["plan", "missions/ugv.toml", "--pareto", objectives, "--certificate", &front],
        "",
    );
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let outcome = verify(&[&front, "--proved"]);
    let line = "\nproved: theorem `mission_front` covers the part knowledge\n";
    assert!(outcome.status == 0 && outcome.stdout.contains(line), "{outcome:#?}");
}

/// A program that accepts all derivations.
#[cfg(unix)]
const KNOWN: &str = "echo 'proved: exactly the 2 facts hold'";

/// The theorem about the plan also holds if theorem `knowledge` does not apply to the derivations.
#[test]
#[cfg(unix)]
fn answer_about_derivations_is_compared() {
    let folder = tempfile::tempdir().expect("a folder");
    let ugv = certificate(folder.path(), &["plan", "missions/ugv.toml"]);
    let check = "echo 'proved: the plan of 4 steps is optimal, metric 408'";
    let covers = "proved: theorem `optimal` covers the parts task, plan, argument\n";
    for (script, line) in [
        (None, "derivations NOT proved by a theorem: the program `metaplan-proved-knowledge` is missing"),
        (
            Some("echo 'rejected: not covered: keys'; exit 3"),
            "derivations NOT proved by a theorem: not covered: keys",
        ),
        (
            Some("echo 'not proved'; exit 30"),
            "derivations NOT proved by a theorem: the proved checker does not accept the derivations",
        ),
        (
            Some("echo 'proved: nothing'"),
            "derivations NOT proved by a theorem: `metaplan-proved-knowledge` prints no statement about the facts",
        ),
        (Some(KNOWN), "proved: theorem `knowledge` covers the part derivations"),
    ] {
        let programs = stubs("echo evidence", check);
        if let Some(script) = script {
            add_stub(programs.path(), "metaplan-proved-knowledge", script);
        }
        let outcome = with_stubs(&ugv, &programs, &[]);
        assert_eq!(outcome.status, 0, "{outcome:#?}");
        let missing = "knowledge NOT proved by a theorem: the program `metaplan-proved-mission` is missing";
        assert!(outcome.stdout.ends_with(&format!("{line}\n{missing}\n{covers}")), "{line}: {outcome:#?}");
    }
    let optimal = "the plan of 4 steps is optimal, metric 408";
    let problem = "proved: for the problem that follows from the knowledge base: ";
    let covered = "proved: theorem `mission_optimal` covers the part knowledge";
    let states = |statement: &str| format!("test -s \"$2\" && echo '{statement}'");
    for (script, line) in [
        (states(&format!("{problem}{optimal}")), covered),
        (
            states(&format!("proved: {optimal}")),
            "knowledge NOT proved by a theorem: `metaplan-proved-mission` proves something else: proved: the plan of 4 steps is optimal, metric 408",
        ),
        (
            states(&format!("{problem}there is no plan")),
            "knowledge NOT proved by a theorem: `metaplan-proved-mission` proves something else: proved: for the problem that follows from the knowledge base: there is no plan",
        ),
        (
            "echo 'not proved'; exit 30".to_owned(),
            "knowledge NOT proved by a theorem: the proved checker does not accept the mission",
        ),
        (
            "echo 'rejected: not covered: either'; exit 3".to_owned(),
            "knowledge NOT proved by a theorem: not covered: either",
        ),
    ] {
        let programs = stubs("echo evidence", check);
        add_stub(programs.path(), "metaplan-proved-knowledge", KNOWN);
        add_stub(programs.path(), "metaplan-proved-mission", &script);
        let outcome = with_stubs(&ugv, &programs, &[]);
        assert_eq!(outcome.status, 0, "{outcome:#?}");
        assert!(outcome.stdout.ends_with(&format!("{line}\n{covers}")), "{line}: {outcome:#?}");
    }
    change(&ugv, "origin.json", &|text| text.replace("lessThan", "greaterThan"));
    let programs = stubs("echo evidence", check);
    add_stub(programs.path(), "metaplan-proved-knowledge", KNOWN);
    let outcome = with_stubs(&ugv, &programs, &[]);
    assert_eq!(outcome.status, 30, "{outcome:#?}");
    let line = "theorem     failed: the checkers disagree: the proved checker accepts the derivations (proved: exactly the 2 facts hold)";
    assert!(outcome.stdout.contains(line), "{outcome:#?}");
}

/// A wrong claim is rejected by both checkers, which is not a disagreement.
#[test]
fn both_checkers_reject_a_worse_plan() {
    if !has_checker() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let certificate = folder.path().join("battery").display().to_string();
    copy_folder(&root().join("proved/tests/battery"), Path::new(&certificate));
    change(&certificate, "plan.txt", &|text| {
        text.lines().skip(1).fold(String::new(), |text, line| text + line + "\n")
    });
    let outcome = verify(&[&certificate, "--proved"]);
    assert_eq!(outcome.status, 30, "{outcome:#?}");
    assert!(outcome.stdout.ends_with("NOT proved by a theorem: not proved\n"), "{outcome:#?}");
    assert!(!outcome.stdout.contains("theorem     failed"), "{outcome:#?}");
}

fn stubs(prepare: &str, check: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    add_stub(folder.path(), "metaplan-proved-prepare", prepare);
    add_stub(folder.path(), "metaplan-proved-check", check);
    folder
}

fn add_stub(folder: &Path, name: &str, script: &str) {
    let path = folder.join(name);
    std::fs::write(&path, format!("#!/bin/sh\n{script}\n")).expect("written");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).expect("executable");
    }
}

fn with_stubs(certificate: &str, programs: &tempfile::TempDir, options: &[&str]) -> Outcome {
    let proved = format!("--proved={}", programs.path().display());
    verify(&[&[certificate, proved.as_str()], options].concat())
}

#[test]
#[cfg(unix)]
fn disagreement_is_an_error() {
    let designs = format!("{STORED}/designs");
    let accepts = "echo 'proved: the plan of 3 steps is optimal, metric 5'";
    let folder = tempfile::tempdir().expect("a folder");
    let changed = folder.path().join("designs").display().to_string();
    copy_folder(&root().join(&designs), Path::new(&changed));
    change(&changed, "plan.txt", &|_| String::new());
    for (certificate, check, disagreement) in [
        (&designs, "echo not proved; exit 30", "the proved checker does not accept this certificate"),
        (&designs, "echo 'proved: there is no plan'", "proves something else: proved: there is no plan"),
        (
            &designs,
            "echo 'proved: the plan of 3 steps is optimal, metric 55'",
            "proves something else: proved: the plan of 3 steps is optimal, metric 55",
        ),
        (&changed, accepts, "the proved checker accepts this certificate"),
    ] {
        let outcome = with_stubs(certificate, &stubs("echo evidence", check), &[]);
        assert_eq!(outcome.status, 30, "{check}: {outcome:#?}");
        let line = outcome.stdout.lines().find(|line| line.starts_with("theorem     failed: "));
        let line = line.unwrap_or_else(|| panic!("{check}: {outcome:#?}"));
        assert!(line.contains("the checkers disagree") && line.contains(disagreement), "{outcome:#?}");
        assert!(outcome.stdout.contains("\nNOT verified: "), "{outcome:#?}");
    }
    let programs = stubs("echo evidence", "echo not proved; exit 30");
    let answer = with_stubs(&designs, &programs, &["--format", "json"]).json();
    assert_eq!((&answer["verified"], &answer["theorem"]["proved"]), (&json!(false), &json!(false)));
}

#[test]
#[cfg(unix)]
fn reason_without_a_theorem_is_printed() {
    let designs = format!("{STORED}/designs");
    for (prepare, check, reason) in [
        ("echo 'rejected: not covered: waiting' >&2; exit 3", "exit 0", "not covered: waiting"),
        ("exit 3", "exit 0", "the program has printed no reason"),
        (
            "kill -9 $$",
            "exit 0",
            "`metaplan-proved-prepare` ended without an exit status; its stack may be too small",
        ),
        ("exit 0", "echo 'rejected: too deep for the stack'; exit 3", "too deep for the stack"),
        ("exit 0", "exit 7", "`metaplan-proved-check` ended with status 7"),
    ] {
        let outcome = with_stubs(&designs, &stubs(prepare, check), &[]);
        assert_eq!(outcome.status, 1, "{outcome:#?}");
        let line = format!("NOT proved by a theorem: {reason}\n");
        assert!(outcome.stdout.ends_with(&line), "{reason}: {outcome:#?}");
    }
    let outcome = with_stubs("no/such/directory", &stubs("exit 0", "exit 0"), &[]);
    let line = "NOT proved by a theorem: the files of the certificate cannot be read\n";
    assert!(outcome.status == 30 && outcome.stdout.ends_with(line), "{outcome:#?}");
}

/// If another part than those of the theorem is rejected, the last line does not claim a proof.
#[test]
#[cfg(unix)]
fn no_theorem_is_named_for_a_rejected_certificate() {
    let folder = tempfile::tempdir().expect("a folder");
    let ugv = certificate(folder.path(), &["plan", "missions/ugv.toml"]);
    let programs = stubs("echo evidence", "echo 'proved: the plan of 4 steps is optimal, metric 408'");
    add_stub(programs.path(), "metaplan-proved-knowledge", KNOWN);
    for (component, status) in [(&[] as &[&str], 0), (&["--fail", "c_kinect"], 30)] {
        let arguments = [&["--mission", "missions/ugv.toml"][..], component].concat();
        let outcome = with_stubs(&ugv, &programs, &arguments);
        assert_eq!(outcome.status, status, "{outcome:#?}");
        let refused = "NOT proved by a theorem: the certificate is not verified\n";
        assert_eq!(outcome.stdout.ends_with(refused), status != 0, "{outcome:#?}");
        assert_eq!(outcome.stdout.contains("\nproved: "), status == 0, "{outcome:#?}");
    }
}

/// The proved checker also reads files that the manifest does not list.
#[test]
#[cfg(unix)]
fn programs_open_only_files_that_were_read() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().expect("a folder");
    let [stuck, designs, front] = ["stuck", "designs", "front"].map(|name| {
        let copy = folder.path().join(name);
        copy_folder(&root().join(STORED).join(name), &copy);
        copy
    });
    symlink("/dev/null", stuck.join("plan.txt")).expect("a link");
    symlink("/dev/null", designs.join("front.txt")).expect("a link");
    let second = front.join("2");
    std::fs::remove_dir_all(&second).expect("removed");
    symlink(root().join(STORED).join("front/2"), &second).expect("a link");
    let programs = stubs("echo evidence", "echo 'proved: there is no plan'");
    add_stub(programs.path(), "metaplan-proved-front", "echo 'proved: the front has exactly these values: '");
    for (certificate, reason, status) in [
        (&stuck, "`plan.txt` does not belong to the certificate", 1),
        (&designs, "`front.txt` does not belong to the certificate", 1),
        (&front, "2: there is no such directory", 30),
    ] {
        let outcome = with_stubs(&certificate.display().to_string(), &programs, &[]);
        assert_eq!(outcome.status, status, "{outcome:#?}");
        let line = format!("NOT proved by a theorem: {reason}\n");
        assert!(outcome.stdout.ends_with(&line), "{outcome:#?}");
    }
}

#[test]
#[cfg(unix)]
fn programs_are_called_with_certificate_and_evidence() {
    let designs = format!("{STORED}/designs");
    let prepare = format!("test \"$1\" = {designs} && echo evidence of the first program");
    let check = format!(
        "test \"$1\" = {designs} && grep -q '^evidence of the first program$' \"$2\" && echo 'proved: the plan of 3 steps is optimal, metric 5'"
    );
    let outcome = with_stubs(&designs, &stubs(&prepare, &check), &[]);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let outcome = with_stubs(&designs, &stubs("exec sleep 600", "exit 0"), &["--time-limit", "2"]);
    assert_eq!(outcome.status, 30, "{outcome:#?}");
    let line = "NOT proved by a theorem: `metaplan-proved-prepare` did not end within the limits\n";
    assert!(outcome.stdout.ends_with(line) && outcome.stdout.contains("limits      failed"), "{outcome:#?}");
}

#[test]
fn missing_programs_are_reported_with_a_remedy() {
    let folder = tempfile::tempdir().expect("a folder");
    let proved = format!("--proved={}", folder.path().display());
    let outcome = verify(&["proved/tests/battery", &proved]);
    assert_eq!((outcome.status, outcome.stdout.as_str()), (3, ""), "{outcome:#?}");
    for part in ["M145", "metaplan-proved-check", "sh proved/build.sh", "--proved=FOLDER"] {
        assert!(outcome.stderr.contains(part), "{part}: {outcome:#?}");
    }
}

fn page() -> Option<PathBuf> {
    let page = root().join("docs/verify.html");
    if page.is_file() {
        return Some(page);
    }
    test_resources::missing(Resource::ProvedPage, "docs/verify.html does not exist");
    None
}

type Files = BTreeMap<String, Vec<u8>>;

fn files(certificate: &Path) -> Files {
    let entries = std::fs::read_dir(certificate).expect("a folder").map(|entry| entry.expect("an entry"));
    entries
        .map(|entry| {
            let name = entry.file_name().into_string().expect("UTF-8");
            (name, std::fs::read(entry.path()).expect("a file"))
        })
        .collect()
}

/// Opens the page, gives it these lists of files one after another, and returns what it shows for each. Every
/// second list is dropped on the page; the others are chosen.
fn statuses(browser: &Path, page: &Path, cases: &[Files]) -> Vec<String> {
    let encoded = |files: &Files| -> Value {
        files.iter().map(|(name, bytes)| (name.clone(), Value::from(BASE64_STANDARD.encode(bytes)))).collect()
    };
    let lists: Vec<Value> = cases.iter().map(encoded).collect();
    // Virtual time runs while a worker computes, so that the page has to be busy until the worker has ended.
    let script = format!(
        r#"<pre id="results"></pre><script>
        const busy = () => {{ let x = 0; for (let i = 0; i < 2e7; i++) x = (x * 31 + i) | 0; return new Promise(next => setTimeout(next, 5, x)); }};
        addEventListener("load", async () => {{
          const results = [];
          for (const [index, files] of {}.entries()) {{
            const transfer = new DataTransfer();
            for (const [name, text] of Object.entries(files)) transfer.items.add(new File([Uint8Array.from(atob(text), c => c.charCodeAt(0))], name));
            if (index % 2 === 1) dispatchEvent(new DragEvent("drop", {{ dataTransfer: transfer }}));
            else {{ folder.files = transfer.files; folder.dispatchEvent(new Event("change")); }}
            while (status.dataset.state === "running") await busy();
            results.push(`${{status.dataset.state}}: ${{status.textContent}}`);
          }}
          document.getElementById("results").textContent = JSON.stringify(results);
        }});</script></body>"#,
        Value::from(lists)
    );
    let folder = tempfile::tempdir().expect("a folder");
    let copy = folder.path().join("verify.html");
    let text = std::fs::read_to_string(page).expect("the page").replace("</body>", &script);
    std::fs::write(&copy, text).expect("written");
    let (console, document) = open(browser, &copy, &folder.path().join("profile"));
    assert_eq!(console, Vec::<String>::new());
    let (_, results) = document.split_once("<pre id=\"results\">").expect("the results");
    let (results, _) = results.split_once("</pre>").expect("the end of the results");
    serde_json::from_str(results).unwrap_or_else(|error| panic!("{error}: {results}"))
}

#[test]
fn page_checks_a_certificate_without_a_server() {
    let (Some(browser), Some(page)) = (browser(), page()) else { return };
    let stored = |name: &str| files(&root().join(name));
    let ugv = stored("proved/tests/ugv");
    let mut other_plan = ugv.clone();
    other_plan.insert("plan.txt".to_owned(), Vec::new());
    let mut without_task = ugv.clone();
    without_task.remove("task.json");
    let mut without_manifest = ugv.clone();
    without_manifest.remove("manifest.json");
    let folder = tempfile::tempdir().expect("a folder");
    let certificate = folder.path().join("ugv").display().to_string();
    copy_folder(&root().join("proved/tests/ugv"), Path::new(&certificate));
    change(&certificate, "problem.pddl", &|text| text.replace("(robot_at wp1)", "(robot_at wp2)"));
    let cases = [
        (ugv, "proved: proved: the plan of 4 steps is optimal, metric 408"),
        (stored("proved/tests/lamps"), "proved: proved: the plan of 2 steps is optimal, metric 2"),
        (stored(&format!("{STORED}/stuck")), "proved: proved: there is no plan"),
        (
            stored(&format!("{STORED}/oven")),
            "proved: proved, with timed initial literals: the plan of 2 steps is optimal, metric 3.5",
        ),
        (other_plan, "failed: not proved: plan.txt is not the file that manifest.json lists"),
        (without_task, "failed: not proved: there is no task.json"),
        (
            without_manifest,
            "failed: not proved: there is no manifest.json: choose the folder that plan --certificate has written",
        ),
        (files(Path::new(&certificate)), "failed: not proved: not proved"),
    ];
    let (lists, expected): (Vec<Files>, Vec<&str>) = cases.into_iter().unzip();
    let results = statuses(&browser, &page, &lists);
    assert_eq!(results, expected);
}
