//! Detects the concrete syntax of a document from its content. File names are not reliable: real files named
//! `.owl` are RDF/XML or Turtle.

use std::borrow::Cow;
use std::fmt;

/// A concrete syntax of OWL ontologies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Syntax {
    /// RDF/XML.
    RdfXml,
    /// Turtle, including N-Triples.
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
    /// Detects the syntax of `text`. Text that is neither XML nor functional-style counts as Turtle, whose
    /// parser then reports the errors.
    pub fn detect(text: &[u8]) -> Self {
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

/// Returns `true` if a text that starts with `<` begins with an IRI (Turtle) and not with an XML tag. An
/// IRI ends without white space, and contains a colon or a character that element names cannot contain.
/// An element name with a colon is followed by white space for the declaration of its prefix, except
/// after a document type declaration.
fn is_iri_reference(text: &[u8]) -> bool {
    let Some(end) = text.iter().position(|&byte| byte == b'>' || byte.is_ascii_whitespace()) else {
        return false;
    };
    let inside = &text[1..end];
    let named = |byte: &u8| byte.is_ascii_alphanumeric() || *byte >= 0x80 || b"_-.:/".contains(byte);
    text[end] == b'>'
        && !inside.starts_with(b"!")
        && !inside.starts_with(b"?")
        && (inside.contains(&b':')
            || inside.starts_with(b"#")
            || !inside.iter().all(named)
            || inside.is_empty())
}

/// Returns the name of the root element of an XML document and the text after the name. Skips the XML
/// declaration, comments and the document type declaration before it.
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

pub(super) fn root_attribute<'a>(text: &'a [u8], name: &[u8]) -> Option<&'a str> {
    let (_, mut tail) = xml_root(text)?;
    loop {
        tail = tail.trim_ascii_start();
        let end = tail.iter().position(|&byte| byte == b'=' || byte == b'>')?;
        let (key, value) = tail.split_at(end);
        let value = value.strip_prefix(b"=")?.trim_ascii_start();
        let quote = *value.first().filter(|quote| b"\"'".contains(quote))?;
        let value = &value[1..];
        let (value, after) = value.split_at(value.iter().position(|&byte| byte == quote)?);
        if key.trim_ascii_end() == name {
            return std::str::from_utf8(value).ok();
        }
        tail = &after[1..];
    }
}

pub(super) fn unclosed_root(text: &[u8]) -> Option<String> {
    let (root, tail) = xml_root(text)?;
    let close = [b"</", root].concat();
    if text.windows(close.len()).rev().any(|window| window == close) {
        return None;
    }
    let (mut quote, mut previous) = (None, b' ');
    for &byte in tail {
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

/// Returns the offset of the first closing tag that does not match the open element, or of markup that is not
/// closed. Returns the end of the text if an element is not closed, and `None` if all tags match. The error
/// is the offset at which the nesting exceeds `max_depth`.
pub(super) fn mismatched_tag(text: &[u8], max_depth: usize) -> Result<Option<usize>, usize> {
    let (mut open, mut cursor) = (Vec::new(), 0);
    while let Some((start, end)) = next_markup(text, cursor) {
        let Some(end) = end else { return Ok(Some(start)) };
        if open.len() > max_depth {
            return Err(start);
        }
        let inside = &text[start + 1..end - 1];
        let name = |text: &'_ [u8]| text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
        match inside.first() {
            Some(b'/') if open.pop() != Some(inside[1..].trim_ascii()) => return Ok(Some(start)),
            Some(b'/' | b'!' | b'?') => {}
            // An empty element.
            _ if inside.ends_with(b"/") => {}
            _ => open.push(&inside[..name(inside)]),
        }
        cursor = end;
    }
    Ok((!open.is_empty()).then_some(text.len()))
}

#[derive(Debug)]
pub(super) struct Flattened<'a> {
    pub text: Cow<'a, [u8]>,
    /// Corresponding positions after each change: offset in the rewritten text, and offset in the
    /// original text. Both are increasing.
    pub offsets: Vec<(usize, usize)>,
}

impl<'a> Flattened<'a> {
    pub(super) fn unchanged(text: &'a [u8]) -> Self {
        Self { text: Cow::Borrowed(text), offsets: Vec::new() }
    }

    pub(super) fn origin(&self, offset: usize) -> usize {
        let after = self.offsets.partition_point(|&(rewritten, _)| rewritten <= offset);
        let (rewritten, original) = after.checked_sub(1).map_or((0, 0), |last| self.offsets[last]);
        original + (offset - rewritten)
    }
}

/// Removes comments from an XML document and converts CDATA sections to ordinary text, because
/// horned-owl includes the delimiters of both in literals.
pub(super) fn flattened(text: &[u8]) -> Flattened<'_> {
    const SECTION: &[u8] = b"<![CDATA[";
    let (mut flat, mut offsets, mut cursor, mut copied) = (Vec::new(), Vec::new(), 0, 0);
    while let Some((start, Some(end))) = next_markup(text, cursor) {
        cursor = end;
        let section = text[start..end].strip_prefix(SECTION);
        if section.is_none() && !text[start..].starts_with(b"<!--") {
            continue;
        }
        flat.extend_from_slice(&text[copied..start]);
        for byte in section.map_or(&[][..], |section| &section[..section.len() - b"]]>".len()]) {
            match byte {
                b'<' => flat.extend_from_slice(b"&lt;"),
                b'>' => flat.extend_from_slice(b"&gt;"),
                b'&' => flat.extend_from_slice(b"&amp;"),
                _ => flat.push(*byte),
            }
        }
        copied = end;
        offsets.push((flat.len(), end));
    }
    if offsets.is_empty() {
        return Flattened { text: Cow::Borrowed(text), offsets };
    }
    flat.extend_from_slice(&text[copied..]);
    Flattened { text: Cow::Owned(flat), offsets }
}

/// Returns start and end of the next tag, comment, CDATA section or processing instruction after `from`,
/// or `None` without one. The end is `None` if the markup is not closed.
fn next_markup(text: &[u8], from: usize) -> Option<(usize, Option<usize>)> {
    let start = from + text[from..].iter().position(|&byte| byte == b'<')?;
    let markup = &text[start..];
    let (skip, end): (usize, &[u8]) = match markup {
        [b'<', b'!', b'-', b'-', ..] => (4, b"-->"),
        _ if markup.starts_with(b"<![CDATA[") => (9, b"]]>"),
        [b'<', b'?', ..] => (2, b"?>"),
        [b'<', b'!', ..] if declares_entities(markup) => (2, b"]>"),
        _ => return Some((start, end_of_tag(markup).map(|length| start + length + 1))),
    };
    let length = markup[skip..].windows(end.len()).position(|window| window == end);
    Some((start, length.map(|length| start + skip + length + end.len())))
}

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

/// Returns `true` if a `!DOCTYPE` has an internal subset, which may contain `>`.
fn declares_entities(text: &[u8]) -> bool {
    let stop = text.iter().position(|&byte| byte == b'[' || byte == b'>');
    stop.is_some_and(|index| text[index] == b'[')
}

#[cfg(test)]
mod tests {
    use super::{Syntax, flattened, mismatched_tag};

    #[test]
    fn tags_are_balanced_outside_of_comments_and_character_data() {
        for (text, expected) in [
            ("<a><b/></a>", None),
            ("<a><b></a>", Some(6)),
            ("<a><b></b>", Some(10)),
            ("<a><![CDATA[</b> ]> <c d=\"]]></a>", None),
            ("<a><![CDATA[<b>]]><b></a>", Some(21)),
            ("<a><![CDATA[</a>", Some(3)),
            ("<a><!-- </b> ' --></a>", None),
            ("<!DOCTYPE a [ <!ENTITY b \"c\"> ]><?d <e> ?><a b='>'></a >", None),
        ] {
            assert_eq!(mismatched_tag(text.as_bytes(), 256), Ok(expected), "{text}");
        }
    }

    #[test]
    fn flattening_keeps_offsets() {
        for (text, expected) in [
            ("<a>b</a>", "<a>b</a>"),
            ("<a>b<!-- <c> --> d</a>", "<a>b d</a>"),
            ("<!----><a><![CDATA[<&>]]>!<![CDATA[]]></a>", "<a>&lt;&amp;&gt;!</a>"),
            ("<a b='<!-- c -->'/><!-- open", "<a b='<!-- c -->'/><!-- open"),
        ] {
            let flat = flattened(text.as_bytes());
            assert_eq!(String::from_utf8_lossy(&flat.text), expected, "{text}");
            assert_eq!(flat.origin(flat.text.len()), text.len(), "{text}");
            let (rewritten, original) = (expected.find("</a>"), text.find("</a>"));
            assert_eq!(rewritten.map(|offset| flat.origin(offset)), original, "{text}");
        }
    }

    #[test]
    fn the_content_determines_the_syntax() {
        for (text, expected) in [
            ("<?xml version=\"1.0\"?>\n<rdf:RDF xmlns:rdf=\"r\">", Syntax::RdfXml),
            ("<!DOCTYPE rdf:RDF [ <!ENTITY a \"b\"> ]>\n<rdf:RDF>", Syntax::RdfXml),
            ("<!-- a > b --><Ontology xmlns=\"http://www.w3.org/2002/07/owl#\">", Syntax::OwlXml),
            ("<owl:Ontology rdf:about=\"x\"/>", Syntax::RdfXml),
            ("# comment\n@prefix : <urn:x#> .", Syntax::Turtle),
            ("<http://e/#a> <http://e/#b> <http://e/#c> .", Syntax::Turtle),
            ("<urn:a> <urn:b> <urn:c> .", Syntax::Turtle),
            ("<mailto:a@b> <urn:b> <urn:c> .", Syntax::Turtle),
            ("<tag:x,2020:i> <urn:b> <urn:c> .", Syntax::Turtle),
            ("<file:x> <urn:b> <urn:c> .", Syntax::Turtle),
            ("<#i> <urn:b> <urn:c> .", Syntax::Turtle),
            ("<Ontology>", Syntax::OwlXml),
            ("<RDF/>", Syntax::RdfXml),
            ("Prefix(:=<http://e/#>)\nOntology(<http://e/>)", Syntax::Functional),
            ("", Syntax::Turtle),
        ] {
            assert_eq!(Syntax::detect(text.as_bytes()), expected, "{text}");
        }
    }
}
