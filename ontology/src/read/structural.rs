//! OWL/XML and functional-style documents as N-Triples: what their readers do not take is treated or refused before.

use super::entities;
use super::message::shortened;
use super::syntax::{self, Syntax};
use crate::error::{Error, Errors, Position};
use crate::horned;
use crate::normalize::depth::MAX_NESTING;

/// A document in one of the two.
pub(super) struct Structural<'a> {
    pub name: &'a str,
    pub text: &'a [u8],
    pub syntax: Syntax,
}

impl Structural<'_> {
    fn malformed(&self, offset: usize, message: &str) -> Errors {
        let (position, message) = (self.place(offset), shortened(message));
        Error::Malformed { position, syntax: self.syntax, message }.into()
    }

    fn place(&self, offset: usize) -> Position {
        Position::of_offset(self.name, self.text, offset)
    }

    fn too_deep(&self, offset: usize) -> Errors {
        let (file, position) = (self.name.to_owned(), Some(self.place(offset)));
        Error::TooDeep { file, about: None, position, deepest: MAX_NESTING }.into()
    }

    /// OWL/XML as N-Triples.
    pub(super) fn owl_xml(&self) -> Result<Vec<u8>, Errors> {
        let whole =
            entities::expanded(self.text).map_err(|fault| self.malformed(fault.offset, &fault.message))?;
        // The reader takes memory without end where an element is not closed, and recurses into elements.
        match syntax::mismatched_tag(&whole.text, MAX_NESTING + MARGIN) {
            Ok(None) => {}
            Ok(Some(offset)) => {
                let message = "an element is not closed, or another one than is open";
                return Err(self.malformed(whole.origin(offset), message));
            }
            Err(offset) => return Err(self.too_deep(whole.origin(offset))),
        }
        let flat = syntax::flattened(&whole.text);
        let fault =
            |fault: horned::Fault| self.malformed(whole.origin(flat.origin(fault.offset)), &fault.message);
        horned::transcribe(&flat.text, self.syntax).map(relabelled).map_err(fault)
    }

    /// Functional-style syntax as N-Triples.
    pub(super) fn functional(&self) -> Result<Vec<u8>, Errors> {
        let words = Words { text: self.text, at: 0 };
        let mut depth = 0_usize;
        for (offset, word) in words.clone() {
            match word {
                b"(" => depth += 1,
                b")" => depth = depth.saturating_sub(1),
                _ => {}
            }
            if depth > MAX_NESTING + MARGIN {
                return Err(self.too_deep(offset));
            }
        }
        let fault = |fault: horned::Fault| match undeclared_prefix(words.clone()) {
            Some((offset, prefix)) => {
                self.malformed(offset, &format!("the prefix `{prefix}` is not declared"))
            }
            None => self.malformed(fault.offset, &fault.message),
        };
        horned::transcribe(self.text, self.syntax).map(relabelled).map_err(fault)
    }
}

/// Elements or parentheses around an expression: ontology, axiom, annotations.
const MARGIN: usize = 8;

/// The words of functional-style syntax with their places: parentheses, equality signs, names; strings, IRIs and comments
/// are passed over.
#[derive(Clone)]
struct Words<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Iterator for Words<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let rest = &self.text[self.at..];
            let length = match rest.first()? {
                byte if byte.is_ascii_whitespace() => 1,
                b'#' => rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len()),
                b'<' => rest.iter().position(|&byte| byte == b'>').map_or(rest.len(), |end| end + 1),
                b'"' => string_length(rest),
                _ => break,
            };
            self.at += length;
        }
        let rest = &self.text[self.at..];
        let ends = |byte: &u8| byte.is_ascii_whitespace() || b"()=<\"".contains(byte);
        let length = rest.iter().position(ends).unwrap_or(rest.len()).max(1);
        let start = self.at;
        self.at += length;
        Some((start, &rest[..length]))
    }
}

fn string_length(text: &[u8]) -> usize {
    let mut escaped = false;
    for (at, &byte) in text.iter().enumerate().skip(1) {
        match (escaped, byte) {
            (false, b'"') => return at + 1,
            (false, b'\\') => escaped = true,
            _ => escaped = false,
        }
    }
    text.len()
}

/// The first name whose prefix nothing declares; OWL's own prefixes need no declaration.
fn undeclared_prefix(words: Words) -> Option<(usize, String)> {
    let mut declared: Vec<&[u8]> =
        vec![b"owl:", b"rdf:", b"rdfs:", b"xsd:", b"xml:", b"_:", b"swrl:", b"swrlb:"];
    let mut before: [&[u8]; 2] = [b"", b""];
    for (offset, word) in words {
        if let Some(colon) = word.iter().position(|&byte| byte == b':') {
            let start = word.iter().rposition(|&byte| byte == b'^').map_or(0, |at| at + 1).min(colon);
            let prefix = &word[start..=colon];
            if before == [&b"Prefix"[..], b"("] {
                declared.push(prefix);
            } else if !declared.contains(&prefix) {
                return Some((offset + start, String::from_utf8_lossy(prefix).into_owned()));
            }
        }
        before = [before[1], word];
    }
    None
}

/// The readers keep `_:` as a part of the names of blank nodes, so that writing N-Triples says it twice.
fn relabelled(ntriples: Vec<u8>) -> Vec<u8> {
    const TWICE: &[u8] = b"_:_:";
    if !ntriples.windows(TWICE.len()).any(|window| window == TWICE) {
        return ntriples;
    }
    let mut result = Vec::with_capacity(ntriples.len());
    for line in ntriples.split_inclusive(|&byte| byte == b'\n') {
        for (place, term) in line.splitn(3, |&byte| byte == b' ').enumerate() {
            if place > 0 {
                result.push(b' ');
            }
            match term.strip_prefix(TWICE) {
                Some(label) => {
                    // A name of the document is not one of the writer's.
                    result.extend_from_slice(b"_:own-");
                    result.extend_from_slice(label);
                }
                None => result.extend_from_slice(term),
            }
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prefixes_are_declared_before_they_are_used() {
        for (text, expected) in [
            ("Prefix(:=<http://x#>) Ontology(<http://x> Declaration(Class(:A)))", None),
            ("Ontology(<http://x>\nDeclaration(Class(foo:A))\n)", Some((38, "foo:"))),
            ("Prefix(a:=<u:>) Ontology(Annotation(a:b \"c:d (\") # e:f\n)", None),
            ("Ontology(ClassAssertion(owl:Thing _:x))", None),
            ("Prefix(a:=<u:>) Ontology(DataPropertyAssertion(a:p a:i \"1\"^^b:c))", Some((60, "b:"))),
        ] {
            let found = undeclared_prefix(Words { text: text.as_bytes(), at: 0 });
            let expected = expected.map(|(offset, prefix)| (offset, prefix.to_owned()));
            assert_eq!(found, expected, "{text}");
        }
    }
}
