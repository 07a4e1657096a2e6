//! Lints for models: legal OWL that is probably a mistake, because the robot adapts less than its author
//! expects.

use std::collections::{BTreeMap, BTreeSet};

use rules::{Engine, Literal as Value, Symbol};

use super::change::holders;
use super::facts::Facts;
use super::terms::{self, Term};
use crate::error::Warning;
use crate::lower::Equality;
use crate::owl::{
    AnnotatedAxiom, Argument, Atom, Axiom, Characteristic, DataRange, Iri, Literal,
    ObjectPropertyExpression as Property, Ontology,
};
use crate::vocab::{owl, xsd};

/// Checks a model for probable mistakes. `engine` contains the consequences of `ontology` under the given semantics of
/// names. Returns the warnings, sorted.
pub fn check(ontology: &Ontology, engine: &Engine, equality: Equality) -> Vec<Warning> {
    let facts = Facts::new(engine);
    let mut warnings = functions(facts);
    warnings.extend(requirements(facts));
    warnings.extend(measurements(facts));
    warnings.extend(several_values(ontology, equality));
    warnings.extend(statuses(ontology));
    warnings.sort();
    warnings.dedup();
    warnings
}

fn iri(facts: Facts, symbol: Symbol) -> String {
    facts.name(symbol).unwrap_or_default().to_owned()
}

fn functions(facts: Facts) -> Vec<Warning> {
    let mut warnings = Vec::new();
    for design in facts.members(terms::FUNCTION_DESIGN) {
        if facts.objects(design, terms::SOLVES_F).is_empty() {
            warnings.push(Warning::DesignWithoutFunction { design: iri(facts, design) });
        }
    }
    for function in facts.members(terms::FUNCTION) {
        if facts.subjects(function, terms::SOLVES_F).is_empty() {
            warnings.push(Warning::FunctionWithoutDesign { function: iri(facts, function) });
        }
    }
    warnings
}

fn requirements(facts: Facts) -> Vec<Warning> {
    let has_value = |requirement: Symbol, properties: &[Term]| {
        properties.iter().any(|property| !facts.literals(requirement, property).is_empty())
    };
    let bounds = facts.members(terms::REQUIREMENT).into_iter();
    let mut without_value: BTreeSet<Symbol> =
        bounds.filter(|&bound| !has_value(bound, &[terms::HAS_MINIMUM, terms::HAS_MAXIMUM])).collect();
    for objective in facts.members(terms::OBJECTIVE) {
        let required = facts.objects(objective, terms::HAS_NFR).into_iter();
        without_value.extend(required.filter(|&value| !has_value(value, &[terms::HAS_VALUE])));
    }
    let warning = |requirement| Warning::RequirementWithoutValue { requirement: iri(facts, requirement) };
    without_value.into_iter().map(warning).collect()
}

/// Reports attributes without a measurement that are needed for a comparison: a design bounds the
/// attribute, or the attribute has a comparison operator and an estimation of a design.
fn measurements(facts: Facts) -> Vec<Warning> {
    let estimated = |kind: Symbol| {
        let mut values = facts.subjects(kind, terms::IS_TYPE).into_iter();
        values.any(|value| !facts.subjects(value, terms::HAS_ESTIMATION).is_empty())
    };
    let kinds = facts.members(terms::ATTRIBUTE_TYPE).into_iter();
    let kinds = kinds.filter(|&kind| !facts.literals(kind, terms::OPERATOR).is_empty());
    let mut compared: BTreeSet<Symbol> = kinds.filter(|&kind| estimated(kind)).collect();
    for design in facts.members(terms::FUNCTION_DESIGN) {
        let bounds = facts.objects(design, terms::HAS_REQUIREMENT).into_iter();
        compared.extend(bounds.flat_map(|bound| facts.objects(bound, terms::IS_TYPE)));
    }
    let measured = |kind: Symbol| {
        holders(facts, kind).into_iter().any(|holder| !facts.literals(holder, terms::HAS_VALUE).is_empty())
    };
    let unmeasured = compared.into_iter().filter(|&kind| !measured(kind));
    unmeasured.map(|kind| Warning::NothingMeasured { attribute: iri(facts, kind) }).collect()
}

/// Reports individuals with several stated values of a functional property. Literals are compared by value.
fn several_values(ontology: &Ontology, equality: Equality) -> Vec<Warning> {
    let functional: BTreeSet<&Iri> = ontology.axioms.iter().filter_map(functional).collect();
    // Axioms are sorted, so that the values of one property of one individual are adjacent.
    let groups = ontology.axioms.chunk_by(|a, b| edge(a).is_some_and(|edge| Some(edge) == self::edge(b)));
    let several = groups.filter(|axioms| axioms.len() > 1).filter_map(|axioms| {
        let (property, subject) = edge(&axioms[0]).filter(|(property, _)| functional.contains(property))?;
        let values: BTreeSet<String> = axioms.iter().filter_map(object).collect();
        let individuals = matches!(axioms[0].axiom, Axiom::ObjectPropertyAssertion(..));
        (values.len() > 1).then(|| Warning::SeveralValues {
            subject: subject.to_string(),
            property: property.to_string(),
            values: values.into_iter().collect(),
            consequence: match (individuals, equality) {
                (true, Equality::Owl) => "they are treated as one individual",
                (true, Equality::UniqueNames) => "this is a contradiction, because their names are unique",
                (true, Equality::UncheckedUniqueNames) => "all of them are kept",
                (false, _) if any_differ(axioms) => "this is a contradiction",
                (false, _) => "whether these are one value is not decided",
            },
        })
    });
    several.collect()
}

fn any_differ(axioms: &[AnnotatedAxiom]) -> bool {
    let values = axioms.iter().filter_map(|annotated| match &annotated.axiom {
        Axiom::DataPropertyAssertion(_, _, to) => Some(value(to)),
        _ => None,
    });
    let values: Vec<Value> = values.collect();
    values
        .iter()
        .enumerate()
        .any(|(index, first)| values[index + 1..].iter().any(|second| first.differs(second)))
}

fn functional(annotated: &AnnotatedAxiom) -> Option<&Iri> {
    match &annotated.axiom {
        Axiom::FunctionalDataProperty(property)
        | Axiom::ObjectPropertyCharacteristic(Characteristic::Functional, Property::Property(property)) => {
            Some(property)
        }
        _ => None,
    }
}

fn edge(annotated: &AnnotatedAxiom) -> Option<(&Iri, &Iri)> {
    match &annotated.axiom {
        Axiom::ObjectPropertyAssertion(Property::Property(property), subject, _)
        | Axiom::DataPropertyAssertion(property, subject, _) => Some((property, subject)),
        _ => None,
    }
}

fn object(annotated: &AnnotatedAxiom) -> Option<String> {
    match &annotated.axiom {
        Axiom::ObjectPropertyAssertion(_, _, to) => Some(format!("<{to}>")),
        Axiom::DataPropertyAssertion(_, _, to) => Some(value(to).to_string()),
        _ => None,
    }
}

fn value(literal: &Literal) -> Value {
    Value::parse(&literal.lexical, literal.datatype.as_deref(), literal.language.as_deref())
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Boolean(_) => "a boolean",
        _ if value.as_rational().is_some() => "a number",
        _ => "a string",
    }
}

/// Reports asserted status values of an unexpected kind (boolean, number or string). The expected kind is
/// given by the ranges of the property or, without a range, by the literals in the atoms of the property in
/// rule bodies. A property for which these give no kind or several kinds is not checked.
fn statuses(ontology: &Ontology) -> Vec<Warning> {
    let properties =
        [terms::STATUS, terms::OBJECTIVE_STATUS, terms::GROUNDING_STATUS, terms::REALISABILITY].concat();
    let mut expected = BTreeMap::<&str, &'static str>::new();
    for property in properties {
        let range_kinds = kinds_of_ranges(ontology, property);
        let kinds = if range_kinds.is_empty() { tested_kinds(ontology, property) } else { range_kinds };
        if let &[kind] = kinds.iter().collect::<Vec<_>>().as_slice() {
            expected.insert(property, kind);
        }
    }
    let mut warnings = Vec::new();
    for annotated in &ontology.axioms {
        let Axiom::DataPropertyAssertion(property, subject, status) = &annotated.axiom else { continue };
        let Some(expected) = expected.get(&**property) else { continue };
        let status = value(status);
        if kind(&status) != *expected {
            warnings.push(Warning::StatusDatatype {
                subject: subject.to_string(),
                property: property.to_string(),
                value: status.to_string(),
                expected,
            });
        }
    }
    warnings
}

const NUMBERS: [&str; 18] = [
    "decimal",
    "integer",
    "float",
    "double",
    "byte",
    "short",
    "int",
    "long",
    "unsignedByte",
    "unsignedShort",
    "unsignedInt",
    "unsignedLong",
    "nonNegativeInteger",
    "nonPositiveInteger",
    "positiveInteger",
    "negativeInteger",
    "real",
    "rational",
];
const STRINGS: [&str; 8] =
    ["string", "normalizedString", "token", "language", "Name", "NCName", "NMTOKEN", "anyURI"];

/// Returns the kinds of values in the ranges of a property: all kinds if a datatype is unknown.
fn kinds_of_ranges(ontology: &Ontology, property: &str) -> BTreeSet<&'static str> {
    let mut kinds = BTreeSet::new();
    for annotated in &ontology.axioms {
        match &annotated.axiom {
            Axiom::DataPropertyRange(ranged, DataRange::OneOf(values)) if &**ranged == property => {
                kinds.extend(values.iter().map(|literal| kind(&value(literal))));
            }
            Axiom::DataPropertyRange(ranged, DataRange::Datatype(datatype)) if &**ranged == property => {
                match datatype.strip_prefix(xsd::NS).or_else(|| datatype.strip_prefix(owl::NS)) {
                    Some("boolean") => kinds.extend(["a boolean"]),
                    Some(name) if STRINGS.contains(&name) => kinds.extend(["a string"]),
                    Some(name) if NUMBERS.contains(&name) => kinds.extend(["a number"]),
                    _ => kinds.extend(["a boolean", "a number", "a string"]),
                }
            }
            _ => {}
        }
    }
    kinds
}

fn tested_kinds(ontology: &Ontology, property: &str) -> BTreeSet<&'static str> {
    let atoms = ontology.rules.iter().flat_map(|rule| &rule.body);
    let constants = atoms.filter_map(|atom| match atom {
        Atom::DataProperty(predicate, _, Argument::Literal(literal)) if &**predicate == property => {
            Some(kind(&value(literal)))
        }
        _ => None,
    });
    constants.collect()
}
