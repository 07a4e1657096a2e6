//! Converts plain assertions and annotations in the RDF graph directly to axioms, without horned-owl.
//!
//! Most triples of a large knowledge base state the class or a property value of an individual. Once the kinds
//! of the terms are known, such a triple is an axiom by itself, and no pattern has to be matched. Triples that
//! may be part of a pattern remain in the graph: subjects of annotated axioms, headers of ontologies,
//! predicates of several kinds, and OWL's own vocabulary.

use oxrdf::{NamedOrBlankNode, Term, Triple};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::contents::Parts;
use crate::graph::{Graph, iri_of};
use crate::names::{Compact, Names, Object};
use crate::owl::{
    AnnotatedAxiom, Annotation, AnnotationValue, Axiom, ClassExpression, EntityKind, ObjectPropertyExpression,
};
use crate::vocab::{is_reserved, owl, rdf, rdfs};

/// Annotation properties that need no declaration.
const DESCRIPTIONS: [&str; 4] = [rdfs::LABEL, rdfs::COMMENT, rdfs::SEE_ALSO, rdfs::IS_DEFINED_BY];

#[derive(Clone, Copy)]
enum Statement {
    Individual,
    Class,
    Object,
    Data,
    Annotation,
}

#[derive(Clone, Copy, Default)]
struct DeclaredKinds {
    class: bool,
    /// Kind of the statements with the IRI as predicate. `Err` if the IRI is declared as several kinds of
    /// property.
    property: Option<Result<Statement, ()>>,
}

/// Removes the plain statements from a graph in which all entities are declared. Returns these
/// statements and the `bulk` statements as axioms and annotations.
pub(crate) fn take(graph: &mut Graph, bulk: Vec<Compact>, names: &mut Names) -> Parts {
    let mut parts = Parts::default();
    let (statements, declared) = (statements(graph), KindsByNumber::of(graph, names));
    parts.axioms.reserve(bulk.len() + statements.len());
    for triple in bulk {
        if declared.contains(&triple) {
            parts.axioms.push(axiom(triple, names));
        } else {
            // The predicate turned out to be of another kind, so that horned-owl has to read the triple.
            graph.add(names.triple(triple));
        }
    }
    for (index, statement) in statements {
        if let Some(triple) = graph.take(index) {
            convert(triple, statement, names, &mut parts);
        }
    }
    parts
}

fn statements(graph: &Graph) -> Vec<(usize, Statement)> {
    let (kinds, patterns, headers) = (kinds(graph), patterns(graph), headers(graph));
    let classify = |triple: &Triple| {
        let subject = named(triple).filter(|subject| !is_reserved(subject) && !patterns.contains(subject))?;
        let is_header = headers.contains(subject);
        let kind = |iri: &str| kinds.get(iri).copied().unwrap_or_default();
        match (triple.predicate.as_str(), &triple.object) {
            (_, Term::BlankNode(_)) => None,
            (rdf::TYPE, Term::NamedNode(class)) if class.as_str() == owl::NAMED_INDIVIDUAL => {
                Some(Statement::Individual)
            }
            (rdf::TYPE, Term::NamedNode(class)) if !is_reserved(class.as_str()) => {
                kind(class.as_str()).class.then_some(Statement::Class)
            }
            (predicate, _) if DESCRIPTIONS.contains(&predicate) => {
                (!is_header).then_some(Statement::Annotation)
            }
            (owl::TOP_OBJECT_PROPERTY | owl::BOTTOM_OBJECT_PROPERTY, Term::NamedNode(_)) => {
                Some(Statement::Object)
            }
            (owl::TOP_DATA_PROPERTY | owl::BOTTOM_DATA_PROPERTY, Term::Literal(_)) => Some(Statement::Data),
            (predicate, _) if is_reserved(predicate) || subject == predicate => None,
            (predicate, value) => match (kind(predicate).property?.ok()?, value) {
                (Statement::Object, Term::Literal(_)) | (Statement::Data, Term::NamedNode(_)) => None,
                (Statement::Annotation, _) if is_header => None,
                (statement, _) => Some(statement),
            },
        }
    };
    graph.iter().filter_map(|(index, triple)| Some((index, classify(triple)?))).collect()
}

struct KindsByNumber {
    kinds: FxHashMap<u32, DeclaredKinds>,
    rdf_type: Option<u32>,
}

impl KindsByNumber {
    fn of(graph: &Graph, names: &Names) -> Self {
        let declarations = kinds(graph).into_iter();
        let kinds = declarations.filter_map(|(iri, kinds)| Some((names.find(iri)?, kinds))).collect();
        Self { kinds, rdf_type: names.find(rdf::TYPE) }
    }

    fn contains(&self, triple: &Compact) -> bool {
        let property = || self.kinds.get(&triple.predicate).and_then(|kinds| kinds.property);
        match &triple.object {
            Object::Node(class) if Some(triple.predicate) == self.rdf_type => {
                self.kinds.get(class).is_some_and(|kinds| kinds.class)
            }
            Object::Node(_) => matches!(property(), Some(Ok(Statement::Object))),
            Object::Literal(_) => matches!(property(), Some(Ok(Statement::Data))),
        }
    }
}

fn axiom(triple: Compact, names: &Names) -> AnnotatedAxiom {
    let text = |number| names.text(number).clone();
    let (subject, predicate) = (text(triple.subject), text(triple.predicate));
    let axiom = match triple.object {
        Object::Node(class) if &*predicate == rdf::TYPE => {
            Axiom::ClassAssertion(ClassExpression::Class(text(class)), subject)
        }
        Object::Node(object) => Axiom::ObjectPropertyAssertion(
            ObjectPropertyExpression::Property(predicate),
            subject,
            text(object),
        ),
        Object::Literal(literal) => Axiom::DataPropertyAssertion(predicate, subject, *literal),
    };
    AnnotatedAxiom { axiom, annotations: Vec::new() }
}

fn named(triple: &Triple) -> Option<&str> {
    match &triple.subject {
        NamedOrBlankNode::NamedNode(node) => Some(node.as_str()),
        NamedOrBlankNode::BlankNode(_) => None,
    }
}

fn kinds(graph: &Graph) -> FxHashMap<&str, DeclaredKinds> {
    let mut kinds = FxHashMap::<&str, DeclaredKinds>::default();
    for (_, triple) in graph.iter().filter(|(_, triple)| triple.predicate.as_str() == rdf::TYPE) {
        let (Some(subject), Some(class)) = (named(triple), iri_of(&triple.object)) else { continue };
        let property = match class {
            owl::CLASS | rdfs::CLASS => {
                kinds.entry(subject).or_default().class = true;
                continue;
            }
            owl::OBJECT_PROPERTY => Statement::Object,
            owl::DATATYPE_PROPERTY => Statement::Data,
            owl::ANNOTATION_PROPERTY => Statement::Annotation,
            _ => continue,
        };
        let property_kind = &mut kinds.entry(subject).or_default().property;
        *property_kind = match property_kind {
            Some(Ok(other)) if std::mem::discriminant(other) != std::mem::discriminant(&property) => {
                Some(Err(()))
            }
            Some(Err(())) => Some(Err(())),
            _ => Some(Ok(property)),
        };
    }
    kinds
}

/// Returns the IRIs that are the subject of an annotated axiom (`owl:annotatedSource`). Their triples stay in the
/// graph, because horned-owl has to match them with the annotations.
fn patterns(graph: &Graph) -> FxHashSet<&str> {
    let annotated = graph.iter().filter(|(_, triple)| triple.predicate.as_str() == owl::ANNOTATED_SOURCE);
    annotated.filter_map(|(_, triple)| iri_of(&triple.object)).collect()
}

/// Returns the IRIs of ontologies. Their annotations are read elsewhere; their other triples are
/// statements about individuals.
fn headers(graph: &Graph) -> FxHashSet<&str> {
    let typed = graph.iter().filter(|(_, triple)| crate::graph::is_type(triple, owl::ONTOLOGY));
    typed.filter_map(|(_, triple)| named(triple)).collect()
}

fn convert(triple: Triple, statement: Statement, names: &mut Names, parts: &mut Parts) {
    let NamedOrBlankNode::NamedNode(subject) = triple.subject else { return };
    let (subject, predicate) = (names.iri(subject.as_str()), names.iri(triple.predicate.as_str()));
    let axiom = match (statement, triple.object) {
        (Statement::Individual, _) => {
            parts.entities.push((EntityKind::NamedIndividual, subject));
            return;
        }
        (Statement::Annotation, value) => {
            let value = match value {
                Term::NamedNode(iri) => AnnotationValue::Iri(names.iri(iri.as_str())),
                Term::Literal(value) => AnnotationValue::Literal(names.literal(value)),
                Term::BlankNode(_) => return,
            };
            parts.annotations.push((subject, Annotation { property: predicate, value }));
            return;
        }
        (Statement::Class, Term::NamedNode(class)) => {
            Axiom::ClassAssertion(ClassExpression::Class(names.iri(class.as_str())), subject)
        }
        (_, Term::NamedNode(object)) => {
            let property = ObjectPropertyExpression::Property(predicate);
            Axiom::ObjectPropertyAssertion(property, subject, names.iri(object.as_str()))
        }
        (_, Term::Literal(value)) => Axiom::DataPropertyAssertion(predicate, subject, names.literal(value)),
        (_, Term::BlankNode(_)) => return,
    };
    parts.axioms.push(AnnotatedAxiom { axiom, annotations: Vec::new() });
}
