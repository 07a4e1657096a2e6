//! Tests of recordings (MCAP files) after the program was killed, after a signal, and after truncation of the
//! file.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use mcap::read::{MessageStream, Options};
use serde_json::Value;

use super::{decision, decisions, input, run};
use crate::common::root;

/// Timeout for messages to reach the file, which is generous for busy machines.
const TIMEOUT: Duration = Duration::from_secs(30);

/// Returns the number of messages of a topic that can be read from a file, which may be truncated.
pub(super) fn count_readable_messages(file: &Path, topic: &str) -> usize {
    let bytes = std::fs::read(file).expect("the file is read");
    let stream = MessageStream::new_with_options(&bytes, Options::IgnoreEndMagic.into());
    let Ok(stream) = stream else { return 0 };
    stream.map_while(Result::ok).filter(|message| message.channel.topic == topic).count()
}

/// Starts a recorded run and sends each line once the previous line is answered, as in a replay. Returns the
/// process and the answers, once all answers of the topic `/metaplan/loop` are in the file.
fn start_recorded_run(file: &Path) -> (Child, Vec<Value>) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_metaplan"))
        .args(["run", "missions/ugv.toml", "--mcap"])
        .arg(file)
        .current_dir(root())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let text = input();
    let mut events = text.lines();
    let mut pipe = child.stdin.take().expect("a pipe");
    let mut answers = Vec::new();
    let lines = BufReader::new(child.stdout.as_mut().expect("a pipe")).lines();
    for line in lines {
        let answer = decision(&line.expect("a line"));
        let is_handled = answer["answer"] == "handled";
        answers.push(answer);
        if is_handled {
            let Some(event) = events.next() else { break };
            writeln!(pipe, "{event}").expect("the program reads");
        }
    }
    child.stdin = Some(pipe);
    let started = Instant::now();
    let is_loop_answer = |answer: &&Value| {
        ["ready", "error", "duplicate", "handled"].iter().any(|kind| answer["answer"] == *kind)
    };
    let expected_count = answers.iter().filter(is_loop_answer).count();
    while count_readable_messages(file, "/metaplan/loop") < expected_count {
        assert!(started.elapsed() < TIMEOUT, "what was answered is not in the file");
        std::thread::sleep(Duration::from_millis(20));
    }
    (child, answers)
}

#[test]
fn recordings_of_killed_runs_can_be_replayed() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("run.mcap");
    let (mut child, answers) = start_recorded_run(&file);
    child.kill().expect("it is killed");
    child.wait().expect("it ends");
    let bytes = std::fs::read(&file).expect("the file");
    assert!(mcap::read::footer(&bytes).is_err(), "the file was not finished");
    assert_eq!(count_readable_messages(&file, "/metaplan/events"), input().lines().count());
    assert_eq!(count_readable_messages(&file, "/diagnostics"), 4);
    let replayed = run(&["--events", &file.display().to_string()], "");
    let original: Vec<Value> = answers.into_iter().filter(|answer| answer["answer"] != "planning").collect();
    assert_eq!(decisions(&replayed), original);
    assert!(replayed.stderr.contains("warning[M330]"), "{replayed:#?}");
    super::others::assert_readable_by_python(&file, input().lines().count());
}

#[test]
fn truncated_recordings_are_read_up_to_the_last_chunk() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("run.mcap");
    let (mut child, _) = start_recorded_run(&file);
    drop(child.stdin.take());
    child.wait().expect("it ends");
    let bytes = std::fs::read(&file).expect("the file");
    let data_end = mcap::read::footer(&bytes).expect("the file is whole").summary_start as usize;
    let mut counts = Vec::new();
    for length in (0..bytes.len()).step_by(bytes.len() / 25) {
        std::fs::write(&file, &bytes[..length]).expect("a file");
        let outcome = run(&["--events", &file.display().to_string()], "");
        assert_eq!(outcome.status, 0, "{length}: {outcome:#?}");
        let is_truncated = (1..data_end).contains(&length);
        assert_eq!(outcome.stderr.contains("M330"), is_truncated, "{length}: {outcome:#?}");
        let handled = decisions(&outcome).iter().filter(|answer| answer["answer"] == "handled").count();
        let readable_events = count_readable_messages(&file, "/metaplan/events");
        assert!(handled <= readable_events + 1, "{length}: {handled} of {readable_events}");
        counts.push(handled);
    }
    assert!(counts.is_sorted() && counts.first() == Some(&1), "{counts:?}");
    assert_eq!(counts.last(), Some(&(input().lines().count() + 1)), "{counts:?}");
}

#[cfg(unix)]
#[test]
fn signals_complete_the_recording() {
    let directory = tempfile::tempdir().expect("a directory");
    for signal in ["-INT", "-TERM"] {
        let file = directory.path().join(signal);
        let (mut child, _) = start_recorded_run(&file);
        // Standard input stays open, as its end would also end the run.
        let input_pipe = child.stdin.take();
        let killed = Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill");
        assert!(killed.success());
        assert_eq!(child.wait().expect("it ends").code(), Some(130));
        drop(input_pipe);
        let bytes = std::fs::read(&file).expect("the file");
        let summary = mcap::Summary::read(&bytes).expect("a whole file").expect("a summary");
        let count = summary.stats.expect("statistics").message_count as usize;
        assert!(count > 2 * input().lines().count(), "{count}");
    }
}
