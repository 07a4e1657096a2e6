//! Removes axioms that use an annotation property as another kind of property. OWL 2 DL forbids such axioms,
//! and horned-owl rejects a document that contains one. Each removed axiom about a named entity causes a
//! warning.
//!
//! Two forms, which occur in practice, are recognised: `owl:equivalentProperty` with an annotation property
//! on at least one side, and restrictions on annotation properties. A property that is also declared as an
//! object or data property does not count. If a class expression contains such a restriction, every axiom
//! with this expression is removed. A SWRL rule with such an expression is removed as a whole, with a warning.

use oxrdf::{BlankNode, NamedOrBlankNode, Term};
use rustc_hash::{FxHashMap as HashMap, FxHashSet as HashSet};

use super::swrl::{ORIGIN, Origin};
use crate::error::Warning;
use crate::graph::{Graph, iri_of};
use crate::vocab::{owl, rdfs, swrl};

const REASON: &str = "an annotation property has no logical axioms; declare it as an object or data property";

pub(crate) fn rewrite(graph: &mut Graph, origins: &[Origin], warnings: &mut Vec<Warning>) {
    let named = |class: &str| -> HashSet<String> {
        let instances = graph.instances(class).into_iter();
        instances
            .filter_map(|(_, node)| match node {
                NamedOrBlankNode::NamedNode(iri) => Some(iri.into_string()),
                NamedOrBlankNode::BlankNode(_) => None,
            })
            .collect()
    };
    let mut annotative = named(owl::ANNOTATION_PROPERTY);
    for kind in [owl::OBJECT_PROPERTY, owl::DATATYPE_PROPERTY] {
        let logical = named(kind);
        // A property that is also declared as a logical property may have logical axioms.
        annotative.retain(|iri| !logical.contains(iri));
    }
    if annotative.is_empty() {
        return;
    }
    let is_annotative = |term: &Term| iri_of(term).is_some_and(|iri| annotative.contains(iri));
    let (mut removed, mut expressions): (Vec<usize>, HashSet<BlankNode>) = (Vec::new(), HashSet::default());
    for (index, triple) in graph.iter() {
        let predicate = triple.predicate.as_str();
        let subject = Term::from(triple.subject.clone());
        if predicate == owl::EQUIVALENT_PROPERTY && (is_annotative(&subject) || is_annotative(&triple.object))
        {
            removed.push(index);
        } else if let (owl::ON_PROPERTY, true, NamedOrBlankNode::BlankNode(node)) =
            (predicate, is_annotative(&triple.object), &triple.subject)
        {
            expressions.insert(node.clone());
        }
    }
    if expressions.is_empty() && removed.is_empty() {
        return;
    }
    let expressions = closure(graph, expressions);
    let rules: HashSet<NamedOrBlankNode> =
        graph.instances(swrl::IMP).into_iter().map(|(_, rule)| rule).collect();
    let is_part = |node: &BlankNode| expressions.contains(node);
    let unusable: HashSet<NamedOrBlankNode> = graph
        .iter()
        .filter(|(_, triple)| matches!(&triple.object, Term::BlankNode(node) if is_part(node)))
        .map(|(_, triple)| triple.subject.clone())
        .filter(|subject| rules.contains(subject))
        .collect();
    let mut parts = Vec::new();
    for (index, triple) in graph.iter() {
        if unusable.contains(&triple.subject) {
            // Without its body or head, a rule would have another meaning.
            parts.push(index);
            if triple.predicate.as_str() == ORIGIN {
                warnings.extend(unread_rule(graph, &triple.subject, &triple.object, origins));
            }
            continue;
        }
        match (&triple.subject, &triple.object) {
            (NamedOrBlankNode::BlankNode(node), _) if is_part(node) => parts.push(index),
            (NamedOrBlankNode::NamedNode(_), Term::BlankNode(node)) if is_part(node) => removed.push(index),
            _ => {}
        }
    }
    for index in removed {
        if let Some(triple) = graph.take(index) {
            let object = match &triple.object {
                Term::BlankNode(_) => "a restriction of an annotation property".to_owned(),
                other => other.to_string(),
            };
            let statement = format!("{} {} {object}", triple.subject, triple.predicate);
            warnings.push(Warning::Unread { statement, reason: REASON.to_owned() });
        }
    }
    for index in parts {
        graph.take(index);
    }
}

/// Returns the warning about a removed rule; `origin` is the index of the rule in `origins`.
fn unread_rule(graph: &Graph, rule: &NamedOrBlankNode, origin: &Term, origins: &[Origin]) -> Option<Warning> {
    let Term::Literal(index) = origin else { return None };
    let Origin { ontology, position, .. } = origins.get(index.value().parse::<usize>().ok()?)?;
    let label = graph.objects(rule, rdfs::LABEL).find_map(|term| match term {
        Term::Literal(literal) => Some(literal.value().to_owned()),
        _ => None,
    });
    let reason = format!("it contains a restriction of an annotation property; {REASON}");
    Some(Warning::UnreadRule { ontology: ontology.to_string(), position: *position, label, reason })
}

/// Adds the blank nodes that contain one of `expressions`, directly or indirectly.
fn closure(graph: &Graph, mut expressions: HashSet<BlankNode>) -> HashSet<BlankNode> {
    let mut containers: HashMap<BlankNode, Vec<BlankNode>> = HashMap::default();
    for (_, triple) in graph.iter().filter(|_| !expressions.is_empty()) {
        if let (NamedOrBlankNode::BlankNode(outer), Term::BlankNode(inner)) =
            (&triple.subject, &triple.object)
        {
            containers.entry(inner.clone()).or_default().push(outer.clone());
        }
    }
    let mut open: Vec<BlankNode> = expressions.iter().cloned().collect();
    while let Some(inner) = open.pop() {
        for outer in containers.remove(&inner).into_iter().flatten() {
            if expressions.insert(outer.clone()) {
                open.push(outer);
            }
        }
    }
    expressions
}
