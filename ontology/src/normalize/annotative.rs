//! Removes axioms that use an annotation property as another kind of property. OWL 2 DL forbids such axioms,
//! and horned-owl rejects a document that contains one. Each removed axiom about a named entity causes a
//! warning.
//!
//! Two forms, which occur in practice, are recognised: `owl:equivalentProperty` with an annotation property
//! on at least one side, and restrictions on annotation properties. A property that is also declared as an
//! object or data property does not count. If a class expression contains such a restriction, every axiom
//! with this expression is removed.

use oxrdf::{BlankNode, NamedOrBlankNode, Term};
use rustc_hash::FxHashSet as HashSet;

use crate::error::Warning;
use crate::graph::{Graph, iri_of};
use crate::vocab::owl;

const REASON: &str = "an annotation property has no logical axioms; declare it as an object or data property";

pub(crate) fn rewrite(graph: &mut Graph, warnings: &mut Vec<Warning>) {
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
    // Propagate from expressions to the expressions that contain them, up to axioms about named entities.
    loop {
        let containing = graph.iter().filter_map(|(_, triple)| match (&triple.subject, &triple.object) {
            (NamedOrBlankNode::BlankNode(outer), Term::BlankNode(inner)) if expressions.contains(inner) => {
                Some(outer.clone())
            }
            _ => None,
        });
        let added: Vec<BlankNode> = containing.filter(|node| !expressions.contains(node)).collect();
        if added.is_empty() {
            break;
        }
        expressions.extend(added);
    }
    let mut parts = Vec::new();
    for (index, triple) in graph.iter() {
        let is_part = |node: &BlankNode| expressions.contains(node);
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
