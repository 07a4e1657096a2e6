//! Result of opening a journal.

use crate::message::Message;

/// Result of opening a journal.
#[derive(Debug, Clone, Default)]
pub struct Recovery {
    /// Number of observations since the restored snapshot, or since the beginning. `None` for a new journal.
    pub replayed: Option<u64>,
    /// Number of bytes of incomplete records that were cut off.
    pub cut: u64,
    /// Faults in files that were not needed, and a message if the last records of the journal are missing.
    pub warnings: Vec<Message>,
}
