//! Every entity gets a declaration: horned-owl drops assertions of properties whose kind it does not know.
//!
//! Declarations come from the imports closure where it has them. What is declared nowhere gets its kind from its use,
//! with a warning: a property with literals as values is a data property, one between individuals an object property,
//! one that describes only classes, properties or ontologies an annotation property.

use std::collections::{BTreeMap, BTreeSet};

use oxrdf::{NamedNode, NamedOrBlankNode, Term, Triple};
use rustc_hash::FxHashSet as HashSet;

use super::swrl::ORIGIN;
use crate::error::Warning;
use crate::graph::{Graph, iri_of, is_type};
use crate::names::Names;
use crate::owl::{ANONYMOUS, EntityKind, Iri};
use crate::vocab::{is_reserved, owl, rdf, rdfs, swrl, swrla, xsd};

/// How far a kind spreads between undeclared properties.
const SPREADS: usize = 16;

/// How an undeclared property is used.
#[derive(Clone, Copy, Debug, Default)]
#[allow(clippy::struct_excessive_bools)] // independent observations
struct Use {
    literal: bool,
    individual: bool,
    /// By an axiom or rule that says which.
    data: bool,
    object: bool,
    /// By a restriction that does not say which.
    restricted: bool,
    /// On something that is not an individual.
    entity: bool,
}

/// Declares what is not; `classes` are used elsewhere and not declared.
pub(crate) fn declare(graph: &mut Graph, mut classes: BTreeSet<String>, warnings: &mut Vec<Warning>) {
    let (declared, mut properties) = (Declared::of(graph), BTreeMap::new());
    for (_, triple) in graph.iter() {
        record_classes(triple, &declared, &mut classes);
        record_property(graph, triple, &declared, &mut properties);
    }
    let kinds = Kinds { declared: &declared, uses: properties };
    let properties = kinds.between_properties(graph, warnings);
    for class in classes {
        state(graph, &class, owl::CLASS);
        warnings.push(Warning::Undeclared { iri: class, kind: "a class", position: None });
    }
    for (property, used) in properties {
        let (class, kind) = kind_of(used);
        state(graph, &property, class);
        warnings.push(Warning::Undeclared { iri: property, kind, position: None });
    }
    let enabled = swrla::IS_RULE_ENABLED;
    let used = graph.iter().any(|(_, triple)| triple.predicate.as_str() == enabled);
    if used && !declared.annotation_properties.contains(enabled) {
        state(graph, enabled, owl::ANNOTATION_PROPERTY);
    }
    state(graph, ORIGIN, owl::ANNOTATION_PROPERTY);
}

/// Declares those of some entities that documents name and do not declare.
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

/// What is known of properties: their declarations and their uses.
struct Kinds<'a> {
    declared: &'a Declared,
    uses: BTreeMap<String, Use>,
}

impl Kinds<'_> {
    /// The kind of a property, as the class that declares it; `None` while nothing is known.
    fn of(&self, property: &str) -> Option<&'static str> {
        if self.declared.object_properties.contains(property) {
            Some(owl::OBJECT_PROPERTY)
        } else if self.declared.annotation_properties.contains(property) {
            Some(owl::ANNOTATION_PROPERTY)
        } else if self.declared.properties.contains(property) {
            Some(owl::DATATYPE_PROPERTY)
        } else {
            self.uses.get(property).map(|used| kind_of(*used).0)
        }
    }

    /// Properties that are said to be equivalent, disjoint or one below the other have one kind: a known one spreads,
    /// an axiom between two kinds is taken away (horned-owl rejects the whole document for it).
    fn between_properties(mut self, graph: &mut Graph, warnings: &mut Vec<Warning>) -> BTreeMap<String, Use> {
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
        // As often as kinds can spread along a path of pairs.
        for _ in 0..pairs.len().min(SPREADS) {
            for (_, first, second) in &pairs {
                match (self.of(first), self.of(second)) {
                    (Some(kind), None) => self.assume(second, kind),
                    (None, Some(kind)) => self.assume(first, kind),
                    _ => {}
                }
            }
        }
        for (index, first, second) in pairs {
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
            let used = self.uses.entry(property.to_owned()).or_default();
            used.object |= kind == owl::OBJECT_PROPERTY;
            used.data |= kind == owl::DATATYPE_PROPERTY;
            used.entity |= kind == owl::ANNOTATION_PROPERTY;
        }
    }
}

fn kind_of(used: Use) -> (&'static str, &'static str) {
    let values_only = used.literal && !used.object;
    if used.data || values_only && (!used.entity || used.restricted && !used.individual) {
        (owl::DATATYPE_PROPERTY, "a data property")
    } else if used.object || used.restricted || (used.individual && !used.entity) {
        (owl::OBJECT_PROPERTY, "an object property")
    } else {
        (owl::ANNOTATION_PROPERTY, "an annotation property")
    }
}

fn state(graph: &mut Graph, iri: &str, class: &str) {
    let subject = NamedOrBlankNode::from(NamedNode::new_unchecked(iri));
    graph.state(&subject, rdf::TYPE, NamedNode::new_unchecked(class));
}

/// What the closure declares.
struct Declared {
    classes: HashSet<String>,
    datatypes: HashSet<String>,
    properties: HashSet<String>,
    object_properties: HashSet<String>,
    annotation_properties: HashSet<String>,
}

impl Declared {
    fn of(graph: &Graph) -> Self {
        let all = |types: &[&str]| -> HashSet<String> {
            let typed = types.iter().flat_map(|class| graph.instances(class));
            typed.filter_map(|(_, node)| named(&node).map(str::to_owned)).collect()
        };
        let object_properties = all(&[owl::OBJECT_PROPERTY]);
        let annotation_properties = all(&[owl::ANNOTATION_PROPERTY]);
        let mut properties = all(&[owl::DATATYPE_PROPERTY]);
        properties.extend(object_properties.iter().chain(&annotation_properties).cloned());
        Self {
            classes: all(&[owl::CLASS, rdfs::CLASS]),
            datatypes: all(&[rdfs::DATATYPE]),
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

    /// Whether the node is something else than an individual.
    fn is_entity(&self, graph: &Graph, node: &NamedOrBlankNode) -> bool {
        // Most of what headers say are annotations.
        if graph.of(node).any(|(_, triple)| is_type(triple, owl::ONTOLOGY)) {
            return true;
        }
        named(node).is_none_or(|iri| {
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

/// Whether a restriction is one on values.
fn restricts_data(graph: &Graph, restriction: &NamedOrBlankNode, declared: &Declared) -> bool {
    graph.of(restriction).any(|(_, triple)| match triple.predicate.as_str() {
        owl::ON_DATA_RANGE => true,
        owl::HAS_VALUE => matches!(triple.object, Term::Literal(_)),
        owl::SOME_VALUES_FROM | owl::ALL_VALUES_FROM => match &triple.object {
            Term::NamedNode(filler) => declared.is_datatype(filler.as_str()),
            Term::BlankNode(node) => {
                let node = NamedOrBlankNode::from(node.clone());
                graph.of(&node).any(|(_, said)| is_type(said, rdfs::DATATYPE))
            }
            Term::Literal(_) => false,
        },
        _ => false,
    })
}

/// Notes the undeclared classes that a triple names.
fn record_classes(triple: &Triple, declared: &Declared, classes: &mut BTreeSet<String>) {
    let mut note = |iri: Option<&str>| {
        if let Some(iri) = iri.filter(|iri| !is_reserved(iri))
            && !declared.classes.contains(iri)
            && !declared.datatypes.contains(iri)
        {
            classes.insert(iri.to_owned());
        }
    };
    let object = iri_of(&triple.object);
    match triple.predicate.as_str() {
        rdf::TYPE | rdfs::DOMAIN | swrl::CLASS_PREDICATE => note(object),
        rdfs::RANGE => {
            let object_property =
                named(&triple.subject).is_some_and(|iri| declared.object_properties.contains(iri));
            note(object.filter(|_| object_property));
        }
        rdfs::SUB_CLASS_OF | owl::EQUIVALENT_CLASS | owl::DISJOINT_WITH => {
            note(named(&triple.subject));
            note(object);
        }
        _ => {}
    }
}

/// Notes how a triple uses an undeclared property.
fn record_property(graph: &Graph, triple: &Triple, declared: &Declared, uses: &mut BTreeMap<String, Use>) {
    let mut note = |iri: &str, change: &dyn Fn(&mut Use)| {
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
                note(property, &|used| if data { used.data = true } else { used.object = true });
            }
        }
        rdfs::DOMAIN => {
            if let Some(property) = named(&triple.subject) {
                note(property, &|_| ());
            }
        }
        owl::ON_PROPERTY => {
            let data = restricts_data(graph, &triple.subject, declared);
            if let Some(property) = object {
                note(property, &|used| if data { used.data = true } else { used.restricted = true });
            }
        }
        owl::INVERSE_OF => {
            for property in [named(&triple.subject), object].into_iter().flatten() {
                note(property, &|used| used.object = true);
            }
        }
        rdfs::RANGE => {
            let data = object.is_some_and(|range| declared.is_datatype(range));
            let class = object.is_some_and(|range| declared.classes.contains(range));
            if let Some(property) = named(&triple.subject) {
                note(property, &|used| {
                    used.data |= data;
                    used.object |= class;
                });
            }
        }
        _ => {}
    }
    if !is_reserved(predicate) && !declared.properties.contains(predicate) {
        let entity = declared.is_entity(graph, &triple.subject);
        let literal = matches!(triple.object, Term::Literal(_));
        note(predicate, &|used| {
            used.entity |= entity;
            used.literal |= literal;
            used.individual |= !literal;
        });
    }
}
