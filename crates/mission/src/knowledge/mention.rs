//! Messages about an individual, at the place where the documents mention it.

use ontology::vocab::local_name;

use super::base::Knowledge;
use crate::message::Message;

/// Creates a warning at the first occurrence of an individual's local name in the documents, except on
/// comment lines. Without an occurrence, the warning has no location.
pub fn doubt_about(knowledge: &Knowledge, code: &str, iri: &str, text: String) -> Message {
    let name = local_name(iri);
    // `fd_a` must not match inside `fd_ab`, and a comment is not the place to correct.
    let is_part = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == '-');
    for file in knowledge.documents() {
        let Ok(document) = std::fs::read_to_string(file) else { continue };
        for (line, number) in document.lines().zip(1..) {
            let place = line.match_indices(name).find(|(at, _)| {
                !is_part(line[..*at].chars().next_back()) && !is_part(line[at + name.len()..].chars().next())
            });
            if let Some((at, _)) = place.filter(|_| !line.trim_start().starts_with('#')) {
                let column = line[..at].chars().count() + 1;
                return Message::warning_at(code, file, (number, column), text).with_source(&document);
            }
        }
    }
    Message::warning(code, text)
}
