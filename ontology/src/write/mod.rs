//! Writes knowledge bases in all supported syntaxes: documents and their imports are merged into one document
//! without imports.
//!
//! The RDF syntaxes contain every triple that was read, except imports and the headers of all documents but the first,
//! with renamed blank nodes. The annotations of these headers remain, and their properties are declared if necessary.
//! Functional-style syntax and OWL/XML contain entities, axioms, annotations and rules; all other triples cause
//! warnings.

mod functional;
mod xml;

use std::path::Path;

use oxrdf::{NamedNode, Triple};
use oxrdfio::{RdfFormat, RdfSerializer};

use crate::error::{Error, Errors, Warning};
use crate::horned;
use crate::read::{self, ReadOptions};
use crate::vocab::{owl, rdf, rdfs, swrl, tomasys, xsd};

/// An output syntax.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputSyntax {
    /// RDF/XML.
    RdfXml,
    /// Turtle.
    Turtle,
    /// N-Triples, sorted and without duplicates.
    NTriples,
    /// OWL/XML.
    OwlXml,
    /// OWL 2 functional-style syntax with `DLSafeRule` for rules.
    Functional,
}

/// Reads documents with their imports and writes them as one document.
///
/// ```
/// use ontology::{OutputSyntax, ReadOptions, convert_files};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let (text, _warnings) = convert_files(&["kb/ugv.ttl"], &ReadOptions::default(), OutputSyntax::NTriples)?;
/// assert!(text.lines().all(|line| line.ends_with(" .")));
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// Returns the errors of [`crate::read_files`], and [`Error::Unwritable`] if the syntax cannot express a
/// statement.
pub fn convert_files<P: AsRef<Path>>(
    files: &[P],
    options: &ReadOptions,
    syntax: OutputSyntax,
) -> Result<(String, Vec<Warning>), Errors> {
    let format = match syntax {
        OutputSyntax::RdfXml => RdfFormat::RdfXml,
        OutputSyntax::Turtle => RdfFormat::Turtle,
        OutputSyntax::NTriples => RdfFormat::NTriples,
        OutputSyntax::OwlXml | OutputSyntax::Functional => {
            let ontology = read::read_files(files, options)?;
            functional::require_rules(&ontology).map_err(|reason| {
                let syntax =
                    if syntax == OutputSyntax::OwlXml { "OWL/XML" } else { "functional-style syntax" };
                vec![Error::Unwritable { syntax, reason }]
            })?;
            let text = functional::document(&ontology);
            let text = match syntax {
                OutputSyntax::Functional => text,
                _ => xml::require_text(&text)
                    .and_then(|()| horned::owl_xml(text.as_bytes()))
                    .map(xml::escape_line_ends)
                    .map_err(|reason| vec![Error::Unwritable { syntax: "OWL/XML", reason }])?,
            };
            return Ok((text, ontology.warnings));
        }
    };
    let (mut triples, warnings) = read::merged(files, options)?;
    if format == RdfFormat::NTriples {
        triples.sort_by_cached_key(ToString::to_string);
        triples.dedup();
    }
    serialize(format, &triples)
        .map(|text| (text, warnings))
        .map_err(|reason| Error::Unwritable { syntax: format.name(), reason }.into())
}

/// Converts N-Triples of [`crate::ntriples()`] to Turtle. Declares the prefixes of the vocabularies that occur.
///
/// # Errors
/// Returns [`Error::Unwritable`] if the text is not N-Triples.
pub fn turtle(ntriples: &str) -> Result<String, Error> {
    let unwritable = |reason| Error::Unwritable { syntax: "Turtle", reason };
    let parsed: Result<Vec<Triple>, _> =
        oxttl::NTriplesParser::new().for_slice(ntriples.as_bytes()).collect();
    let triples = parsed.map_err(|error| unwritable(error.to_string()))?;
    serialize(RdfFormat::Turtle, &triples).map_err(unwritable)
}

fn serialize(format: RdfFormat, triples: &[Triple]) -> Result<String, String> {
    if format == RdfFormat::RdfXml {
        xml::require_triples(triples)?;
    }
    let mut serializer = RdfSerializer::from_format(format);
    for (prefix, namespace) in [
        ("owl", owl::NS),
        ("rdf", rdf::NS),
        ("rdfs", rdfs::NS),
        ("swrl", swrl::NS),
        ("tomasys", tomasys::NS),
        ("xsd", xsd::NS),
    ] {
        // Unused prefixes are not declared.
        let uses = |iri: &NamedNode| iri.as_str().starts_with(namespace);
        let used = |triple: &Triple| {
            uses(&triple.predicate)
                || matches!(&triple.object, oxrdf::Term::NamedNode(iri) if uses(iri))
                || matches!(&triple.subject, oxrdf::NamedOrBlankNode::NamedNode(iri) if uses(iri))
        };
        if triples.iter().any(used) {
            serializer = serializer.with_prefix(prefix, namespace).map_err(|error| error.to_string())?;
        }
    }
    let mut writer = serializer.for_writer(Vec::new());
    for triple in triples {
        writer.serialize_triple(triple).map_err(|error| error.to_string())?;
    }
    let bytes = writer.finish().map_err(|error| error.to_string())?;
    let mut text = String::from_utf8(bytes).map_err(|error| error.to_string())?;
    if !text.is_empty() && !text.ends_with('\n') {
        text.push('\n');
    }
    if format == RdfFormat::RdfXml {
        text = xml::escape_line_ends(text);
    }
    Ok(text)
}
