//! Executes a run of a parameter study as a process.

use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use planner::Limits;
use serde_json::Value;

use super::results::Line;
use super::study::{Planned, Study, shown};
use crate::message::Message;

const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// Time in which the output of killed processes is read.
const READ_GRACE: Duration = Duration::from_secs(1);

const MAX_MESSAGE_CHARACTERS: usize = 2000;

/// Executes a run of a study with `program`, and waits for its end. At the study's time limit, which
/// includes the generator of the run's files, the running process is killed and a result is
/// returned. If a limit in `limits` is reached first, the process is killed and `None` is returned.
/// If the generator fails, the result has no answer.
///
/// # Errors
/// The program or the generator cannot be started, or the system provides no temporary directory or no
/// exit status.
pub fn perform(
    program: &Path,
    study: &Study,
    run: &Planned,
    limits: &Limits,
) -> Result<Option<Line>, Message> {
    let failed = |what: &str, error: &dyn std::fmt::Display| {
        Message::error("M152", format!("run {}: {what}: {error}", run.number))
    };
    let folder = tempfile::tempdir().map_err(|error| failed("a directory of its own", &error))?;
    let begun = Instant::now();
    let time_limit = study.time_limit().map(Duration::from_secs_f64);
    let execute = |program: &Path, words: &[String]| {
        execute(program, words, &study.directory, &|| {
            if time_limit.is_some_and(|limit| begun.elapsed() >= limit) {
                Some(Reached::TimeLimit)
            } else {
                limits.reached().then_some(Reached::Study)
            }
        })
        .map_err(|error| failed(&command_line(program, words), &error))
    };
    let line = |status: Option<i32>, timed_out: bool, answer: Value, message: String| {
        let seconds = (begun.elapsed().as_secs_f64() * 1000.0).round() / 1000.0;
        Line { run: run.number, vary: run.vary.clone(), status, timed_out, seconds, answer, message }
    };
    if let Some(words) = study.generator(run, folder.path())
        && let Some((generator, arguments)) = words.split_first()
    {
        let generator = Path::new(generator);
        let ended = execute(generator, arguments)?;
        let reason = match ended.status {
            Ok(status) if status.success() => None,
            Ok(status) => Some(status.to_string()),
            Err(Reached::TimeLimit) => Some("reached the time limit of the run".to_owned()),
            Err(Reached::Study) => return Ok(None),
        };
        if let Some(reason) = reason {
            let message =
                format!("{}: {reason}\n{}", command_line(generator, arguments), end_of(&ended.errors));
            let message = message.trim_end().to_owned();
            return Ok(Some(line(None, ended.status.is_err(), Value::Null, message)));
        }
    }
    let ended = execute(program, &study.words(run, folder.path()))?;
    let (status, timed_out, signal) = match ended.status {
        Ok(status) => (status.code(), false, status.code().is_none().then(|| status.to_string())),
        Err(Reached::TimeLimit) => (None, true, None),
        Err(Reached::Study) => return Ok(None),
    };
    let answer: Value = serde_json::from_str(&ended.output).unwrap_or_default();
    let (answer, message) = match error_texts(&answer) {
        Some(texts) => (Value::Null, texts),
        None if answer.is_null() => {
            let message = format!("{}\n{}", signal.unwrap_or_default(), end_of(&ended.errors));
            (Value::Null, message.trim().to_owned())
        }
        None => (answer, String::new()),
    };
    Ok(Some(line(status, timed_out, answer, message)))
}

fn command_line(program: &Path, words: &[String]) -> String {
    format!("{} {}", program.display(), words.join(" ")).trim_end().to_owned()
}

/// Returns the last characters of a text, at most [`MAX_MESSAGE_CHARACTERS`].
fn end_of(text: &str) -> &str {
    let from = text.char_indices().rev().nth(MAX_MESSAGE_CHARACTERS - 1).map_or(0, |(at, _)| at);
    text[from..].trim_end()
}

/// Returns the messages of the answer of a failed command, one per line. Returns `None` if the
/// command has not failed.
fn error_texts(answer: &Value) -> Option<String> {
    answer["format"].as_str().filter(|format| format.starts_with("metaplan-error/"))?;
    let messages = answer["messages"].as_array().into_iter().flatten();
    let text = |message: &Value| {
        let part = |name: &str| message[name].as_str().unwrap_or_default();
        let place = ["file", "line", "column"].iter().map(|name| &message[*name]);
        let place: String = place.filter(|part| !part.is_null()).map(|part| shown(part) + ":").collect();
        let text = format!("{}[{}]: {}", part("severity"), part("code"), part("message"));
        if place.is_empty() { text } else { format!("{place} {text}") }
    };
    Some(messages.map(text).collect::<Vec<_>>().join("\n"))
}

/// Limit that ended a process.
#[derive(Debug, Clone, Copy)]
enum Reached {
    /// The time limit of the run.
    TimeLimit,
    /// A limit of the whole study, or an interruption.
    Study,
}

/// A process that has ended or was killed.
#[derive(Debug)]
struct Ended {
    /// Exit status, or the limit at which the process was killed.
    status: Result<ExitStatus, Reached>,
    /// Text on standard output.
    output: String,
    /// Text on standard error.
    errors: String,
}

/// Executes a program in a directory. Waits until it has ended and no process that it started holds its output open.
/// Kills these processes once `reached` returns a limit.
fn execute(
    program: &Path,
    words: &[String],
    directory: &Path,
    reached: &dyn Fn() -> Option<Reached>,
) -> std::io::Result<Ended> {
    let mut command = Command::new(program);
    // Ctrl-C must reach only this program, which then kills the run. A run that is interrupted itself would
    // give a partial answer, which would falsify the study.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let mut child = command
        .args(words)
        .current_dir(directory)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()?;
    let (output, errors) = (reader(child.stdout.take()), reader(child.stderr.take()));
    let status = wait(&mut child, &|| output.is_finished() && errors.is_finished(), reached)?;
    // A pipe that is still open belongs to a process that could not be killed.
    let text = |reader: JoinHandle<String>| {
        if reader.is_finished() { reader.join().unwrap_or_default() } else { String::new() }
    };
    Ok(Ended { status, output: text(output), errors: text(errors) })
}

/// Reads a pipe to its end on a separate thread, because reading two pipes in turn may deadlock.
fn reader(pipe: Option<impl Read + Send + 'static>) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut pipe) = pipe {
            // On an error, the part that was read until then is returned.
            let _ = pipe.read_to_end(&mut bytes);
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

/// Kills a process that leads a process group, and the processes that it has started, such as an external SAT
/// solver: these would keep the pipes open.
fn kill(child: &mut Child) -> std::io::Result<()> {
    // Fails if all processes of the group have ended.
    #[cfg(unix)]
    let _ = rustix::process::kill_process_group(
        rustix::process::Pid::from_child(child),
        rustix::process::Signal::KILL,
    );
    child.kill()
}

/// Waits for the end of a process, and until its output `is_read`. Returns its exit status. Once `reached` returns a
/// limit, kills the process and returns the limit.
fn wait(
    child: &mut Child,
    is_read: &dyn Fn() -> bool,
    reached: &dyn Fn() -> Option<Reached>,
) -> std::io::Result<Result<ExitStatus, Reached>> {
    loop {
        if let Some(status) = child.try_wait()?.filter(|_| is_read()) {
            return Ok(Ok(status));
        }
        if let Some(limit) = reached() {
            kill(child)?;
            child.wait()?;
            let killed = Instant::now();
            while !is_read() && killed.elapsed() < READ_GRACE {
                std::thread::sleep(POLL_INTERVAL);
            }
            return Ok(Err(limit));
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}
