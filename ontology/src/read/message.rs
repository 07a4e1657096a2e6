//! Messages of parsers.

const MAX_MESSAGE_CHARS: usize = 300;

/// Truncates a message: parsers quote the unreadable text, which may be the whole document.
pub(super) fn shortened(message: &str) -> String {
    match message.char_indices().nth(MAX_MESSAGE_CHARS) {
        Some((end, _)) => format!("{}…", &message[..end]),
        None => message.to_owned(),
    }
}
