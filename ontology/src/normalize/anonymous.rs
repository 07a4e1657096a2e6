//! Replaces blank nodes that are individuals by IRIs, which depend only on the documents.
//!
//! A blank node is an individual if it has a type or a property value, or is a property value. Parts of
//! axioms, class expressions, rules and lists are no individuals. A blank node that only has annotations is
//! reported and removed.

use std::collections::BTreeMap;

use oxrdf::{BlankNode, NamedNode, NamedOrBlankNode, Term, Triple};
use rustc_hash::FxHashSet as HashSet;

use crate::error::Warning;
use crate::graph::Graph;
use crate::owl::ANONYMOUS;
use crate::vocab::{is_reserved, owl, rdf, rdfs, swrla};

pub(crate) fn rewrite(graph: &mut Graph, warnings: &mut Vec<Warning>) {
    let structural = structural(graph);
    let individuals = individuals(graph, &structural);
    let mut removed = Vec::new();
    let mut stray: BTreeMap<String, HashSet<BlankNode>> = BTreeMap::new();
    for index in 0..graph.len() {
        // Indices of removed triples remain in use.
        let Some(triple) = graph.get_mut(index) else { continue };
        if let NamedOrBlankNode::BlankNode(node) = &triple.subject {
            if individuals.contains(node) {
                triple.subject = name(node).into();
            } else if !structural.contains(node) {
                stray.entry(triple.predicate.to_string()).or_default().insert(node.clone());
                removed.push(index);
            }
        }
        if let Term::BlankNode(node) = &triple.object
            && individuals.contains(node)
        {
            triple.object = name(node).into();
        }
    }
    for index in removed {
        graph.take(index);
    }
    warnings.extend(stray.into_iter().map(|(predicate, nodes)| Warning::Unread {
        statement: format!("{predicate} of {} blank nodes", nodes.len()),
        reason: "there are no other statements about them".to_owned(),
    }));
}

fn name(node: &BlankNode) -> NamedNode {
    NamedNode::new_unchecked(format!("{ANONYMOUS}{}", node.as_str()))
}

fn structural(graph: &Graph) -> HashSet<BlankNode> {
    let mut nodes = HashSet::default();
    for (_, triple) in graph.iter() {
        if let NamedOrBlankNode::BlankNode(node) = &triple.subject
            && is_structure(triple)
        {
            nodes.insert(node.clone());
        }
    }
    nodes
}

fn is_structure(triple: &Triple) -> bool {
    let predicate = triple.predicate.as_str();
    if predicate == rdf::TYPE {
        let plain = [owl::THING, owl::NOTHING, owl::NAMED_INDIVIDUAL];
        return matches!(&triple.object, Term::NamedNode(class)
            if is_reserved(class.as_str()) && !plain.contains(&class.as_str()));
    }
    let about_individuals =
        [owl::SAME_AS, owl::DIFFERENT_FROM, rdfs::LABEL, rdfs::COMMENT, rdfs::SEE_ALSO, rdfs::IS_DEFINED_BY];
    is_reserved(predicate) && !about_individuals.contains(&predicate)
}

fn individuals(graph: &Graph, structural: &HashSet<BlankNode>) -> HashSet<BlankNode> {
    let annotations: HashSet<_> =
        graph.instances(owl::ANNOTATION_PROPERTY).into_iter().map(|(_, node)| node).collect();
    let is_annotation = |predicate: &NamedNode| {
        predicate.as_str().starts_with(rdfs::NS)
            || predicate.as_str() == swrla::IS_RULE_ENABLED
            || annotations.contains(&NamedOrBlankNode::NamedNode(predicate.clone()))
    };
    let mut nodes = HashSet::default();
    for (_, triple) in graph.iter() {
        let predicate = &triple.predicate;
        if let NamedOrBlankNode::BlankNode(node) = &triple.subject
            && !is_annotation(predicate)
            && !structural.contains(node)
        {
            nodes.insert(node.clone());
        }
        let links = !is_reserved(predicate.as_str())
            || [owl::SAME_AS, owl::DIFFERENT_FROM, owl::HAS_VALUE, rdf::FIRST].contains(&predicate.as_str());
        if let Term::BlankNode(node) = &triple.object
            && links
            && !is_annotation(predicate)
            && !structural.contains(node)
        {
            nodes.insert(node.clone());
        }
    }
    nodes
}
