//! Finds positions for warnings and errors about names. Parsers return triples without positions, so the text is
//! searched for the name: for the whole IRI, or for the local name after a prefix.

use super::text::Text;
use crate::error::{Error, Position, Warning};

/// Limit on the number of warnings for which a position is searched, because each search can visit all
/// documents.
const MAX_SEARCHES: usize = 100;

/// Sets the position of each warning about an undeclared name to the first occurrence of the name in the
/// documents. Considers only the first [`MAX_SEARCHES`] of them.
pub(super) fn locate(warnings: &mut [Warning], texts: &[(String, Text)]) {
    let undeclared = |warning: &&mut Warning| matches!(warning, Warning::Undeclared { .. });
    let mut unlocated: Vec<&mut Warning> =
        warnings.iter_mut().filter(undeclared).take(MAX_SEARCHES).collect();
    for (name, text) in texts {
        if unlocated.is_empty() {
            return;
        }
        let text = text.get();
        let Ok(words) = std::str::from_utf8(&text) else { continue };
        unlocated.retain_mut(|warning| {
            let Warning::Undeclared { iri, position, .. } = &mut **warning else { return false };
            *position = offset(iri, words).map(|offset| Position::of_offset(name, &text, offset));
            // Once a warning has a position, its name is not searched for in further documents.
            position.is_none()
        });
    }
}

pub(super) fn placed(error: Error, texts: &[(String, Text)]) -> Error {
    match error {
        Error::TooDeep { file, about: Some(iri), position: None, deepest } => {
            let document_texts: Vec<_> = texts.iter().filter(|(name, _)| *name == file).cloned().collect();
            let position = place(&format!("<{iri}>"), &document_texts);
            Error::TooDeep { file, about: Some(iri), position, deepest }
        }
        error => error,
    }
}

/// Returns the first position, in the documents, of the first IRI in angle brackets in `message`. Returns
/// `None` if `message` contains no such IRI, or if no document contains it.
pub(super) fn place(message: &str, texts: &[(String, Text)]) -> Option<Position> {
    let iri = message.split_once('<')?.1.split_once('>')?.0;
    texts.iter().find_map(|(name, text)| {
        let text = text.get();
        let offset = offset(iri, std::str::from_utf8(&text).ok()?)?;
        Some(Position::of_offset(name, &text, offset))
    })
}

/// Returns the byte offset of the first occurrence of an IRI in a text. The text may contain the whole IRI in
/// brackets or quotes, or its local name after `:` or `#`.
fn offset(iri: &str, text: &str) -> Option<usize> {
    let whole = spelled(text, iri, |c| matches!(c, '<' | '"' | '\''));
    let local = iri.rsplit(['#', '/', ':']).next().filter(|local| !local.is_empty());
    let short = local.and_then(|local| spelled(text, local, |c| matches!(c, ':' | '#')));
    [whole, short].into_iter().flatten().min()
}

/// Returns the byte offset of the first occurrence of a word that is not the prefix of a longer name. Only
/// occurrences after a character that `opens` accepts count.
fn spelled(text: &str, word: &str, opens: impl Fn(char) -> bool) -> Option<usize> {
    let continues = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-');
    memchr::memmem::find_iter(text.as_bytes(), word).find(|offset| {
        text[..*offset].chars().next_back().is_some_and(&opens)
            && !text[offset + word.len()..].chars().next().is_some_and(continues)
    })
}
