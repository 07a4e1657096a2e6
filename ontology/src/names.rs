//! Interns IRIs: each IRI is stored once and has a number. Triples of numbers take much less memory than
//! triples of text.

use oxrdf::{BlankNode, NamedNode, NamedOrBlankNode, Term, Triple};
use rustc_hash::FxHashMap;

use crate::owl::{Iri, Literal};

/// Prefix of the text of a blank node. No IRI has this prefix.
const BLANK: &str = "_:";

#[derive(Debug, Default)]
pub(crate) struct Names {
    texts: Vec<Iri>,
    numbers: FxHashMap<Iri, u32>,
}

#[derive(Debug)]
pub(crate) struct Compact {
    pub subject: u32,
    pub predicate: u32,
    pub object: Object,
}

#[derive(Debug)]
pub(crate) enum Object {
    Node(u32),
    Literal(Box<Literal>),
}

// Numbers of names are indices in `texts`.
impl Names {
    pub(crate) fn iri(&mut self, name: &str) -> Iri {
        let number = self.number(name);
        self.text(number).clone()
    }

    pub(crate) fn number(&mut self, name: &str) -> u32 {
        if let Some(number) = self.numbers.get(name) {
            return *number;
        }
        let number = self.texts.len() as u32;
        let iri = Iri::from(name);
        self.texts.push(iri.clone());
        self.numbers.insert(iri, number);
        number
    }

    pub(crate) fn blank(&mut self, name: &str) -> u32 {
        self.number(&format!("{BLANK}{name}"))
    }

    pub(crate) fn find(&self, name: &str) -> Option<u32> {
        self.numbers.get(name).copied()
    }

    /// Returns the text with this number: an IRI, or for a blank node a text that begins with `_:`.
    pub(crate) fn text(&self, number: u32) -> &Iri {
        &self.texts[number as usize]
    }

    pub(crate) fn is_blank(&self, number: u32) -> bool {
        self.text(number).starts_with(BLANK)
    }

    pub(crate) fn len(&self) -> usize {
        self.texts.len()
    }

    /// Returns the alphabetical ranks of all texts, by the addresses of the shared texts.
    pub(crate) fn ranks(&self) -> FxHashMap<*const u8, u32> {
        let mut sorted: Vec<&Iri> = self.texts.iter().collect();
        // Interned texts are distinct, so an unstable sort is deterministic.
        sorted.sort_unstable();
        sorted.into_iter().zip(0..).map(|(iri, rank)| (iri.as_ptr(), rank)).collect()
    }

    pub(crate) fn compact(
        &mut self,
        triple: Triple,
        mut blank: impl FnMut(&mut Self, &BlankNode) -> u32,
    ) -> Compact {
        let subject = match &triple.subject {
            NamedOrBlankNode::NamedNode(node) => self.number(node.as_str()),
            NamedOrBlankNode::BlankNode(node) => blank(self, node),
        };
        let predicate = self.number(triple.predicate.as_str());
        let object = match triple.object {
            Term::NamedNode(node) => Object::Node(self.number(node.as_str())),
            Term::BlankNode(node) => Object::Node(blank(self, &node)),
            Term::Literal(literal) => Object::Literal(Box::new(self.literal(literal))),
        };
        Compact { subject, predicate, object }
    }

    pub(crate) fn literal(&mut self, literal: oxrdf::Literal) -> Literal {
        let (lexical, datatype, language) = literal.destruct();
        Literal {
            lexical: lexical.into(),
            datatype: datatype.map(|datatype| self.iri(datatype.as_str())),
            language: language.map(Into::into),
        }
    }

    pub(crate) fn triple(&self, compact: Compact) -> Triple {
        let named = |number| NamedNode::new_unchecked(&**self.text(number));
        let node = |number| match self.text(number).strip_prefix(BLANK) {
            Some(name) => NamedOrBlankNode::from(BlankNode::new_unchecked(name)),
            None => named(number).into(),
        };
        let object = match compact.object {
            Object::Node(number) => node(number).into(),
            Object::Literal(literal) => Term::from(match (literal.language, literal.datatype) {
                (Some(language), _) => {
                    oxrdf::Literal::new_language_tagged_literal_unchecked(&*literal.lexical, &*language)
                }
                (None, Some(datatype)) => {
                    oxrdf::Literal::new_typed_literal(&*literal.lexical, NamedNode::new_unchecked(&*datatype))
                }
                (None, None) => oxrdf::Literal::new_simple_literal(&*literal.lexical),
            }),
        };
        Triple { subject: node(compact.subject), predicate: named(compact.predicate), object }
    }
}
