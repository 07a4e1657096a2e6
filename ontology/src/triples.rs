//! Parsed documents.

use std::sync::Arc;

use crate::error::Position;
use crate::names::Compact;
use crate::read::syntax::Syntax;

#[derive(Debug)]
pub(crate) struct Document {
    pub name: String,
    pub syntax: Syntax,
    pub iri: Option<Arc<str>>,
    pub version: Option<Arc<str>>,
    /// Imported IRIs in order of appearance, each with the position of its first occurrence, if the text contains the
    /// IRI literally.
    pub imports: Vec<(String, Option<Position>)>,
    pub triples: Vec<Compact>,
}
