//! Which concrete syntax a document is written in, by its content: file names do not tell (real files named `.owl`
//! are RDF/XML or Turtle).

use std::fmt;

/// A concrete syntax of OWL ontologies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Syntax {
    /// RDF/XML.
    RdfXml,
    /// Turtle; N-Triples is a part of it.
    Turtle,
    /// OWL/XML.
    OwlXml,
    /// OWL 2 functional-style syntax.
    Functional,
}

impl fmt::Display for Syntax {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::RdfXml => "RDF/XML",
            Self::Turtle => "Turtle",
            Self::OwlXml => "OWL/XML",
            Self::Functional => "functional-style syntax",
        })
    }
}

impl Syntax {
    /// The syntax that `text` looks like. Anything that is neither XML nor functional-style is taken for Turtle,
    /// whose parser then says what is wrong with it.
    pub fn detect(text: &[u8]) -> Self {
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
        let head = skip_comments(text);
        if head.starts_with(b"<") && !is_iri_reference(head) {
            return match xml_root(head) {
                Some((root, _)) if root.ends_with(b"Ontology") && !root.starts_with(b"owl:") => Self::OwlXml,
                _ => Self::RdfXml,
            };
        }
        let functional = [&b"Prefix("[..], b"Prefix (", b"Ontology(", b"Ontology ("];
        if functional.iter().any(|start| head.starts_with(start)) { Self::Functional } else { Self::Turtle }
    }
}

/// `text` from its first byte that is neither white space nor in a `#` comment.
fn skip_comments(mut text: &[u8]) -> &[u8] {
    loop {
        text = text.trim_ascii_start();
        if !text.starts_with(b"#") {
            return text;
        }
        let end = text.iter().position(|&byte| byte == b'\n').unwrap_or(text.len());
        text = &text[end..];
    }
}

/// Whether a text that starts with `<` starts with an IRI, as Turtle does, and not with an XML tag: only an IRI has a
/// colon and then a slash or no white space before its `>`, and is followed by something that is not a tag.
fn is_iri_reference(text: &[u8]) -> bool {
    let Some(end) = text.iter().position(|&byte| byte == b'>' || byte.is_ascii_whitespace()) else {
        return false;
    };
    text[end] == b'>'
        && text[1..end].windows(3).any(|window| window == b"://" || window.starts_with(b"urn"))
        && !text[1..end].starts_with(b"!")
}

/// The name of the first element after the XML declaration, comments and document type, and what follows the name.
fn xml_root(mut text: &[u8]) -> Option<(&[u8], &[u8])> {
    loop {
        text = &text[text.iter().position(|&byte| byte == b'<')? + 1..];
        let end: &[u8] = match text.first()? {
            b'?' => b"?>",
            b'!' if text.starts_with(b"!--") => b"-->",
            b'!' if text.starts_with(b"!DOCTYPE") && declares_entities(text) => b"]>",
            b'!' => b">",
            _ => {
                let end =
                    text.iter().position(|&byte| byte.is_ascii_whitespace() || b"/>".contains(&byte))?;
                return Some(text.split_at(end));
            }
        };
        text = &text[text.windows(end.len()).position(|window| window == end)? + end.len()..];
    }
}

/// The name of the root element, if nothing closes it.
pub(super) fn unclosed_root(text: &[u8]) -> Option<String> {
    let (root, rest) = xml_root(text)?;
    let close = [b"</", root].concat();
    if text.windows(close.len()).rev().any(|window| window == close) {
        return None;
    }
    let (mut quote, mut previous) = (None, b' ');
    for &byte in rest {
        match (quote, byte) {
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(open), _) if open == byte => quote = None,
            (None, b'>') if previous == b'/' => return None,
            (None, b'>') => break,
            _ => {}
        }
        previous = byte;
    }
    Some(String::from_utf8_lossy(root).into_owned())
}

/// Where the first tag stands that closes another element than the one that is open; or the end of the text, if
/// elements are open there.
pub(super) fn mismatched_tag(text: &[u8]) -> Option<usize> {
    let (mut open, mut at) = (Vec::new(), 0);
    while let Some(start) = text[at..].iter().position(|&byte| byte == b'<').map(|found| at + found) {
        let tag = &text[start..];
        let end: &[u8] = match tag {
            [b'<', b'!', b'-', b'-', ..] => b"-->",
            [b'<', b'?', ..] => b"?>",
            [b'<', b'!', ..] if declares_entities(tag) => b"]>",
            _ => b">",
        };
        let length = match end {
            b">" => end_of_tag(tag),
            _ => tag.windows(end.len()).position(|window| window == end),
        };
        let Some(length) = length else { return Some(start) };
        let inside = &tag[1..length];
        let name = |text: &'_ [u8]| text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
        match inside.first() {
            Some(b'/') if open.pop() != Some(inside[1..].trim_ascii()) => return Some(start),
            Some(b'/' | b'!' | b'?') => {}
            _ if inside.ends_with(b"/") => {}
            _ => open.push(&inside[..name(inside)]),
        }
        at = start + length + end.len();
    }
    (!open.is_empty()).then_some(text.len())
}

/// Where a tag's `>` stands, outside of quotes.
fn end_of_tag(tag: &[u8]) -> Option<usize> {
    let mut quote = None;
    tag.iter().position(|&byte| {
        match (quote, byte) {
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(open), _) if open == byte => quote = None,
            _ => return quote.is_none() && byte == b'>',
        }
        false
    })
}

/// Whether a `!DOCTYPE` has an internal subset, which contains `>` itself.
fn declares_entities(text: &[u8]) -> bool {
    let stop = text.iter().position(|&byte| byte == b'[' || byte == b'>');
    stop.is_some_and(|index| text[index] == b'[')
}

#[cfg(test)]
mod tests {
    use super::Syntax;

    #[test]
    fn content_decides() {
        for (text, expected) in [
            ("<?xml version=\"1.0\"?>\n<rdf:RDF xmlns:rdf=\"r\">", Syntax::RdfXml),
            ("<!DOCTYPE rdf:RDF [ <!ENTITY a \"b\"> ]>\n<rdf:RDF>", Syntax::RdfXml),
            ("\u{feff}<!-- a > b --><Ontology xmlns=\"http://www.w3.org/2002/07/owl#\">", Syntax::OwlXml),
            ("<owl:Ontology rdf:about=\"x\"/>", Syntax::RdfXml),
            ("# comment\n@prefix : <urn:x#> .", Syntax::Turtle),
            ("<http://e/#a> <http://e/#b> <http://e/#c> .", Syntax::Turtle),
            ("<urn:a> <urn:b> <urn:c> .", Syntax::Turtle),
            ("Prefix(:=<http://e/#>)\nOntology(<http://e/>)", Syntax::Functional),
            ("", Syntax::Turtle),
        ] {
            assert_eq!(Syntax::detect(text.as_bytes()), expected, "{text}");
        }
    }
}
