//! `metaplan run` with lines that come as they happen: what is safe comes before any plan, and all that waits is read first.

use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::common::{program, root};

/// A loop with a pipe.
struct Run {
    child: Child,
    input: ChildStdin,
    answers: Receiver<(Instant, Value)>,
}

impl Run {
    fn new(arguments: &[&str]) -> Self {
        let mut child = Command::new(program())
            .arg("run")
            .args(arguments)
            .current_dir(root())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let (input, output) = (child.stdin.take().expect("a pipe"), child.stdout.take().expect("a pipe"));
        let (sender, answers) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(output).lines() {
                let answer = serde_json::from_str(&line.expect("a line")).expect("JSON");
                if sender.send((Instant::now(), answer)).is_err() {
                    return;
                }
            }
        });
        Self { child, input, answers }
    }

    fn say(&mut self, line: &str) {
        writeln!(self.input, "{line}").expect("the program reads");
    }

    /// The answers up to one that fits, signs of life apart, with the time of that one.
    fn until(&self, fits: impl Fn(&Value) -> bool) -> (Vec<Value>, Instant) {
        let mut all = Vec::new();
        loop {
            let (time, answer) = self.answers.recv_timeout(Duration::from_secs(120)).expect("an answer");
            let is_it = fits(&answer);
            if answer["answer"] != "planning" {
                all.push(answer);
            }
            if is_it {
                return (all, time);
            }
        }
    }

    fn end(self) -> Vec<Value> {
        let Self { mut child, input, answers } = self;
        drop(input);
        let rest = answers.iter().map(|(_, answer)| answer).collect();
        assert!(child.wait().expect("the program ends").success());
        rest
    }
}

fn is(kind: &'static str, line: u64) -> impl Fn(&Value) -> bool {
    move |answer| answer["answer"] == kind && answer["line"] == line
}

fn failed(component: &str) -> String {
    format!(r#"{{"event":"component_status","component":"{component}","status":"FALSE"}}"#)
}

/// Each plan of this mission takes its four seconds. The losses are answered before, and the plan is made for what is known last.
#[test]
fn a_lost_design_is_answered_before_a_plan_is_looked_for() {
    let journal = tempfile::tempdir().expect("a directory");
    let directory = journal.path().join("journal");
    let directory = directory.to_str().expect("a name");
    let mut run = Run::new(&["tests/program/ferry/mission.toml", "--journal", directory]);
    let (start, _) = run.until(is("handled", 0));
    let action = start.iter().find(|answer| answer["answer"] == "request_action").expect("an action");
    let configuration = action["configuration"].as_object().expect("designs");
    let steers = configuration.contains_key("f_steer");
    let lost = if steers { ["c_eye", "c_gps"] } else { ["c_winch", "c_pump"] };
    let begun = Instant::now();
    for component in lost {
        run.say(&failed(component));
    }
    let is_safe = |answer: &Value| {
        answer["line"] == 2 && ["reconfigure", "suspend_action"].iter().any(|kind| answer["answer"] == *kind)
    };
    let (answers, time) = run.until(is_safe);
    // Far below the time limit of plans; the bound itself is measured in the library.
    assert!(time - begun < Duration::from_secs(2), "{:?}", time - begun);
    let kinds: Vec<&str> = answers.iter().filter_map(|answer| answer["answer"].as_str()).collect();
    assert!(!kinds.contains(&"plan_requested"), "{kinds:?}");
    assert_eq!(kinds[0], "inferred");
    let (plan, _) = run.until(is("handled", 2));
    for step in plan.iter().filter_map(|answer| answer["steps"].as_array()).flatten() {
        let text = step["configuration"].to_string();
        assert!(!text.contains("fd_gps") && !text.contains("fd_eye") || !steers, "{text}");
    }
    assert!(run.end().is_empty());
    // What was decided beside the input is decided again from the journal.
    let again = Run::new(&["tests/program/ferry/mission.toml", "--journal", directory]);
    let (ready, _) = again.until(|answer| answer["answer"] == "ready");
    assert_eq!((&ready[0]["resumed"], &ready[0]["lines"]), (&Value::Bool(true), &Value::from(2)));
    again.end();
}

/// A recovery that a filter has held back counts, and a better plan is looked for, without a further line.
#[test]
fn time_passes_without_a_line() {
    let directory = tempfile::tempdir().expect("a directory");
    let manifest = directory.path().join("ugv.toml");
    let text = std::fs::read_to_string(root().join("missions/ugv.toml")).expect("a manifest");
    let text = text.replace("\"../", &format!("\"{}/", root().display()));
    let quick = "\n[adaptation]\nheal_time = 0.2\nsettle = 0.3\n";
    std::fs::write(&manifest, text + quick).expect("a file");
    let (manifest, journal) = (manifest.display().to_string(), directory.path().join("journal"));
    let journal = journal.display().to_string();
    let mut run = Run::new(&[&manifest, "--journal", &journal]);
    run.until(is("handled", 0));
    run.say(&failed("c_kinect"));
    run.until(is("handled", 1));
    run.say(&failed("c_kinect").replace("FALSE", "RECOVERED"));
    let (answers, _) = run.until(is("filtered", 2));
    assert_eq!(answers.last().expect("an answer")["because"], "heal");
    run.until(is("inferred", 2));
    let (answers, _) = run.until(is("plan_requested", 2));
    assert_eq!(answers.last().expect("an answer")["because"][0], "there may be a better plan");
    run.until(is("plan_found", 2));
    run.end();
    // Time that passed is a part of the journal, and not a line.
    let again = Run::new(&[&manifest, "--journal", &journal]);
    let (ready, _) = again.until(|answer| answer["answer"] == "ready");
    assert_eq!((&ready[0]["resumed"], &ready[0]["lines"]), (&Value::Bool(true), &Value::from(2)));
    again.end();
}

/// Who pipes a script in, with reports on actions to come, gets the answers to it.
#[test]
fn a_script_can_be_piped_in() {
    let mut run = Run::new(&["missions/ugv.toml"]);
    run.say(r#"{"event":"action_succeeded","action":1}"#);
    run.say(r#"{"event":"action_succeeded","action":2}"#);
    let answers = run.end();
    let kinds: Vec<String> = answers.iter().map(|own| format!("{} {}", own["line"], own["answer"])).collect();
    let expected = [
        "null \"ready\"",
        "0 \"plan_requested\"",
        "0 \"plan_found\"",
        "0 \"reconfigure\"",
        "0 \"request_action\"",
        "0 \"handled\"",
        "1 \"request_action\"",
        "1 \"handled\"",
        "2 \"request_action\"",
        "2 \"handled\"",
    ];
    let kinds: Vec<&String> = kinds.iter().filter(|kind| !kind.contains("planning")).collect();
    assert_eq!(kinds, expected);
}
