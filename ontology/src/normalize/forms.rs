//! Rewrites forms of class expressions and axioms that occur in RDF documents, but are not recognised by
//! horned-owl.
//!
//! - A named class that *is* an expression, as in OWL 1, becomes equivalent to the expression ([1], tables 17
//!   and 18).
//! - Expressions without a type, or with a wrong one, get a type from their properties.
//! - Axioms and annotations that are nodes with an IRI get a blank node instead.
//! - Inverse properties in qualified cardinality restrictions get a name, which `crate::horned` translates
//!   back.
//! - Headers of ontologies without an IRI are removed.
//!
//! [1] OWL 2 Web Ontology Language, Mapping to RDF Graphs, W3C 2012.

use oxrdf::{NamedNode, NamedOrBlankNode, Term};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::graph::{Graph, is_type, subject_of};
use crate::owl::INVERSE;
use crate::vocab::{owl, rdf, rdfs, xsd};

const CONNECTIVES: [&str; 5] =
    [owl::INTERSECTION_OF, owl::UNION_OF, owl::COMPLEMENT_OF, owl::ONE_OF, owl::DATATYPE_COMPLEMENT_OF];

const RESTRICTION_PROPERTIES: [&str; 14] = [
    owl::ON_PROPERTY,
    owl::ON_PROPERTIES,
    owl::SOME_VALUES_FROM,
    owl::ALL_VALUES_FROM,
    owl::HAS_VALUE,
    owl::HAS_SELF,
    owl::CARDINALITY,
    owl::MIN_CARDINALITY,
    owl::MAX_CARDINALITY,
    owl::QUALIFIED_CARDINALITY,
    owl::MIN_QUALIFIED_CARDINALITY,
    owl::MAX_QUALIFIED_CARDINALITY,
    owl::ON_CLASS,
    owl::ON_DATA_RANGE,
];

pub(crate) fn rewrite(graph: &mut Graph) {
    remove_anonymous_headers(graph);
    remove_axiom_iris(graph);
    definitions(graph);
    correct_types(graph);
    name_inverses(graph);
}

fn remove_anonymous_headers(graph: &mut Graph) {
    for (_, node) in graph.instances(owl::ONTOLOGY) {
        if let NamedOrBlankNode::BlankNode(_) = node {
            take_all(graph, &node);
        }
    }
}

fn take_all(graph: &mut Graph, node: &NamedOrBlankNode) {
    let indices: Vec<usize> = graph.of(node).map(|(index, _)| index).collect();
    for index in indices {
        graph.take(index);
    }
}

fn remove_axiom_iris(graph: &mut Graph) {
    let kinds = [owl::ALL_DIFFERENT, owl::NEGATIVE_PROPERTY_ASSERTION, owl::AXIOM, owl::ANNOTATION];
    let named: Vec<NamedOrBlankNode> = kinds
        .iter()
        .flat_map(|kind| graph.instances(kind))
        .map(|(_, node)| node)
        .filter(|node| matches!(node, NamedOrBlankNode::NamedNode(_)))
        .collect();
    for node in named {
        let fresh = graph.fresh().into();
        let indices: Vec<usize> = graph.of(&node).map(|(index, _)| index).collect();
        for triple in indices.into_iter().filter_map(|index| graph.take(index)).collect::<Vec<_>>() {
            graph.state(&fresh, triple.predicate.as_str(), triple.object);
        }
    }
}

fn definitions(graph: &mut Graph) {
    let datatypes: FxHashSet<NamedOrBlankNode> =
        graph.instances(rdfs::DATATYPE).into_iter().map(|(_, node)| node).collect();
    let is_named = |node: &NamedOrBlankNode| matches!(node, NamedOrBlankNode::NamedNode(_));
    let mut combined: Vec<(usize, NamedOrBlankNode)> = Vec::new();
    let mut restricted: Vec<NamedOrBlankNode> = Vec::new();
    for (index, triple) in graph.iter().filter(|(_, triple)| is_named(&triple.subject)) {
        let predicate = triple.predicate.as_str();
        if CONNECTIVES.contains(&predicate) {
            combined.push((index, triple.subject.clone()));
        } else if predicate == owl::ON_PROPERTY || predicate == owl::ON_PROPERTIES {
            restricted.push(triple.subject.clone());
        }
    }
    for (index, class) in combined {
        let Some(triple) = graph.take(index) else { continue };
        let node = graph.fresh();
        let kind = if datatypes.contains(&class) { rdfs::DATATYPE } else { owl::CLASS };
        state(graph, &class, rdf::TYPE, kind);
        graph.state(&class, owl::EQUIVALENT_CLASS, Term::from(node.clone()));
        let node = node.into();
        state(graph, &node, rdf::TYPE, kind);
        graph.state(&node, triple.predicate.as_str(), triple.object);
    }
    for class in restricted {
        let parts = graph.of(&class).filter(|(_, triple)| {
            RESTRICTION_PROPERTIES.contains(&triple.predicate.as_str()) || is_type(triple, owl::RESTRICTION)
        });
        let indices: Vec<usize> = parts.map(|(index, _)| index).collect();
        let node = graph.fresh();
        state(graph, &class, rdf::TYPE, owl::CLASS);
        graph.state(&class, owl::EQUIVALENT_CLASS, Term::from(node.clone()));
        let node = node.into();
        for triple in indices.into_iter().filter_map(|index| graph.take(index)).collect::<Vec<_>>() {
            graph.state(&node, triple.predicate.as_str(), triple.object);
        }
    }
}

fn state(graph: &mut Graph, subject: &NamedOrBlankNode, predicate: &str, object: &str) {
    graph.state(subject, predicate, NamedNode::new_unchecked(object));
}

fn correct_types(graph: &mut Graph) {
    let datatypes: FxHashSet<Term> =
        graph.instances(rdfs::DATATYPE).into_iter().map(|(_, node)| Term::from(node)).collect();
    let mut kinds: FxHashMap<NamedOrBlankNode, &str> = FxHashMap::default();
    let mut nodes: Vec<NamedOrBlankNode> = Vec::new();
    for (_, triple) in graph.iter() {
        if let NamedOrBlankNode::NamedNode(_) = triple.subject {
            continue;
        }
        let kind = match triple.predicate.as_str() {
            owl::ON_PROPERTY | owl::ON_PROPERTIES => owl::RESTRICTION,
            owl::ON_DATATYPE | owl::DATATYPE_COMPLEMENT_OF => rdfs::DATATYPE,
            owl::COMPLEMENT_OF => owl::CLASS,
            owl::ONE_OF | owl::UNION_OF | owl::INTERSECTION_OF => {
                if has_values(graph, &triple.object, &datatypes) { rdfs::DATATYPE } else { owl::CLASS }
            }
            _ => continue,
        };
        if kinds.insert(triple.subject.clone(), kind).is_none() {
            nodes.push(triple.subject.clone());
        }
    }
    let expressions = [owl::CLASS, rdfs::CLASS, owl::RESTRICTION, rdfs::DATATYPE, owl::DATA_RANGE];
    for node in nodes {
        let expected = kinds[&node];
        let wrong: Vec<usize> = graph
            .of(&node)
            .filter(|(_, triple)| {
                let is = |class: &&str| is_type(triple, class);
                expressions.iter().any(&is) && !is(&expected)
            })
            .map(|(index, _)| index)
            .collect();
        for index in wrong {
            graph.take(index);
        }
        if !graph.of(&node).any(|(_, triple)| is_type(triple, expected)) {
            state(graph, &node, rdf::TYPE, expected);
        }
    }
}

/// Returns `true` if the first member of a list is a literal or a data range.
fn has_values(graph: &Graph, list: &Term, datatypes: &FxHashSet<Term>) -> bool {
    let first = subject_of(list).and_then(|node| graph.objects(&node, rdf::FIRST).next());
    match first {
        Some(Term::Literal(_)) => true,
        Some(Term::NamedNode(iri)) => {
            iri.as_str().starts_with(xsd::NS)
                || [rdfs::LITERAL, rdf::PLAIN_LITERAL].contains(&iri.as_str())
                || datatypes.contains(&Term::from(iri.clone()))
        }
        Some(node @ Term::BlankNode(blank)) => {
            let data = [owl::ON_DATATYPE, owl::DATATYPE_COMPLEMENT_OF];
            let blank = NamedOrBlankNode::from(blank.clone());
            datatypes.contains(node)
                || graph.of(&blank).any(|(_, triple)| {
                    data.contains(&triple.predicate.as_str()) || is_type(triple, owl::DATA_RANGE)
                })
        }
        None => false,
    }
}

/// Names anonymous inverses in qualified cardinality restrictions. Removes the types of all anonymous
/// inverses.
fn name_inverses(graph: &mut Graph) {
    let mut inverses: FxHashMap<Term, String> = FxHashMap::default();
    let mut typed = Vec::new();
    for (_, triple) in graph.iter().filter(|(_, triple)| triple.predicate.as_str() == owl::INVERSE_OF) {
        if let (NamedOrBlankNode::BlankNode(node), Term::NamedNode(property)) =
            (&triple.subject, &triple.object)
        {
            inverses.insert(node.clone().into(), format!("{INVERSE}{}", property.as_str()));
            let types = graph.of(&triple.subject).filter(|(_, triple)| is_type(triple, owl::OBJECT_PROPERTY));
            typed.extend(types.map(|(index, _)| index));
        }
    }
    for index in typed {
        graph.take(index);
    }
    let qualified = graph.iter().filter(|(_, triple)| triple.predicate.as_str() == owl::ON_CLASS);
    let restrictions: Vec<NamedOrBlankNode> = qualified.map(|(_, triple)| triple.subject.clone()).collect();
    let mut renamed = Vec::new();
    for restriction in restrictions {
        let replacement = graph.of(&restriction).find_map(|(index, triple)| {
            let is_property = triple.predicate.as_str() == owl::ON_PROPERTY;
            Some((index, inverses.get(&triple.object).filter(|_| is_property)?.clone()))
        });
        if let Some((index, name)) = replacement
            && let Some(triple) = graph.get_mut(index)
        {
            let name = NamedNode::new_unchecked(name);
            renamed.push(std::mem::replace(&mut triple.object, name.clone().into()));
            state(graph, &name.into(), rdf::TYPE, owl::OBJECT_PROPERTY);
        }
    }
    // An inverse without a remaining reference would be left over by horned-owl.
    let references = graph.references();
    for node in renamed {
        if let Term::BlankNode(node) = node
            && !references.contains_key(&node)
        {
            take_all(graph, &node.into());
        }
    }
}
