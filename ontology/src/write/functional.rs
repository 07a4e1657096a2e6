//! Writes an [`Ontology`] in functional-style syntax, with full IRIs.

use std::cell::Cell;
use std::fmt::Write;

use crate::owl::{
    ANONYMOUS, Annotation, AnnotationValue, Argument, Atom, Axiom, EntityKind, Iri, Ontology, Rule,
};
use crate::vocab::{is_reserved, rdfs, xsd};

/// Number of written blank nodes that are only values of annotations. Each of them gets its own label.
type Blanks = Cell<usize>;

pub(super) fn document(ontology: &Ontology) -> String {
    let blanks = &Blanks::default();
    let mut text = String::from("Prefix(xsd:=<http://www.w3.org/2001/XMLSchema#>)\n\n");
    let root = ontology.sources.first();
    let iri = ontology.iri().map(|iri| format!("<{iri}>")).unwrap_or_default();
    let version = root.and_then(|source| source.version.as_ref());
    let version = version.map(|version| format!(" <{version}>")).unwrap_or_default();
    line(&mut text, &format!("Ontology({iri}{version}"));
    let is_header = |subject: &Iri| Some(subject) == ontology.iri();
    for (_, entry) in ontology.annotations.iter().filter(|(subject, _)| is_header(subject)) {
        line(&mut text, &annotation(entry, blanks));
    }
    for (kind, iri) in &ontology.entities {
        line(&mut text, &format!("Declaration({}(<{iri}>))", entity(*kind)));
    }
    for annotated in ontology.axioms.iter().filter(|annotated| has_form(&annotated.axiom)) {
        let annotations = annotated.annotations.iter().map(|entry| annotation(entry, blanks) + " ");
        let annotations: String = annotations.collect();
        let axiom = annotated.axiom.to_string();
        // The annotations of an axiom follow its first parenthesis.
        line(&mut text, &axiom.replacen('(', &format!("({annotations}"), 1));
    }
    for (subject, entry) in ontology.annotations.iter().filter(|(subject, _)| !is_header(subject)) {
        let annotations = annotations_of(ontology, subject, entry, blanks);
        if let Some(axiom) = annotation_axiom(ontology, subject, entry) {
            line(&mut text, &axiom.replacen('(', &format!("({annotations}"), 1));
            continue;
        }
        let (property, value) = (&entry.property, value(&entry.value, blanks));
        let subject = node(subject);
        line(&mut text, &format!("AnnotationAssertion({annotations}<{property}> {subject} {value})"));
    }
    for swrl_rule in &ontology.rules {
        line(&mut text, &rule(swrl_rule, blanks));
    }
    text + ")\n"
}

/// Checks that the reader of the syntax accepts the rules: arguments of data properties, data ranges and built-ins must
/// not be individuals, although SWRL allows the first argument of a data property to be one. Otherwise describes the
/// first such atom.
pub(super) fn require_rules(ontology: &Ontology) -> Result<(), String> {
    let is_individual = |argument: &Argument| matches!(argument, Argument::Individual(_));
    let is_unreadable = |atom: &&Atom| match atom {
        Atom::DataProperty(_, x, y) => is_individual(x) || is_individual(y),
        Atom::DataRange(_, x) => is_individual(x),
        Atom::BuiltIn(_, arguments) => arguments.iter().any(is_individual),
        _ => false,
    };
    let mut atoms = ontology.rules.iter().flat_map(|rule| rule.body.iter().chain(&rule.head));
    match atoms.find(is_unreadable) {
        None => Ok(()),
        Some(unreadable) => Err(format!(
            "a rule has `{}`, and readers of this syntax accept no individual there; choose another syntax, such as \
             Turtle",
            atom(unreadable)
        )),
    }
}

/// Returns `false` for n-ary axioms with fewer than two members: these axioms state nothing, and the
/// syntax has no form for them.
fn has_form(axiom: &Axiom) -> bool {
    let member_count = match axiom {
        Axiom::SameIndividual(items)
        | Axiom::DifferentIndividuals(items)
        | Axiom::EquivalentDataProperties(items)
        | Axiom::DisjointDataProperties(items) => items.len(),
        Axiom::EquivalentClasses(items) | Axiom::DisjointClasses(items) => items.len(),
        Axiom::EquivalentObjectProperties(items) | Axiom::DisjointObjectProperties(items) => items.len(),
        _ => return true,
    };
    member_count > 1
}

fn annotations_of(ontology: &Ontology, subject: &Iri, entry: &Annotation, blanks: &Blanks) -> String {
    let sorted = &ontology.annotation_annotations;
    let start = sorted
        .partition_point(|(other_subject, annotation, _)| (other_subject, annotation) < (subject, entry));
    let nested = sorted[start..]
        .iter()
        .take_while(|(other_subject, annotation, _)| (other_subject, annotation) == (subject, entry));
    nested.map(|(.., nested)| annotation(nested, blanks) + " ").collect()
}

/// Returns the axiom about an annotation property (subproperty, domain or range) that the ontology
/// stores as the annotation `entry`; `None` for other annotations.
fn annotation_axiom(ontology: &Ontology, subject: &Iri, entry: &Annotation) -> Option<String> {
    let AnnotationValue::Iri(value) = &entry.value else { return None };
    let is_annotative = |iri: &Iri| {
        is_reserved(iri)
            || ontology.entities.binary_search(&(EntityKind::AnnotationProperty, iri.clone())).is_ok()
    };
    if !is_annotative(subject) || value.starts_with(ANONYMOUS) {
        return None;
    }
    match &*entry.property {
        rdfs::SUB_PROPERTY_OF if is_annotative(value) => {
            Some(format!("SubAnnotationPropertyOf(<{subject}> <{value}>)"))
        }
        rdfs::DOMAIN => Some(format!("AnnotationPropertyDomain(<{subject}> <{value}>)")),
        rdfs::RANGE => Some(format!("AnnotationPropertyRange(<{subject}> <{value}>)")),
        _ => None,
    }
}

fn line(text: &mut String, content: &str) {
    // Writing to a string cannot fail.
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

fn annotation(annotation: &Annotation, blanks: &Blanks) -> String {
    format!("Annotation(<{}> {})", annotation.property, value(&annotation.value, blanks))
}

fn value(value: &AnnotationValue, blanks: &Blanks) -> String {
    match value {
        AnnotationValue::Literal(literal) => literal.to_string(),
        AnnotationValue::Iri(iri) if **iri == *ANONYMOUS => {
            blanks.set(blanks.get() + 1);
            format!("_:a{}", blanks.get())
        }
        AnnotationValue::Iri(iri) => node(iri),
    }
}

fn rule(rule: &Rule, blanks: &Blanks) -> String {
    let annotations: String = rule.annotations.iter().map(|entry| annotation(entry, blanks) + " ").collect();
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
        // Parsers of rules require a datatype; `xsd:string` is read as a plain literal.
        Argument::Literal(literal) if literal.datatype.is_none() && literal.language.is_none() => {
            format!("{literal}^^<{}>", xsd::STRING)
        }
        Argument::Literal(literal) => literal.to_string(),
    }
}
