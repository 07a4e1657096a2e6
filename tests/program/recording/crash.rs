//! What a crash leaves of a recording.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use mcap::read::{MessageStream, Options};
use serde_json::Value;

use super::{decision, decisions, input, run};
use crate::common::root;

/// So long a message may take to the file; a busy machine is given more.
const PATIENCE: Duration = Duration::from_secs(30);

/// How many messages of a topic are in a file that may break off.
pub(super) fn salvaged(file: &Path, topic: &str) -> usize {
    let bytes = std::fs::read(file).expect("the file is read");
    let stream = MessageStream::new_with_options(&bytes, Options::IgnoreEndMagic.into());
    let Ok(stream) = stream else { return 0 };
    stream.map_while(Result::ok).filter(|message| message.channel.topic == topic).count()
}

/// Starts a run that is recorded, sends each line when the one before is answered, as a replay reads them, and waits until all
/// answers are in the file.
fn begun(file: &Path) -> (Child, Vec<Value>) {
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
    let begun = Instant::now();
    let handled = |answer: &&Value| {
        ["ready", "error", "duplicate", "handled"].iter().any(|kind| answer["answer"] == *kind)
    };
    let wanted = answers.iter().filter(handled).count();
    while salvaged(file, "/metaplan/loop") < wanted {
        assert!(begun.elapsed() < PATIENCE, "what was answered is not in the file");
        std::thread::sleep(Duration::from_millis(20));
    }
    (child, answers)
}

#[test]
fn a_run_that_is_killed_leaves_a_recording_that_can_be_recovered() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("run.mcap");
    let (mut child, answers) = begun(&file);
    child.kill().expect("it is killed");
    child.wait().expect("it ends");
    let bytes = std::fs::read(&file).expect("the file");
    assert!(mcap::read::footer(&bytes).is_err(), "the file was not finished");
    assert_eq!(salvaged(&file, "/metaplan/events"), input().lines().count());
    assert_eq!(salvaged(&file, "/diagnostics"), 4);
    let replayed = run(&["--events", &file.display().to_string()], "");
    let original: Vec<Value> = answers.into_iter().filter(|answer| answer["answer"] != "planning").collect();
    assert_eq!(decisions(&replayed), original);
    assert!(replayed.stderr.contains("warning[M330]"), "{replayed:#?}");
    super::others::salvages(&file, input().lines().count());
}

/// Wherever a file breaks off, all chunks before are read, and nothing else is.
#[test]
fn a_recording_that_breaks_off_anywhere_is_read_so_far() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("run.mcap");
    let (mut child, _) = begun(&file);
    drop(child.stdin.take());
    child.wait().expect("it ends");
    let bytes = std::fs::read(&file).expect("the file");
    let data_end = mcap::read::footer(&bytes).expect("the file is whole").summary_start as usize;
    let mut counts = Vec::new();
    for length in (0..bytes.len()).step_by(bytes.len() / 25) {
        std::fs::write(&file, &bytes[..length]).expect("a file");
        let outcome = run(&["--events", &file.display().to_string()], "");
        assert_eq!(outcome.status, 0, "{length}: {outcome:#?}");
        let breaks_off = (1..data_end).contains(&length);
        assert_eq!(outcome.stderr.contains("M330"), breaks_off, "{length}: {outcome:#?}");
        let handled = decisions(&outcome).iter().filter(|answer| answer["answer"] == "handled").count();
        let whole = salvaged(&file, "/metaplan/events");
        assert!(handled <= whole + 1, "{length}: {handled} of {whole}");
        counts.push(handled);
    }
    assert!(counts.is_sorted() && counts.first() == Some(&1), "{counts:?}");
    assert_eq!(counts.last(), Some(&(input().lines().count() + 1)), "{counts:?}");
}

#[cfg(unix)]
#[test]
fn a_signal_ends_a_recording_as_a_whole() {
    let directory = tempfile::tempdir().expect("a directory");
    for signal in ["-INT", "-TERM"] {
        let file = directory.path().join(signal);
        let (mut child, _) = begun(&file);
        // The end of its input would end it, too.
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
