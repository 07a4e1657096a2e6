//! Where documents spell the names that warnings are about. Parsers hand on triples without their places, so the text is
//! searched for the name: as a whole IRI, or its last part behind a prefix.

use super::text::Text;
use crate::error::{Error, Position, Warning};

/// Only so many warnings are given a place: each costs a search through all documents.
const MOST_SEARCHES: usize = 100;

/// Gives undeclared names the place where a document spells them first.
pub(super) fn locate(warnings: &mut [Warning], texts: &[(String, Text)]) {
    let undeclared = |warning: &&mut Warning| matches!(warning, Warning::Undeclared { .. });
    let mut open: Vec<&mut Warning> = warnings.iter_mut().take(MOST_SEARCHES).filter(undeclared).collect();
    for (name, text) in texts {
        if open.is_empty() {
            return;
        }
        let text = text.get();
        let Ok(words) = std::str::from_utf8(&text) else { continue };
        open.retain_mut(|warning| {
            let Warning::Undeclared { iri, position, .. } = &mut **warning else { return false };
            *position = offset(iri, words).map(|offset| Position::of_offset(name, &text, offset));
            position.is_none()
        });
    }
}

/// An error with the place of what it is about, if it has none and its document spells that.
pub(super) fn placed(error: Error, texts: &[(String, Text)]) -> Error {
    match error {
        Error::TooDeep { file, about: Some(iri), position: None, deepest } => {
            let own: Vec<_> = texts.iter().filter(|(name, _)| *name == file).cloned().collect();
            let position = place(&format!("<{iri}>"), &own);
            Error::TooDeep { file, about: Some(iri), position, deepest }
        }
        error => error,
    }
}

/// Where documents spell the first IRI that a message names in angle brackets.
pub(super) fn place(message: &str, texts: &[(String, Text)]) -> Option<Position> {
    let iri = message.split_once('<')?.1.split_once('>')?.0;
    texts.iter().find_map(|(name, text)| {
        let text = text.get();
        let offset = offset(iri, std::str::from_utf8(&text).ok()?)?;
        Some(Position::of_offset(name, &text, offset))
    })
}

/// Where a text spells an IRI: whole between brackets or quotes, or its local name behind `:` or `#`.
fn offset(iri: &str, text: &str) -> Option<usize> {
    let whole = spelled(text, iri, |c| matches!(c, '<' | '"' | '\''));
    let local = iri.rsplit(['#', '/', ':']).next().filter(|local| !local.is_empty());
    let short = local.and_then(|local| spelled(text, local, |c| matches!(c, ':' | '#')));
    [whole, short].into_iter().flatten().min()
}

/// The first place where a word stands behind one of some characters and no name goes on after it.
fn spelled(text: &str, word: &str, opens: impl Fn(char) -> bool) -> Option<usize> {
    let goes_on = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-');
    memchr::memmem::find_iter(text.as_bytes(), word).find(|offset| {
        text[..*offset].chars().next_back().is_some_and(&opens)
            && !text[offset + word.len()..].chars().next().is_some_and(goes_on)
    })
}
