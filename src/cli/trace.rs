//! `--trace`: a profile of the program in the format of `chrome://tracing`, which Perfetto also
//! opens.

use std::path::{Path, PathBuf};

use crate::file::{Pending, create};
use crate::message::Message;
use tracing_chrome::{ChromeLayerBuilder, FlushGuard};
use tracing_subscriber::layer::SubscriberExt as _;

pub(super) struct Trace {
    flush: FlushGuard,
    pending: Pending,
    file: PathBuf,
}

impl Trace {
    pub(super) fn begin(file: &Path) -> Result<Self, Message> {
        let (writer, pending) = create(file).map_err(|error| unwritten(file, &error))?;
        let (layer, flush) = ChromeLayerBuilder::new().writer(writer).include_args(true).build();
        let subscriber = tracing_subscriber::registry().with(layer);
        tracing::subscriber::set_global_default(subscriber)
            .map_err(|error| unwritten(file, &std::io::Error::other(error)))?;
        Ok(Self { flush, pending, file: file.to_owned() })
    }

    pub(super) fn end(self) -> Result<(), Message> {
        drop(self.flush);
        self.pending.commit().map_err(|error| unwritten(&self.file, &error))
    }
}

fn unwritten(file: &Path, error: &std::io::Error) -> Message {
    let text = format!("the trace cannot be written: {}", error.kind());
    Message::at("M109", &file.display().to_string(), None, text)
}
