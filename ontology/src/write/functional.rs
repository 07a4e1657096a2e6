//! An [`Ontology`] as a document in functional-style syntax, with IRIs in full.

use std::fmt::Write;

use crate::owl::{
    ANONYMOUS, Annotation, AnnotationValue, Argument, Atom, Axiom, EntityKind, Iri, Ontology, Rule,
};
use crate::vocab::{is_reserved, rdfs, xsd};

/// The document; what stands where depends on the ontology alone.
pub(super) fn document(ontology: &Ontology) -> String {
    let mut text = String::from("Prefix(xsd:=<http://www.w3.org/2001/XMLSchema#>)\n\n");
    let root = ontology.sources.first();
    let iri = ontology.iri().map(|iri| format!("<{iri}>")).unwrap_or_default();
    let version = root.and_then(|source| source.version.as_ref());
    let version = version.map(|version| format!(" <{version}>")).unwrap_or_default();
    line(&mut text, &format!("Ontology({iri}{version}"));
    let about = |subject: &Iri| Some(subject) == ontology.iri();
    for (_, found) in ontology.annotations.iter().filter(|(subject, _)| about(subject)) {
        line(&mut text, &annotation(found));
    }
    for (kind, iri) in &ontology.entities {
        line(&mut text, &format!("Declaration({}(<{iri}>))", entity(*kind)));
    }
    for annotated in ontology.axioms.iter().filter(|annotated| says_something(&annotated.axiom)) {
        let annotations: String = annotated.annotations.iter().map(|found| annotation(found) + " ").collect();
        let axiom = annotated.axiom.to_string();
        // The name of an axiom ends at its first parenthesis, where its annotations belong.
        line(&mut text, &axiom.replacen('(', &format!("({annotations}"), 1));
    }
    for (subject, found) in ontology.annotations.iter().filter(|(subject, _)| !about(subject)) {
        let annotations = annotations_of(ontology, subject, found);
        if let Some(axiom) = annotation_axiom(ontology, subject, found) {
            line(&mut text, &axiom.replacen('(', &format!("({annotations}"), 1));
            continue;
        }
        let (property, value) = (&found.property, value(&found.value));
        let subject = node(subject);
        line(&mut text, &format!("AnnotationAssertion({annotations}<{property}> {subject} {value})"));
    }
    for found in &ontology.rules {
        line(&mut text, &rule(found));
    }
    text + ")\n"
}

/// Whether an axiom about several entities is about more than one: the syntax has no form for others, which say nothing.
fn says_something(axiom: &Axiom) -> bool {
    let several = match axiom {
        Axiom::SameIndividual(items)
        | Axiom::DifferentIndividuals(items)
        | Axiom::EquivalentDataProperties(items)
        | Axiom::DisjointDataProperties(items) => items.len(),
        Axiom::EquivalentClasses(items) | Axiom::DisjointClasses(items) => items.len(),
        Axiom::EquivalentObjectProperties(items) | Axiom::DisjointObjectProperties(items) => items.len(),
        _ => return true,
    };
    several > 1
}

/// The annotations of an annotation.
fn annotations_of(ontology: &Ontology, subject: &Iri, found: &Annotation) -> String {
    let all = &ontology.annotation_annotations;
    let start = all.partition_point(|(s, annotation, _)| (s, annotation) < (subject, found));
    let own = all[start..].iter().take_while(|(s, annotation, _)| (s, annotation) == (subject, found));
    own.map(|(.., own)| annotation(own) + " ").collect()
}

/// An axiom about an annotation property, which an ontology keeps as an annotation.
fn annotation_axiom(ontology: &Ontology, subject: &Iri, found: &Annotation) -> Option<String> {
    let AnnotationValue::Iri(value) = &found.value else { return None };
    let is_annotative = |iri: &Iri| {
        is_reserved(iri)
            || ontology.entities.binary_search(&(EntityKind::AnnotationProperty, iri.clone())).is_ok()
    };
    if !is_annotative(subject) || value.starts_with(ANONYMOUS) {
        return None;
    }
    match &*found.property {
        rdfs::SUB_PROPERTY_OF if is_annotative(value) => {
            Some(format!("SubAnnotationPropertyOf(<{subject}> <{value}>)"))
        }
        rdfs::DOMAIN => Some(format!("AnnotationPropertyDomain(<{subject}> <{value}>)")),
        rdfs::RANGE => Some(format!("AnnotationPropertyRange(<{subject}> <{value}>)")),
        _ => None,
    }
}

fn line(text: &mut String, content: &str) {
    // Writing to a string does not fail.
    let _ = writeln!(text, "{content}");
}

fn entity(kind: EntityKind) -> &'static str {
    match kind {
        EntityKind::Class => "Class",
        EntityKind::ObjectProperty => "ObjectProperty",
        EntityKind::DataProperty => "DataProperty",
        EntityKind::AnnotationProperty => "AnnotationProperty",
        EntityKind::Datatype => "Datatype",
        EntityKind::NamedIndividual => "NamedIndividual",
    }
}

fn node(iri: &Iri) -> String {
    iri.strip_prefix(ANONYMOUS).map_or_else(|| format!("<{iri}>"), |label| format!("_:{label}"))
}

fn annotation(annotation: &Annotation) -> String {
    format!("Annotation(<{}> {})", annotation.property, value(&annotation.value))
}

fn value(value: &AnnotationValue) -> String {
    match value {
        AnnotationValue::Literal(literal) => literal.to_string(),
        AnnotationValue::Iri(iri) => node(iri),
    }
}

fn rule(rule: &Rule) -> String {
    let annotations: String = rule.annotations.iter().map(|found| annotation(found) + " ").collect();
    let atoms = |atoms: &[Atom]| atoms.iter().map(atom).collect::<Vec<_>>().join(" ");
    format!("DLSafeRule({annotations}Body({}) Head({}))", atoms(&rule.body), atoms(&rule.head))
}

fn atom(atom: &Atom) -> String {
    match atom {
        Atom::Class(class, x) => format!("ClassAtom({class} {})", argument(x)),
        Atom::DataRange(range, x) => format!("DataRangeAtom({range} {})", argument(x)),
        Atom::ObjectProperty(property, x, y) => {
            format!("ObjectPropertyAtom({property} {} {})", argument(x), argument(y))
        }
        Atom::DataProperty(property, x, y) => {
            format!("DataPropertyAtom(<{property}> {} {})", argument(x), argument(y))
        }
        Atom::SameIndividual(x, y) => format!("SameIndividualAtom({} {})", argument(x), argument(y)),
        Atom::DifferentIndividuals(x, y) => {
            format!("DifferentIndividualsAtom({} {})", argument(x), argument(y))
        }
        Atom::BuiltIn(built_in, arguments) => {
            let arguments: Vec<_> = arguments.iter().map(argument).collect();
            format!("BuiltInAtom(<{built_in}> {})", arguments.join(" "))
        }
    }
}

fn argument(argument: &Argument) -> String {
    match argument {
        Argument::Variable(iri) => format!("Variable(<{iri}>)"),
        Argument::Individual(iri) => node(iri),
        // A plain literal would come back as one, but the parsers of rules want a datatype.
        Argument::Literal(literal) if literal.datatype.is_none() && literal.language.is_none() => {
            format!("{literal}^^<{}>", xsd::STRING)
        }
        Argument::Literal(literal) => literal.to_string(),
    }
}
