//! Result of opening a journal.

use crate::message::Message;

/// Result of opening a journal.
#[derive(Debug, Clone, Default)]
pub struct Recovery {
    /// Number of observations replayed when the journal was opened. `None` for a new journal.
    pub replayed: Option<u64>,
    /// Number of bytes of an incomplete last record that were cut off.
    pub cut: u64,
    /// Faults of the journal that did not affect the recovery.
    pub warnings: Vec<Message>,
}
