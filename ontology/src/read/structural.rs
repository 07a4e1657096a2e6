//! Converts OWL/XML and functional-style documents to N-Triples. Input that horned-owl's readers do not handle
//! is rewritten or rejected first.

use std::borrow::Cow;

use rustc_hash::FxHashSet;

use super::entities;
use super::message::shortened;
use super::syntax::{self, Syntax};
use crate::error::{Error, Errors, Position};
use crate::horned;
use crate::normalize::depth::MAX_NESTING;
use crate::vocab::{owl, rdf, rdfs, swrl, swrlb, xsd};

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

    pub(super) fn owl_xml(&self) -> Result<Vec<u8>, Errors> {
        let expanded =
            entities::expanded(self.text).map_err(|fault| self.malformed(fault.offset, &fault.message))?;
        // horned-owl allocates memory without limit if an element is not closed, and recurses into elements.
        match syntax::mismatched_tag(&expanded.text, MAX_NESTING + NESTING_MARGIN) {
            Ok(None) => {}
            Ok(Some(offset)) => {
                let message = "an element is not closed, or another one than is open";
                return Err(self.malformed(expanded.origin(offset), message));
            }
            Err(offset) => return Err(self.too_deep(expanded.origin(offset))),
        }
        let flat = syntax::flattened(&expanded.text);
        let fault =
            |fault: horned::Fault| self.malformed(expanded.origin(flat.origin(fault.offset)), &fault.message);
        horned::transcribe(&flat.text, self.syntax).map(relabelled).map_err(fault)
    }

    pub(super) fn functional(&self) -> Result<Vec<u8>, Errors> {
        let words = Words { text: self.text, cursor: 0 };
        let mut depth = 0_usize;
        for (offset, word) in words.clone() {
            match word {
                b"(" => depth += 1,
                b")" => depth = depth.saturating_sub(1),
                _ => {}
            }
            if depth > MAX_NESTING + NESTING_MARGIN {
                return Err(self.too_deep(offset));
            }
        }
        let undeclared = undeclared_prefixes(words.clone());
        let standard = |prefix: &[u8]| STANDARD_PREFIXES.iter().find(|(name, _)| name.as_bytes() == prefix);
        let missing = undeclared.iter().filter_map(|(_, prefix)| standard(prefix));
        let declarations = missing.map(|(name, iri)| format!("Prefix({name}=<{iri}>)"));
        let declarations = declarations.collect::<Vec<_>>().concat();
        let fault = |fault: horned::Fault| {
            match undeclared.iter().find(|(_, prefix)| standard(prefix).is_none()) {
                // horned-owl reports an undeclared prefix as a generic syntax error.
                Some((offset, prefix)) => {
                    let prefix = String::from_utf8_lossy(prefix);
                    self.malformed(*offset, &format!("the prefix `{prefix}` is not declared"))
                }
                None => self.malformed(fault.offset.saturating_sub(declarations.len()), &fault.message),
            }
        };
        let mut text = without_double_inverses(words);
        if !declarations.is_empty() {
            text = [declarations.as_bytes(), &text].concat().into();
        }
        horned::transcribe(&text, self.syntax).map(relabelled).map_err(fault)
    }
}

/// Replaces each axiom `InverseObjectProperties(p ObjectInverseOf(q))`, in which horned-owl accepts only names,
/// by the equivalent `EquivalentObjectProperties(p q)`. The offsets of all other axioms remain.
fn without_double_inverses(words: Words<'_>) -> Cow<'_, [u8]> {
    const AXIOM: &[u8] = b"InverseObjectProperties";
    const REPLACEMENT: &[u8] = b"EquivalentObjectProperties";
    const INVERSE: &[u8] = b"ObjectInverseOf";
    let text = words.text;
    let mut result = Cow::Borrowed(text);
    let mut words = words;
    while let Some((start, word)) = words.next() {
        if word != AXIOM {
            continue;
        }
        // Offsets of the first inverse of the axiom, its opening and its closing parenthesis.
        let (mut depth, mut inverse, mut open, mut close) = (0_usize, None, None, None);
        for (offset, word) in words.clone() {
            match word {
                INVERSE if depth == 1 && inverse.is_none() => inverse = Some(offset),
                b"(" => {
                    if inverse.is_some() && open.is_none() {
                        open = Some(offset);
                    }
                    depth += 1;
                }
                b")" => {
                    depth = depth.saturating_sub(1);
                    if open.is_some() && close.is_none() {
                        close = Some(offset);
                    }
                }
                _ => {}
            }
            if depth == 0 {
                break;
            }
        }
        let (Some(inverse), Some(open), Some(close)) = (inverse, open, close) else { continue };
        let result = result.to_mut();
        result[inverse..inverse + INVERSE.len()].fill(b' ');
        result[open] = b' ';
        result[close] = b' ';
        // The replacement is longer than the name of the axiom, so that the text up to the inverse moves.
        result.copy_within(start + AXIOM.len()..inverse, start + REPLACEMENT.len());
        result[start..start + REPLACEMENT.len()].copy_from_slice(REPLACEMENT);
    }
    result
}

/// Nesting levels allowed in addition to those of an expression: ontology, axiom and annotations around
/// the expression.
const NESTING_MARGIN: usize = 8;

/// Iterates over the words of functional-style syntax with their offsets: parentheses, equality signs and
/// names. Skips strings, IRIs and comments.
#[derive(Clone)]
struct Words<'a> {
    text: &'a [u8],
    cursor: usize,
}

impl<'a> Iterator for Words<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let tail = &self.text[self.cursor..];
            let length = match tail.first()? {
                byte if byte.is_ascii_whitespace() => 1,
                b'#' => tail.iter().position(|&byte| byte == b'\n').unwrap_or(tail.len()),
                b'<' => tail.iter().position(|&byte| byte == b'>').map_or(tail.len(), |end| end + 1),
                b'"' => string_length(tail),
                _ => break,
            };
            self.cursor += length;
        }
        let tail = &self.text[self.cursor..];
        let ends = |byte: &u8| byte.is_ascii_whitespace() || b"()=<\"".contains(byte);
        let length = tail.iter().position(ends).unwrap_or(tail.len()).max(1);
        let start = self.cursor;
        self.cursor += length;
        Some((start, &tail[..length]))
    }
}

fn string_length(text: &[u8]) -> usize {
    let mut escaped = false;
    for (index, &byte) in text.iter().enumerate().skip(1) {
        match (escaped, byte) {
            (false, b'"') => return index + 1,
            (false, b'\\') => escaped = true,
            _ => escaped = false,
        }
    }
    text.len()
}

/// Prefixes that need no declaration ([1], section 2.4), and prefixes that tools use without a declaration.
///
/// [1] OWL 2 Web Ontology Language, Structural Specification and Functional-Style Syntax, W3C 2012.
const STANDARD_PREFIXES: [(&str, &str); 7] = [
    ("rdf:", rdf::NS),
    ("rdfs:", rdfs::NS),
    ("xsd:", xsd::NS),
    ("owl:", owl::NS),
    ("xml:", "http://www.w3.org/XML/1998/namespace"),
    ("swrl:", swrl::NS),
    ("swrlb:", swrlb::NS),
];

/// Returns the prefixes without a declaration, each with the offset of its first use.
fn undeclared_prefixes(words: Words<'_>) -> Vec<(usize, &[u8])> {
    // The prefix of blank nodes is part of the grammar.
    let mut visited = FxHashSet::<&[u8]>::from_iter([&b"_:"[..]]);
    let (mut undeclared, mut previous) = (Vec::new(), [&b""[..]; 2]);
    for (offset, word) in words {
        if let Some(colon) = word.iter().position(|&byte| byte == b':') {
            let start = word.iter().rposition(|&byte| byte == b'^').map_or(0, |index| index + 1).min(colon);
            let prefix = &word[start..=colon];
            let is_declaration = previous == [&b"Prefix"[..], b"("];
            if visited.insert(prefix) && !is_declaration {
                undeclared.push((offset + start, prefix));
            }
        }
        previous = [previous[1], word];
    }
    undeclared
}

/// Replaces `_:_:` at the start of labels of blank nodes by `_:own-`. The reason is that horned-owl's readers
/// keep the prefix as part of the label, and the writer adds another prefix.
fn relabelled(ntriples: Vec<u8>) -> Vec<u8> {
    const DOUBLE_PREFIX: &[u8] = b"_:_:";
    if !ntriples.windows(DOUBLE_PREFIX.len()).any(|window| window == DOUBLE_PREFIX) {
        return ntriples;
    }
    let mut result = Vec::with_capacity(ntriples.len());
    for line in ntriples.split_inclusive(|&byte| byte == b'\n') {
        for (index, term) in line.splitn(3, |&byte| byte == b' ').enumerate() {
            if index > 0 {
                result.push(b' ');
            }
            match term.strip_prefix(DOUBLE_PREFIX) {
                Some(label) => {
                    // The prefix `own-` separates labels of the document from labels that the writer generates.
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
    fn double_inverses_become_equivalences() {
        for (text, expected) in [
            ("InverseObjectProperties(:p :q)", "InverseObjectProperties(:p :q)"),
            (
                "InverseObjectProperties(:p ObjectInverseOf(:q)) A(:b)",
                "EquivalentObjectProperties(:p :q ) A(:b)",
            ),
            (
                "InverseObjectProperties(Annotation(:a \"ObjectInverseOf(\") ObjectInverseOf(<u:q>) :p)",
                "EquivalentObjectProperties(Annotation(:a \"ObjectInverseOf(\") <u:q> :p)",
            ),
            (
                "InverseObjectProperties(ObjectInverseOf(:q) ObjectInverseOf(:p))",
                "EquivalentObjectProperties( :q ObjectInverseOf(:p))",
            ),
            ("InverseObjectProperties(:p ObjectInverseOf(", "InverseObjectProperties(:p ObjectInverseOf("),
        ] {
            let actual = without_double_inverses(Words { text: text.as_bytes(), cursor: 0 });
            // The length remains, so that offsets after the axiom do.
            assert_eq!(actual.len(), text.len(), "{text}");
            let words: Vec<String> =
                String::from_utf8_lossy(&actual).split_whitespace().map(str::to_owned).collect();
            assert_eq!(words.join(" "), expected, "{text}");
        }
    }

    #[test]
    fn undeclared_prefixes_are_listed_once() {
        for (text, expected) in [
            ("Prefix(:=<http://x#>) Ontology(<http://x> Declaration(Class(:A)))", &[][..]),
            ("Ontology(<http://x>\nDeclaration(Class(foo:A))\n)", &[(38, "foo:")]),
            ("Prefix(a:=<u:>) Ontology(Annotation(a:b \"c:d (\") # e:f\n)", &[]),
            ("Ontology(ClassAssertion(owl:Thing _:x) ClassAssertion(owl:Thing _:y))", &[(24, "owl:")]),
            ("Prefix(a:=<u:>) Ontology(DataPropertyAssertion(a:p a:i \"1\"^^b:c))", &[(60, "b:")]),
        ] {
            let actual = undeclared_prefixes(Words { text: text.as_bytes(), cursor: 0 });
            let expected: Vec<_> =
                expected.iter().map(|(offset, prefix)| (*offset, prefix.as_bytes())).collect();
            assert_eq!(actual, expected, "{text}");
        }
    }
}
