//! Runs the commands of a page in a shell. All commands of a page become one script, so directories,
//! variables and the status of the last command carry over, as at a prompt. After each command the script
//! prints a separator with the command's status.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use snapbox::{Assert, IntoData as _};
use tempfile::TempDir;
use test_resources::data_path;

use crate::common::{copy_folder, root, verifier, without_progress};
use crate::page::{Block, FIXTURES, Kind};

/// Character that no program prints. The script prints it before and after each status.
const SEPARATOR: char = '\u{1e}';

pub struct Session {
    /// Temporary directory that contains a copy of the project.
    directory: TempDir,
    path: String,
}

struct Step {
    command: String,
    shown: String,
}

pub struct Outcome {
    /// Text of the block with the actual output of its commands.
    pub text: String,
    pub faults: Vec<String>,
}

impl Session {
    pub fn is_possible() -> bool {
        cfg!(unix) && Command::new("sh").args(["-c", "true"]).status().is_ok()
    }

    pub fn new() -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        copy_project(&directory);
        // `metaplan-verify` is the one built with the tests unless `METAPLAN_PROGRAMS` contains one. Installing
        // it would compile everything again with other features.
        let built = verifier().parent().expect("a folder").display().to_string();
        let installed = std::env::var("METAPLAN_PROGRAMS").ok();
        let path = std::env::var("PATH").unwrap_or_default();
        let folders: Vec<String> = installed.into_iter().chain([built, path]).collect();
        Self { directory, path: folders.join(":") }
    }

    pub fn run(&self, blocks: &[&Block]) -> Vec<Outcome> {
        for fixture in FIXTURES
            .iter()
            .filter(|fixture| blocks.iter().any(|block| block.needs.iter().any(|name| name == fixture.name)))
        {
            for (source, target) in fixture.files {
                let (source, target) = (data_path(source), self.place().join(target));
                if source.is_dir() {
                    copy_folder(&source, &target);
                } else {
                    std::fs::copy(source, target).expect("a copy");
                }
            }
        }
        let steps: Vec<Vec<Step>> = blocks.iter().map(|block| steps(block)).collect();
        let mut script = String::from("exec 2>&1\n");
        for (block, steps) in blocks.iter().zip(&steps) {
            for (number, step) in steps.iter().enumerate() {
                let is_last = number + 1 == steps.len();
                let command = &step.command;
                let _ = match block.input_ends_after.filter(|_| is_last) {
                    Some(seconds) => write!(script, "sleep {seconds} | {command}"),
                    None => write!(script, "{command}"),
                };
                // Restores the status for the next command, which may read `$?`.
                script +=
                    "\nstatus_of_step=$?; printf '\\036%s\\036' $status_of_step; (exit $status_of_step)\n";
            }
        }
        let output = self.shell(&script);
        let mut parts = output.split(SEPARATOR);
        let mut results = std::iter::from_fn(|| Some((parts.next()?, parts.next()?.parse::<i32>().ok()?)));
        let mut outcomes = Vec::new();
        for (block, steps) in blocks.iter().zip(&steps) {
            outcomes.push(compare(block, steps, &mut results));
        }
        outcomes
    }

    fn place(&self) -> PathBuf {
        self.directory.path().join("metaplan")
    }

    fn shell(&self, script: &str) -> String {
        let file = self.directory.path().join("script");
        std::fs::write(&file, script).expect("the script is written");
        let mut shell = Command::new("sh");
        shell.arg(file).current_dir(self.place()).env("PATH", &self.path).env_remove("CLICOLOR_FORCE");
        // The output must not depend on the machine's language, or on a repository around the temporary directory.
        shell.env("LC_ALL", "C").env("GIT_CEILING_DIRECTORIES", std::env::temp_dir());
        let output = shell.stdin(Stdio::null()).output().expect("the shell runs");
        String::from_utf8(output.stdout).expect("UTF-8")
    }
}

/// Takes one result, output and status, per command from the iterator.
fn compare<'a>(block: &Block, steps: &[Step], results: &mut impl Iterator<Item = (&'a str, i32)>) -> Outcome {
    let (mut text, mut faults) = (String::new(), Vec::new());
    if steps.is_empty() {
        faults.push("no line begins with `$ `".to_owned());
    }
    for (number, step) in steps.iter().enumerate() {
        let Some((output, status)) = results.next() else {
            faults.push(format!("`{}`: the shell ended before", step.command));
            continue;
        };
        let output = without_progress(output);
        let shows_status = steps.get(number + 1).is_some_and(|next| next.command == "echo $?");
        if status != 0 && !shows_status {
            let detail = if block.kind == Kind::Script { &*output } else { "the page does not show that" };
            faults.push(format!("`{}` ends with status {status}: {detail}", step.command));
        }
        if block.kind == Kind::Script {
            continue;
        }
        let assert = Assert::new().normalize_paths(false);
        let (actual, expected) = (output.into_data(), step.shown.as_str().into_data());
        let _ = writeln!(text, "$ {}", step.command);
        text += &assert.normalize(actual.clone(), expected.clone()).0.render().expect("a text");
        if let Err(error) = assert.try_eq(Some(&step.command), actual, expected) {
            faults.push(error.to_string());
        }
    }
    if block.kind == Kind::Script {
        text.clone_from(&block.text);
    }
    Outcome { text, faults }
}

/// Copies the files that git lists for the project. Without git, copies the folders that the commands of
/// pages use.
fn copy_project(directory: &TempDir) {
    let place = directory.path().join("metaplan");
    let mut git = Command::new("git");
    git.args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"]).current_dir(root());
    let files = git.output().ok().filter(|output| output.status.success());
    let Some(files) = files else {
        for folder in ["missions", "encodings", "ontology", "rules", "docs", "integrations"] {
            copy_folder(&root().join(folder), &place.join(folder));
        }
        return;
    };
    let names = String::from_utf8(files.stdout).expect("UTF-8");
    for name in names.split('\0').filter(|name| !name.is_empty()) {
        let (source, target) = (root().join(name), place.join(name));
        // Removed files are listed until the removal is committed.
        if source.is_file() {
            std::fs::create_dir_all(target.parent().expect("a parent")).expect("a folder");
            std::fs::copy(source, target).expect("a copy");
        }
    }
}

fn steps(block: &Block) -> Vec<Step> {
    if block.kind == Kind::Script {
        return vec![Step { command: block.text.trim_end().to_owned(), shown: String::new() }];
    }
    let mut steps: Vec<Step> = Vec::new();
    for line in block.text.lines() {
        match (line.strip_prefix("$ "), steps.last_mut()) {
            (Some(command), _) => steps.push(Step { command: command.to_owned(), shown: String::new() }),
            (None, Some(step)) => {
                step.shown += line;
                step.shown.push('\n');
            }
            (None, None) => {}
        }
    }
    steps
}
