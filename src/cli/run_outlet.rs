//! Where what the loop hears and answers goes: its answers to standard output, and both to a recording, if there is one.

use std::io::{self, Write as _};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use metaplan::answers::{HandledLine, NumberedAnswer};
use metaplan::message::Message;
use metaplan::recording::{Form, Recorder};
use metaplan::visible::visible_json;
use serde::Serialize;

use crate::cli::output;

/// Where the run goes besides standard output.
#[derive(Debug, Args)]
pub(super) struct Outlets {
    /// Record what is heard and answered as an MCAP file, which must not be there yet.
    #[arg(long, value_name = "FILE")]
    mcap: Option<PathBuf>,
    /// How events and answers are recorded; diagnostics are always messages of ROS 2.
    #[arg(long, value_name = "FORM", value_enum, default_value_t = Recorded::Json, requires = "mcap")]
    mcap_events: Recorded,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Recorded {
    /// As JSON with schemas, for viewers.
    Json,
    /// As `std_msgs/msg/String`, for `ros2 bag play`.
    String,
}

/// Where it goes; copies lead to the same places.
#[derive(Debug, Clone)]
pub(super) struct Outlet {
    recorder: Option<(Recorder, String)>,
}

impl Outlet {
    /// Opens what is wanted.
    pub(super) fn open(wanted: &Outlets, mission: &str) -> Result<Self, Message> {
        let Some(path) = &wanted.mcap else { return Ok(Self { recorder: None }) };
        let form = match wanted.mcap_events {
            Recorded::Json => Form::Json,
            Recorded::String => Form::Text,
        };
        let name = path.display().to_string();
        let recorder = Recorder::create(path, mission, form).map_err(|error| {
            let exists = error.kind() == io::ErrorKind::AlreadyExists;
            let text = if exists {
                "is there already, and no recording is overwritten: name another file, or remove it"
                    .to_owned()
            } else {
                format!("cannot be written: {error}")
            };
            Message::at("M331", &name, None, text)
        })?;
        let copy = recorder.clone();
        // Who ends the program by a signal wants a file that is whole. If the platform refuses a handler, it can be recovered.
        let _ = ctrlc::set_handler(move || {
            let _ = copy.finish();
            std::process::exit(130);
        });
        Ok(Self { recorder: Some((recorder, name)) })
    }

    /// A line that is about to be handled, with its number and the time since the start of the mission.
    pub(super) fn heard(&self, line: u64, now: Duration, text: &str) {
        if let Some((recorder, _)) = &self.recorder {
            recorder.event(line, now, text);
        }
    }

    /// Writes answers, a line each, at once, so that no other thread's line comes in between.
    pub(super) fn say(&self, lines: &str) -> io::Result<()> {
        let lines = visible_json(lines);
        let mut stdout = io::stdout().lock();
        stdout.write_all(lines.as_bytes())?;
        stdout.flush()?;
        drop(stdout);
        if let Some((recorder, _)) = &self.recorder {
            lines.lines().for_each(|line| recorder.answer(line));
        }
        Ok(())
    }

    /// Writes the answers to a line, each with the line's number, and that it was handled.
    pub(super) fn answer(&self, line: u64, answers: &[impl Serialize], read: Instant) -> io::Result<()> {
        let mut text = String::new();
        for answer in answers {
            text += &output::line(&NumberedAnswer::new(answer, line));
        }
        text += &output::line(&HandledLine::new(line, read.elapsed().as_micros()));
        self.say(&text)
    }

    /// Ends what was opened.
    pub(super) fn close(&self) -> Result<(), Message> {
        let Some((recorder, name)) = &self.recorder else { return Ok(()) };
        recorder.finish().map_err(|error| {
            let text = format!("cannot be written: {error}; what was recorded before can be recovered");
            Message::at("M331", name, None, text)
        })
    }
}
