//! Parses one document to triples. The content selects the parser, and blank nodes are renamed, so that
//! documents can be merged.
//!
//! `crate::horned` first converts OWL/XML and functional-style documents to RDF, so that all later stages
//! process triples.

use std::borrow::Cow;

use oxrdf::{BlankNode, NamedOrBlankNode, Term, Triple};
use rustc_hash::{FxHashMap as HashMap, FxHashSet};

use super::message::shortened;
use super::structural::Structural;
use super::syntax::{self, Syntax};
use super::{encoding, entities, foreign};
use crate::error::{Error, Errors, Position};
use crate::graph::iri_of;
use crate::names::{Compact, Names, Object};
use crate::normalize::TRUE;
use crate::triples::Document;
use crate::vocab::{owl, rdf, swrl};

/// Number of syntax errors in a Turtle document after which parsing stops. Other parsers stop at the first
/// error.
const MAX_SYNTAX_ERRORS: usize = 10;

pub(crate) fn decoded<'a>(bytes: &'a [u8], name: &str) -> Result<Cow<'a, [u8]>, Errors> {
    encoding::decoded(bytes).map_err(|message| {
        let position = Position::of_offset(name, bytes, 0);
        Error::Malformed { position, syntax: Syntax::RdfXml, message }.into()
    })
}

pub(crate) fn require_syntax(text: &[u8], name: &str) -> Result<(), Errors> {
    match foreign::recognized(text) {
        Some(what) => {
            Err(vec![Error::OtherSyntax { position: Position::of_offset(name, text, 0), what }].into())
        }
        None => Ok(()),
    }
}

/// Parses a document to triples. Relative IRIs are resolved against `base`, and the names of blank nodes
/// start with `prefix`. All names are added to `names`.
pub(crate) fn parse(
    text: &[u8],
    name: &str,
    base: &str,
    prefix: &str,
    names: &mut Names,
) -> Result<Document, Errors> {
    let syntax = Syntax::detect(text);
    let text = match syntax {
        Syntax::RdfXml | Syntax::OwlXml => &*with_line_feeds(text),
        Syntax::Turtle | Syntax::Functional => text,
    };
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
    let Sink { names, mut triples, .. } = sink;
    remove_truth(&mut triples, names);
    let [rdf_type, ontology, imports, version] =
        [rdf::TYPE, owl::ONTOLOGY, owl::IMPORTS, owl::VERSION_IRI].map(|iri| names.number(iri));
    let is_header = |triple: &&Compact| {
        triple.predicate == rdf_type
            && matches!(triple.object, Object::Node(class) if class == ontology)
            && !names.is_blank(triple.subject)
    };
    // A document may contain headers of other ontologies; the first header counts.
    let header = triples.iter().find(is_header).map(|triple| names.text(triple.subject).clone());
    let objects = |predicate: u32| {
        let matching = triples.iter().filter(move |triple| triple.predicate == predicate);
        matching.filter_map(|triple| match triple.object {
            Object::Node(object) if !names.is_blank(object) => Some(names.text(object).clone()),
            _ => None,
        })
    };
    let version = objects(version).next();
    // Parsers report no positions of triples, so the text is searched for the IRI.
    let offset_of = |iri: &str| std::str::from_utf8(text).ok()?.find(iri);
    let position = |iri: &str| offset_of(iri).map(|offset| Position::of_offset(name, text, offset));
    let imports = objects(imports).map(|iri| (iri.to_string(), position(&iri))).collect();
    Ok(Document { name: name.to_owned(), syntax, iri: header, version, imports, triples })
}

/// Replaces each line end of an XML document (CR LF, or CR alone) by LF, as XML requires before parsing [1]. The
/// numbers of lines do not change.
///
/// [1] Extensible Markup Language (XML) 1.0, fifth edition, W3C 2008, section 2.11.
fn with_line_feeds(text: &[u8]) -> Cow<'_, [u8]> {
    if memchr::memchr(b'\r', text).is_none() {
        return text.into();
    }
    let mut result = Vec::with_capacity(text.len());
    for (index, &byte) in text.iter().enumerate() {
        match byte {
            b'\r' if text.get(index + 1) == Some(&b'\n') => {}
            b'\r' => result.push(b'\n'),
            _ => result.push(byte),
        }
    }
    result.into()
}

/// Removes the atoms `sameAs(TRUE, TRUE)` that `crate::horned` adds to an empty body or head of a rule, so that
/// the list is empty again.
fn remove_truth(triples: &mut Vec<Compact>, names: &mut Names) {
    let Some(truth) = names.find(TRUE) else { return };
    let [argument, first, nil] = [swrl::ARGUMENT1, rdf::FIRST, rdf::NIL].map(|iri| names.number(iri));
    let subjects = |triples: &[Compact], predicate: u32, objects: &FxHashSet<u32>| -> FxHashSet<u32> {
        let matches = |triple: &&Compact| {
            triple.predicate == predicate
                && matches!(triple.object, Object::Node(node) if objects.contains(&node))
        };
        triples.iter().filter(matches).map(|triple| triple.subject).collect()
    };
    let atoms = subjects(triples, argument, &FxHashSet::from_iter([truth]));
    let lists = subjects(triples, first, &atoms);
    triples.retain(|triple| !atoms.contains(&triple.subject) && !lists.contains(&triple.subject));
    for triple in triples {
        if let Object::Node(node) = &mut triple.object
            && lists.contains(node)
        {
            *node = nil;
        }
    }
}

/// Collects the triples of a document. Blank nodes are numbered in order of appearance: parsers give random
/// names to anonymous blank nodes, and two documents may use one label for different nodes.
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

/// Returns the ontology IRI that `head`, the start of a possibly truncated document, declares.
pub(crate) fn ontology_iri(head: &[u8]) -> Option<String> {
    let base = "file:///";
    let head = encoding::decoded(head).ok()?;
    // The ontology IRI may contain an entity.
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
    let tail = &text[text.find(start)? + start.len()..];
    tail.find(end).map(|length| tail[..length].to_owned())
}

/// Parses a document in N-Triples, a subset of Turtle without relative IRIs and prefixes. Returns `false` and
/// no triples if the document is not N-Triples. A document with `/.` is also rejected, because the Turtle
/// parser may change an IRI by removing dot segments.
fn parse_ntriples(text: &[u8], sink: &mut Sink) -> bool {
    let start = text.iter().find(|byte| !byte.is_ascii_whitespace());
    if !matches!(start, Some(b'<' | b'_' | b'#')) || memchr::memmem::find(text, b"/.").is_some() {
        return false;
    }
    let first_new = sink.names.len();
    // A text without escapes is parsed without checks. Instead, each distinct IRI is checked once, after
    // parsing, and `is_strict` does the other checks. This takes half the time of checking each occurrence.
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
    if plain && (first_new..sink.names.len()).any(|number| is_wrong(sink.names.text(number as u32))) {
        sink.triples.clear();
        sink.blanks.clear();
        return false;
    }
    true
}

/// Returns `true` if the strict parser would accept the triple, given that its IRIs are valid.
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
                if errors.len() == MAX_SYNTAX_ERRORS {
                    break;
                }
            }
        }
    }
    if errors.is_empty() { Ok(()) } else { Err(errors.into()) }
}

/// Rejects documents that are not N-Triples: with entities or prefixes, a short text can expand to a very large
/// one.
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
    // The parser does not report an unclosed root element.
    if let Some(root) = syntax::unclosed_root(&flat.text) {
        return Err(malformed(text.len(), &format!("the document ends before </{root}>")).into());
    }
    Ok(())
}
