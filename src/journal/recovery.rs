//! What was found when a journal was opened.

use crate::message::Message;

/// What opening a journal has come to.
#[derive(Debug, Clone, Default)]
pub struct Recovery {
    /// How many observations were handled again; none for a new journal.
    pub replayed: Option<u64>,
    /// How many bytes of an incomplete record were cut off.
    pub cut: u64,
    /// What is wrong with the journal and has changed nothing.
    pub warnings: Vec<Message>,
}
