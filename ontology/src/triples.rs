//! Parsed documents.

use std::sync::Arc;

use crate::error::Position;
use crate::names::{Compact, Names, Object};
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

impl Document {
    /// Returns `true` if the triples of two documents are equal except for the names of blank nodes. Expects that the
    /// documents have equal texts, so that blank nodes correspond by position.
    pub(crate) fn has_equal_triples(&self, other: &Self, names: &Names) -> bool {
        let node = |first, second| first == second || names.is_blank(first) && names.is_blank(second);
        let object = |first: &Object, second: &Object| match (first, second) {
            (Object::Node(first), Object::Node(second)) => node(*first, *second),
            (Object::Literal(first), Object::Literal(second)) => first == second,
            _ => false,
        };
        let is_equal = |(first, second): (&Compact, &Compact)| {
            node(first.subject, second.subject)
                && first.predicate == second.predicate
                && object(&first.object, &second.object)
        };
        self.triples.len() == other.triples.len() && self.triples.iter().zip(&other.triples).all(is_equal)
    }
}
