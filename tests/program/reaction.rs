//! Tests of reactions of `metaplan run`: safe effects are sent before planning starts, and pending input is read first.

use std::cell::Cell;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::common::{program, root};

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

    fn send(&mut self, line: &str) {
        writeln!(self.input, "{line}").expect("the program reads");
    }

    /// Returns the answers up to the first one that satisfies the predicate, without progress reports, and
    /// the time of this last answer.
    fn until(&self, is_wanted: impl Fn(&Value) -> bool) -> (Vec<Value>, Instant) {
        let mut received = Vec::new();
        loop {
            let (time, answer) = self.answers.recv_timeout(Duration::from_secs(120)).expect("an answer");
            let is_last = is_wanted(&answer);
            if answer["answer"] != "planning" {
                received.push(answer);
            }
            if is_last {
                return (received, time);
            }
        }
    }

    fn end(self) -> Vec<Value> {
        let Self { mut child, input, answers } = self;
        drop(input);
        let remaining_answers = answers.iter().map(|(_, answer)| answer).collect();
        assert!(child.wait().expect("the program ends").success());
        remaining_answers
    }
}

fn is_answer(kind: &'static str, line: u64) -> impl Fn(&Value) -> bool {
    move |answer| answer["answer"] == kind && answer["line"] == line
}

fn failure_event(component: &str) -> String {
    format!(r#"{{"event":"component_status","component":"{component}","status":"FALSE"}}"#)
}

/// Planning takes the full limit of 4 s in this mission. Lost designs are answered before planning, and the
/// plan takes all losses into account.
#[test]
fn lost_designs_are_answered_before_planning() {
    let journal = tempfile::tempdir().expect("a directory");
    let directory = journal.path().join("journal");
    let directory = directory.to_str().expect("a name");
    let mut run = Run::new(&["tests/program/ferry/mission.toml", "--journal", directory]);
    let (start, _) = run.until(is_answer("handled", 0));
    let action = start.iter().find(|answer| answer["answer"] == "request_action").expect("an action");
    let configuration = action["configuration"].as_object().expect("designs");
    let is_steering = configuration.contains_key("f_steer");
    let components = if is_steering { ["c_eye", "c_gps"] } else { ["c_winch", "c_pump"] };
    let started = Instant::now();
    for component in components {
        run.send(&failure_event(component));
    }
    let is_safe = |answer: &Value| {
        answer["line"] == 2 && ["reconfigure", "suspend_action"].iter().any(|kind| answer["answer"] == *kind)
    };
    let (answers, time) = run.until(is_safe);
    // The bound is far below the time limit of planning. The exact bound is measured in tests of the library.
    assert!(time - started < Duration::from_secs(2), "{:?}", time - started);
    let kinds: Vec<&str> = answers.iter().filter_map(|answer| answer["answer"].as_str()).collect();
    assert!(!kinds.contains(&"plan_requested"), "{kinds:?}");
    assert_eq!(kinds[0], "inferred");
    let (plan, _) = run.until(is_answer("handled", 2));
    for step in plan.iter().filter_map(|answer| answer["steps"].as_array()).flatten() {
        let text = step["configuration"].to_string();
        assert!(!text.contains("fd_gps") && !text.contains("fd_eye") || !is_steering, "{text}");
    }
    assert!(run.end().is_empty());
    // Decisions that were made while input was pending are replayed from the journal.
    let resumed = Run::new(&["tests/program/ferry/mission.toml", "--journal", directory]);
    let (ready, _) = resumed.until(|answer| answer["answer"] == "ready");
    assert_eq!((&ready[0]["resumed"], &ready[0]["lines"]), (&Value::Bool(true), &Value::from(2)));
    resumed.end();
}

/// Writes the manifest of the UGV with settings of the adaptation to a directory. Returns its path.
fn ugv_with(settings: &str, directory: &Path) -> String {
    let manifest = directory.join("ugv.toml");
    let text = std::fs::read_to_string(root().join("missions/ugv.toml")).expect("a manifest");
    let text = text.replace("\"../", &format!("\"{}/", root().display()));
    std::fs::write(&manifest, format!("{text}\n[adaptation]\n{settings}\n")).expect("a file");
    manifest.display().to_string()
}

#[test]
fn timers_run_without_input() {
    let directory = tempfile::tempdir().expect("a directory");
    let manifest = ugv_with("heal_time = 0.2\nsettle = 0.3", directory.path());
    let journal = directory.path().join("journal").display().to_string();
    let mut run = Run::new(&[&manifest, "--journal", &journal]);
    run.until(is_answer("handled", 0));
    // A refused line does not replace the clock by its time.
    run.send(r#"{"event":"tick","time":1764535144}"#);
    run.until(is_answer("error", 1));
    run.send(&failure_event("c_kinect"));
    run.until(is_answer("handled", 2));
    run.send(&failure_event("c_kinect").replace("FALSE", "RECOVERED"));
    let (answers, _) = run.until(is_answer("filtered", 3));
    assert_eq!(answers.last().expect("an answer")["because"], "heal");
    run.until(is_answer("inferred", 3));
    let (answers, _) = run.until(is_answer("plan_requested", 3));
    assert_eq!(answers.last().expect("an answer")["because"][0], "there may be a better plan");
    run.until(is_answer("plan_found", 3));
    run.end();
    // Elapsed time is part of the journal, but does not count as an input line.
    let resumed = Run::new(&[&manifest, "--journal", &journal]);
    let (ready, _) = resumed.until(|answer| answer["answer"] == "ready");
    assert_eq!((&ready[0]["resumed"], &ready[0]["lines"]), (&Value::Bool(true), &Value::from(3)));
    resumed.end();
}

/// The program waits while its answers are not read. Lines that arrive in time do so although they are handled later.
#[test]
fn lines_that_wait_have_the_time_of_their_arrival() {
    let directory = tempfile::tempdir().expect("a directory");
    let manifest = ugv_with("deadline = 1.5\ndeadline_factor = 0.001", directory.path());
    let mut child = Command::new(program())
        .args(["run", &manifest])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let (mut input, mut output) =
        (child.stdin.take().expect("a pipe"), BufReader::new(child.stdout.take().expect("a pipe")));
    let mut read_until = |line: u64| {
        let mut text = String::new();
        while !text.lines().last().is_some_and(|last| {
            let answer: Value = serde_json::from_str(last).expect("JSON");
            is_answer("handled", line)(&answer)
        }) {
            assert!(output.read_line(&mut text).expect("answers") > 0, "{text}");
        }
        text
    };
    let mut send = |line: &str| writeln!(input, "{line}").expect("the program reads");
    let progress =
        |fraction: f64| format!(r#"{{"event":"action_progress","action":1,"fraction":{fraction}}}"#);
    // The answer to this line is longer than a pipe.
    let long = format!(r#"{{"event":"{}"}}"#, "x".repeat(300_000));
    read_until(0);
    send(&progress(0.1));
    send(&long);
    for step in 1..=12 {
        std::thread::sleep(Duration::from_millis(250));
        send(r#"{"event":"tick"}"#);
        send(&progress(0.1 + 0.01 * f64::from(step)));
    }
    let text = read_until(26);
    assert!(!text.contains("overdue"), "{text}");
    // The deadline of the second action begins when it is requested.
    send(&long);
    std::thread::sleep(Duration::from_millis(250));
    send(r#"{"event":"action_succeeded","action":1}"#);
    std::thread::sleep(Duration::from_secs(4));
    let text = read_until(28);
    assert!(text.contains("request_action"), "{text}");
    std::thread::sleep(Duration::from_millis(700));
    send(r#"{"event":"tick"}"#);
    let text = read_until(29);
    assert!(!text.contains("overdue"), "{text}");
    drop(input);
    assert!(child.wait().expect("the program ends").success());
}

/// A search that is stopped because the plan has become valid again does not count as one of three stopped in a row.
#[test]
fn a_search_is_stopped_after_earlier_ones_that_became_unnecessary() {
    let directory = tempfile::tempdir().expect("a directory");
    let folder = root().join("tests/program/ferry");
    let text = std::fs::read_to_string(folder.join("mission.toml")).expect("a manifest");
    let mut text = text + "settle = 60\n";
    for name in ["kb.ttl", "domain.pddl", "problem.pddl"] {
        text = text.replace(name, &folder.join(name).display().to_string());
    }
    let manifest = directory.path().join("ferry.toml");
    std::fs::write(&manifest, text).expect("a file");
    let mut run = Run::new(&[&manifest.display().to_string()]);
    let (start, _) = run.until(is_answer("handled", 0));
    let plan = start.iter().find(|answer| answer["answer"] == "plan_found").expect("a plan");
    let lanes = plan["steps"].as_array().expect("steps").iter().filter(|step| step["action"] == "sail");
    let lanes: Vec<String> = lanes
        .map(|step| {
            let arguments = step["arguments"].as_array().expect("arguments").iter();
            let names = arguments.filter_map(Value::as_str).filter(|name| name.starts_with('p'));
            names.collect::<Vec<_>>().join(" ")
        })
        .collect();
    let lane = lanes.iter().rfind(|lane| *lane != &lanes[0]).expect("another lane");
    let mut line = 0;
    for _ in 0..3 {
        for (value, awaited) in [("false", "planning"), ("true", "handled")] {
            line += 1;
            run.send(&format!(r#"{{"event":"fact_changed","name":"lane {lane}","value":{value}}}"#));
            run.until(is_answer(awaited, line));
        }
    }
    let boxes = "(box_at b0 p8) (box_at b1 p4) (box_at b2 p0) (box_at b3 p4) (box_at b4 p9) (box_at b5 p4)";
    let goal = |place: &str| {
        format!(r#"{{"event":"goal_changed","goal":"(and {boxes} (box_at b6 p8) (at_port {place}))"}}"#)
    };
    run.send(&goal("p0"));
    run.until(is_answer("planning", 7));
    run.send(&goal("p1"));
    // A search that is not stopped reports its third second, too.
    let third_seconds = Cell::new(0);
    run.until(|answer| {
        let is_third = is_answer("planning", 8)(answer) && answer["seconds"] == 3;
        third_seconds.set(third_seconds.get() + u32::from(is_third));
        is_answer("handled", 8)(answer)
    });
    assert!(third_seconds.get() <= 1, "{third_seconds:?}");
    run.end();
}

/// A script with reports about future actions can be piped in and is answered line by line.
#[test]
fn scripts_can_be_piped_in() {
    let mut run = Run::new(&["missions/ugv.toml"]);
    run.send(r#"{"event":"action_succeeded","action":1}"#);
    run.send(r#"{"event":"action_succeeded","action":2}"#);
    let answers = run.end();
    let kinds: Vec<String> =
        answers.iter().map(|answer| format!("{} {}", answer["line"], answer["answer"])).collect();
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

/// Without lines, no time passes in a mission whose lines state times, also after a restart.
#[test]
fn the_clock_does_not_replace_the_times_of_lines_after_a_restart() {
    let directory = tempfile::tempdir().expect("a directory");
    let manifest = ugv_with("deadline = 0.2\ndeadline_factor = 0.001", directory.path());
    let journal = directory.path().join("journal").display().to_string();
    let mut run = Run::new(&[&manifest, "--journal", &journal]);
    run.send(r#"{"event":"action_started","action":1,"time":0.1}"#);
    run.send(r#"{"event":"action_progress","action":1,"fraction":0.1,"time":0.2}"#);
    run.until(is_answer("handled", 2));
    run.end();
    let resumed = Run::new(&[&manifest, "--journal", &journal]);
    resumed.until(|answer| answer["answer"] == "ready");
    std::thread::sleep(Duration::from_secs(1));
    let answers = resumed.end();
    assert!(answers.iter().all(|answer| answer["answer"] != "overdue"), "{answers:?}");
}

/// Lines behind a line that waits for the first plan stay in the pipe, not in memory.
#[test]
fn few_lines_are_read_while_a_line_waits_for_a_plan() {
    const LINES: u64 = 6000;
    let mut run = Run::new(&["tests/program/ferry/mission.toml"]);
    run.send(r#"{"event":"action_started","action":1}"#);
    let note = format!(r#"{{"event":"note","text":"{}"}}"#, "x".repeat(1000));
    let sent = Arc::new(AtomicU64::new(0));
    let (counter, mut input) = (Arc::clone(&sent), run.input);
    let writer = std::thread::spawn(move || {
        for _ in 0..LINES {
            writeln!(input, "{note}").expect("the program reads");
            counter.fetch_add(1, Ordering::Relaxed);
        }
    });
    let is_planned = |(_, answer): &(Instant, Value)| answer["answer"] == "plan_found";
    assert!(run.answers.iter().any(|answer| is_planned(&answer)));
    // The queue and the channel contain 1024 lines each, and buffers some more.
    assert!(sent.load(Ordering::Relaxed) < LINES / 2, "{sent:?}");
    writer.join().expect("all lines are read");
    let last = run.answers.iter().last().expect("answers");
    assert_eq!(last.1["line"], LINES + 1);
    assert!(run.child.wait().expect("the program ends").success());
}
