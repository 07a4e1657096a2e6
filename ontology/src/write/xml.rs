//! Conditions under which triples and text can be written as XML 1.0 [1]. The serializers do not check them.
//!
//! [1] Extensible Markup Language (XML) 1.0, fifth edition, W3C 2008.

use oxrdf::{Term, Triple};

use crate::vocab::rdf;

/// Namespaces that a document must not declare as default namespaces.
const FORBIDDEN_NAMESPACES: [&str; 2] =
    ["http://www.w3.org/2000/xmlns/", "http://www.w3.org/XML/1998/namespace"];

/// # Errors
/// Returns the reason if RDF/XML cannot express a triple.
pub(super) fn require_triples(triples: &[Triple]) -> Result<(), String> {
    for (index, triple) in triples.iter().enumerate() {
        require_name("property", triple.predicate.as_str())?;
        // The class in the first triple of a subject becomes the name of an element.
        let is_first = index == 0 || triples[index - 1].subject != triple.subject;
        match &triple.object {
            Term::NamedNode(class) if is_first && triple.predicate.as_str() == rdf::TYPE => {
                require_name("class", class.as_str())?;
            }
            Term::Literal(literal) => require_text(literal.value())?,
            _ => {}
        }
    }
    Ok(())
}

/// Checks that an IRI can be the name of an element: its end must be an XML name without a colon.
fn require_name(kind: &str, iri: &str) -> Result<(), String> {
    let tail = iri.rfind(|character| !is_name_character(character)).map_or(iri, |start| &iri[start..]);
    if tail.contains(is_name_start) && !FORBIDDEN_NAMESPACES.iter().any(|space| iri.starts_with(space)) {
        return Ok(());
    }
    Err(format!("the end of the {kind} <{iri}> is not an XML name; choose another syntax, such as Turtle"))
}

/// # Errors
/// Returns the reason if a text contains a character that XML forbids.
pub(super) fn require_text(text: &str) -> Result<(), String> {
    let Some((offset, character)) = text.char_indices().find(|(_, character)| !is_allowed(*character)) else {
        return Ok(());
    };
    let line = text[..offset].rsplit('\n').next().unwrap_or_default();
    let context: String = line.chars().rev().take(80).collect::<Vec<_>>().into_iter().rev().collect();
    Err(format!(
        "XML has no character U+{:04X}, which follows `{}`; choose another syntax, such as Turtle",
        u32::from(character),
        context.escape_debug()
    ))
}

/// Escapes each carriage return of a written document. Parsers of XML replace an unescaped one by a line feed.
pub(super) fn escape_line_ends(text: String) -> String {
    if text.contains('\r') { text.replace('\r', "&#xD;") } else { text }
}

/// Production 2 of [1].
fn is_allowed(character: char) -> bool {
    matches!(character, '\t' | '\n' | '\r' | ' '..='\u{FFFD}' | '\u{10000}'..)
}

/// Production 4 of [1], without the colon.
fn is_name_start(character: char) -> bool {
    matches!(character, 'A'..='Z' | '_' | 'a'..='z'
        | '\u{C0}'..='\u{D6}' | '\u{D8}'..='\u{F6}' | '\u{F8}'..='\u{2FF}' | '\u{370}'..='\u{37D}'
        | '\u{37F}'..='\u{1FFF}' | '\u{200C}'..='\u{200D}' | '\u{2070}'..='\u{218F}'
        | '\u{2C00}'..='\u{2FEF}' | '\u{3001}'..='\u{D7FF}' | '\u{F900}'..='\u{FDCF}'
        | '\u{FDF0}'..='\u{FFFD}' | '\u{10000}'..='\u{EFFFF}')
}

/// Production 4a of [1], without the colon.
fn is_name_character(character: char) -> bool {
    is_name_start(character)
        || matches!(character, '-' | '.' | '0'..='9' | '\u{B7}' | '\u{300}'..='\u{36F}' | '\u{203F}'..='\u{2040}')
}
