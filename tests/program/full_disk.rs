//! Tests of a journal that cannot be written. A limit on the size of files has the same effect as a full
//! disk: the write fails.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::{Value, json};

use crate::common::{Outcome, copy_of_mission, metaplan, metaplan_in, outcome, program};

/// Number of input lines before the last one. The journal records of these lines exceed the limit on the size
/// of files.
const NOTES: usize = 60;

/// Runs the program with a limit of a few kilobytes on the size of files. The input lines come from a file if
/// `is_file`, otherwise from a pipe.
fn limited(directory: &Path, arguments: &[&str], is_file: bool) -> Outcome {
    // The lines grow, so that later segments of the journal also exceed the limit.
    let note =
        |index: usize| json!({ "event": "note", "text": "x".repeat(100 + 30 * index) }).to_string() + "\n";
    let failure = json!({ "event": "component_status", "component": "c_kinect", "status": "FALSE" });
    let input = (0..NOTES).map(note).collect::<String>() + &format!("{failure}\n");
    // Without the trap, the signal SIGXFSZ ends the program.
    let script = "trap '' XFSZ; ulimit -f 8; exec \"$@\"";
    let program = program().display().to_string();
    let arguments = [&["-c", script, "sh", &program], arguments].concat();
    if is_file {
        return outcome(Path::new("sh"), directory, &arguments, &input);
    }
    let child = Command::new("sh")
        .args(&arguments)
        .current_dir(directory)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let mut child = child.expect("the program starts");
    // If the program has stopped, the pipe is closed and the write fails.
    let _ = child.stdin.take().expect("a pipe").write_all(input.as_bytes());
    let output = child.wait_with_output().expect("the program ends");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    Outcome {
        status: output.status.code().unwrap_or(-1),
        stdout: text(output.stdout),
        stderr: text(output.stderr),
    }
}

fn answers(outcome: &Outcome) -> Vec<Value> {
    outcome.stdout.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

fn of_kind<'a>(answers: &'a [Value], kind: &str) -> Vec<&'a Value> {
    answers.iter().filter(|answer| answer["answer"] == kind).collect()
}

/// Runs a loop with both values of the setting `unrecorded`, which `set` writes. The journal
/// directory is appended to `command`.
fn check(directory: &Path, set: &dyn Fn(&str), command: &[&str], is_file: bool) {
    let context = format!("{command:?}, {is_file}");
    set("stop");
    let journal = |name: &str| [command, &["--journal", name][..]].concat().join(" ");
    let run = |name: &str| limited(directory, &journal(name).split(' ').collect::<Vec<_>>(), is_file);
    let stopped = run("stop");
    assert_eq!(stopped.status, 3, "{context}: {stopped:#?}");
    assert!(
        stopped.stderr.contains("M321") && stopped.stderr.contains("cannot be written"),
        "{context}: {stopped:#?}"
    );
    let handled = of_kind(&answers(&stopped), "handled").len();
    assert!((2..NOTES).contains(&handled), "{context}: {handled}");
    assert!(of_kind(&answers(&stopped), "unrecorded").is_empty(), "{context}");
    // Once there is space on the disk, the run is resumed. The line without an answer may have been written.
    let resumed = metaplan_in(directory, &journal("stop").split(' ').collect::<Vec<_>>(), "");
    assert_eq!(resumed.status, 0, "{context}: {resumed:#?}");
    let ready = &answers(&resumed)[0];
    let lines = ready["lines"].as_u64().expect("a number") as usize;
    assert!(ready["resumed"] == true && [handled - 1, handled].contains(&lines), "{context}: {ready}");

    set("continue");
    let continued = run("continue");
    assert_eq!(continued.status, 0, "{context}: {continued:#?}");
    let all = answers(&continued);
    assert_eq!(of_kind(&all, "handled").len(), NOTES + 2, "{context}");
    let [unrecorded] = of_kind(&all, "unrecorded")[..] else { panic!("{context}: {continued:#?}") };
    let message = unrecorded["message"].as_str().expect("a message");
    assert!(message.contains("the journal cannot be written: "), "{context}: {message}");
    assert_eq!(continued.stderr.matches("M324").count(), 1, "{context}: {}", continued.stderr);
    // The loop still decides.
    let decides = all.iter().any(|answer| answer["answer"] == "reconfigure" && answer["line"] == NOTES + 1);
    assert!(decides, "{context}: {continued:#?}");
    let refused = metaplan_in(directory, &journal("continue").split(' ').collect::<Vec<_>>(), "");
    assert_eq!(refused.status, 3, "{context}: {refused:#?}");
    for part in ["M324", "cannot be resumed", "partial-0", "another directory"] {
        assert!(refused.stderr.contains(part), "{context}: {part}: {}", refused.stderr);
    }
    assert_eq!(refused.stdout, "", "{context}");
    let directory = directory.join("continue").display().to_string();
    let report = metaplan(&["journal", "show", &directory, "--format", "json"]);
    assert_eq!((report.status, report.json()["sound"].clone()), (3, json!(false)), "{context}");
    let parts = metaplan(&["journal", "check", &directory]);
    assert!(parts.stdout.contains("partial-0") && parts.stderr.contains("M324"), "{context}: {parts:#?}");
}

#[test]
fn the_planning_loop_stops_or_goes_on_without_a_journal() {
    for (is_file, every) in [(false, "1000"), (true, "1000"), (true, "5")] {
        let directory = copy_of_mission("ugv");
        let manifest = directory.path().join("missions/ugv.toml");
        let text = std::fs::read_to_string(&manifest).expect("a manifest");
        let set = |value: &str| {
            let section = format!("\n[adaptation]\nunrecorded = \"{value}\"\n");
            std::fs::write(&manifest, format!("{text}{section}")).expect("written");
        };
        check(directory.path(), &set, &["run", "missions/ugv.toml", "--snapshot-every", every], is_file);
    }
}

#[test]
fn the_configuration_loop_stops_or_goes_on_without_a_journal() {
    for is_file in [false, true] {
        let directory = copy_of_mission("ugv");
        let file = directory.path().join("adaptation.toml");
        let set = |value: &str| {
            std::fs::write(&file, format!("[adaptation]\nunrecorded = \"{value}\"\n")).expect("written");
        };
        let command = "run --configure ontology/kb/ugv.ttl --rules coadaptation --adaptation adaptation.toml";
        check(directory.path(), &set, &command.split(' ').collect::<Vec<_>>(), is_file);
    }
}
