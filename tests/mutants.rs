//! Whether the oracles notice when the planner is wrong, and the simulation of `tests/world` when the loop is.
//!
//! `tests/oracle/mutants.toml` and `tests/world/mutants.toml` name faults. They are put into a copy of the workspace, all into one program, which is asked once for each
//! fault with that one switched on. A fault that no oracle notices is a hole in the oracles, or no fault at all. `MUTANTS` has the numbers of
//! those that are tried, if not all are.

#![expect(
    clippy::print_stdout,
    reason = "what noticed each fault, and after how long, is what this is run for"
)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde::Deserialize;

/// What is copied of the workspace.
const PARTS: [&str; 16] = [
    "Cargo.toml",
    "Cargo.lock",
    "README.md",
    "docs",
    "src",
    "ontology",
    "rules",
    "encodings",
    "crates",
    "integrations",
    ".ci/features",
    "tests",
    "benches",
    "missions",
    "clippy.toml",
    "GLOSSARY.md",
];

/// The variable that switches a fault on; counted from 1.
const SWITCH: &str = "METAPLAN_MUTANT";

/// Where the switch is in a crate.
const LIBRARY: &str = "src/lib.rs";

/// A program of tests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tests {
    /// `tests/oracle`.
    Oracle,
    /// `tests/planta`.
    Planta,
    /// What stands beside the code of the planner, for what only larger tasks come to.
    Unit,
    /// `tests/world`.
    World,
}

/// Tests that judge faults: the program, the name of the tests, and the number of tasks that they judge, or 0.
type Oracle = (Tests, &'static str, u32);

/// Files of faults, each with the tests that have to notice them.
const SUITES: [(&str, &[Oracle]); 2] = [
    ("tests/oracle/mutants.toml", &ORACLES),
    ("tests/world/mutants.toml", &[(Tests::World, "schedule", 1_000)]),
];

/// What is asked of each fault, in order: tests, and how many tasks they judge.
const ORACLES: [Oracle; 10] = [
    (Tests::Oracle, "field::", 0),
    (Tests::Planta, "random::", 0),
    (Tests::Oracle, "front::", 300),
    (Tests::Unit, "search::", 0),
    (Tests::Oracle, "numbers::special::hundreds_of_designs", 0),
    (Tests::Oracle, "temporal::actions_one_after_another", 4_000),
    (Tests::Oracle, "temporal::actions_with_designs", 3_000),
    (Tests::Oracle, "temporal::overlapping_actions", 1_500),
    (Tests::Oracle, "temporal::batteries_that_are_charged", 400),
    (Tests::Oracle, "numbers::random_tasks_with_numbers", 1_500),
];

/// A planner that does not come to an end is wrong, too.
const PATIENCE: Duration = Duration::from_secs(900);

#[derive(Deserialize)]
struct Mutants {
    mutant: Vec<Mutant>,
}

#[derive(Deserialize)]
struct Mutant {
    name: String,
    file: String,
    before: String,
    after: String,
    /// The tests that have to notice it.
    #[serde(skip)]
    oracles: &'static [Oracle],
}

/// Writes a file; what is as it was is left alone, and not compiled again.
fn write(path: &Path, bytes: &[u8]) {
    if std::fs::read(path).ok().as_deref() != Some(bytes) {
        std::fs::create_dir_all(path.parent().expect("a directory")).expect("a directory");
        std::fs::write(path, bytes).expect("a file");
    }
}

/// Removes what the workspace does not have any more.
fn prune(from: &Path, to: &Path) {
    if !from.exists() {
        let removed = if to.is_dir() { std::fs::remove_dir_all(to) } else { std::fs::remove_file(to) };
        removed.expect("it can be removed");
    } else if to.is_dir() {
        for entry in std::fs::read_dir(to).expect("a directory") {
            let name = entry.expect("an entry").file_name();
            prune(&from.join(&name), &to.join(&name));
        }
    }
}

/// Copies what has no faults.
fn copy(from: &Path, to: &Path, faulty: &BTreeMap<PathBuf, String>) {
    if from.is_dir() {
        for entry in std::fs::read_dir(from).expect("a directory") {
            let name = entry.expect("an entry").file_name();
            if name != "target" {
                copy(&from.join(&name), &to.join(&name), faulty);
            }
        }
    } else if !faulty.contains_key(to) {
        write(to, &std::fs::read(from).expect("a file"));
    }
}

fn mutants() -> Vec<Mutant> {
    let read = |(file, oracles): &(&str, &'static [Oracle])| {
        let mutants = toml::from_str::<Mutants>(&original(file)).expect("faults").mutant.into_iter();
        mutants.map(|mutant| Mutant { oracles, ..mutant }).collect::<Vec<_>>()
    };
    SUITES.iter().flat_map(read).collect()
}

/// The files below the workspace that have faults, with all of them, each behind its switch.
fn faulty(mutants: &[Mutant]) -> BTreeMap<String, String> {
    let mut files: BTreeMap<String, String> = BTreeMap::new();
    for (mutant, number) in mutants.iter().zip(1..) {
        let text = files.entry(mutant.file.clone()).or_insert_with(|| original(&mutant.file));
        assert_eq!(
            text.matches(&mutant.before).count(),
            1,
            "`{}`: the place in {}",
            mutant.name,
            mutant.file
        );
        let after = mutant.after.replace("IS_ON", &format!("crate::is_mutant({number})"));
        *text = text.replace(&mutant.before, &after);
    }
    files
}

fn original(file: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).expect("a file")
}

/// A copy of the workspace with all faults.
fn mutated(mutants: &[Mutant]) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let home = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mutants");
    let files = faulty(mutants).into_iter().map(|(file, text)| (home.join(file), text));
    let mut faulty: BTreeMap<PathBuf, String> = files.collect();
    let question = format!(
        "pub(crate) fn is_mutant(number: u32) -> bool {{ \
         static ON: std::sync::OnceLock<u32> = std::sync::OnceLock::new(); \
         let on = || std::env::var(\"{SWITCH}\").ok().and_then(|text| text.parse().ok()).unwrap_or(0); \
         *ON.get_or_init(on) == number }}"
    );
    let crates: BTreeSet<&str> = mutants.iter().filter_map(|own| own.file.split("src/").next()).collect();
    for own in crates {
        let library = format!("{own}{LIBRARY}");
        *faulty.entry(home.join(&library)).or_insert_with(|| original(&library)) += &question;
    }
    for part in PARTS {
        prune(&root.join(part), &home.join(part));
        copy(&root.join(part), &home.join(part), &faulty);
    }
    for (path, text) in faulty {
        write(&path, text.as_bytes());
    }
    home
}

/// Compiles tests of a workspace.
fn compiled(home: &Path, tests: Tests) -> PathBuf {
    let (target, name): (&[&str], _) = match tests {
        Tests::Oracle => (&["--test", "oracle"], "oracle"),
        Tests::Planta => (&["--test", "planta"], "planta"),
        Tests::World => (&["--test", "world"], "world"),
        Tests::Unit => (&["--package", "metaplan-search", "--lib"], "metaplan_search"),
    };
    let output = Command::new(env!("CARGO"))
        .args(["test", "--release", "--offline", "--no-run", "--message-format", "json-render-diagnostics"])
        .args(target)
        .current_dir(home)
        .env("CARGO_TARGET_DIR", home.with_file_name("mutants-target"))
        .env("RUSTFLAGS", "--cap-lints allow")
        .stderr(Stdio::inherit())
        .output()
        .expect("cargo");
    assert!(output.status.success(), "the faults do not compile");
    let text = String::from_utf8_lossy(&output.stdout);
    let last = text.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let programs = last.filter(|line| line["target"]["name"] == name);
    let mut programs = programs.filter_map(|line| line["executable"].as_str().map(PathBuf::from));
    let program = programs.next_back();
    program.expect("a program")
}

/// Whether an oracle is content with the planner when a fault is on.
fn is_content(
    programs: &[(Tests, PathBuf)],
    home: &Path,
    fault: usize,
    (tests, test, tasks): (Tests, &str, u32),
) -> bool {
    let program = programs.iter().find(|(own, _)| *own == tests);
    let mut command = Command::new(&program.expect("it is compiled").1);
    command.arg(test).current_dir(home).env(SWITCH, fault.to_string()).env("ORACLE_STOP", "1");
    if tasks > 0 {
        command.env("ORACLE_TASKS", tasks.to_string()).env("METAPLAN_SCHEDULES", tasks.to_string());
    }
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the oracles");
    let started = Instant::now();
    loop {
        if let Some(status) = child.try_wait().expect("a process") {
            return status.success();
        }
        if started.elapsed() > PATIENCE {
            child.kill().expect("a process");
            child.wait().expect("a process");
            return false;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn every_fault_has_its_place() {
    assert!(faulty(&mutants()).len() > 10);
}

/// Cargo reads no workspace that a member is missing from.
#[test]
fn every_member_is_copied() {
    let manifest: toml::Table = original("Cargo.toml").parse().expect("TOML");
    let members = manifest["workspace"]["members"].as_array().expect("members");
    for member in members {
        let name = member.as_str().expect("a name");
        let is_copied = PARTS.iter().any(|part| Path::new(name).starts_with(part));
        assert!(is_copied, "`{name}` is a member of the workspace, and not copied");
    }
}

#[test]
#[ignore = "takes an hour: compiles the planner again, and judges thousands of tasks for each fault"]
fn every_fault_is_noticed() {
    let mutants = mutants();
    let home = mutated(&mutants);
    let chosen: Option<Vec<usize>> = std::env::var("MUTANTS")
        .ok()
        .map(|text| text.split(',').map(|number| number.parse().expect("a number")).collect());
    let is_chosen = |number: &usize| chosen.as_ref().is_none_or(|chosen| chosen.contains(number));
    let tried: Vec<(&Mutant, usize)> =
        mutants.iter().zip(1..).filter(|(_, number)| is_chosen(number)).collect();
    let mut oracles: Vec<Oracle> = Vec::new();
    for oracle in tried.iter().flat_map(|(mutant, _)| mutant.oracles) {
        if !oracles.contains(oracle) {
            oracles.push(*oracle);
        }
    }
    // Programs that judge none of the chosen faults are not compiled.
    let mut programs: Vec<(Tests, PathBuf)> = Vec::new();
    for (tests, ..) in &oracles {
        if programs.iter().all(|(own, _)| own != tests) {
            programs.push((*tests, compiled(&home, *tests)));
        }
    }
    for oracle in &oracles {
        assert!(is_content(&programs, &home, 0, *oracle), "{} fails without a fault", oracle.1);
    }
    let mut missed = Vec::new();
    for (mutant, number) in &tried {
        let started = Instant::now();
        let noticed = mutant.oracles.iter().find(|oracle| !is_content(&programs, &home, *number, **oracle));
        let by = noticed.map_or("NOBODY", |(_, test, _)| test);
        println!("{number:>3}. {}: noticed by {by} after {:.0?}", mutant.name, started.elapsed());
        if noticed.is_none() {
            missed.push(mutant.name.as_str());
        }
    }
    assert!(
        missed.is_empty(),
        "{} of {} faults are noticed by nobody: {missed:#?}",
        missed.len(),
        tried.len()
    );
}
