//! Triples with an index by subject, in document order, from which triples can be taken.

use oxrdf::{BlankNode, NamedNode, NamedOrBlankNode, Term, Triple};
use rustc_hash::{FxHashMap as HashMap, FxHashSet as HashSet};

use crate::vocab::rdf;

/// A set of triples that keeps the order in which they were added.
#[derive(Debug, Default)]
pub(crate) struct Graph {
    triples: Vec<Option<Triple>>,
    by_subject: HashMap<NamedOrBlankNode, Vec<usize>>,
    fresh: usize,
}

/// An `rdf:List` that was followed to its end.
#[derive(Debug)]
pub(crate) struct List {
    pub items: Vec<Term>,
    /// Indices of the triples of its spine.
    pub spine: Vec<usize>,
}

impl Graph {
    /// Adds a triple and returns its index.
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

    /// Adds the triple `subject predicate object`.
    pub(crate) fn state(&mut self, subject: &NamedOrBlankNode, predicate: &str, object: impl Into<Term>) {
        self.add(Triple::new(subject.clone(), NamedNode::new_unchecked(predicate), object));
    }

    /// Number of indices in use, taken triples included.
    pub(crate) fn len(&self) -> usize {
        self.triples.len()
    }

    pub(crate) fn take(&mut self, index: usize) -> Option<Triple> {
        self.triples.get_mut(index).and_then(Option::take)
    }

    pub(crate) fn get_mut(&mut self, index: usize) -> Option<&mut Triple> {
        self.triples.get_mut(index).and_then(Option::as_mut)
    }

    /// All triples with their indices, in order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (usize, &Triple)> {
        self.triples.iter().enumerate().filter_map(|(index, triple)| Some((index, triple.as_ref()?)))
    }

    /// The triples of a subject with their indices, in order.
    pub(crate) fn of<'a>(
        &'a self,
        subject: &NamedOrBlankNode,
    ) -> impl Iterator<Item = (usize, &'a Triple)> + use<'a> {
        let indices = self.by_subject.get(subject).map_or(&[][..], Vec::as_slice);
        indices.iter().filter_map(|&index| Some((index, self.triples[index].as_ref()?)))
    }

    /// The objects of `subject predicate`, in order.
    pub(crate) fn objects<'a>(
        &'a self,
        subject: &NamedOrBlankNode,
        predicate: &'a str,
    ) -> impl Iterator<Item = &'a Term> + use<'a> {
        self.of(subject)
            .filter(move |(_, t)| t.predicate.as_str() == predicate)
            .map(|(_, triple)| &triple.object)
    }

    /// The only object of `subject predicate`, or a message that says why there is none.
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

    /// The subjects of type `class` with the index of the triple that says so, in order.
    pub(crate) fn instances(&self, class: &str) -> Vec<(usize, NamedOrBlankNode)> {
        let typed = self.iter().filter(|(_, triple)| is_type(triple, class));
        typed.map(|(index, triple)| (index, triple.subject.clone())).collect()
    }

    /// The items of the list that starts at `head`, or a message that says what is wrong with it.
    pub(crate) fn list(&self, head: &Term) -> Result<List, String> {
        let mut list = List { items: Vec::new(), spine: Vec::new() };
        let (mut node, mut seen) = (head.clone(), HashSet::default());
        loop {
            if matches!(&node, Term::NamedNode(iri) if iri.as_str() == rdf::NIL) {
                return Ok(list);
            }
            let Some(subject) = subject_of(&node) else { return Err(format!("{node} is not a list")) };
            if !seen.insert(subject.clone()) {
                return Err(format!("the list at {head} runs in a circle"));
            }
            list.items.push(self.object(&subject, rdf::FIRST)?.clone());
            let rest = self.object(&subject, rdf::REST)?.clone();
            list.spine.extend(self.of(&subject).map(|(index, _)| index));
            node = rest;
        }
    }

    /// Adds a list and returns its head.
    pub(crate) fn add_list(&mut self, items: impl IntoIterator<Item = Term>, class: Option<&str>) -> Term {
        let nodes: Vec<_> = items.into_iter().map(|item| (self.fresh(), item)).collect();
        let nil = Term::from(NamedNode::new_unchecked(rdf::NIL));
        let head = nodes.first().map_or_else(|| nil.clone(), |(node, _)| node.clone().into());
        for (place, (node, item)) in nodes.iter().enumerate() {
            let subject = node.clone().into();
            if let Some(class) = class {
                self.state(&subject, rdf::TYPE, NamedNode::new_unchecked(class));
            }
            self.state(&subject, rdf::FIRST, item.clone());
            let rest = nodes.get(place + 1).map_or_else(|| nil.clone(), |(next, _)| next.clone().into());
            self.state(&subject, rdf::REST, rest);
        }
        head
    }

    /// A blank node that occurs nowhere else.
    pub(crate) fn fresh(&mut self) -> BlankNode {
        self.fresh += 1;
        BlankNode::new_unchecked(format!("n{}", self.fresh))
    }

    /// Blank nodes and how often each is an object.
    pub(crate) fn references(&self) -> HashMap<BlankNode, usize> {
        let mut counts = HashMap::default();
        for (_, triple) in self.iter() {
            if let Term::BlankNode(node) = &triple.object {
                *counts.entry(node.clone()).or_default() += 1;
            }
        }
        counts
    }

    /// The triples that are left, in order.
    pub(crate) fn into_triples(self) -> Vec<Triple> {
        self.triples.into_iter().flatten().collect()
    }

    /// The triples that are left, as an N-Triples document.
    pub(crate) fn to_ntriples(&self) -> Vec<u8> {
        use std::io::Write;
        let mut text = Vec::with_capacity(self.triples.len() * 128);
        for (_, triple) in self.iter() {
            // Writing to memory does not fail.
            let _ = writeln!(text, "{triple} .");
        }
        text
    }
}

/// Whether the triple says that its subject is of type `class`.
pub(crate) fn is_type(triple: &Triple, class: &str) -> bool {
    triple.predicate.as_str() == rdf::TYPE
        && matches!(&triple.object, Term::NamedNode(object) if object.as_str() == class)
}

/// The term as a subject, unless it is a literal.
pub(crate) fn subject_of(term: &Term) -> Option<NamedOrBlankNode> {
    match term {
        Term::NamedNode(node) => Some(node.clone().into()),
        Term::BlankNode(node) => Some(node.clone().into()),
        Term::Literal(_) => None,
    }
}

/// The IRI of a node that has one.
pub(crate) fn iri_of(term: &Term) -> Option<&str> {
    match term {
        Term::NamedNode(node) => Some(node.as_str()),
        _ => None,
    }
}
