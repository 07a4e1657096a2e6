//! The program killed again and again: what it does in the end is what it does undisturbed.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use serde_json::Value;

use crate::journal::script;

/// A running program, and what it writes.
struct Program {
    child: Child,
    stdin: ChildStdin,
    lines: Receiver<Value>,
}

impl Program {
    fn start(journal: &Path) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_metaplan"))
            .args(["run", "missions/ugv.toml", "--snapshot-every", "7", "--fsync", "never", "--journal"])
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
                // The last line of a killed program may not be whole.
                let Ok(value) = serde_json::from_str(&line) else { break };
                if sender.send(value).is_err() {
                    break;
                }
            }
        });
        Self { child, stdin, lines }
    }
}

/// What has left the program.
#[derive(Debug, Default)]
struct Robot {
    effects: BTreeMap<u64, Value>,
    acknowledged: Vec<u64>,
}

impl Robot {
    fn take(&mut self, mut line: Value) {
        let Some(number) = line["effect"].as_u64() else { return };
        let object = line.as_object_mut().expect("an object");
        object.remove("line");
        let repeated = object.remove("repeated").is_some();
        assert!(!self.acknowledged.contains(&number), "effect {number} was acknowledged: {line}");
        let before = self.effects.insert(number, line.clone());
        assert!(before.is_none() || repeated, "effect {number} comes twice without a word");
        assert!(before.is_none_or(|before| before == line), "effect {number} has changed");
    }
}

/// Runs the script, killing the program `kills` times at most.
fn run(random: &mut fastrand::Rng, kills: &mut usize) -> Robot {
    let directory = tempfile::tempdir().expect("a directory");
    let script = script();
    let mut robot = Robot::default();
    loop {
        let mut program = Program::start(directory.path());
        let victim = *kills > 0;
        let patience = if victim { random.usize(0..6) } else { usize::MAX };
        // Sometimes it dies before it has said a word.
        if victim && random.u32(..8) == 0 {
            std::thread::sleep(Duration::from_micros(random.u64(..20_000)));
        } else {
            talk(&mut program, &script, patience, &mut robot);
            if victim {
                std::thread::sleep(Duration::from_micros(random.u64(..8_000)));
            }
        }
        if !victim {
            drop(program.stdin);
            assert!(program.child.wait().expect("it ends").success());
            for line in program.lines {
                robot.take(line);
            }
            return robot;
        }
        // SIGKILL; what was written before is still read.
        program.child.kill().expect("it is killed");
        program.child.wait().expect("it ends");
        for line in program.lines {
            robot.take(line);
        }
        *kills -= 1;
        if random.u32(..10) == 0 {
            // Now and then one run is enough.
            let mut none = 0;
            std::mem::swap(kills, &mut none);
            let last = finish(directory.path(), &script, robot);
            std::mem::swap(kills, &mut none);
            return last;
        }
    }
}

fn finish(directory: &Path, script: &[String], mut robot: Robot) -> Robot {
    let mut program = Program::start(directory);
    talk(&mut program, script, usize::MAX, &mut robot);
    drop(program.stdin);
    assert!(program.child.wait().expect("it ends").success());
    for line in program.lines {
        robot.take(line);
    }
    robot
}

/// Sends the lines that were not handled, waiting for each but the last of `patience` to be handled.
fn talk(program: &mut Program, script: &[String], patience: usize, robot: &mut Robot) {
    let ready = program.lines.recv().expect("a first line");
    assert_eq!(ready["answer"], "ready", "{ready}");
    let known = ready["seq"].as_u64().unwrap_or(0) as usize;
    for (index, line) in script.iter().enumerate().skip(known).take(patience.saturating_add(1)) {
        if writeln!(program.stdin, "{line}").is_err() {
            return;
        }
        if index - known == patience {
            return;
        }
        for answer in &program.lines {
            let is_last = answer["answer"] == "handled";
            robot.take(answer);
            if is_last {
                break;
            }
        }
        let event: Value = serde_json::from_str(line).expect("an event");
        robot.acknowledged.extend(event["effect"].as_u64());
    }
}

fn check(seed: u64, count: usize) {
    let mut none = 0;
    let mut random = fastrand::Rng::with_seed(seed);
    let undisturbed = run(&mut random, &mut none);
    assert!(undisturbed.effects.len() > 10, "{undisturbed:#?}");
    let mut kills = count;
    while kills > 0 {
        let robot = run(&mut random, &mut kills);
        assert_eq!(robot.effects, undisturbed.effects);
    }
}

#[test]
fn killed_at_random_points() {
    check(11, 12);
}

#[test]
#[ignore = "takes a minute or two"]
fn killed_at_five_hundred_random_points() {
    check(12, 500);
}
