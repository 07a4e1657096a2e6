//! Executes a run of a parameter study as a process.

use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use planner::Limits;
use serde_json::Value;

use super::results::Line;
use super::study::{Planned, Study};
use crate::message::Message;

const POLL_INTERVAL: Duration = Duration::from_millis(5);

const MAX_MESSAGE_CHARACTERS: usize = 2000;

/// Executes a run of a study with `program`, and waits for its end. At the study's time limit, the
/// run is killed and a result is returned. If a limit in `limits` is reached first, the run is killed
/// and `None` is returned. The generator of the run's files is not subject to the limits, but its
/// duration counts towards the time limit of the run.
///
/// # Errors
/// The program cannot be executed, the generator of its files cannot be executed or fails, or the
/// system provides no temporary directory or no exit status.
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
    // Ctrl-C must reach only this program, which then kills the run. A run that is interrupted itself would
    // give a partial answer, which would falsify the study.
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
        let from = errors.char_indices().rev().nth(MAX_MESSAGE_CHARACTERS - 1).map_or(0, |(at, _)| at);
        errors[from..].trim_end().to_owned()
    } else {
        String::new()
    };
    let seconds = (begun.elapsed().as_secs_f64() * 1000.0).round() / 1000.0;
    Ok(Some(Line { run: run.number, vary: run.vary.clone(), status, timed_out, seconds, answer, message }))
}

/// Reads a pipe to its end on a separate thread, because reading two pipes in turn may deadlock.
fn reader(pipe: Option<impl Read + Send + 'static>) -> std::thread::JoinHandle<String> {
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
    #[cfg(unix)]
    rustix::process::kill_process_group(
        rustix::process::Pid::from_child(child),
        rustix::process::Signal::KILL,
    )?;
    child.kill()
}

/// Waits for the end of a process. Returns its exit status, and `true` if `limit`, the time limit
/// of a run, ended it. If a limit of `limits` is reached, kills the process and returns `None`.
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
            kill(child)?;
            child.wait()?;
            return Ok(is_late.then_some((None, true)));
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}
