//! Tests in which the program is killed repeatedly. In the end, its effects and its state equal those of an
//! undisturbed run. A second process cannot open the journal meanwhile.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use metaplan::journal::{Journal, JournalReport};
use serde_json::Value;

use crate::common::control;
use crate::journal::{POLICY, script, state, uuv_script};

struct Story {
    mission: &'static str,
    script: Vec<String>,
}

impl Story {
    fn acknowledged(&self, sent: usize) -> Vec<u64> {
        let effect = |line: &String| serde_json::from_str::<Value>(line).ok()?.get("effect")?.as_u64();
        self.script[..sent].iter().filter_map(effect).collect()
    }
}

/// Writes the manifest of a shipped mission in which every report counts immediately. The scripts depend on
/// the resulting numbers of effects.
fn manifest(mission: &str) -> PathBuf {
    let root = env!("CARGO_MANIFEST_DIR");
    let text = std::fs::read_to_string(format!("{root}/missions/{mission}.toml")).expect("a manifest");
    let text = text.replace("\"../", &format!("\"{root}/"));
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{mission}-{}.toml", std::process::id()));
    let immediate = "\n[adaptation]\nsettle = 0\nheal_time = 0\nband = 0\n";
    std::fs::write(&file, text + immediate).expect("a file");
    file
}

struct Program {
    child: Child,
    stdin: ChildStdin,
    lines: Receiver<Value>,
}

impl Program {
    fn start(mission: &str, journal: &Path) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_metaplan"))
            .arg("run")
            .arg(manifest(mission))
            .args(["--snapshot-every", "7", "--fsync", "never"])
            .arg("--journal")
            .arg(journal)
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit())
            .spawn()
            .expect("the program starts");
        let stdin = child.stdin.take().expect("a pipe");
        let stdout = BufReader::new(child.stdout.take().expect("a pipe"));
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in stdout.lines().map_while(Result::ok) {
                // The last line of a killed program can be incomplete.
                let Ok(value) = serde_json::from_str(&line) else { break };
                if sender.send(value).is_err() {
                    break;
                }
            }
        });
        Self { child, stdin, lines }
    }
}

#[derive(Debug, Default, PartialEq)]
struct Robot {
    effects: BTreeMap<u64, Value>,
    /// Numbers of effects in the order of their first arrival.
    order: Vec<u64>,
    acknowledged: Vec<u64>,
    state: Value,
}

impl Robot {
    fn take(&mut self, mut line: Value) {
        let Some(number) = line["effect"].as_u64() else { return };
        let object = line.as_object_mut().expect("an object");
        object.remove("line");
        let repeated = object.remove("repeated").is_some();
        assert!(!self.acknowledged.contains(&number), "effect {number} was acknowledged: {line}");
        match self.effects.insert(number, line.clone()) {
            Some(before) => {
                assert!(repeated, "effect {number} comes twice without a word");
                assert_eq!(before, line, "effect {number} has changed");
            }
            None => self.order.push(number),
        }
    }

    fn finish(&mut self, mut program: Program, story: &Story, journal: &Path) {
        self.send_lines(&mut program, story, usize::MAX);
        drop(program.stdin);
        assert!(program.child.wait().expect("it ends").success());
        for line in program.lines {
            self.take(line);
        }
        let mut control = control(story.mission);
        let (mut journal, recovery) =
            Journal::open(journal, POLICY, &mut control).expect("the journal opens");
        journal.begin(&mut control).expect("nothing is to be decided");
        assert_eq!(recovery.cut, 0);
        self.state = state(&control);
    }

    /// Sends at most `patience` + 1 unhandled lines. Waits until each line is handled, except the last one.
    fn send_lines(&mut self, program: &mut Program, story: &Story, patience: usize) {
        let ready = program.lines.recv().expect("a first line");
        assert_eq!(ready["answer"], "ready", "{ready}");
        let handled = ready["seq"].as_u64().unwrap_or(0) as usize;
        self.acknowledged = story.acknowledged(handled);
        self.read_answers(program);
        for (index, line) in story.script.iter().enumerate().skip(handled).take(patience.saturating_add(1)) {
            if writeln!(program.stdin, "{line}").is_err() || index - handled == patience {
                return;
            }
            self.read_answers(program);
            self.acknowledged = story.acknowledged(index + 1);
        }
    }

    fn read_answers(&mut self, program: &Program) {
        for answer in &program.lines {
            let is_last = answer["answer"] == "handled";
            self.take(answer);
            if is_last {
                break;
            }
        }
    }
}

/// Runs a mission to its end and kills the program at most `kills` times. Returns the robot and the number of
/// kills.
fn run(story: &Story, random: &mut fastrand::Rng, kills: usize) -> (Robot, usize) {
    let directory = tempfile::tempdir().expect("a directory");
    let mut robot = Robot::default();
    let mut killed = 0;
    // Some runs end after few kills.
    while killed < kills && (killed == 0 || random.u32(..10) > 0) {
        let mut program = Program::start(story.mission, directory.path());
        // In some cases the program is killed soon after its start, possibly before its first output.
        if random.u32(..8) == 0 {
            std::thread::sleep(Duration::from_micros(random.u64(..20_000)));
        } else {
            robot.send_lines(&mut program, story, random.usize(0..6));
            std::thread::sleep(Duration::from_micros(random.u64(..8_000)));
        }
        // Kill with SIGKILL. Output that the program has already written is still read.
        program.child.kill().expect("it is killed");
        program.child.wait().expect("it ends");
        for line in program.lines {
            robot.take(line);
        }
        killed += 1;
    }
    let program = Program::start(story.mission, directory.path());
    robot.finish(program, story, directory.path());
    (robot, killed)
}

fn check(seed: u64, count: usize) {
    let ugv = Story { mission: "ugv", script: script() };
    let uuv = Story { mission: "uuv", script: uuv_script() };
    let mut random = fastrand::Rng::with_seed(seed);
    let undisturbed = [&ugv, &uuv].map(|story| (story, run(story, &mut random, 0).0));
    for (_, robot) in &undisturbed {
        assert!(robot.effects.len() > 10 && robot.order.is_sorted(), "{robot:#?}");
        assert_eq!(robot.state["reached"], true);
    }
    let (mut killed, mut runs) = (0, 0);
    while killed < count {
        let (story, expected) = &undisturbed[runs % 2];
        let (robot, kills) = run(story, &mut random, count - killed);
        assert_eq!(robot, *expected);
        killed += kills;
        runs += 1;
    }
}

#[test]
fn a_program_killed_at_random_points_recovers() {
    check(11, 12);
}

#[test]
#[ignore = "takes a minute or two"]
fn a_program_killed_at_five_hundred_points_recovers() {
    check(12, 500);
}

#[test]
fn a_recorded_event_without_a_decision_is_counted_and_decided_once() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut control = control("ugv");
    let (mut journal, _) = Journal::open(directory.path(), POLICY, &mut control).expect("the journal opens");
    journal.begin(&mut control).expect("written");
    // The process ends between the record of the event and the record of the reaction.
    let event = r#"{"event":"fact_changed","name":"battery","value":99.1}"#;
    journal.observe(&mut control, event, Duration::ZERO).expect("written");
    drop(journal);

    let mut program = Program::start("ugv", directory.path());
    let ready = program.lines.recv().expect("a first line");
    assert_eq!(ready["lines"], 1, "{ready}");
    let handled = |program: &Program| program.lines.iter().find(|answer| answer["answer"] == "handled");
    assert_eq!(handled(&program).expect("an answer")["line"], 1);
    writeln!(program.stdin, r#"{{"event":"tick"}}"#).expect("it listens");
    assert_eq!(handled(&program).expect("an answer")["line"], 2);
    drop(program.stdin);
    assert!(program.child.wait().expect("it ends").success());

    let entries = JournalReport::read(directory.path()).expect("a journal").entries;
    let positions: Vec<usize> = (0..entries.len()).filter(|&index| entries[index].content == event).collect();
    let [position] = positions[..] else { panic!("{entries:#?}") };
    let next = &entries[position + 1];
    assert!(["reaction", "decision"].contains(&next.kind.as_str()), "{next:?}");
}

#[test]
fn a_second_process_cannot_open_a_journal() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut first = Program::start("ugv", directory.path());
    assert!(first.lines.iter().any(|answer| answer["answer"] == "handled"));
    let second = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_metaplan"));
        command.arg("run").arg(manifest("ugv")).arg("--journal").arg(directory.path());
        let outcome = command.current_dir(env!("CARGO_MANIFEST_DIR")).stdin(Stdio::null()).output();
        let outcome = outcome.expect("the program starts");
        (outcome.status.code(), String::from_utf8_lossy(&outcome.stderr).into_owned())
    };
    let before = std::fs::read(directory.path().join("journal-000000")).expect("a journal");
    let (status, message) = second();
    assert_eq!(status, Some(3), "{message}");
    let owner = format!("another process (number {}) uses the journal", first.child.id());
    assert!(message.contains("M322") && message.contains(&owner), "{message}");
    assert_eq!(std::fs::read(directory.path().join("journal-000000")).expect("a journal"), before);
    // The refused second process has not disturbed the first one.
    writeln!(first.stdin, r#"{{"event":"tick"}}"#).expect("it listens");
    assert!(first.lines.iter().take(6).any(|answer| answer["answer"] == "handled"));
    // The lock of a killed process is released.
    first.child.kill().expect("it is killed");
    first.child.wait().expect("it ends");
    let (status, message) = second();
    assert_eq!(status, Some(0), "{message}");
}
