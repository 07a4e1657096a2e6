//! Rewrites forms of class expressions and axioms that occur in RDF documents, but are not recognised by
//! horned-owl.
//!
//! - A named class that *is* an expression, as in OWL 1, becomes equivalent to the expression ([1], tables 17
//!   and 18).
//! - Expressions without a type, or with a wrong one, get a type from their properties.
//! - Axioms and annotations that are nodes with an IRI get a blank node instead.
//! - Inverse properties in qualified cardinality restrictions get a name, which `crate::horned` translates
//!   back.
//! - Axioms that state the inverse of an anonymous inverse property become axioms about named properties.
//! - Data ranges within the list of a union or intersection get a name with a definition, which
//!   `crate::horned` replaces by the data range. horned-owl discards such a list if it visits the list before
//!   a blank node in it, and the order of its visits differs from run to run.
//! - Headers of ontologies without an IRI are removed.
//!
//! [1] OWL 2 Web Ontology Language, Mapping to RDF Graphs, W3C 2012.

use oxrdf::{NamedNode, NamedOrBlankNode, Term, Triple};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::graph::{Graph, is_type, subject_of};
use crate::normalize::depth::MAX_NESTING;
use crate::owl::{INVERSE, RANGE};
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
    name_ranges(graph);
    replace_double_inverses(graph);
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
                let is_datatype = datatypes.contains(&Term::from(triple.subject.clone()))
                    || has_values(graph, &triple.object, &datatypes);
                if is_datatype { rdfs::DATATYPE } else { owl::CLASS }
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

/// Datatypes outside the namespace of XML Schema that need no declaration.
const BUILT_IN_DATATYPES: [&str; 6] =
    [rdfs::LITERAL, rdf::PLAIN_LITERAL, rdf::LANG_STRING, rdf::XML_LITERAL, owl::REAL, owl::RATIONAL];

/// Returns `true` if the first member of a list is a literal or a data range. If the first member is another
/// expression with a list, the first member of that list decides.
fn has_values(graph: &Graph, list: &Term, datatypes: &FxHashSet<Term>) -> bool {
    let mut list = list.clone();
    // The limit also ends cycles.
    for _ in 0..MAX_NESTING {
        let first = subject_of(&list).and_then(|node| graph.objects(&node, rdf::FIRST).next());
        let node = match first {
            Some(Term::Literal(_)) => return true,
            Some(Term::NamedNode(iri)) => {
                return iri.as_str().starts_with(xsd::NS)
                    || BUILT_IN_DATATYPES.contains(&iri.as_str())
                    || datatypes.contains(&Term::from(iri.clone()));
            }
            Some(node @ Term::BlankNode(_)) if datatypes.contains(node) => return true,
            Some(Term::BlankNode(blank)) => NamedOrBlankNode::from(blank.clone()),
            None => return false,
        };
        let is_data = graph.of(&node).any(|(_, triple)| {
            [owl::ON_DATATYPE, owl::DATATYPE_COMPLEMENT_OF].contains(&triple.predicate.as_str())
                || is_type(triple, owl::DATA_RANGE)
        });
        if is_data {
            return true;
        }
        let lists = [owl::ONE_OF, owl::UNION_OF, owl::INTERSECTION_OF];
        let nested = graph.of(&node).find(|(_, triple)| lists.contains(&triple.predicate.as_str()));
        match nested {
            Some((_, triple)) => list = triple.object.clone(),
            None => return false,
        }
    }
    false
}

fn name_ranges(graph: &mut Graph) {
    let mut cells: Vec<usize> = Vec::new();
    for (_, node) in graph.instances(rdfs::DATATYPE) {
        let lists = [owl::UNION_OF, owl::INTERSECTION_OF].map(|predicate| graph.objects(&node, predicate));
        for list in lists.into_iter().flatten().filter_map(|head| graph.list(head).ok()) {
            cells.extend(list.spine.into_iter().filter(|&index| {
                let is_nested = |triple: &Triple| {
                    triple.predicate.as_str() == rdf::FIRST && matches!(triple.object, Term::BlankNode(_))
                };
                graph.get(index).is_some_and(is_nested)
            }));
        }
    }
    // Two ranges may share a list.
    cells.sort_unstable();
    cells.dedup();
    for (number, index) in cells.into_iter().enumerate() {
        let name = NamedNode::new_unchecked(format!("{RANGE}{number}"));
        let Some(triple) = graph.get_mut(index) else { continue };
        let range = std::mem::replace(&mut triple.object, name.clone().into());
        let name = NamedOrBlankNode::from(name);
        state(graph, &name, rdf::TYPE, rdfs::DATATYPE);
        graph.state(&name, owl::EQUIVALENT_CLASS, range);
    }
}

/// Replaces `p owl:inverseOf [ owl:inverseOf q ]` and `[ owl:inverseOf q ] owl:inverseOf p` by `p
/// owl:equivalentProperty q`, and `[ owl:inverseOf q ] owl:inverseOf [ owl:inverseOf p ]` by `q owl:inverseOf p`.
fn replace_double_inverses(graph: &mut Graph) {
    // The named property whose inverse a blank node is.
    let property_of = |graph: &Graph, node: &Term| {
        let Term::BlankNode(node) = node else { return None };
        let node = NamedOrBlankNode::from(node.clone());
        let mut triples = graph.of(&node).filter(|(_, triple)| triple.predicate.as_str() == owl::INVERSE_OF);
        let is_named = |(_, triple): &(usize, &Triple)| matches!(triple.object, Term::NamedNode(_));
        triples.find(is_named).map(|(_, triple)| triple.object.clone())
    };
    let mut axioms = Vec::new();
    for (index, triple) in graph.iter().filter(|(_, triple)| triple.predicate.as_str() == owl::INVERSE_OF) {
        let (subject, object) = (Term::from(triple.subject.clone()), &triple.object);
        let axiom = match (property_of(graph, &subject), property_of(graph, object)) {
            (None, Some(property)) => (subject, owl::EQUIVALENT_PROPERTY, property),
            // The first triple about a blank node defines it.
            (Some(property), None) if property != *object => {
                (property, owl::EQUIVALENT_PROPERTY, object.clone())
            }
            (Some(property), Some(other)) => (property, owl::INVERSE_OF, other),
            _ => continue,
        };
        axioms.push((index, axiom));
    }
    let mut nodes = FxHashSet::default();
    for (index, (subject, predicate, object)) in axioms {
        let Some(subject) = subject_of(&subject) else { continue };
        if let Some(triple) = graph.take(index) {
            nodes.extend([Term::from(triple.subject), triple.object]);
        }
        for property in [Some(subject.clone()), subject_of(&object)].into_iter().flatten() {
            state(graph, &property, rdf::TYPE, owl::OBJECT_PROPERTY);
        }
        graph.state(&subject, predicate, object);
    }
    remove_unreferenced(graph, nodes.into_iter().collect());
}

/// Removes the triples about blank nodes without a reference. horned-owl would report such an inverse as unread.
fn remove_unreferenced(graph: &mut Graph, nodes: Vec<Term>) {
    if nodes.is_empty() {
        return;
    }
    let references = graph.references();
    for node in nodes {
        if let Term::BlankNode(node) = node
            && !references.contains_key(&node)
        {
            take_all(graph, &node.into());
        }
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
    remove_unreferenced(graph, renamed);
}
