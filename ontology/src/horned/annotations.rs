//! Annotations of entities, and annotations of these annotations.

use horned_owl::model::{self as ho, RcStr};

use super::Builder;
use crate::owl::{ANONYMOUS, Annotation, AnnotationValue, Iri};

impl Builder {
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

    pub(super) fn annotate(&mut self, subject: Iri, annotation: Annotation, annotations: Vec<Annotation>) {
        let nested = annotations.into_iter().map(|nested| (subject.clone(), annotation.clone(), nested));
        self.parts.annotation_annotations.extend(nested);
        self.parts.annotations.push((subject, annotation));
    }

    pub(super) fn annotation(&mut self, annotation: &ho::Annotation<RcStr>) -> Annotation {
        let value = match &annotation.av {
            ho::AnnotationValue::Literal(literal) => AnnotationValue::Literal(self.literal(literal)),
            ho::AnnotationValue::IRI(iri) => AnnotationValue::Iri(self.iri(iri)),
            // A blank node that is only the value of an annotation needs no identity.
            ho::AnnotationValue::AnonymousIndividual(_) => AnnotationValue::Iri(self.iri(ANONYMOUS)),
        };
        Annotation { property: self.iri(&annotation.ap), value }
    }
}
