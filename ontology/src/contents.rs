//! What an ontology says, while it is being put together.

use crate::error::Warning;
use crate::owl::{AnnotatedAxiom, Annotation, EntityKind, Iri, Rule};

/// The contents of an ontology, each list sorted but the rules, which are in document order.
#[derive(Debug, Default)]
pub(crate) struct Parts {
    pub entities: Vec<(EntityKind, Iri)>,
    pub axioms: Vec<AnnotatedAxiom>,
    pub annotations: Vec<(Iri, Annotation)>,
    pub annotation_annotations: Vec<(Iri, Annotation, Annotation)>,
    pub rules: Vec<Rule>,
    pub warnings: Vec<Warning>,
}
