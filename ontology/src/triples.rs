//! Documents as triples.

use std::sync::Arc;

use crate::error::Position;
use crate::names::Compact;
use crate::read::syntax::Syntax;

/// The triples of one document and what they say about the document.
#[derive(Debug)]
pub(crate) struct Document {
    /// Path or name, for messages.
    pub name: String,
    pub syntax: Syntax,
    /// The ontology IRI, if the document declares one.
    pub iri: Option<Arc<str>>,
    pub version: Option<Arc<str>>,
    /// The IRIs imported, in order of appearance, with the place of each where it is spelled out.
    pub imports: Vec<(String, Option<Position>)>,
    pub triples: Vec<Compact>,
}
