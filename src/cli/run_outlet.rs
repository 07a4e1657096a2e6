//! Output of the loop: answers to standard output; events and answers to a recording and to a web
//! page, if requested.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::answers::{HandledLine, NumberedAnswer};
use crate::live::{Address, Live, Token};
use crate::mapek::{Answer, Beliefs, Loop};
use crate::message::{Errors, Message};
use crate::recording::{Form, Recorder};
use crate::report::Painter;
use crate::setup::Setup;
use crate::visible::visible_json;
use clap::{Args, ValueEnum};
use serde::Serialize;

use crate::cli::common::Common;
use crate::cli::output;

/// Options for outputs other than standard output.
#[derive(Debug, Args)]
pub(super) struct Outlets {
    /// Record events and answers to a new MCAP file.
    #[arg(long, value_name = "FILE")]
    mcap: Option<PathBuf>,
    /// Encoding of recorded events and answers. Diagnostics are always ROS 2 messages.
    #[arg(long, value_name = "FORM", value_enum, default_value_t = Recorded::Json, requires = "mcap")]
    mcap_events: Recorded,
    /// Serve a web page of the run at PORT, HOST or HOST:PORT. By default only this machine can access it.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    serve: Option<String>,
    /// File with the access token of the page. Required if other machines can reach it.
    #[arg(long, value_name = "FILE", requires = "serve")]
    serve_token: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Recorded {
    /// JSON with schemas, for viewers.
    Json,
    /// `std_msgs/msg/String`, for `ros2 bag play`.
    String,
}

impl Outlets {
    pub(super) fn painter(&self, setup: &Setup) -> Result<Option<Painter>, Errors> {
        let positions = self.serve.as_ref().map(|_| setup.positions()).transpose()?;
        Ok(positions.map(|positions| Painter::new(&setup.mission, positions)))
    }
}

#[derive(Debug, Clone)]
pub(super) struct Outlet {
    recorder: Option<(Recorder, String)>,
    /// Set once the failure of the recording has been reported.
    is_told: Arc<AtomicBool>,
    live: Option<Live>,
}

impl Outlet {
    pub(super) fn open(wanted: &Outlets, mission: &str, painter: Option<Painter>) -> Result<Self, Message> {
        let live = match &wanted.serve {
            None => None,
            Some(address) => {
                let token = wanted.serve_token.as_deref().map(Token::read).transpose()?;
                let live = Live::open(Address::read(address)?, token, painter)?;
                output::note(&format!("the run can be seen at http://{}/\n", live.address()));
                Some(live)
            }
        };
        let recorder =
            wanted.mcap.as_deref().map(|path| record(path, wanted.mcap_events, mission)).transpose()?;
        Ok(Self { recorder, is_told: Arc::default(), live })
    }

    /// Adds a line of input to the recording and the web page, before the line is handled. `now` is
    /// the time since the start of the mission.
    pub(super) fn heard(&self, line: u64, now: Duration, text: &str) {
        if let Some((recorder, _)) = &self.recorder {
            recorder.event(line, now, text);
        }
        if let Some(live) = &self.live {
            live.heard(line, text);
        }
    }

    pub(super) fn begin(&self, control: &Loop) {
        if let Some(live) = &self.live {
            live.known(control.designs());
            if control.beliefs().plan().is_some() {
                live.planned(control.beliefs().outlook());
            }
        }
    }

    pub(super) fn plan(&self, beliefs: &Beliefs, answers: &[Answer]) {
        let is_about_plans =
            |answer: &Answer| matches!(answer, Answer::PlanFound { .. } | Answer::PlanNone { .. });
        if let Some(live) = self.live.as_ref().filter(|_| answers.iter().any(is_about_plans)) {
            live.planned(beliefs.outlook());
        }
    }

    /// Writes lines to standard output in one piece, so that lines of other threads do not interleave. Also adds the
    /// lines to the recording and the web page, if requested.
    pub(super) fn say(&self, lines: &str) -> io::Result<()> {
        let lines = visible_json(lines);
        let mut stdout = io::stdout().lock();
        stdout.write_all(lines.as_bytes())?;
        stdout.flush()?;
        drop(stdout);
        if let Some((recorder, name)) = &self.recorder {
            lines.lines().for_each(|line| recorder.answer(line));
            if recorder.has_failed() && !self.is_told.swap(true, Ordering::Relaxed) {
                let text = format!("{name} can no longer be written: the run continues without a recording");
                output::note(Message::warning("M331", text).text());
            }
        }
        if let Some(live) = &self.live {
            lines.lines().for_each(|line| live.said(line));
        }
        Ok(())
    }

    /// Writes answers to an input line, each with the number of that line. Does not acknowledge the
    /// line, because more answers may follow.
    pub(super) fn answer_so_far(&self, line: u64, answers: &[impl Serialize]) -> io::Result<()> {
        if answers.is_empty() {
            return Ok(());
        }
        let lines = answers.iter().map(|answer| output::line(&NumberedAnswer::new(answer, line)));
        self.say(&lines.collect::<String>())
    }

    pub(super) fn answer(&self, line: u64, answers: &[impl Serialize], read: Instant) -> io::Result<()> {
        let mut text = String::new();
        for answer in answers {
            text += &output::line(&NumberedAnswer::new(answer, line));
        }
        text += &output::line(&HandledLine::new(line, read.elapsed().as_micros()));
        self.say(&text)
    }

    pub(super) fn close(&self) -> Result<(), Message> {
        if let Some(live) = &self.live {
            live.end();
        }
        let Some((recorder, name)) = &self.recorder else { return Ok(()) };
        recorder.finish().map_err(|error| {
            let text = format!(
                "the recording cannot be written: {error}; what was recorded before can be recovered"
            );
            Message::at("M331", name, None, text)
        })
    }
}

/// Returns `true` if the reader of the answers has closed the pipe. Any other failure is an error.
pub(super) fn is_over(written: io::Result<()>) -> Result<bool, Message> {
    match written {
        Ok(()) => Ok(false),
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(true),
        Err(error) => Err(Message::error("M109", format!("the answer cannot be written: {error}"))),
    }
}

pub(super) fn unwritten(error: &io::Error) -> Message {
    Message::error("M321", format!("the journal cannot be written: {error}"))
}

pub(super) fn warn_if_unrecorded<'a>(common: &Common, answers: impl IntoIterator<Item = &'a Answer>) {
    for answer in answers {
        if let Answer::Unrecorded { message } = answer {
            output::warnings(common, [&Message::warning("M324", message.clone())]);
        }
    }
}

/// Starts a recording, which is also completed after Ctrl-C or a termination signal. Returns the
/// recorder and the name of its file.
fn record(path: &Path, events: Recorded, mission: &str) -> Result<(Recorder, String), Message> {
    let form = match events {
        Recorded::Json => Form::Json,
        Recorded::String => Form::Text,
    };
    let name = path.display().to_string();
    if crate::file::is_stdout(path) {
        let text = "standard output is used for the answers; name a file for the recording";
        return Err(Message::at("M331", &name, None, text));
    }
    let recorder = Recorder::create(path, mission, form).map_err(|error| {
        let text = if error.kind() == io::ErrorKind::AlreadyExists {
            "exists already, and recordings are never overwritten: name another file, or remove the existing \
             one"
            .to_owned()
        } else {
            format!("the recording cannot be written: {error}")
        };
        Message::at("M331", &name, None, text)
    })?;
    let copy = recorder.clone();
    // Without a handler, the unfinished file can still be recovered.
    let _ = ctrlc::set_handler(move || {
        let _ = copy.finish();
        std::process::exit(130);
    });
    Ok((recorder, name))
}
