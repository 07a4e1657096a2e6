//! Writes the input lines and answers of a loop to an MCAP file.

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

const FORMAT: &str = "metaplan-recording/1";

/// Encoding of event lines and answers in a recording.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Form {
    /// JSON with a JSON Schema, so that viewers can display the fields.
    #[default]
    Json,
    /// The JSON text as `std_msgs/msg/String` in CDR. `ros2 bag play` needs files with a single
    /// encoding.
    Text,
}

/// An MCAP file that is open for writing. The parameter `time` of its methods is in nanoseconds of
/// the system's clock, and must not decrease.
#[derive(Debug)]
pub struct Recording<W: Write + Seek> {
    writer: Out<W>,
    form: Form,
    diagnostics: Topic,
    events: Topic,
    answers: Vec<Topic>,
}

/// Wrapper that gives the MCAP writer a `Debug` implementation.
struct Out<W: Write + Seek>(Writer<W>);

impl<W: Write + Seek> std::fmt::Debug for Out<W> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("an MCAP file")
    }
}

#[derive(Debug)]
struct Topic {
    channel: u16,
    messages: u32,
}

/// JSON message for an input line. `event` has the line if it is a JSON object, otherwise `text`
/// has it.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct EventMessage<'a> {
    pub(super) line: u64,
    pub(super) nanoseconds: u64,
    #[serde(borrow, default, skip_serializing_if = "Option::is_none")]
    pub(super) event: Option<&'a RawValue>,
    #[serde(borrow, default, skip_serializing_if = "Option::is_none")]
    pub(super) text: Option<Cow<'a, str>>,
}

#[derive(Deserialize)]
struct Kind<'a> {
    #[serde(borrow, default)]
    answer: Cow<'a, str>,
}

impl<W: Write + Seek> Recording<W> {
    /// Creates a recording in `sink`, with all topics.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn begin(sink: W, mission: &str, form: Form) -> io::Result<Self> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(format!("metaplan {} {}", env!("CARGO_PKG_VERSION"), mcap::LIBRARY_IDENTIFIER))
            // Uncompressed chunks need no decompressor in the reader.
            .compression(None)
            // Without seeking, a chunk is written as a whole.
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

    /// Writes an input line with its number and the time since the start of the mission. If the
    /// line reports measurements or component states, also writes them as diagnostics.
    ///
    /// # Errors
    /// The file cannot be written, or an earlier write has failed.
    pub fn event(&mut self, time: u64, line: u64, now: Duration, text: &str) -> io::Result<()> {
        let event = text.starts_with('{').then(|| serde_json::from_str::<&RawValue>(text).ok()).flatten();
        let nanoseconds = u64::try_from(now.as_nanos()).unwrap_or(u64::MAX);
        let text_ = event.is_none().then_some(Cow::Borrowed(text));
        // Serialisation cannot fail for texts and numbers.
        let message = serde_json::to_string(&EventMessage { line, nanoseconds, event, text: text_ });
        let bytes = bytes(self.form, message.unwrap_or_default());
        self.writer.message(&mut self.events, time, &bytes)?;
        match DiagnosticArray::of(&Observation::parse(text), time) {
            None => Ok(()),
            Some(array) => self.writer.message(&mut self.diagnostics, time, &to_cdr(&array)),
        }
    }

    /// Writes an answer, given as the text of a JSON object, to the topic of its kind.
    ///
    /// # Errors
    /// The file cannot be written, or an earlier write has failed.
    pub fn answer(&mut self, time: u64, answer: &str) -> io::Result<()> {
        let kind = serde_json::from_str::<Kind>(answer).map(|kind| schema::topic(&kind.answer));
        // The last topic takes the kinds that no other topic lists.
        let topic = kind.unwrap_or(schema::ANSWERS.len() - 1);
        let bytes = bytes(self.form, answer.to_owned());
        self.writer.message(&mut self.answers[topic], time, &bytes)
    }

    /// Flushes all messages to the sink, so that the file is readable up to this point.
    ///
    /// # Errors
    /// The file cannot be written, or an earlier write has failed.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.0.flush().map_err(failed)
    }

    /// Completes the file with its index.
    ///
    /// # Errors
    /// The file cannot be written, or an earlier write has failed.
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

fn bytes(form: Form, json: String) -> Vec<u8> {
    match form {
        Form::Json => json.into_bytes(),
        Form::Text => to_cdr(&Text { data: json }),
    }
}

fn failed(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}
