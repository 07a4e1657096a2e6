//! Intermediate form of an ontology's contents, between the readers and the public `Ontology`.

use crate::error::Warning;
use crate::owl::{AnnotatedAxiom, Annotation, EntityKind, Iri, Rule};

/// Contents of an ontology. In the result of `horned::build`, the axioms, entities and annotations are sorted, and
/// the rules are in document order.
#[derive(Debug, Default)]
pub(crate) struct Parts {
    pub entities: Vec<(EntityKind, Iri)>,
    pub axioms: Vec<AnnotatedAxiom>,
    pub annotations: Vec<(Iri, Annotation)>,
    pub annotation_annotations: Vec<(Iri, Annotation, Annotation)>,
    pub rules: Vec<Rule>,
    pub warnings: Vec<Warning>,
}
