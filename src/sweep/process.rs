//! A run as a process.

use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use planner::Limits;
use serde_json::Value;

use super::results::Line;
use super::study::{Planned, Study};
use crate::message::Message;

/// So often it is looked whether a process has ended.
const LOOK: Duration = Duration::from_millis(5);

/// So many characters of standard error are kept.
const KEPT: usize = 2000;

/// Performs a run with a program, and waits for its end. Returns `None` if a limit is reached first; the run is ended
/// then.
///
/// # Errors
/// The program, or the one that generates files, cannot be run.
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
    if let Some(words) = study.generator(run, folder.path())
        && let Some((generator, arguments)) = words.split_first()
    {
        let output = Command::new(generator)
            .args(arguments)
            .current_dir(&study.directory)
            .stdin(Stdio::null())
            .output()
            .map_err(|error| failed(generator, &error))?;
        if !output.status.success() {
            let text = String::from_utf8_lossy(&output.stderr);
            return Err(failed(generator, &format!("{}\n{}", output.status, text.trim_end())));
        }
    }
    let mut command = Command::new(program);
    // This program handles Ctrl-C and ends the run. An interrupted run would give a partial answer, which the study
    // does not want.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let mut child = command
        .args(study.words(run, folder.path()))
        .current_dir(&study.directory)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| failed(&program.display().to_string(), &error))?;
    let (out, errors) = (reader(child.stdout.take()), reader(child.stderr.take()));
    let ended = wait(&mut child, study.time_limit().map(Duration::from_secs_f64), begun, limits)
        .map_err(|error| failed("its end", &error))?;
    let (out, errors) = (out.join().unwrap_or_default(), errors.join().unwrap_or_default());
    let Some((status, timed_out)) = ended else { return Ok(None) };
    let answer: Value = serde_json::from_str(&out).unwrap_or_default();
    let message = if answer.is_null() {
        let from = errors.char_indices().rev().nth(KEPT - 1).map_or(0, |(at, _)| at);
        errors[from..].trim_end().to_owned()
    } else {
        String::new()
    };
    let seconds = (begun.elapsed().as_secs_f64() * 1000.0).round() / 1000.0;
    Ok(Some(Line { run: run.number, vary: run.vary.clone(), status, timed_out, seconds, answer, message }))
}

/// Reads to the end in a thread of its own: who waits for two pipes in turns may wait for ever.
fn reader(pipe: Option<impl Read + Send + 'static>) -> std::thread::JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut pipe) = pipe {
            // What was read until an error counts.
            let _ = pipe.read_to_end(&mut bytes);
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

/// Waits for the end of a process. At its own time limit, the process is ended, and that is its result. At another
/// limit, it is ended, and `None` is returned.
fn wait(
    child: &mut Child,
    limit: Option<Duration>,
    begun: Instant,
    limits: &Limits,
) -> std::io::Result<Option<(Option<i32>, bool)>> {
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some((status.code(), false)));
        }
        let is_late = limit.is_some_and(|limit| begun.elapsed() >= limit);
        if is_late || limits.reached() {
            child.kill()?;
            child.wait()?;
            return Ok(is_late.then_some((None, true)));
        }
        std::thread::sleep(LOOK);
    }
}
