//! RDF graph: triples in document order, with an index by subject. Triples can be removed.

use oxrdf::{BlankNode, NamedNode, NamedOrBlankNode, Term, Triple};
use rustc_hash::{FxHashMap as HashMap, FxHashSet as HashSet};

use crate::vocab::rdf;

/// Triples in the order in which they were added. A removed triple leaves a `None`, so that indices stay valid.
#[derive(Debug, Default)]
pub(crate) struct Graph {
    triples: Vec<Option<Triple>>,
    by_subject: HashMap<NamedOrBlankNode, Vec<usize>>,
    fresh: usize,
}

#[derive(Debug)]
pub(crate) struct List {
    pub items: Vec<Term>,
    /// Indices of all triples whose subject is a node of the list.
    pub spine: Vec<usize>,
}

impl Graph {
    pub(crate) fn add(&mut self, triple: Triple) -> usize {
        let index = self.triples.len();
        match self.by_subject.get_mut(&triple.subject) {
            Some(indices) => indices.push(index),
            None => {
                self.by_subject.insert(triple.subject.clone(), vec![index]);
            }
        }
        self.triples.push(Some(triple));
        index
    }

    pub(crate) fn state(&mut self, subject: &NamedOrBlankNode, predicate: &str, object: impl Into<Term>) {
        self.add(Triple::new(subject.clone(), NamedNode::new_unchecked(predicate), object));
    }

    /// Returns the number of indices in use, including the indices of removed triples.
    pub(crate) fn len(&self) -> usize {
        self.triples.len()
    }

    pub(crate) fn take(&mut self, index: usize) -> Option<Triple> {
        self.triples.get_mut(index).and_then(Option::take)
    }

    pub(crate) fn get(&self, index: usize) -> Option<&Triple> {
        self.triples.get(index).and_then(Option::as_ref)
    }

    /// The index by subject keeps the subject with which the triple was added.
    pub(crate) fn get_mut(&mut self, index: usize) -> Option<&mut Triple> {
        self.triples.get_mut(index).and_then(Option::as_mut)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (usize, &Triple)> {
        self.triples.iter().enumerate().filter_map(|(index, triple)| Some((index, triple.as_ref()?)))
    }

    pub(crate) fn of<'a>(
        &'a self,
        subject: &NamedOrBlankNode,
    ) -> impl Iterator<Item = (usize, &'a Triple)> + use<'a> {
        let indices = self.by_subject.get(subject).map_or(&[][..], Vec::as_slice);
        indices.iter().filter_map(|&index| Some((index, self.triples[index].as_ref()?)))
    }

    pub(crate) fn objects<'a>(
        &'a self,
        subject: &NamedOrBlankNode,
        predicate: &'a str,
    ) -> impl Iterator<Item = &'a Term> + use<'a> {
        self.of(subject)
            .filter(move |(_, triple)| triple.predicate.as_str() == predicate)
            .map(|(_, triple)| &triple.object)
    }

    pub(crate) fn object<'a>(
        &'a self,
        subject: &NamedOrBlankNode,
        predicate: &'a str,
    ) -> Result<&'a Term, String> {
        let mut objects = self.objects(subject, predicate);
        match (objects.next(), objects.next()) {
            (Some(object), None) => Ok(object),
            (None, _) => Err(format!("{subject} has no <{predicate}>")),
            _ => Err(format!("{subject} has several <{predicate}>")),
        }
    }

    pub(crate) fn instances(&self, class: &str) -> Vec<(usize, NamedOrBlankNode)> {
        let typed = self.iter().filter(|(_, triple)| is_type(triple, class));
        typed.map(|(index, triple)| (index, triple.subject.clone())).collect()
    }

    pub(crate) fn list(&self, head: &Term) -> Result<List, String> {
        let mut list = List { items: Vec::new(), spine: Vec::new() };
        let (mut node, mut visited) = (head.clone(), HashSet::default());
        loop {
            if matches!(&node, Term::NamedNode(iri) if iri.as_str() == rdf::NIL) {
                return Ok(list);
            }
            let Some(subject) = subject_of(&node) else { return Err(format!("{node} is not a list")) };
            if !visited.insert(subject.clone()) {
                return Err(format!("the list at {head} is cyclic"));
            }
            list.items.push(self.object(&subject, rdf::FIRST)?.clone());
            let tail = self.object(&subject, rdf::REST)?.clone();
            list.spine.extend(self.of(&subject).map(|(index, _)| index));
            node = tail;
        }
    }

    pub(crate) fn add_list(&mut self, items: impl IntoIterator<Item = Term>, class: Option<&str>) -> Term {
        let nodes: Vec<_> = items.into_iter().map(|item| (self.fresh(), item)).collect();
        let nil = Term::from(NamedNode::new_unchecked(rdf::NIL));
        let head = nodes.first().map_or_else(|| nil.clone(), |(node, _)| node.clone().into());
        for (index, (node, item)) in nodes.iter().enumerate() {
            let subject = node.clone().into();
            if let Some(class) = class {
                self.state(&subject, rdf::TYPE, NamedNode::new_unchecked(class));
            }
            self.state(&subject, rdf::FIRST, item.clone());
            let tail = nodes.get(index + 1).map_or_else(|| nil.clone(), |(next, _)| next.clone().into());
            self.state(&subject, rdf::REST, tail);
        }
        head
    }

    pub(crate) fn fresh(&mut self) -> BlankNode {
        self.fresh += 1;
        BlankNode::new_unchecked(format!("n{}", self.fresh))
    }

    pub(crate) fn references(&self) -> HashMap<BlankNode, usize> {
        let mut counts = HashMap::default();
        for (_, triple) in self.iter() {
            if let Term::BlankNode(node) = &triple.object {
                *counts.entry(node.clone()).or_default() += 1;
            }
        }
        counts
    }

    pub(crate) fn into_triples(self) -> Vec<Triple> {
        self.triples.into_iter().flatten().collect()
    }

    pub(crate) fn to_ntriples(&self) -> Vec<u8> {
        use std::io::Write;
        let mut text = Vec::with_capacity(self.triples.len() * 128);
        for (_, triple) in self.iter() {
            // Writing to a vector cannot fail.
            let _ = writeln!(text, "{triple} .");
        }
        text
    }
}

pub(crate) fn is_type(triple: &Triple, class: &str) -> bool {
    triple.predicate.as_str() == rdf::TYPE
        && matches!(&triple.object, Term::NamedNode(object) if object.as_str() == class)
}

pub(crate) fn subject_of(term: &Term) -> Option<NamedOrBlankNode> {
    match term {
        Term::NamedNode(node) => Some(node.clone().into()),
        Term::BlankNode(node) => Some(node.clone().into()),
        Term::Literal(_) => None,
    }
}

pub(crate) fn iri_of(term: &Term) -> Option<&str> {
    match term {
        Term::NamedNode(node) => Some(node.as_str()),
        _ => None,
    }
}
