//! One document to triples: the parser that its content asks for, blank nodes renamed so that documents can be merged.
//!
//! OWL/XML and functional-style documents are first written as RDF by `crate::horned`, so that everything after
//! this file sees triples only.

use std::borrow::Cow;

use oxrdf::{BlankNode, NamedOrBlankNode, Term, Triple};
use rustc_hash::FxHashMap as HashMap;

use super::message::shortened;
use super::structural::Structural;
use super::syntax::{self, Syntax};
use super::{encoding, entities, foreign};
use crate::error::{Error, Errors, Position};
use crate::graph::iri_of;
use crate::names::{Compact, Names, Object};
use crate::triples::Document;
use crate::vocab::{owl, rdf};

/// After so many syntax errors in one document its parser is stopped.
const MOST_ERRORS: usize = 10;

/// The text of a document in UTF-8, without a byte order mark.
pub(crate) fn decoded<'a>(bytes: &'a [u8], name: &str) -> Result<Cow<'a, [u8]>, Errors> {
    encoding::decoded(bytes).map_err(|message| {
        let position = Position::of_offset(name, bytes, 0);
        Error::Malformed { position, syntax: Syntax::RdfXml, message }.into()
    })
}

/// Refuses a document that is in none of the syntaxes.
///
/// # Errors
/// The document is in another syntax, which the error names.
pub(crate) fn require_syntax(text: &[u8], name: &str) -> Result<(), Errors> {
    match foreign::recognized(text) {
        Some(what) => {
            Err(vec![Error::OtherSyntax { position: Position::of_offset(name, text, 0), what }].into())
        }
        None => Ok(()),
    }
}

/// Parses `text`. Relative IRIs are resolved against `base`; blank nodes get names that start with `prefix`, and all names
/// numbers of `names`.
pub(crate) fn parse(
    text: &[u8],
    name: &str,
    base: &str,
    prefix: &str,
    names: &mut Names,
) -> Result<Document, Errors> {
    let syntax = Syntax::detect(text);
    let mut sink = Sink { names, prefix, blanks: HashMap::default(), triples: Vec::new() };
    match syntax {
        Syntax::Turtle if parse_ntriples(text, &mut sink) => {}
        Syntax::Turtle => parse_turtle(text, name, base, &mut sink)?,
        Syntax::RdfXml => parse_rdf_xml(text, name, base, &mut sink)?,
        Syntax::OwlXml => {
            let ntriples = Structural { name, text, syntax }.owl_xml()?;
            parse_turtle(&ntriples, name, base, &mut sink)?;
        }
        Syntax::Functional => {
            let ntriples = Structural { name, text, syntax }.functional()?;
            parse_turtle(&ntriples, name, base, &mut sink)?;
        }
    }
    let Sink { names, triples, .. } = sink;
    let [kind, ontology, imports, version] =
        [rdf::TYPE, owl::ONTOLOGY, owl::IMPORTS, owl::VERSION_IRI].map(|iri| names.number(iri));
    let is_header = |triple: &&Compact| {
        triple.predicate == kind
            && matches!(triple.object, Object::Node(class) if class == ontology)
            && !names.is_blank(triple.subject)
    };
    let header = triples.iter().find(is_header).map(|triple| names.text(triple.subject).clone());
    let objects = |predicate: u32| {
        let matching = triples.iter().filter(move |triple| triple.predicate == predicate);
        matching.filter_map(|triple| match triple.object {
            Object::Node(object) if !names.is_blank(object) => Some(names.text(object).clone()),
            _ => None,
        })
    };
    let version = objects(version).next();
    let place = |iri: &str| std::str::from_utf8(text).ok()?.find(iri);
    let position = |iri: &str| place(iri).map(|offset| Position::of_offset(name, text, offset));
    let imports = objects(imports).map(|iri| (iri.to_string(), position(&iri))).collect();
    Ok(Document { name: name.to_owned(), syntax, iri: header, version, imports, triples })
}

/// Takes triples, and numbers blank nodes in order of appearance: parsers give anonymous ones random names, and two documents
/// may use one name for two nodes.
struct Sink<'a> {
    names: &'a mut Names,
    prefix: &'a str,
    blanks: HashMap<String, u32>,
    triples: Vec<Compact>,
}

impl Sink<'_> {
    fn add(&mut self, triple: Triple) {
        let (blanks, prefix) = (&mut self.blanks, self.prefix);
        let blank = |names: &mut Names, node: &BlankNode| {
            let next = blanks.len();
            let fresh = || names.blank(&format!("{prefix}b{next}"));
            *blanks.entry(node.as_str().to_owned()).or_insert_with(fresh)
        };
        let triple = self.names.compact(triple, blank);
        self.triples.push(triple);
    }
}

/// The ontology IRI declared in `head`, the start of a document (its end may be cut off).
pub(crate) fn ontology_iri(head: &[u8]) -> Option<String> {
    let base = "file:///";
    let head = encoding::decoded(head).ok()?;
    let head = entities::expanded(&head).ok()?.text.into_owned();
    let head = head.as_slice();
    let is_header = |triple: &Triple| {
        triple.predicate.as_str() == rdf::TYPE && iri_of(&triple.object) == Some(owl::ONTOLOGY)
    };
    let triple = match Syntax::detect(head) {
        Syntax::Turtle => {
            let parser = oxttl::TurtleParser::new().with_base_iri(base).ok()?;
            parser.for_slice(head).map_while(Result::ok).find(is_header)
        }
        Syntax::RdfXml => {
            let parser = oxrdfxml::RdfXmlParser::new().with_base_iri(base).ok()?;
            parser.for_slice(head).map_while(Result::ok).find(is_header)
        }
        Syntax::OwlXml => return between(head, "ontologyIRI=\"", '"'),
        Syntax::Functional => return between(head, "Ontology(<", '>'),
    }?;
    match triple.subject {
        NamedOrBlankNode::NamedNode(node) => Some(node.into_string()),
        NamedOrBlankNode::BlankNode(_) => None,
    }
}

fn between(text: &[u8], start: &str, end: char) -> Option<String> {
    let text = String::from_utf8_lossy(text);
    let rest = &text[text.find(start)? + start.len()..];
    rest.find(end).map(|length| rest[..length].to_owned())
}

/// Takes the triples of a document that is N-Triples, which is Turtle without abbreviations: nothing is left to resolve. `false`
/// where it is not, or where resolving would change an IRI.
fn parse_ntriples(text: &[u8], sink: &mut Sink) -> bool {
    let start = text.iter().find(|byte| !byte.is_ascii_whitespace());
    if !matches!(start, Some(b'<' | b'_' | b'#')) || memchr::memmem::find(text, b"/.").is_some() {
        return false;
    }
    let known = sink.names.len();
    // To check each IRI once, and not each time it is named, takes half as long. Nothing else may be left unchecked.
    let plain = memchr::memchr(b'\\', text).is_none();
    let parser = oxttl::NTriplesParser::new();
    let parser = if plain { parser.lenient() } else { parser };
    let triples =
        parser.for_slice(text).map(|result| result.ok().filter(|triple| !plain || is_strict(triple)));
    for triple in triples {
        let Some(triple) = triple else {
            sink.triples.clear();
            sink.blanks.clear();
            return false;
        };
        sink.add(triple);
    }
    let is_wrong = |name: &str| !name.starts_with("_:") && oxiri::Iri::parse(name).is_err();
    if plain && (known..sink.names.len()).any(|number| is_wrong(sink.names.text(number as u32))) {
        sink.triples.clear();
        sink.blanks.clear();
        return false;
    }
    true
}

/// Whether a triple is one that a parser takes that is not lenient, as far as its IRIs are valid.
fn is_strict(triple: &Triple) -> bool {
    let is_blank = |node: &oxrdf::NamedNode| node.as_str().starts_with("_:");
    if is_blank(&triple.predicate)
        || matches!(&triple.subject, NamedOrBlankNode::NamedNode(node) if is_blank(node))
    {
        return false;
    }
    match &triple.object {
        Term::NamedNode(node) => !is_blank(node),
        Term::Literal(literal) => {
            let is_tag = |tag| oxrdf::Literal::new_language_tagged_literal("", tag).is_ok();
            let tagged = [rdf::LANG_STRING, rdf::DIR_LANG_STRING];
            let is_datatype = || !tagged.contains(&literal.datatype().as_str());
            literal.language().map_or_else(is_datatype, is_tag) && !literal.value().contains(['\n', '\r'])
        }
        Term::BlankNode(_) => true,
    }
}

fn parse_turtle(text: &[u8], name: &str, base: &str, sink: &mut Sink) -> Result<(), Errors> {
    let mut parser = oxttl::TurtleParser::new();
    if let Ok(with_base) = parser.clone().with_base_iri(base) {
        parser = with_base;
    }
    let mut errors = Vec::new();
    for result in parser.for_slice(text) {
        match result {
            Ok(triple) => sink.add(triple),
            Err(error) => {
                errors.push(malformed_turtle(&error, name));
                if errors.len() == MOST_ERRORS {
                    break;
                }
            }
        }
    }
    if errors.is_empty() { Ok(()) } else { Err(errors.into()) }
}

/// Refuses what is not N-Triples: entities and prefixes can make much of a short text.
pub(crate) fn require_ntriples(text: &[u8], name: &str) -> Result<(), Errors> {
    match oxttl::NTriplesParser::new().for_slice(text).find_map(Result::err) {
        Some(error) => Err(vec![malformed_turtle(&error, name)].into()),
        None => Ok(()),
    }
}

fn malformed_turtle(error: &oxttl::TurtleSyntaxError, name: &str) -> Error {
    let start = error.location().start;
    let position = Position { file: name.to_owned(), line: start.line + 1, column: start.column + 1 };
    Error::Malformed { position, syntax: Syntax::Turtle, message: shortened(error.message()) }
}

fn parse_rdf_xml(text: &[u8], name: &str, base: &str, sink: &mut Sink) -> Result<(), Errors> {
    let mut parser = oxrdfxml::RdfXmlParser::new();
    if let Ok(with_base) = parser.clone().with_base_iri(base) {
        parser = with_base;
    }
    let malformed = |offset, message: &str| {
        let position = Position::of_offset(name, text, offset);
        vec![Error::Malformed { position, syntax: Syntax::RdfXml, message: shortened(message) }]
    };
    let flat = entities::expanded(text).map_err(|fault| malformed(fault.offset, &fault.message))?;
    let mut parser = parser.for_slice(&flat.text);
    while let Some(result) = parser.next() {
        match result {
            Ok(triple) => sink.add(triple),
            Err(error) => {
                let offset = usize::try_from(parser.buffer_position()).unwrap_or(usize::MAX);
                return Err(malformed(flat.origin(offset), &error.to_string()).into());
            }
        }
    }
    // The parser takes the end of the text for the end of the document, wherever it is.
    if let Some(root) = syntax::unclosed_root(&flat.text) {
        return Err(malformed(text.len(), &format!("the document ends before </{root}>")).into());
    }
    Ok(())
}
