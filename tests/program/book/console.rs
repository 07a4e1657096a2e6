//! A session of a shell, as a page shows it.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use snapbox::{Assert, IntoData as _};
use tempfile::TempDir;

use crate::common::{copy_folder, root, verifier, without_progress};

/// What a session finds in its directory, which is not the project's, so that commands may write.
pub const FILES: [&str; 8] = [
    "missions",
    "encodings/ugv",
    "encodings/uuv",
    "encodings/camara_like",
    "ontology/kb",
    "rules/swrl",
    "docs",
    "ros/examples",
];

pub struct Session {
    _directory: TempDir,
    /// Where the next command runs.
    place: PathBuf,
    path: String,
    /// Of the last command.
    status: i32,
}

/// A command with what the page shows as its answer.
struct Step {
    command: String,
    shown: String,
}

impl Session {
    pub fn can_be_held() -> bool {
        cfg!(unix) && Command::new("sh").args(["-c", "true"]).status().is_ok()
    }

    pub fn new() -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        for folder in FILES {
            copy_folder(&root().join(folder), &directory.path().join(folder));
        }
        let programs = verifier().parent().expect("a folder").display().to_string();
        let path = format!("{programs}:{}", std::env::var("PATH").unwrap_or_default());
        Self { place: directory.path().to_owned(), _directory: directory, path, status: 0 }
    }

    /// Runs the commands of a block. Returns the block with the answers that came, and what is wrong with those that it shows.
    pub fn hold(&mut self, block: &str) -> (String, Vec<String>) {
        let (mut text, mut faults) = (String::new(), Vec::new());
        let steps = steps(block);
        if steps.is_empty() {
            faults.push("no line begins with `$ `".to_owned());
        }
        for (number, step) in steps.iter().enumerate() {
            let _ = writeln!(text, "$ {}", step.command.replace('\n', "\n> "));
            let Some(answer) = self.run(&step.command) else {
                text += &step.shown;
                continue;
            };
            let assert = Assert::new().normalize_paths(false);
            let (actual, expected) = (answer.into_data(), step.shown.as_str().into_data());
            text += &assert.normalize(actual.clone(), expected.clone()).0.render().expect("a text");
            if let Err(error) = assert.try_eq(Some(&step.command), actual, expected) {
                faults.push(error.to_string());
            }
            let asked = steps.get(number + 1).is_some_and(|next| next.command == "echo $?");
            if self.status != 0 && !asked {
                faults.push(format!(
                    "`{}` ends with status {}, and the page does not show that",
                    step.command, self.status
                ));
            }
        }
        (text, faults)
    }

    /// What a command writes, standard error among it; nothing where it cannot be run here.
    fn run(&mut self, command: &str) -> Option<String> {
        if let Some(folder) = command.strip_prefix("cd ") {
            self.place.push(folder);
            return Some(String::new());
        }
        if command.contains("python3") && Command::new("python3").arg("--version").output().is_err() {
            println!("skipped: there is no python3: {command}");
            return None;
        }
        let command = command.replace("cargo run --release -- ", "metaplan ");
        let script = format!("exec 2>&1\n(exit {})\n{command}", self.status);
        let mut shell = Command::new("sh");
        shell
            .args(["-c", &script])
            .current_dir(&self.place)
            .env("PATH", &self.path)
            .env_remove("CLICOLOR_FORCE");
        // Whatever the machine is set to, and wherever temporary files lie.
        shell.env("LC_ALL", "C").env("GIT_CEILING_DIRECTORIES", std::env::temp_dir());
        let output = shell.stdin(Stdio::null()).output().expect("the shell runs");
        self.status = output.status.code().unwrap_or(-1);
        Some(without_progress(&String::from_utf8(output.stdout).expect("UTF-8")))
    }
}

fn steps(block: &str) -> Vec<Step> {
    let mut found: Vec<Step> = Vec::new();
    for line in block.lines() {
        match (line.strip_prefix("$ "), line.strip_prefix("> "), found.last_mut()) {
            (Some(command), ..) => found.push(Step { command: command.to_owned(), shown: String::new() }),
            (None, Some(further), Some(step)) if step.shown.is_empty() => {
                step.command.push('\n');
                step.command += further;
            }
            (None, _, Some(step)) => {
                step.shown += line;
                step.shown.push('\n');
            }
            (None, _, None) => {}
        }
    }
    found
}
