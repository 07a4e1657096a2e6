//! `--trace`: a profile of the program in the format of `chrome://tracing`, which Perfetto also
//! opens.

use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};

use crate::file::{Pending, create};
use crate::message::Message;
use tracing_chrome::{ChromeLayerBuilder, FlushGuard};
use tracing_subscriber::layer::SubscriberExt as _;

pub(super) struct Trace {
    flush: FlushGuard,
    errors: Receiver<io::Error>,
    pending: Pending,
    file: PathBuf,
}

impl Trace {
    pub(super) fn begin(file: &Path) -> Result<Self, Message> {
        let (writer, pending) = create(file).map_err(|error| unwritten(file, &error))?;
        let (sender, errors) = channel();
        let writer = ReportingWriter { file: Some(writer), errors: sender };
        let (layer, flush) = ChromeLayerBuilder::new().writer(writer).include_args(true).build();
        let subscriber = tracing_subscriber::registry().with(layer);
        tracing::subscriber::set_global_default(subscriber)
            .map_err(|error| unwritten(file, &io::Error::other(error)))?;
        Ok(Self { flush, errors, pending, file: file.to_owned() })
    }

    pub(super) fn end(self) -> Result<(), Message> {
        // Waits until the thread has written the last event.
        drop(self.flush);
        if let Ok(error) = self.errors.try_recv() {
            return Err(unwritten(&self.file, &error));
        }
        self.pending.commit().map_err(|error| unwritten(&self.file, &error))
    }
}

/// Writer that reports its first error to a channel and discards all further text, because the
/// thread of `tracing_chrome` panics on an error. A closed pipe is not an error.
struct ReportingWriter {
    file: Option<File>,
    errors: Sender<io::Error>,
}

impl Write for ReportingWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Some(file) = &mut self.file
            && let Err(error) = file.write_all(bytes)
        {
            self.file = None;
            if error.kind() != ErrorKind::BrokenPipe {
                // The receiver lives longer than the thread.
                let _ = self.errors.send(error);
            }
        }
        Ok(bytes.len())
    }

    /// Does nothing: the file has no buffer.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn unwritten(file: &Path, error: &io::Error) -> Message {
    let text = format!("the trace cannot be written: {}", error.kind());
    Message::at("M109", &file.display().to_string(), None, text)
}
