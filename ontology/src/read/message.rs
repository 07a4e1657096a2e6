//! What parsers say.

/// Messages of parsers are cut after so many characters.
const LONGEST_MESSAGE: usize = 300;

/// Parsers quote what they cannot read, which may be the whole document.
pub(super) fn shortened(message: &str) -> String {
    match message.char_indices().nth(LONGEST_MESSAGE) {
        Some((end, _)) => format!("{}…", &message[..end]),
        None => message.to_owned(),
    }
}
