//! `--trace`: what the program spends its time on, in the format of `chrome://tracing`, which Perfetto opens, too.

use std::path::{Path, PathBuf};

use metaplan::file::temporary;
use metaplan::message::Message;
use tempfile::TempPath;
use tracing_chrome::{ChromeLayerBuilder, FlushGuard};
use tracing_subscriber::layer::SubscriberExt as _;

/// A trace under way. The file has its name only once it is whole.
pub(super) struct Trace {
    flush: FlushGuard,
    written: TempPath,
    file: PathBuf,
}

impl Trace {
    /// Begins to take notes of spans, until [`Trace::end`].
    ///
    /// # Errors
    /// The file cannot be made.
    pub(super) fn begin(file: &Path) -> Result<Self, Message> {
        let made = temporary(file).map_err(|error| unwritten(file, &error))?;
        let (writer, written) = made.into_parts();
        let (layer, flush) = ChromeLayerBuilder::new().writer(writer).include_args(true).build();
        let subscriber = tracing_subscriber::registry().with(layer);
        tracing::subscriber::set_global_default(subscriber)
            .map_err(|error| unwritten(file, &std::io::Error::other(error)))?;
        Ok(Self { flush, written, file: file.to_owned() })
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn end(self) -> Result<(), Message> {
        drop(self.flush);
        self.written.persist(&self.file).map_err(|error| unwritten(&self.file, &error.error))
    }
}

fn unwritten(file: &Path, error: &std::io::Error) -> Message {
    let text = format!("the trace cannot be written: {}", error.kind());
    Message::at("M109", &file.display().to_string(), None, text)
}
