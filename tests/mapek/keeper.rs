//! Tests of the journal of the configuration loop ([`Keeper`]): recovery from any cut, and reactions to the
//! passing of time.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use metaplan::configure::{Configurator, Goal, Keeper, Wishes};
use metaplan::journal::{Journal, Policy, Sync};
use metaplan::knowledge::Knowledge;
use metaplan::mapek::{FilterSettings, Recoverable as _};
use serde_json::{Value, json};

use crate::common::last_segment;
use crate::configure::{ROBOT, robot, robot_with};
use crate::faults::temporary_directory;

const POLICY: Policy = Policy { sync: Sync::Never, snapshot_every: 4 };

fn keeper_of(knowledge: Knowledge, wishes: Wishes) -> Keeper {
    let mut configurator = Configurator::new(knowledge, wishes).expect("known names");
    configurator.pursue(&Goal::of("f_look")).expect("known");
    Keeper::new(configurator, None).with_filters(&FilterSettings::default())
}

fn keeper() -> Keeper {
    keeper_of(robot(), Wishes::default())
}

/// Returns random lines with sequence numbers and times. Some are invalid.
fn script(seed: u64, length: usize) -> Vec<String> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut pick = |words: &[&str]| words[random.usize(..words.len())].to_owned();
    let mut time = 0.0;
    let mut lines: Vec<String> = Vec::new();
    for seq in 1..=length {
        let effect: u64 = pick(&["1", "1", "2", "3", "4", "5", "7", "9"]).parse().expect("a number");
        let mut event = match pick(&["c", "c", "c", "a", "a", "f", "d", "o", "r", "m", "t", "x"]).as_str() {
            "c" => json!({
                "event": "component_status",
                "component": pick(&["c_arm", "c_camera"]),
                "status": pick(&["FALSE", "FALSE", "RECOVERED", "OK"]),
            }),
            "a" => json!({ "event": "acknowledged", "effect": effect }),
            "f" => json!({ "event": "reconfiguration_failed", "effect": effect }),
            "d" => json!({
                "event": "design_status",
                "design": pick(&["fd_look_close", "fd_look_far", "fd_push"]),
                "realisable": pick(&["yes", "no"]) == "yes",
            }),
            "o" => json!({
                "event": "objective_added",
                "objective": pick(&["o1", "o2"]),
                "function": pick(&["f_look", "f_grasp"]),
                "requirements": { "energy": 3 },
            }),
            "r" => json!({ "event": "objective_removed", "objective": pick(&["o1", "o2", "o_f_look"]) }),
            "m" => json!({ "event": "measured", "attribute": "performance", "value": 0.5 }),
            "t" => json!({ "event": "tick" }),
            _ => json!({ "event": "nonsense" }),
        };
        if seq == 1 {
            event = json!({ "event": "note", "text": "the script begins" });
        }
        time += pick(&["0.25", "0.5", "3"]).parse::<f64>().expect("a number");
        event["seq"] = json!(seq);
        event["time"] = json!(time);
        lines.push(event.to_string());
    }
    lines
}

fn to_json(keeper: &mut Keeper, answers: &[metaplan::configure::KeeperAnswer]) -> Vec<Value> {
    keeper.decision(answers).answers
}

/// Runs the loop without an interruption. Returns the answers before the first line and to each line, the
/// final state, and the directory of the journal.
fn uninterrupted(pristine: &Keeper, lines: &[String]) -> (Vec<Vec<Value>>, Value, tempfile::TempDir) {
    let directory = tempfile::tempdir().expect("a directory");
    let mut keeper = pristine.clone();
    let (mut journal, recovery) = Journal::open(directory.path(), POLICY, &mut keeper).expect("it opens");
    assert_eq!(recovery.replayed, None);
    let answers = journal.begin(&mut keeper).expect("written");
    let mut all = vec![to_json(&mut keeper, &answers)];
    for line in lines {
        let answers = journal.handle(&mut keeper, line, Duration::ZERO).expect("written");
        all.push(to_json(&mut keeper, &answers));
    }
    (all, keeper.checkpoint().0, directory)
}

#[test]
fn a_journal_cut_after_every_line_restores_the_configuration_loop() {
    let pristine = keeper();
    let mut random = fastrand::Rng::with_seed(1);
    let mut repeated = 0;
    for seed in 0..3 {
        let lines = script(seed, 20);
        let (expected, state, _directory) = uninterrupted(&pristine, &lines);
        for stop in 0..=lines.len() {
            let directory = temporary_directory();
            let mut keeper = pristine.clone();
            let (mut journal, _) = Journal::open(directory.path(), POLICY, &mut keeper).expect("it opens");
            journal.begin(&mut keeper).expect("written");
            for line in &lines[..stop] {
                journal.handle(&mut keeper, line, Duration::ZERO).expect("written");
            }
            drop(journal);
            // Up to two lines at the end of the last segment are missing or incomplete.
            let last = last_segment(directory.path());
            let text = std::fs::read(&last).expect("a journal");
            let records: Vec<&[u8]> = text.split_inclusive(|&byte| byte == b'\n').collect();
            let sound: usize =
                records[..records.len().saturating_sub(2).max(1)].iter().map(|own| own.len()).sum();
            std::fs::write(&last, &text[..random.usize(sound..=text.len())]).expect("cut");

            let mut keeper = pristine.clone();
            let (mut journal, recovery) =
                Journal::open(directory.path(), POLICY, &mut keeper).expect("it opens");
            assert!(recovery.replayed.is_some());
            let answers = journal.begin(&mut keeper).expect("written");
            let known = keeper.lines() as usize;
            let answers = to_json(&mut keeper, &answers);
            let (again, first): (Vec<Value>, Vec<Value>) =
                answers.into_iter().partition(|answer| answer["repeated"] == true);
            assert!(first.is_empty() || first == expected[known], "{first:#?}\n{:#?}", expected[known]);
            for mut effect in again {
                repeated += 1;
                effect.as_object_mut().expect("an object").remove("repeated");
                assert!(expected[..=known].iter().flatten().any(|answer| *answer == effect), "{effect}");
            }
            for (index, line) in lines.iter().enumerate().skip(known) {
                let answers = journal.handle(&mut keeper, line, Duration::ZERO).expect("written");
                assert_eq!(to_json(&mut keeper, &answers), expected[index + 1], "{seed}, {stop}: {line}");
            }
            assert_eq!(keeper.checkpoint().0, state, "{seed}, {stop}");
        }
    }
    assert!(repeated > 20, "{repeated}");
}

#[test]
fn an_acknowledged_change_is_not_repeated() {
    let directory = tempfile::tempdir().expect("a directory");
    let open = || {
        let mut keeper = keeper();
        let (mut journal, _) = Journal::open(directory.path(), POLICY, &mut keeper).expect("it opens");
        let answers = journal.begin(&mut keeper).expect("written");
        let answers = to_json(&mut keeper, &answers);
        (keeper, journal, answers)
    };
    let (.., answers) = open();
    let first = answers.iter().find(|answer| answer["answer"] == "reconfigure").expect("a design");
    assert_eq!((&first["effect"], first.get("repeated")), (&json!(1), None));
    let (mut keeper, mut journal, answers) = open();
    assert_eq!(answers.len(), 1);
    assert_eq!((&answers[0]["effect"], &answers[0]["repeated"]), (&json!(1), &json!(true)));
    let acknowledged = r#"{"event":"acknowledged","effect":1}"#;
    journal.handle(&mut keeper, acknowledged, Duration::ZERO).expect("written");
    drop(journal);
    assert_eq!(open().2, Vec::<Value>::new());
}

#[test]
fn damage_and_another_knowledge_base_are_refused() {
    let (_, _, directory) = uninterrupted(&keeper(), &script(1, 6));
    let refused = |mut keeper: Keeper| {
        Journal::open(directory.path(), POLICY, &mut keeper).expect_err("refused").message.clone()
    };
    let exclusive = ["c_arm".to_owned()].into();
    for other in [
        keeper_of(robot_with(":c_lamp a t:Component ."), Wishes::default()),
        keeper_of(robot(), Wishes { exclusive, ..Wishes::default() }),
        keeper().with_filters(&FilterSettings::none()),
    ] {
        let message = refused(other);
        assert!(message.contains("belongs to another mission"), "{message}");
    }
    let last = last_segment(directory.path());
    let mut text = std::fs::read(&last).expect("a journal");
    text[60] ^= 1;
    std::fs::write(&last, &text).expect("damaged");
    let message = refused(keeper());
    assert!(message.contains("is damaged"), "{message}");
}

struct Program {
    child: Child,
    stdin: ChildStdin,
    lines: Receiver<Value>,
}

impl Program {
    fn start(directory: &Path, options: &[&str]) -> Self {
        let file = directory.join("robot.ttl");
        std::fs::write(&file, ROBOT).expect("written");
        let mut child = Command::new(env!("CARGO_BIN_EXE_metaplan"))
            .args(["run", "--configure", "--rules", "coadaptation", "--objective", "f_look"])
            .args(options)
            .arg(file)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let stdin = child.stdin.take().expect("a pipe");
        let stdout = BufReader::new(child.stdout.take().expect("a pipe"));
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in stdout.lines().map_while(Result::ok) {
                // The last line of a killed program may be incomplete.
                let Ok(value) = serde_json::from_str(&line) else { break };
                if sender.send(value).is_err() {
                    break;
                }
            }
        });
        Self { child, stdin, lines }
    }

    fn send(&mut self, line: &str) {
        writeln!(self.stdin, "{line}").expect("a pipe");
    }

    fn answers(&self) -> Vec<Value> {
        let mut answers = Vec::new();
        loop {
            let mut answer = self.lines.recv_timeout(Duration::from_secs(60)).expect("an answer");
            if answer["answer"] == "handled" {
                return answers;
            }
            answer.as_object_mut().expect("an object").remove("line");
            answers.push(answer);
        }
    }

    fn kill(mut self) {
        self.child.kill().expect("it is killed");
        self.child.wait().expect("it ends");
    }
}

#[test]
fn the_program_killed_after_every_line_gives_the_same_answers() {
    let lines = script(3, 12);
    let directory = tempfile::tempdir().expect("a directory");
    let run = |is_killed: bool| {
        let journal = directory.path().join(if is_killed { "killed" } else { "whole" });
        let journal = journal.display().to_string();
        let options = ["--journal", &journal, "--snapshot-every", "4"];
        let mut program = Program::start(directory.path(), &options);
        let ready = program.lines.recv().expect("a line");
        assert_eq!((&ready["resumed"], &ready["lines"]), (&json!(false), &json!(0)), "{ready}");
        let mut all = vec![program.answers()];
        let mut seq = None;
        for (index, line) in lines.iter().enumerate() {
            if is_killed {
                program.kill();
                program = Program::start(directory.path(), &options);
                let ready = program.lines.recv().expect("a line");
                assert_eq!((&ready["resumed"], &ready["lines"]), (&json!(true), &json!(index)), "{ready}");
                assert_eq!(ready["seq"].as_u64(), seq, "{ready}");
                assert!(program.answers().iter().all(|answer| answer["repeated"] == true));
            }
            program.send(line);
            let answers = program.answers();
            // The sequence number of a refused line can be used again.
            if answers.iter().all(|answer| answer["answer"] != "error") {
                seq = Some(index as u64 + 1);
            }
            all.push(answers);
        }
        program.send(&lines[0]);
        assert_eq!(program.answers(), [json!({ "answer": "duplicate", "seq": 1 })]);
        program.kill();
        all
    };
    assert_eq!(run(true), run(false));
}

#[test]
fn the_configuration_loop_reacts_when_a_report_becomes_due() {
    let directory = tempfile::tempdir().expect("a directory");
    let adaptation = directory.path().join("adaptation.toml");
    std::fs::write(&adaptation, "[adaptation]\nconfirm_time = 0.5\n").expect("written");
    let (adaptation, journal) = (adaptation.display().to_string(), directory.path().join("journal"));
    let journal = journal.display().to_string();
    let options = ["--adaptation", &adaptation, "--journal", &journal];
    let mut program = Program::start(directory.path(), &options);
    program.lines.recv().expect("a line");
    program.answers();
    // A refused line does not replace the clock by its time.
    program.send(r#"{"event":"tick","time":1764535144}"#);
    program.answers();
    let failed = r#"{"event":"component_status","component":"c_arm","status":"FALSE"}"#;
    let sent = Instant::now();
    program.send(failed);
    let answers = program.answers();
    assert_eq!(answers.len(), 1, "{answers:?}");
    assert_eq!(answers[0]["because"], "confirm");
    // The test sends no further line.
    let mut timed = || program.lines.recv_timeout(Duration::from_secs(60)).expect("an answer");
    let change = std::iter::repeat_with(&mut timed).find(|answer| answer["answer"] == "reconfigure");
    let change = change.expect("a design");
    assert!(sent.elapsed() >= Duration::from_millis(450), "{:?}", sent.elapsed());
    assert_eq!((&change["to"], &change["line"]), (&json!("fd_look_far"), &json!(2)));
    program.kill();
    // The journal contains the timer.
    let program = Program::start(directory.path(), &options);
    let ready = program.lines.recv().expect("a line");
    assert_eq!((&ready["resumed"], &ready["lines"]), (&json!(true), &json!(2)));
    let answers = program.answers();
    assert_eq!(answers.len(), 1, "{answers:?}");
    assert_eq!((&answers[0]["to"], &answers[0]["repeated"]), (&json!("fd_look_far"), &json!(true)));
    program.kill();

    // If the lines have times, time advances only with lines.
    let mut program = Program::start(directory.path(), &["--adaptation", &adaptation]);
    program.lines.recv().expect("a line");
    program.answers();
    program.send(r#"{"event":"component_status","component":"c_arm","status":"FALSE","time":1}"#);
    program.answers();
    std::thread::sleep(Duration::from_millis(900));
    assert!(program.lines.try_recv().is_err());
    program.send(r#"{"event":"tick","time":2}"#);
    assert!(program.answers().iter().any(|answer| answer["to"] == "fd_look_far"));
    program.kill();
}

#[test]
#[ignore = "a measurement, of interest in a release build"]
fn thousands_of_lines_are_replayed() {
    #![expect(clippy::print_stdout, reason = "figures are what the test is for")]
    let lines = script(9, 3999);
    for snapshot_every in [1000, u64::MAX] {
        let policy = Policy { sync: Sync::Never, snapshot_every };
        let directory = tempfile::tempdir().expect("a directory");
        let mut keeper = keeper();
        let start = Instant::now();
        let (mut journal, _) = Journal::open(directory.path(), policy, &mut keeper).expect("it opens");
        journal.begin(&mut keeper).expect("written");
        for line in &lines {
            journal.handle(&mut keeper, line, Duration::ZERO).expect("written");
        }
        drop(journal);
        let handled = start.elapsed();
        let start = Instant::now();
        let (_, recovery) = Journal::open(directory.path(), policy, &mut self::keeper()).expect("it opens");
        println!(
            "snapshot every {snapshot_every}: handled in {handled:?}, {} lines replayed in {:?}",
            recovery.replayed.unwrap_or_default(),
            start.elapsed()
        );
    }
}
