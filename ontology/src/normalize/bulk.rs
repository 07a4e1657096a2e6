//! Detects statements that no other pass has to process: assertions about named individuals with classes and
//! declared properties. No other statement may make these individuals part of an axiom, a list or a rule.
//! Most triples of a large knowledge base are of this kind. They remain triples of numbers until they become
//! axioms, which saves time and memory.

use std::collections::BTreeSet;

use rustc_hash::FxHashSet;

use crate::names::{Compact, Names, Object};
use crate::triples::Document;
use crate::vocab::{is_reserved, owl, rdf, rdfs};

#[derive(Clone, Copy, Default)]
#[allow(clippy::struct_excessive_bools)] // independent observations
struct NameUse {
    reserved: bool,
    /// `true` if the name is a blank node, or may be part of an axiom, a list, a rule or a header.
    special: bool,
    /// `true` if the name is a blank node or has a type of a reserved vocabulary other than `owl:NamedIndividual`.
    declared: bool,
    class: bool,
    object: bool,
    data: bool,
    annotation: bool,
}

pub(super) struct Usage {
    uses: Vec<NameUse>,
    kind: Option<u32>,
    individual: Option<u32>,
}

impl Usage {
    pub(super) fn of(documents: &[Document], names: &Names) -> Self {
        let reserved = |number| NameUse {
            reserved: is_reserved(names.text(number)),
            special: names.is_blank(number),
            declared: names.is_blank(number),
            ..NameUse::default()
        };
        let uses: Vec<NameUse> = (0..names.len() as u32).map(reserved).collect();
        let [kind, individual] = [rdf::TYPE, owl::NAMED_INDIVIDUAL].map(|iri| names.find(iri));
        let mut usage = Self { uses, kind, individual };
        // A name that occurs only in these annotations is not part of an axiom.
        let comments = [rdfs::LABEL, rdfs::COMMENT, rdfs::SEE_ALSO, rdfs::IS_DEFINED_BY];
        let comments = comments.map(|iri| names.find(iri));
        for triple in documents.iter().flat_map(|document| &document.triples) {
            if !comments.contains(&Some(triple.predicate)) {
                usage.record(triple, names);
            }
        }
        usage
    }

    fn record(&mut self, triple: &Compact, names: &Names) {
        let object = match triple.object {
            Object::Node(object) => Some(object),
            Object::Literal(_) => None,
        };
        if Some(triple.predicate) == self.kind {
            let Some(class) = object else { return };
            if !self.uses[class as usize].reserved || Some(class) == self.individual {
                return;
            }
            let subject = &mut self.uses[triple.subject as usize];
            (subject.special, subject.declared) = (true, true);
            match &**names.text(class) {
                owl::CLASS | rdfs::CLASS => subject.class = true,
                owl::OBJECT_PROPERTY => subject.object = true,
                owl::DATATYPE_PROPERTY => subject.data = true,
                owl::ANNOTATION_PROPERTY => subject.annotation = true,
                _ => {}
            }
        } else if self.uses[triple.predicate as usize].reserved {
            self.uses[triple.subject as usize].special = true;
            if let Some(object) = object {
                self.uses[object as usize].special = true;
            }
        }
    }

    pub(super) fn is_bulk(&self, triple: &Compact) -> bool {
        let uses = |number: u32| self.uses[number as usize];
        let subject = uses(triple.subject);
        // Such a triple may be part of an axiom, or a statement about a property.
        if subject.special || subject.reserved || triple.subject == triple.predicate {
            return false;
        }
        let property = uses(triple.predicate);
        match triple.object {
            Object::Node(class) if Some(triple.predicate) == self.kind => {
                let class = uses(class);
                // An undeclared name in this position becomes a class.
                (class.class || !class.declared) && !class.reserved
            }
            _ if property.reserved || property.annotation => false,
            Object::Node(object) => property.object && !property.data && !uses(object).special,
            Object::Literal(_) => property.data && !property.object,
        }
    }

    pub(super) fn undeclared(&self, bulk: &[Compact], names: &Names) -> BTreeSet<String> {
        let typed = bulk.iter().filter(|triple| Some(triple.predicate) == self.kind);
        let classes: FxHashSet<u32> = typed
            .filter_map(|triple| match triple.object {
                Object::Node(class) if !self.uses[class as usize].class => Some(class),
                _ => None,
            })
            .collect();
        classes.into_iter().map(|class| names.text(class).to_string()).collect()
    }
}
