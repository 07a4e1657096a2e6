//! Annotations of entities, and annotations of these annotations.

use horned_owl::model::{self as ho, RcStr};

use super::Builder;
use crate::owl::{ANONYMOUS, Annotation, AnnotationValue, Iri};

impl Builder {
    /// Adds an axiom about an annotation property, which an ontology keeps as an annotation.
    pub(super) fn annotate_property(
        &mut self,
        property: &str,
        (relation, value): (&str, &str),
        annotations: Vec<Annotation>,
    ) {
        let (subject, property) = (self.iri(property), self.iri(relation));
        let value = AnnotationValue::Iri(self.iri(value));
        self.annotate(subject, Annotation { property, value }, annotations);
    }

    /// Adds an annotation with its own annotations.
    pub(super) fn annotate(&mut self, subject: Iri, annotation: Annotation, annotations: Vec<Annotation>) {
        let own = annotations.into_iter().map(|own| (subject.clone(), annotation.clone(), own));
        self.parts.annotation_annotations.extend(own);
        self.parts.annotations.push((subject, annotation));
    }

    pub(super) fn annotation(&mut self, annotation: &ho::Annotation<RcStr>) -> Annotation {
        let value = match &annotation.av {
            ho::AnnotationValue::Literal(literal) => AnnotationValue::Literal(self.literal(literal)),
            ho::AnnotationValue::IRI(iri) => AnnotationValue::Iri(self.iri(iri)),
            // Blank nodes that are only the value of an annotation have no identity of their own.
            ho::AnnotationValue::AnonymousIndividual(_) => AnnotationValue::Iri(self.iri(ANONYMOUS)),
        };
        Annotation { property: self.iri(&annotation.ap), value }
    }
}
