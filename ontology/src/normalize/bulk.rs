//! Which statements no pass has to look at: assertions about named individuals with classes and declared properties, where
//! nothing is said of the individuals that could be part of an axiom, a list or a rule. Most of a large knowledge base are
//! such, and they stay triples of numbers until they become axioms.

use std::collections::BTreeSet;

use rustc_hash::FxHashSet;

use crate::names::{Compact, Names, Object};
use crate::triples::Document;
use crate::vocab::{is_reserved, owl, rdf, rdfs};

/// What is said of a name, as far as it matters here.
#[derive(Clone, Copy, Default)]
#[allow(clippy::struct_excessive_bools)] // independent observations
struct Said {
    /// The name of a vocabulary.
    reserved: bool,
    /// It may be part of an axiom, a list, a rule or a header; or it is a blank node.
    special: bool,
    /// It is a blank node, or declared to be something.
    known: bool,
    class: bool,
    object: bool,
    data: bool,
    annotation: bool,
}

/// What documents say of all names, by number.
pub(super) struct Known {
    said: Vec<Said>,
    kind: Option<u32>,
    individual: Option<u32>,
}

impl Known {
    pub(super) fn of(documents: &[Document], names: &Names) -> Self {
        let reserved = |number| Said {
            reserved: is_reserved(names.text(number)),
            special: names.is_blank(number),
            known: names.is_blank(number),
            ..Said::default()
        };
        let said: Vec<Said> = (0..names.len() as u32).map(reserved).collect();
        let [kind, individual] = [rdf::TYPE, owl::NAMED_INDIVIDUAL].map(|iri| names.find(iri));
        let mut known = Self { said, kind, individual };
        let comments = [rdfs::LABEL, rdfs::COMMENT, rdfs::SEE_ALSO, rdfs::IS_DEFINED_BY];
        let comments = comments.map(|iri| names.find(iri));
        for triple in documents.iter().flat_map(|document| &document.triples) {
            if !comments.contains(&Some(triple.predicate)) {
                known.note(triple, names);
            }
        }
        known
    }

    fn note(&mut self, triple: &Compact, names: &Names) {
        let object = match triple.object {
            Object::Node(object) => Some(object),
            Object::Literal(_) => None,
        };
        if Some(triple.predicate) == self.kind {
            let Some(class) = object else { return };
            if !self.said[class as usize].reserved || Some(class) == self.individual {
                return;
            }
            let own = &mut self.said[triple.subject as usize];
            (own.special, own.known) = (true, true);
            match &**names.text(class) {
                owl::CLASS | rdfs::CLASS => own.class = true,
                owl::OBJECT_PROPERTY => own.object = true,
                owl::DATATYPE_PROPERTY => own.data = true,
                owl::ANNOTATION_PROPERTY => own.annotation = true,
                _ => {}
            }
        } else if self.said[triple.predicate as usize].reserved {
            self.said[triple.subject as usize].special = true;
            if let Some(object) = object {
                self.said[object as usize].special = true;
            }
        }
    }

    /// Whether a triple is a statement that no pass has to look at.
    pub(super) fn is_bulk(&self, triple: &Compact) -> bool {
        let said = |number: u32| self.said[number as usize];
        let subject = said(triple.subject);
        if subject.special || subject.reserved || triple.subject == triple.predicate {
            return false;
        }
        let property = said(triple.predicate);
        match triple.object {
            Object::Node(class) if Some(triple.predicate) == self.kind => {
                let class = said(class);
                (class.class || !class.known) && !class.reserved
            }
            _ if property.reserved || property.annotation => false,
            Object::Node(object) => property.object && !property.data && !said(object).special,
            Object::Literal(_) => property.data && !property.object,
        }
    }

    /// The classes that such statements name and nothing declares.
    pub(super) fn undeclared(&self, bulk: &[Compact], names: &Names) -> BTreeSet<String> {
        let typed = bulk.iter().filter(|triple| Some(triple.predicate) == self.kind);
        let classes: FxHashSet<u32> = typed
            .filter_map(|triple| match triple.object {
                Object::Node(class) if !self.said[class as usize].class => Some(class),
                _ => None,
            })
            .collect();
        classes.into_iter().map(|class| names.text(class).to_string()).collect()
    }
}
