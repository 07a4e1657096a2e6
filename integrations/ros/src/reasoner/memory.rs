//! State of a reasoner that must survive a restart: its goals, the designs of their functions, and
//! the latest reports.
//!
//! The state is a single file, which is replaced atomically on each change.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use metaplan::file::create;
use metaplan::message::Message;
use serde::{Deserialize, Serialize};

use crate::interfaces::mros2_msgs::msg::QoS;

const FORMAT: &str = "metaplan-reasoner/1";

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Memory {
    format: String,
    /// Last reported event, as a line, by measured attribute or component.
    pub(super) reports: BTreeMap<String, String>,
    pub(super) goals: Vec<Remembered>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Remembered {
    pub(super) goal: [u8; 16],
    /// Requested objective. Its `objective_id` is the final name, which the client may have
    /// omitted.
    pub(super) wanted: QoS,
    /// Design of the goal's function. `None` if no design was set.
    pub(super) design: Option<String>,
}

#[derive(Debug)]
pub(super) struct MemoryFile {
    path: PathBuf,
    last: Memory,
}

impl Memory {
    pub(super) fn new(reports: BTreeMap<String, String>, goals: Vec<Remembered>) -> Self {
        Self { format: FORMAT.to_owned(), reports, goals }
    }
}

impl MemoryFile {
    /// Opens the state file in a directory, and creates the directory if needed. A missing file is
    /// an empty state.
    pub(super) fn open(directory: &Path) -> Result<Self, Message> {
        let path = directory.join("reasoner.json");
        let failed = |text: String| Message::at("N141", &path.display().to_string(), None, text);
        std::fs::create_dir_all(directory)
            .map_err(|error| failed(format!("the directory cannot be created: {error}")))?;
        let last = match std::fs::read_to_string(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Memory::default(),
            Err(error) => return Err(failed(format!("the file cannot be read: {error}"))),
            Ok(text) => {
                serde_json::from_str(&text).map_err(|error| failed(format!("is damaged: {error}")))?
            }
        };
        if last != Memory::default() && last.format != FORMAT {
            return Err(failed(format!("has the format `{}`; this program writes {FORMAT}", last.format)));
        }
        Ok(Self { path, last })
    }

    /// Returns the state that was last read or written.
    pub(super) fn read(&self) -> Memory {
        self.last.clone()
    }

    /// Writes the state to the file if it differs from the stored state.
    pub(super) fn write(&mut self, memory: Memory) -> Result<(), Message> {
        if memory == self.last {
            return Ok(());
        }
        let failed = |error: std::io::Error| {
            Message::at(
                "N141",
                &self.path.display().to_string(),
                None,
                format!("the file cannot be written: {error}"),
            )
        };
        let (mut file, pending) = create(&self.path).map_err(failed)?;
        let text = serde_json::to_string(&memory).unwrap_or_default();
        file.write_all(text.as_bytes()).map_err(failed)?;
        pending.commit().map_err(failed)?;
        self.last = memory;
        Ok(())
    }
}
