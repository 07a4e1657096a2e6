//! Functions that run the program as a user would, and that prepare files for it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use serde_json::Value;

#[derive(Debug, PartialEq, Eq)]
pub struct Outcome {
    pub status: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Outcome {
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error}: {self:#?}"))
    }
}

/// Returns the messages on standard error, one line `PLACE: SEVERITY[CODE]: SENTENCE` each, without source
/// lines and help.
pub fn headlines(stderr: &str) -> String {
    let mut lines: Vec<String> = Vec::new();
    for line in stderr.lines() {
        let is_head = ["error[", "warning["].iter().any(|word| line.starts_with(word));
        match (line.trim_start().strip_prefix("┌─ "), lines.last_mut()) {
            _ if is_head => lines.push(line.to_owned()),
            (Some(place), Some(head)) => *head = format!("{place}: {head}"),
            _ => {}
        }
    }
    lines.iter().fold(String::new(), |text, line| text + line + "\n")
}

/// Removes progress lines, such as `planning, 3 s: cost 4`. Progress lines are printed at intervals of
/// seconds, so their number depends on the load of the machine.
pub fn without_progress(text: &str) -> String {
    let is_progress = |line: &&str| {
        let Some((word, remainder)) = line.trim_end().split_once(", ") else { return false };
        let digits = remainder.trim_start_matches(|character: char| character.is_ascii_digit());
        let is_word = !word.is_empty() && word.chars().all(|character| character.is_ascii_lowercase());
        is_word && digits.len() < remainder.len() && (digits == " s" || digits.starts_with(" s: "))
    };
    text.split_inclusive('\n').filter(|line| !is_progress(line)).collect()
}

pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

pub fn metaplan(arguments: &[&str]) -> Outcome {
    metaplan_in(&root(), arguments, "")
}

/// Returns the path of the tested program: built by cargo for the tests, or `metaplan` in the directory
/// `METAPLAN_PROGRAMS`. CI sets the directory of `cargo install`, because these tests take a fraction of the
/// time with a release build.
pub fn program() -> PathBuf {
    match std::env::var_os("METAPLAN_PROGRAMS") {
        Some(directory) => Path::new(&directory).join(format!("metaplan{}", std::env::consts::EXE_SUFFIX)),
        None => PathBuf::from(env!("CARGO_BIN_EXE_metaplan")),
    }
}

pub fn metaplan_in(directory: &Path, arguments: &[&str], input: &str) -> Outcome {
    outcome(&program(), directory, arguments, input)
}

/// Runs `metaplan verify` and `metaplan-verify` in a directory. Asserts that their outcomes are equal and
/// returns the outcome.
pub fn verify_in(directory: &Path, arguments: &[&str]) -> Outcome {
    let arguments_of_subcommand: Vec<&str> = ["verify"].iter().chain(arguments).copied().collect();
    let subcommand = metaplan_in(directory, &arguments_of_subcommand, "");
    let standalone = outcome(verifier(), directory, arguments, "");
    assert_eq!(subcommand, standalone, "`metaplan verify` and `metaplan-verify`: {arguments:?}");
    subcommand
}

/// Returns the path of the program `metaplan-verify`. Cargo does not build this program for these tests,
/// because it belongs to another package. It is therefore built here, through the test of its package, with
/// the same options. This avoids a second compilation of the dependencies.
pub fn verifier() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        let tested_program = Path::new(env!("CARGO_BIN_EXE_metaplan"));
        let folder = tested_program.parent().expect("a folder");
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(["test", "--no-run", "--quiet", "--offline", "--locked", "--test", "verifier"]);
        if folder.ends_with("release") {
            cargo.arg("--release");
        }
        cargo.arg("--target-dir").arg(folder.parent().expect("a folder")).current_dir(root());
        let output = cargo.output().expect("cargo runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        folder.join(format!("metaplan-verify{}", std::env::consts::EXE_SUFFIX))
    })
}

pub fn outcome(program: &Path, directory: &Path, arguments: &[&str], input: &str) -> Outcome {
    use std::io::{Seek as _, Write as _};
    // Standard input is a file instead of a pipe, so that `run` answers each line before it reads the next
    // one.
    let mut stdin = tempfile::tempfile().expect("a file");
    stdin.write_all(input.as_bytes()).and_then(|()| stdin.rewind()).expect("written");
    let child = Command::new(program)
        .args(arguments)
        .current_dir(directory)
        .stdin(Stdio::from(stdin))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let output = child.wait_with_output().expect("the program ends");
    let text = |bytes: Vec<u8>| {
        let text = String::from_utf8(bytes).expect("UTF-8");
        // Messages and tables name files with the separator of the platform; JSON escapes characters with it.
        let is_json = text.starts_with(['{', '[']);
        if cfg!(windows) && !is_json { text.replace('\\', "/") } else { text }
    };
    Outcome {
        status: output.status.code().unwrap_or(-1),
        stdout: text(output.stdout),
        stderr: without_progress(&text(output.stderr)),
    }
}

/// Returns the processor time of a run in seconds (user and system), as the median of three runs. Needs
/// python3.
pub fn processor_time(directory: &Path, arguments: &[&str]) -> f64 {
    let script = "import resource as r, subprocess as s, sys\n\
        def once():\n \
        u = lambda: sum(r.getrusage(r.RUSAGE_CHILDREN)[:2])\n \
        t = u()\n \
        s.run(sys.argv[1:], stdout=s.DEVNULL, stderr=s.DEVNULL)\n \
        return u() - t\n\
        print(sorted(once() for _ in range(3))[1])";
    let mut python = Command::new("python3");
    let output = python.args(["-c", script]).arg(program()).args(arguments).current_dir(directory).output();
    let output = output.expect("python3 runs");
    let text = String::from_utf8_lossy(&output.stdout);
    text.trim().parse().unwrap_or_else(|error| panic!("{error}: {output:?}"))
}

pub fn copy_of_mission(name: &str) -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let files = [
        format!("missions/{name}.toml"),
        format!("encodings/{name}/domain.pddl"),
        format!("encodings/{name}/problem.pddl"),
        format!("ontology/kb/{name}.ttl"),
        "ontology/kb/tomasys.ttl".to_owned(),
    ];
    for file in files {
        let target = directory.path().join(&file);
        std::fs::create_dir_all(target.parent().expect("a parent")).expect("a directory");
        std::fs::copy(root().join(&file), target).expect("a copy");
    }
    directory
}

pub fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder").map(|entry| entry.expect("an entry")) {
        let (from, to) = (entry.path(), to.join(entry.file_name()));
        if from.is_dir() {
            copy_folder(&from, &to);
        } else {
            std::fs::copy(from, to).expect("a copy");
        }
    }
}

/// Replaces all occurrences. Panics without any occurrence.
pub fn edit(directory: &Path, file: &str, old: &str, new: &str) {
    let path = directory.join(file);
    let text = std::fs::read_to_string(&path).expect("the file is read");
    assert!(text.contains(old), "{file} has no `{old}`");
    std::fs::write(path, text.replace(old, new)).expect("the file is written");
}

/// Formats the steps of an answer as `action arguments | design, design`. Functions and designs are removed
/// from the arguments.
pub fn steps(answer: &Value) -> Vec<String> {
    let step = |step: &Value| {
        let configuration = step["configuration"].as_object().expect("a configuration");
        let designs: Vec<&str> = configuration.values().filter_map(Value::as_str).collect();
        // Functions and designs can also be parameters of the action.
        let is_configured = |a: &&str| designs.contains(a) || configuration.contains_key(*a);
        let arguments = step["arguments"].as_array().expect("arguments").iter().filter_map(Value::as_str);
        let route: Vec<&str> = arguments.filter(|argument| !is_configured(argument)).collect();
        format!(
            "{} {} | {}",
            step["action"].as_str().expect("an action"),
            route.join(" "),
            designs.join(", ")
        )
    };
    answer["steps"].as_array().expect("steps").iter().map(step).collect()
}

/// Returns `true` if this process ignores a signal, as background processes of a shell do. Child processes
/// inherit this.
#[cfg(unix)]
pub fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask >> (signal - 1) & 1 == 1
}
