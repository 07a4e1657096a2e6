//! Mutation tests. The oracles must detect faults of the planner, and the simulation in `tests/world` must
//! detect faults of the MAPE-K loop.
//!
//! `tests/oracle/mutants.toml` and `tests/world/mutants.toml` list the faults. All faults are compiled into
//! one copy of the workspace, each behind a switch, and the tests run once per fault with only this fault
//! switched on. A fault that no oracle detects is a gap in the oracles, or not a fault. The environment
//! variable `MUTANTS` selects faults by their numbers.

#![expect(
    clippy::print_stdout,
    reason = "what noticed each fault, and after how long, is what this is run for"
)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde::Deserialize;

const COPIED_PATHS: [&str; 17] = [
    "Cargo.toml",
    "Cargo.lock",
    "README.md",
    "docs",
    "src",
    "ontology",
    "rules",
    "encodings",
    "crates",
    "examples",
    "integrations",
    ".ci/features",
    "tests",
    "benches",
    "missions",
    "clippy.toml",
    "GLOSSARY.md",
];

/// Environment variable with the number of the active fault, counted from 1.
const SWITCH: &str = "METAPLAN_MUTANT";

/// File of a crate to which the function that queries the switch is added.
const LIBRARY: &str = "src/lib.rs";

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tests {
    Oracle,
    Planta,
    /// Unit tests of the planner, for code that only large tasks reach.
    Unit,
    World,
}

/// Tests that must detect faults: program, filter for test names, and number of tasks (0 for the program's
/// default).
type Oracle = (Tests, &'static str, u32);

const SUITES: [(&str, &[Oracle]); 2] = [
    ("tests/oracle/mutants.toml", &ORACLES),
    ("tests/world/mutants.toml", &[(Tests::World, "violates", 1_000)]),
];

/// Tests that run for each fault of the planner, in this order, until one fails.
const ORACLES: [Oracle; 11] = [
    (Tests::Oracle, "field::", 0),
    (Tests::Planta, "random::", 0),
    (Tests::Oracle, "front::", 300),
    (Tests::Unit, "search::", 0),
    (Tests::Unit, "bounds::", 0),
    (Tests::Oracle, "numbers::special::hundreds_of_designs", 0),
    (Tests::Oracle, "temporal::actions_one_after_another", 4_000),
    (Tests::Oracle, "temporal::actions_with_designs", 3_000),
    (Tests::Oracle, "temporal::overlapping_actions", 1_500),
    (Tests::Oracle, "temporal::batteries_that_are_charged", 400),
    (Tests::Oracle, "numbers::random_tasks_with_numbers", 1_500),
];

/// Time limit of a test program. A planner that does not terminate counts as detected.
const TIMEOUT: Duration = Duration::from_secs(900);

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
    #[serde(skip)]
    oracles: &'static [Oracle],
}

/// Writes a file unless it is unchanged, so that cargo does not compile it again.
fn write(path: &Path, bytes: &[u8]) {
    if std::fs::read(path).ok().as_deref() != Some(bytes) {
        std::fs::create_dir_all(path.parent().expect("a directory")).expect("a directory");
        std::fs::write(path, bytes).expect("a file");
    }
}

/// Removes files below `to` that no longer exist below `from`.
fn prune(from: &Path, to: &Path) {
    if !from.exists() {
        let result = if to.is_dir() { std::fs::remove_dir_all(to) } else { std::fs::remove_file(to) };
        result.expect("it can be removed");
    } else if to.is_dir() {
        for entry in std::fs::read_dir(to).expect("a directory") {
            let name = entry.expect("an entry").file_name();
            prune(&from.join(&name), &to.join(&name));
        }
    }
}

/// Copies a file or folder, except the files whose copies are in `faulty_files`.
fn copy(from: &Path, to: &Path, faulty_files: &BTreeMap<PathBuf, String>) {
    if from.is_dir() {
        for entry in std::fs::read_dir(from).expect("a directory") {
            let name = entry.expect("an entry").file_name();
            // Build results are large and not needed.
            if name != "target" {
                copy(&from.join(&name), &to.join(&name), faulty_files);
            }
        }
    } else if !faulty_files.contains_key(to) {
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

/// Returns the texts of the files with faults, by path relative to the workspace. Each fault is behind its
/// switch.
fn faulty_texts(mutants: &[Mutant]) -> BTreeMap<String, String> {
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

fn mutated(mutants: &[Mutant]) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let home = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mutants");
    let files = faulty_texts(mutants).into_iter().map(|(file, text)| (home.join(file), text));
    let mut faulty_files: BTreeMap<PathBuf, String> = files.collect();
    let switch_function = format!(
        "pub(crate) fn is_mutant(number: u32) -> bool {{ \
         static ON: std::sync::OnceLock<u32> = std::sync::OnceLock::new(); \
         let on = || std::env::var(\"{SWITCH}\").ok().and_then(|text| text.parse().ok()).unwrap_or(0); \
         *ON.get_or_init(on) == number }}"
    );
    let crates: BTreeSet<&str> =
        mutants.iter().filter_map(|mutant| mutant.file.split("src/").next()).collect();
    for crate_folder in crates {
        let library = format!("{crate_folder}{LIBRARY}");
        *faulty_files.entry(home.join(&library)).or_insert_with(|| original(&library)) += &switch_function;
    }
    for part in COPIED_PATHS {
        prune(&root.join(part), &home.join(part));
        copy(&root.join(part), &home.join(part), &faulty_files);
    }
    for (path, text) in faulty_files {
        write(&path, text.as_bytes());
    }
    home
}

fn compile_tests(home: &Path, tests: Tests) -> PathBuf {
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
        // Faults cause warnings, such as unused variables, which must not stop the build.
        .env("RUSTFLAGS", "--cap-lints allow")
        .stderr(Stdio::inherit())
        .output()
        .expect("cargo");
    assert!(output.status.success(), "the faults do not compile");
    let text = String::from_utf8_lossy(&output.stdout);
    let messages = text.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let programs = messages.filter(|line| line["target"]["name"] == name);
    let mut programs = programs.filter_map(|line| line["executable"].as_str().map(PathBuf::from));
    let program = programs.next_back();
    program.expect("a program")
}

/// Fault 0 means no fault.
fn passes(
    programs: &[(Tests, PathBuf)],
    home: &Path,
    fault: usize,
    (tests, test, tasks): (Tests, &str, u32),
) -> bool {
    let program = programs.iter().find(|(program_tests, _)| *program_tests == tests);
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
        if started.elapsed() > TIMEOUT {
            child.kill().expect("a process");
            child.wait().expect("a process");
            return false;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn faults_apply_to_the_current_sources() {
    assert!(faulty_texts(&mutants()).len() > 10);
}

/// All members must be copied, because cargo rejects a workspace with missing members.
#[test]
fn all_members_are_copied() {
    let manifest: toml::Table = original("Cargo.toml").parse().expect("TOML");
    let members = manifest["workspace"]["members"].as_array().expect("members");
    for member in members {
        let name = member.as_str().expect("a name");
        let is_copied = COPIED_PATHS.iter().any(|part| Path::new(name).starts_with(part));
        assert!(is_copied, "`{name}` is a member of the workspace, and not copied");
    }
}

#[test]
#[ignore = "takes an hour: compiles the planner again, and judges thousands of tasks for each fault"]
fn all_faults_are_detected() {
    let mutants = mutants();
    let home = mutated(&mutants);
    let chosen: Option<Vec<usize>> = std::env::var("MUTANTS")
        .ok()
        .map(|text| text.split(',').map(|number| number.parse().expect("a number")).collect());
    let is_chosen = |number: &usize| chosen.as_ref().is_none_or(|chosen| chosen.contains(number));
    let selected: Vec<(&Mutant, usize)> =
        mutants.iter().zip(1..).filter(|(_, number)| is_chosen(number)).collect();
    let mut oracles: Vec<Oracle> = Vec::new();
    for oracle in selected.iter().flat_map(|(mutant, _)| mutant.oracles) {
        if !oracles.contains(oracle) {
            oracles.push(*oracle);
        }
    }
    // Programs without tests for the selected faults are not compiled.
    let mut programs: Vec<(Tests, PathBuf)> = Vec::new();
    for (tests, ..) in &oracles {
        if programs.iter().all(|(program_tests, _)| program_tests != tests) {
            programs.push((*tests, compile_tests(&home, *tests)));
        }
    }
    // The tests must pass without a fault, otherwise their failure proves nothing.
    for oracle in &oracles {
        assert!(passes(&programs, &home, 0, *oracle), "{} fails without a fault", oracle.1);
    }
    let mut missed = Vec::new();
    for (mutant, number) in &selected {
        let started = Instant::now();
        let detecting_oracle =
            mutant.oracles.iter().find(|oracle| !passes(&programs, &home, *number, **oracle));
        let test_name = detecting_oracle.map_or("NOBODY", |(_, test, _)| test);
        println!("{number:>3}. {}: noticed by {test_name} after {:.0?}", mutant.name, started.elapsed());
        if detecting_oracle.is_none() {
            missed.push(mutant.name.as_str());
        }
    }
    assert!(
        missed.is_empty(),
        "{} of {} faults are noticed by nobody: {missed:#?}",
        missed.len(),
        selected.len()
    );
}
