//! Adds declarations of undeclared classes and properties, because horned-owl drops assertions of properties
//! whose kind is unknown.
//!
//! A class or property that the imports closure does not declare gets a kind from its use, with a warning. In
//! general, a property with literals as values is a data property, and a property between individuals is an
//! object property. A property that describes only classes, properties or ontologies is an annotation
//! property.

use std::collections::{BTreeMap, BTreeSet};

use oxrdf::{NamedNode, NamedOrBlankNode, Term, Triple};
use rustc_hash::FxHashSet as HashSet;

use super::swrl::ORIGIN;
use crate::error::Warning;
use crate::graph::{Graph, iri_of, is_type};
use crate::names::Names;
use crate::owl::{ANONYMOUS, EntityKind, Iri};
use crate::vocab::{is_reserved, owl, rdf, rdfs, swrl, swrla, xsd};

const MAX_PROPAGATION_ROUNDS: usize = 16;

#[derive(Clone, Copy, Debug, Default)]
#[allow(clippy::struct_excessive_bools)] // independent observations
struct Use {
    literal: bool,
    individual: bool,
    data: bool,
    object: bool,
    /// Used in a restriction that may be about an object property or about a data property.
    restricted: bool,
    /// Used with a subject that is not an individual, as annotation properties are.
    entity: bool,
}

/// Declares the undeclared classes and properties of `graph`, with a warning for each. `classes` contains undeclared
/// classes that occur in triples outside of `graph`, and `ontologies` the IRIs of ontologies whose headers are not in
/// `graph`.
pub(crate) fn declare(
    graph: &mut Graph,
    mut classes: BTreeSet<String>,
    ontologies: HashSet<Iri>,
    warnings: &mut Vec<Warning>,
) {
    let (declared, mut properties) = (Declared { ontologies, ..Declared::of(graph) }, BTreeMap::new());
    for (_, triple) in graph.iter() {
        record_classes(triple, &declared, &mut classes);
        record_property(graph, triple, &declared, &mut properties);
    }
    let kinds = Kinds { declared: &declared, uses: properties };
    let properties = kinds.propagate_kinds(graph, warnings);
    for class in classes {
        state(graph, &class, owl::CLASS);
        warnings.push(Warning::Undeclared { iri: class, kind: "a class", position: None });
    }
    for (property, usage) in properties {
        let (class, kind) = kind_of(usage);
        state(graph, &property, class);
        warnings.push(Warning::Undeclared { iri: property, kind, position: None });
    }
    let enabled = swrla::IS_RULE_ENABLED;
    let is_used = graph.iter().any(|(_, triple)| triple.predicate.as_str() == enabled);
    if is_used && !declared.annotation_properties.contains(enabled) {
        state(graph, enabled, owl::ANNOTATION_PROPERTY);
    }
    // `crate::horned` finds the origins of rules in this annotation.
    state(graph, ORIGIN, owl::ANNOTATION_PROPERTY);
}

/// Declares the `known` entities, except individuals, that the documents mention but do not declare.
pub(crate) fn declare_known(graph: &mut Graph, known: &[(EntityKind, Iri)], names: &Names) {
    if known.is_empty() {
        return;
    }
    let declared = Declared::of(graph);
    for (kind, iri) in known.iter().filter(|(_, iri)| names.find(iri).is_some() && !is_reserved(iri)) {
        let (class, is_declared) = match kind {
            EntityKind::Class => (owl::CLASS, declared.classes.contains(&**iri)),
            EntityKind::Datatype => (rdfs::DATATYPE, declared.datatypes.contains(&**iri)),
            EntityKind::ObjectProperty => (owl::OBJECT_PROPERTY, declared.properties.contains(&**iri)),
            EntityKind::DataProperty => (owl::DATATYPE_PROPERTY, declared.properties.contains(&**iri)),
            EntityKind::AnnotationProperty => {
                (owl::ANNOTATION_PROPERTY, declared.properties.contains(&**iri))
            }
            EntityKind::NamedIndividual => continue,
        };
        if !is_declared {
            state(graph, iri, class);
        }
    }
}

/// Declares the properties of dropped `headers` that no other statement describes as annotation properties. Otherwise a reader of the
/// merged triples would take the annotations of these headers for assertions about individuals. A property that is
/// also the subject or the object of a statement keeps the kind that follows from its use.
pub(crate) fn declare_header_annotations(graph: &mut Graph, headers: &HashSet<Iri>) {
    if headers.is_empty() {
        return;
    }
    let (mut properties, mut nodes) = (BTreeSet::new(), HashSet::default());
    for (_, triple) in graph.iter() {
        let subject = named(&triple.subject);
        nodes.extend(subject.into_iter().chain(iri_of(&triple.object)));
        let property = triple.predicate.as_str();
        if subject.is_some_and(|iri| headers.contains(iri)) && !is_reserved(property) {
            properties.insert(property);
        }
    }
    let properties = properties.into_iter().filter(|property| !nodes.contains(property));
    let properties: Vec<String> = properties.map(str::to_owned).collect();
    for property in properties {
        state(graph, &property, owl::ANNOTATION_PROPERTY);
    }
}

struct Kinds<'a> {
    declared: &'a Declared,
    uses: BTreeMap<String, Use>,
}

impl Kinds<'_> {
    fn of(&self, property: &str) -> Option<&'static str> {
        if self.declared.object_properties.contains(property) {
            Some(owl::OBJECT_PROPERTY)
        } else if self.declared.annotation_properties.contains(property) {
            Some(owl::ANNOTATION_PROPERTY)
        } else if self.declared.properties.contains(property) {
            Some(owl::DATATYPE_PROPERTY)
        } else {
            self.uses.get(property).map(|usage| kind_of(*usage).0)
        }
    }

    /// Unifies the kinds of properties that axioms relate (equivalent, disjoint or subproperties): a known
    /// kind propagates to undeclared properties. An axiom between properties of different kinds is removed,
    /// because horned-owl rejects documents with such axioms. Returns the uses of the undeclared properties,
    /// including the propagated kinds.
    fn propagate_kinds(mut self, graph: &mut Graph, warnings: &mut Vec<Warning>) -> BTreeMap<String, Use> {
        let relations = [owl::EQUIVALENT_PROPERTY, owl::PROPERTY_DISJOINT_WITH, rdfs::SUB_PROPERTY_OF];
        let pairs: Vec<_> = graph
            .iter()
            .filter(|(_, triple)| relations.contains(&triple.predicate.as_str()))
            .filter_map(|(index, triple)| {
                let (first, second) = (named(&triple.subject)?, iri_of(&triple.object)?);
                Some((index, first.to_owned(), second.to_owned()))
            })
            .filter(|(_, first, second)| !is_reserved(first) && !is_reserved(second))
            .collect();
        // In each round, a kind propagates at least one step along a path of related properties.
        for _ in 0..pairs.len().min(MAX_PROPAGATION_ROUNDS) {
            for (_, first, second) in &pairs {
                match (self.of(first), self.of(second)) {
                    (Some(kind), None) => self.assume(second, kind),
                    (None, Some(kind)) => self.assume(first, kind),
                    _ => {}
                }
            }
        }
        for (index, first, second) in pairs {
            // Without any information, object property is the default.
            let kinds = [&first, &second].map(|property| self.of(property).unwrap_or(owl::OBJECT_PROPERTY));
            if kinds[0] == kinds[1] {
                self.assume(&first, kinds[0]);
                self.assume(&second, kinds[0]);
            } else if let Some(triple) = graph.take(index) {
                let reason = "properties of different kinds".to_owned();
                warnings.push(Warning::Unread { statement: triple.to_string(), reason });
            }
        }
        self.uses
    }

    fn assume(&mut self, property: &str, kind: &str) {
        if !self.declared.properties.contains(property) {
            let usage = self.uses.entry(property.to_owned()).or_default();
            usage.object |= kind == owl::OBJECT_PROPERTY;
            usage.data |= kind == owl::DATATYPE_PROPERTY;
            usage.entity |= kind == owl::ANNOTATION_PROPERTY;
        }
    }
}

/// Returns the most probable kind of a property with these uses: the OWL class for its declaration, and
/// the kind as text.
fn kind_of(usage: Use) -> (&'static str, &'static str) {
    let values_only = usage.literal && !usage.object;
    if usage.data || values_only && (!usage.entity || usage.restricted && !usage.individual) {
        (owl::DATATYPE_PROPERTY, "a data property")
    } else if usage.object || usage.restricted || (usage.individual && !usage.entity) {
        (owl::OBJECT_PROPERTY, "an object property")
    } else {
        (owl::ANNOTATION_PROPERTY, "an annotation property")
    }
}

fn state(graph: &mut Graph, iri: &str, class: &str) {
    let subject = NamedOrBlankNode::from(NamedNode::new_unchecked(iri));
    graph.state(&subject, rdf::TYPE, NamedNode::new_unchecked(class));
}

struct Declared {
    /// IRIs of ontologies whose headers are not in the graph.
    ontologies: HashSet<Iri>,
    classes: HashSet<String>,
    datatypes: HashSet<String>,
    properties: HashSet<String>,
    object_properties: HashSet<String>,
    annotation_properties: HashSet<String>,
}

impl Declared {
    fn of(graph: &Graph) -> Self {
        let instances_of = |types: &[&str]| -> HashSet<String> {
            let typed = types.iter().flat_map(|class| graph.instances(class));
            typed.filter_map(|(_, node)| named(&node).map(str::to_owned)).collect()
        };
        let object_properties = instances_of(&[owl::OBJECT_PROPERTY]);
        let annotation_properties = instances_of(&[owl::ANNOTATION_PROPERTY]);
        let mut properties = instances_of(&[owl::DATATYPE_PROPERTY]);
        properties.extend(object_properties.iter().chain(&annotation_properties).cloned());
        Self {
            ontologies: HashSet::default(),
            classes: instances_of(&[owl::CLASS, rdfs::CLASS]),
            datatypes: instances_of(&[rdfs::DATATYPE]),
            properties,
            object_properties,
            annotation_properties,
        }
    }

    fn is_datatype(&self, iri: &str) -> bool {
        iri.starts_with(xsd::NS)
            || self.datatypes.contains(iri)
            || [rdfs::LITERAL, owl::REAL, owl::RATIONAL].contains(&iri)
            || iri.starts_with(rdf::NS)
    }

    /// Returns `true` for an ontology, for any other blank node (which counts as a class), and for a declared class or
    /// property that is not also an individual.
    fn is_entity(&self, graph: &Graph, node: &NamedOrBlankNode) -> bool {
        // Statements about an ontology header are usually annotations.
        if graph.of(node).any(|(_, triple)| is_type(triple, owl::ONTOLOGY)) {
            return true;
        }
        named(node).is_none_or(|iri| {
            if self.ontologies.contains(iri) {
                return true;
            }
            let individual = iri.starts_with(ANONYMOUS)
                || graph.objects(node, rdf::TYPE).any(|class| match class {
                    Term::NamedNode(class) => {
                        !is_reserved(class.as_str()) || class.as_str() == owl::NAMED_INDIVIDUAL
                    }
                    _ => true,
                });
            !individual && (self.classes.contains(iri) || self.properties.contains(iri))
        })
    }
}

fn named(node: &NamedOrBlankNode) -> Option<&str> {
    match node {
        NamedOrBlankNode::NamedNode(node) => Some(node.as_str()),
        NamedOrBlankNode::BlankNode(_) => None,
    }
}

fn restricts_data(graph: &Graph, restriction: &NamedOrBlankNode, declared: &Declared) -> bool {
    graph.of(restriction).any(|(_, triple)| match triple.predicate.as_str() {
        owl::ON_DATA_RANGE => true,
        owl::HAS_VALUE => matches!(triple.object, Term::Literal(_)),
        owl::SOME_VALUES_FROM | owl::ALL_VALUES_FROM => match &triple.object {
            Term::NamedNode(filler) => declared.is_datatype(filler.as_str()),
            Term::BlankNode(node) => {
                let node = NamedOrBlankNode::from(node.clone());
                graph.of(&node).any(|(_, triple)| is_type(triple, rdfs::DATATYPE))
            }
            Term::Literal(_) => false,
        },
        _ => false,
    })
}

fn record_classes(triple: &Triple, declared: &Declared, classes: &mut BTreeSet<String>) {
    let mut record = |iri: Option<&str>| {
        if let Some(iri) = iri.filter(|iri| !is_reserved(iri))
            && !declared.classes.contains(iri)
            && !declared.datatypes.contains(iri)
        {
            classes.insert(iri.to_owned());
        }
    };
    let object = iri_of(&triple.object);
    match triple.predicate.as_str() {
        rdf::TYPE | rdfs::DOMAIN | swrl::CLASS_PREDICATE => record(object),
        rdfs::RANGE => {
            // The range of a data property is a data range, not a class.
            let object_property =
                named(&triple.subject).is_some_and(|iri| declared.object_properties.contains(iri));
            record(object.filter(|_| object_property));
        }
        rdfs::SUB_CLASS_OF | owl::EQUIVALENT_CLASS | owl::DISJOINT_WITH => {
            record(named(&triple.subject));
            record(object);
        }
        _ => {}
    }
}

fn record_property(graph: &Graph, triple: &Triple, declared: &Declared, uses: &mut BTreeMap<String, Use>) {
    let mut record = |iri: &str, change: &dyn Fn(&mut Use)| {
        if !is_reserved(iri)
            && !declared.properties.contains(iri)
            && iri != ORIGIN
            && iri != swrla::IS_RULE_ENABLED
        {
            change(uses.entry(iri.to_owned()).or_default());
        }
    };
    let predicate = triple.predicate.as_str();
    let object = iri_of(&triple.object);
    match predicate {
        swrl::PROPERTY_PREDICATE => {
            let data = graph.of(&triple.subject).any(|(_, t)| is_type(t, swrl::DATAVALUED_PROPERTY_ATOM));
            if let Some(property) = object {
                record(property, &|usage| if data { usage.data = true } else { usage.object = true });
            }
        }
        rdfs::DOMAIN => {
            if let Some(property) = named(&triple.subject) {
                record(property, &|_| ());
            }
        }
        owl::ON_PROPERTY => {
            let data = restricts_data(graph, &triple.subject, declared);
            if let Some(property) = object {
                record(property, &|usage| if data { usage.data = true } else { usage.restricted = true });
            }
        }
        owl::INVERSE_OF => {
            for property in [named(&triple.subject), object].into_iter().flatten() {
                record(property, &|usage| usage.object = true);
            }
        }
        rdfs::RANGE => {
            let data = object.is_some_and(|range| declared.is_datatype(range));
            let class = object.is_some_and(|range| declared.classes.contains(range));
            if let Some(property) = named(&triple.subject) {
                record(property, &|usage| {
                    usage.data |= data;
                    usage.object |= class;
                });
            }
        }
        _ => {}
    }
    if !is_reserved(predicate) && !declared.properties.contains(predicate) {
        let entity = declared.is_entity(graph, &triple.subject);
        let literal = matches!(triple.object, Term::Literal(_));
        record(predicate, &|usage| {
            usage.entity |= entity;
            usage.literal |= literal;
            usage.individual |= !literal;
        });
    }
}
