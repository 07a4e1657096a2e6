//! Extracts the lines of events from an MCAP file, in the order of the file.
//!
//! For a recording of Metaplan these are the input lines of the loop, at their original times. For
//! any other file, for example of `ros2 bag record`, they are its diagnostics messages, at times
//! relative to the first of them. An unfinished file, for example after a crash, is read up to its
//! end.

use std::collections::{BTreeMap, VecDeque};
use std::io::{self, Read};
use std::time::Duration;

use mcap::McapError;
use mcap::records::{MessageHeader, Record};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::recording::messages::{self, DiagnosticArray, Text, from_cdr};
use crate::recording::schema;
use crate::recording::unpack::{LARGEST, records};
use crate::recording::write::EventMessage;

/// An event line from an MCAP file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Replayed {
    /// Text of the line, for a loop.
    pub text: String,
    /// Time of the line since the start of the mission. In a file that Metaplan has not recorded: since the first
    /// diagnostics message.
    pub now: Duration,
}

/// Reader that extracts event lines from an MCAP file.
pub struct Replay<R> {
    source: R,
    reader: LinearReader,
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Kind>,
    lines: VecDeque<Replayed>,
    /// Time of the first diagnostics message, in nanoseconds; the times of later ones are relative
    /// to it.
    first: Option<u64>,
    state: State,
}

impl<R> std::fmt::Debug for Replay<R> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Replay").field("state", &self.state).finish_non_exhaustive()
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Reading,
    Finished,
    Unfinished,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Event lines of a recorded loop, as JSON.
    Events,
    /// Event lines of a recorded loop, as JSON text in CDR.
    EventTexts,
    Diagnostics,
}

impl<R: Read> Replay<R> {
    /// Creates a reader for an MCAP file.
    pub fn new(source: R) -> Self {
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_emit_chunks(true)
            .with_record_length_limit(LARGEST);
        Self {
            source,
            reader: LinearReader::new_with_options(options),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            lines: VecDeque::new(),
            first: None,
            state: State::Reading,
        }
    }

    /// Returns the next event line, or `None` at the end of the file.
    ///
    /// # Errors
    /// The source cannot be read, is not an MCAP file, or is damaged; or a complete file has
    /// neither a channel for event lines nor one for diagnostics.
    pub fn next_line(&mut self) -> io::Result<Option<Replayed>> {
        loop {
            if let Some(line) = self.lines.pop_front() {
                return Ok(Some(line));
            }
            if self.state != State::Reading {
                return Ok(None);
            }
            self.read()?;
        }
    }

    /// Returns `true` if the file is truncated, for example by a crash. The answer is valid only
    /// after the end is reached.
    pub fn is_unfinished(&self) -> bool {
        self.state == State::Unfinished
    }

    fn read(&mut self) -> io::Result<()> {
        let record = match self.reader.next_event() {
            Some(Ok(LinearReadEvent::ReadRequest(need))) => {
                let read = self.source.read(self.reader.insert(need))?;
                self.reader.notify_read(read);
                return Ok(());
            }
            Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                mcap::parse_record(opcode, data).map_err(damaged)?.into_owned()
            }
            // A crash leaves a file without its end record.
            None | Some(Err(McapError::UnexpectedEof)) => return self.end(State::Unfinished),
            Some(Err(error)) => return Err(damaged(error)),
        };
        match record {
            Record::DataEnd(_) => self.end(State::Finished),
            Record::Chunk { header, data } => {
                records(&header, &data)?.into_iter().try_for_each(|record| self.take(record))
            }
            other => self.take(other),
        }
    }

    fn end(&mut self, state: State) -> io::Result<()> {
        self.state = state;
        // A truncated file may end before its channels.
        if self.channels.is_empty() && state == State::Finished {
            let text = format!("there is neither {} nor {} in it", schema::EVENTS, messages::DIAGNOSTICS);
            return Err(io::Error::other(text));
        }
        Ok(())
    }

    fn take(&mut self, record: Record<'static>) -> io::Result<()> {
        match record {
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id, header.name);
            }
            Record::Channel(channel) => {
                let schema = self.schemas.get(&channel.schema_id).map_or("", String::as_str);
                let kind = match (channel.topic.as_str(), schema, channel.message_encoding.as_str()) {
                    (schema::EVENTS, schema::EVENT, "json") => Kind::Events,
                    (schema::EVENTS, messages::TEXT, "cdr") => Kind::EventTexts,
                    (_, messages::DIAGNOSTICS, "cdr") => Kind::Diagnostics,
                    _ => return Ok(()),
                };
                self.channels.insert(channel.id, kind);
            }
            Record::Message { header, data } => self.message(&header, &data)?,
            _ => {}
        }
        Ok(())
    }

    fn message(&mut self, header: &MessageHeader, data: &[u8]) -> io::Result<()> {
        let wrong = |what: &str, why: String| {
            let text = format!(
                "message {} of channel {} is not a {what}: {why}",
                header.sequence, header.channel_id
            );
            io::Error::other(text)
        };
        let replayed = |json: &str| -> io::Result<Replayed> {
            let event: EventMessage =
                serde_json::from_str(json).map_err(|error| wrong(schema::EVENT, error.to_string()))?;
            let raw = event.event.map(|raw| raw.get().to_owned());
            let text = raw.or(event.text.map(Into::into));
            let text =
                text.ok_or_else(|| wrong(schema::EVENT, "it has neither `event` nor `text`".to_owned()))?;
            Ok(Replayed { text, now: Duration::from_nanos(event.nanoseconds) })
        };
        let line = match self.channels.get(&header.channel_id) {
            None => return Ok(()),
            Some(Kind::Events) => {
                replayed(std::str::from_utf8(data).map_err(|error| wrong(schema::EVENT, error.to_string()))?)?
            }
            Some(Kind::EventTexts) => {
                replayed(&from_cdr::<Text>(data).map_err(|why| wrong(messages::TEXT, why))?.data)?
            }
            // The events of the recorded loop already contain these diagnostics.
            Some(Kind::Diagnostics) if self.channels.values().any(|kind| *kind != Kind::Diagnostics) => {
                return Ok(());
            }
            Some(Kind::Diagnostics) => {
                let array =
                    from_cdr::<DiagnosticArray>(data).map_err(|why| wrong(messages::DIAGNOSTICS, why))?;
                // A foreign recording has no start of a mission, so its first message defines time
                // 0.
                let first = *self.first.get_or_insert(header.log_time);
                let now = Duration::from_nanos(header.log_time.saturating_sub(first));
                // Serialisation cannot fail for texts and numbers.
                Replayed { text: serde_json::to_string(&array).unwrap_or_default(), now }
            }
        };
        self.lines.push_back(line);
        Ok(())
    }
}

fn damaged(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        McapError::BadMagic => io::Error::other("it is not an MCAP file"),
        other => io::Error::other(format!("it is damaged: {other}")),
    }
}
