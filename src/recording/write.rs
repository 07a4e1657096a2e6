//! What a loop hears and answers to an MCAP file.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{self, Seek, Write};
use std::time::Duration;

use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, WriteOptions, Writer};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use serde_json::value::RawValue;

use crate::mapek::Observation;
use crate::recording::messages::{self, DiagnosticArray, Text, to_cdr};
use crate::recording::schema;

/// The version of recordings.
const FORMAT: &str = "metaplan-recording/1";

/// How events and answers are written.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Form {
    /// As JSON with a schema: viewers know the fields.
    #[default]
    Json,
    /// The same JSON as `std_msgs/msg/String` in CDR. A file with one encoding alone is what `ros2 bag play` needs.
    Text,
}

/// An MCAP file that is being written. Each method takes the time in nanoseconds of the system's clock, which must not go back.
#[derive(Debug)]
pub struct Recording<W: Write + Seek> {
    writer: Out<W>,
    form: Form,
    diagnostics: Topic,
    events: Topic,
    answers: Vec<Topic>,
}

/// A writer of the library, of which there is nothing to be shown.
struct Out<W: Write + Seek>(Writer<W>);

impl<W: Write + Seek> std::fmt::Debug for Out<W> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("an MCAP file")
    }
}

/// A channel, and how many messages it has.
#[derive(Debug)]
struct Topic {
    channel: u16,
    messages: u32,
}

/// A line that was heard, as a message.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct EventMessage<'a> {
    pub(super) line: u64,
    pub(super) nanoseconds: u64,
    #[serde(borrow, default, skip_serializing_if = "Option::is_none")]
    pub(super) event: Option<&'a RawValue>,
    #[serde(borrow, default, skip_serializing_if = "Option::is_none")]
    pub(super) text: Option<Cow<'a, str>>,
}

/// The kind of an answer.
#[derive(Deserialize)]
struct Kind<'a> {
    #[serde(borrow, default)]
    answer: Cow<'a, str>,
}

impl<W: Write + Seek> Recording<W> {
    /// Begins a file: all topics are there from the beginning.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn begin(sink: W, mission: &str, form: Form) -> io::Result<Self> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(format!("metaplan {} {}", env!("CARGO_PKG_VERSION"), mcap::LIBRARY_IDENTIFIER))
            .compression(None)
            // A chunk is written as one piece.
            .disable_seeking(true);
        let mut writer = options.create(sink).map_err(failed)?;
        let metadata = [("format", FORMAT), ("mission", mission), ("version", env!("CARGO_PKG_VERSION"))];
        let metadata = metadata.map(|(key, value)| (key.to_owned(), value.to_owned())).into();
        writer.write_metadata(&Metadata { name: "metaplan".to_owned(), metadata }).map_err(failed)?;
        let (encoding, event, answer) = match form {
            Form::Json => {
                let mut schema = |name: &str, definition: Value| {
                    writer.add_schema(name, "jsonschema", definition.to_string().as_bytes()).map_err(failed)
                };
                ("json", schema(schema::EVENT, schema::event())?, schema(schema::ANSWER, schema::answer())?)
            }
            Form::Text => {
                let definition = messages::TEXT_DEFINITION.as_bytes();
                let text = writer.add_schema(messages::TEXT, "ros2msg", definition).map_err(failed)?;
                ("cdr", text, text)
            }
        };
        let definition = messages::DIAGNOSTICS_DEFINITION.as_bytes();
        let array = writer.add_schema(messages::DIAGNOSTICS, "ros2msg", definition).map_err(failed)?;
        let mut topic = |name: &str, schema: u16, encoding: &str| -> io::Result<Topic> {
            let channel = writer.add_channel(schema, name, encoding, &BTreeMap::new()).map_err(failed)?;
            Ok(Topic { channel, messages: 0 })
        };
        let events = topic(schema::EVENTS, event, encoding)?;
        let diagnostics = topic(schema::DIAGNOSTICS, array, "cdr")?;
        let answers = schema::ANSWERS.iter().map(|(name, _)| topic(name, answer, encoding));
        let answers = answers.collect::<io::Result<_>>()?;
        Ok(Self { writer: Out(writer), form, diagnostics, events, answers })
    }

    /// Writes a line that the loop has heard, with its number and the time since the start of the mission, and what it says of
    /// attributes and components as diagnostics.
    ///
    /// # Errors
    /// The file cannot be written, now or since an error before.
    pub fn event(&mut self, time: u64, line: u64, now: Duration, text: &str) -> io::Result<()> {
        let event = text.starts_with('{').then(|| serde_json::from_str::<&RawValue>(text).ok()).flatten();
        let nanoseconds = u64::try_from(now.as_nanos()).unwrap_or(u64::MAX);
        let text_ = event.is_none().then_some(Cow::Borrowed(text));
        // Texts and numbers are always data.
        let message = serde_json::to_string(&EventMessage { line, nanoseconds, event, text: text_ });
        let bytes = bytes(self.form, message.unwrap_or_default());
        self.writer.message(&mut self.events, time, &bytes)?;
        match DiagnosticArray::of(&Observation::parse(text), time) {
            None => Ok(()),
            Some(array) => self.writer.message(&mut self.diagnostics, time, &to_cdr(&array)),
        }
    }

    /// Writes an answer, which is an object of the format as JSON.
    ///
    /// # Errors
    /// The file cannot be written, now or since an error before.
    pub fn answer(&mut self, time: u64, answer: &str) -> io::Result<()> {
        let kind = serde_json::from_str::<Kind>(answer).map(|kind| schema::topic(&kind.answer));
        let topic = kind.unwrap_or(schema::ANSWERS.len() - 1);
        let bytes = bytes(self.form, answer.to_owned());
        self.writer.message(&mut self.answers[topic], time, &bytes)
    }

    /// Writes all that there is to the sink: the file can be read up to here from now on.
    ///
    /// # Errors
    /// The file cannot be written, now or since an error before.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.0.flush().map_err(failed)
    }

    /// Ends the file with its index.
    ///
    /// # Errors
    /// The file cannot be written, now or since an error before.
    pub fn finish(mut self) -> io::Result<()> {
        self.writer.0.finish().map_err(failed)?;
        self.writer.0.into_inner().flush()
    }
}

impl<W: Write + Seek> Out<W> {
    fn message(&mut self, topic: &mut Topic, time: u64, data: &[u8]) -> io::Result<()> {
        let header = MessageHeader {
            channel_id: topic.channel,
            sequence: topic.messages,
            log_time: time,
            publish_time: time,
        };
        topic.messages = topic.messages.wrapping_add(1);
        self.0.write_to_known_channel(&header, data).map_err(failed)
    }
}

/// JSON as a form has it.
fn bytes(form: Form, json: String) -> Vec<u8> {
    match form {
        Form::Json => json.into_bytes(),
        Form::Text => to_cdr(&Text { data: json }),
    }
}

/// What the library says, as an error of writing.
fn failed(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}
