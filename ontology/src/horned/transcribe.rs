//! Transcribes OWL/XML and functional-style documents to N-Triples, and functional-style documents to OWL/XML,
//! with the readers and writers of horned-owl. Rewrites components first that the RDF writer would lose or change.

use std::collections::{BTreeSet, HashMap, HashSet};

use horned_owl::error::{HornedError, Location};
use horned_owl::io::{self, ParserConfiguration, ofn, owx};
use horned_owl::model::{self as ho, Component, RcAnnotatedComponent, RcStr};
use horned_owl::ontology::component_mapped::ComponentMappedOntology;
use horned_owl::ontology::set::SetOntology;

use super::stack::with_stack;
use crate::normalize::{MAX_PAIRED_MEMBERS, TRUE};
use crate::read::syntax::Syntax;
use crate::vocab::{local_name, owl, rdf};

/// Prefix of IRIs that represent blank nodes where horned-owl requires an IRI; the label of the node follows.
const BLANK: &str = "urn:metaplan:blank:";

/// Prefix of the new names of variables; a prefix that other tools give to variables, too.
const VARIABLES: &str = "urn:swrl:var#";

type Annotated = ho::AnnotatedComponent<RcStr>;

#[derive(Debug)]
pub(crate) struct Fault {
    /// Byte offset in the document; 0 if unknown.
    pub offset: usize,
    pub message: String,
}

fn message(error: &HornedError) -> String {
    match error {
        // The reader reports a missing child element as an unexpected end of the file.
        HornedError::ValidityError(message, _) if message == "Unexpected EoF" => {
            "an element ends here that lacks a part, or has one that OWL does not know".to_owned()
        }
        HornedError::ValidityError(message, _) => message.clone(),
        // The message of the functional-style parser quotes the line; its last line has the reason, after a margin of
        // the width of the line number.
        HornedError::ParserError(error, _) => {
            let text = error.to_string();
            let reason = text.lines().next_back().and_then(|line| line.trim_start().strip_prefix("= "));
            reason.map_or_else(|| text.clone(), str::to_owned)
        }
        _ => error.to_string(),
    }
}

pub(crate) fn transcribe(text: &[u8], syntax: Syntax) -> Result<Vec<u8>, Fault> {
    let fault = |error: HornedError| {
        let offset = match &error {
            HornedError::ParserError(_, location) | HornedError::ValidityError(_, location) => match location
            {
                Location::BytePosition(position) => *position,
                Location::ByteSpan(span) => span.start,
                Location::Unknown => 0,
            },
            _ => 0,
        };
        Fault { offset: usize::try_from(offset).unwrap_or(0), message: message(&error) }
    };
    let transcription = || -> Result<Vec<u8>, HornedError> {
        let (mut text, build) = (text, ho::Build::new_rc());
        let configuration = ParserConfiguration::new(&build);
        let ontology: SetOntology<RcStr> = match syntax {
            Syntax::OwlXml => owx::reader::read(&mut text, configuration)?.0,
            _ => ofn::reader::read(&mut text, configuration)?.0,
        };
        let mut components: Vec<_> =
            ontology.into_iter().map(|component| without_empty_part(component, &build)).collect();
        name_importer(&mut components, &build);
        pair_disjoint_classes(&mut components, &build);
        rename_variables(&mut components, &build);
        let ontology: SetOntology<RcStr> = components.into_iter().collect();
        let ontology = ComponentMappedOntology::<RcStr, RcAnnotatedComponent>::from(ontology);
        io::rdf::writer::write_to_rdf_format(Vec::new(), &ontology, "nt").map(with_blank_nodes)
    };
    let panicked = |_| Fault { offset: 0, message: format!("the {syntax} reader failed on this document") };
    with_stack(|| transcription().map_err(fault)).map_err(panicked)?
}

/// Adds the atom `sameAs(TRUE, TRUE)` to an empty body or head of a rule, because the RDF writer panics on an
/// empty list. `crate::read` removes the atom.
fn without_empty_part(mut component: Annotated, build: &ho::Build<RcStr>) -> Annotated {
    if let Component::Rule(rule) = &mut component.component {
        let truth = || ho::IArgument::Individual(build.named_individual(TRUE).into());
        for part in [&mut rule.body, &mut rule.head] {
            if part.is_empty() {
                part.push(ho::Atom::SameIndividualAtom(truth(), truth()));
            }
        }
    }
    component
}

/// Names an ontology without an IRI that has imports, because the RDF writer omits its imports otherwise.
fn name_importer(components: &mut Vec<Annotated>, build: &ho::Build<RcStr>) {
    let has_iri = |item: &Annotated| matches!(&item.component, Component::OntologyID(id) if id.iri.is_some());
    let is_import = |item: &Annotated| matches!(item.component, Component::Import(_));
    if components.iter().any(is_import) && !components.iter().any(has_iri) {
        components.retain(|item| !matches!(item.component, Component::OntologyID(_)));
        let iri = Some(build.iri(format!("{BLANK}importer")));
        components.push(ho::OntologyID { iri, viri: None }.into());
    }
}

/// Replaces each axiom about three or more disjoint classes by the axioms about all pairs. The RDF writer would
/// write only the pairs of the first class. An axiom with more than [`MAX_PAIRED_MEMBERS`] classes becomes the
/// disjoint union of an auxiliary class, which has the list that [`with_blank_nodes`] needs. It loses its annotations.
fn pair_disjoint_classes(components: &mut Vec<Annotated>, build: &ho::Build<RcStr>) {
    let is_nary = |item: &mut Annotated| match &item.component {
        Component::DisjointClasses(axiom) => axiom.0.len() > 2,
        _ => false,
    };
    let mut axioms: Vec<_> = components.extract_if(.., is_nary).collect();
    // The components come in hash order.
    axioms.sort();
    for (index, Annotated { component, ann }) in axioms.into_iter().enumerate() {
        let Component::DisjointClasses(ho::DisjointClasses(classes)) = component else { continue };
        if classes.len() > MAX_PAIRED_MEMBERS {
            let group = build.class(format!("{BLANK}disjoint{index}"));
            components.push(ho::DisjointUnion(group, classes).into());
            continue;
        }
        for (index, first) in classes.iter().enumerate() {
            components.extend(classes[index + 1..].iter().map(|second| {
                let pair = ho::DisjointClasses(vec![first.clone(), second.clone()]);
                Annotated { component: pair.into(), ann: ann.clone() }
            }));
        }
    }
}

enum Argument<'a> {
    Individual(&'a ho::Individual<RcStr>),
    Variable(&'a mut ho::Variable<RcStr>),
    Literal,
}

fn arguments(atom: &mut ho::Atom<RcStr>) -> Vec<Argument<'_>> {
    fn individual(argument: &mut ho::IArgument<RcStr>) -> Argument<'_> {
        match argument {
            ho::IArgument::Individual(individual) => Argument::Individual(individual),
            ho::IArgument::Variable(variable) => Argument::Variable(variable),
        }
    }
    fn data(argument: &mut ho::DArgument<RcStr>) -> Argument<'_> {
        match argument {
            ho::DArgument::Literal(_) => Argument::Literal,
            ho::DArgument::Variable(variable) => Argument::Variable(variable),
        }
    }
    match atom {
        ho::Atom::BuiltInAtom { args, .. } => args.iter_mut().map(data).collect(),
        ho::Atom::ClassAtom { arg, .. } => vec![individual(arg)],
        ho::Atom::DataRangeAtom { arg, .. } => vec![data(arg)],
        ho::Atom::DataPropertyAtom { args, .. } => vec![data(&mut args.0), data(&mut args.1)],
        ho::Atom::ObjectPropertyAtom { args, .. } => vec![individual(&mut args.0), individual(&mut args.1)],
        ho::Atom::SameIndividualAtom(first, second) | ho::Atom::DifferentIndividualsAtom(first, second) => {
            vec![individual(first), individual(second)]
        }
    }
}

/// Gives variables names that no individual has, in this document and in other ones. In RDF, a declaration as a variable
/// would apply to both.
fn rename_variables(components: &mut [Annotated], build: &ho::Build<RcStr>) {
    let mut rules: Vec<Vec<&mut ho::Atom<RcStr>>> = Vec::new();
    for item in components {
        if let Component::Rule(rule) = &mut item.component {
            rules.push(rule.body.iter_mut().chain(&mut rule.head).collect());
        }
    }
    let mut individuals = HashSet::new();
    for argument in rules.iter_mut().flatten().flat_map(|atom| arguments(atom)) {
        if let Argument::Individual(ho::Individual::Named(name)) = argument {
            individuals.insert(name.0.clone());
        }
    }
    for atoms in &mut rules {
        // Names are distinct within a rule, so that variables keep their local names.
        let mut variables = BTreeSet::new();
        for argument in atoms.iter_mut().flat_map(|atom| arguments(atom)) {
            if let Argument::Variable(variable) = argument {
                variables.insert(variable.0.clone());
            }
        }
        let mut names = HashMap::new();
        for iri in variables.clone() {
            if iri.starts_with(VARIABLES) && !individuals.contains(&iri) {
                continue;
            }
            let mut name = format!("{VARIABLES}{}", local_name(&iri));
            while individuals.contains(&*name) || variables.contains(&*name) {
                name.push('_');
            }
            variables.insert(build.iri(&*name));
            names.insert(iri, build.variable(name));
        }
        for argument in atoms.iter_mut().flat_map(|atom| arguments(atom)) {
            if let Argument::Variable(variable) = argument
                && let Some(name) = names.get(&variable.0)
            {
                *variable = name.clone();
            }
        }
    }
}

/// Replaces the auxiliary IRIs of [`name_importer`] and [`pair_disjoint_classes`] by blank nodes, and disjoint unions
/// of auxiliary classes by axioms of the type `owl:AllDisjointClasses`.
fn with_blank_nodes(ntriples: Vec<u8>) -> Vec<u8> {
    let (blank, union) = (format!("<{BLANK}"), format!("<{}>", owl::DISJOINT_UNION_OF));
    if memchr::memmem::find(&ntriples, blank.as_bytes()).is_none() {
        return ntriples;
    }
    let (mut result, is_space) = (Vec::with_capacity(ntriples.len()), |byte: &u8| *byte == b' ');
    for line in ntriples.split_inclusive(|&byte| byte == b'\n') {
        let mut terms = line.splitn(3, is_space);
        let (Some(subject), Some(predicate), Some(object)) = (terms.next(), terms.next(), terms.next())
        else {
            result.extend_from_slice(line);
            continue;
        };
        let node = |term: &[u8]| match term.strip_prefix(blank.as_bytes()) {
            // The bracket ends the label.
            Some(tail) => {
                let tail = tail.iter().filter(|&&byte| byte != b'>');
                b"_:auxiliary-".iter().chain(tail).copied().collect()
            }
            None => term.to_vec(),
        };
        let is_group = subject.starts_with(blank.as_bytes()) && predicate == union.as_bytes();
        let (subject, object) = (node(subject), node(object));
        let mut write = |predicate: &[u8], object: &[u8]| {
            result.extend([&subject[..], predicate, object].join(&b' '));
        };
        if is_group {
            write(
                format!("<{}>", rdf::TYPE).as_bytes(),
                format!("<{}> .\n", owl::ALL_DISJOINT_CLASSES).as_bytes(),
            );
            write(format!("<{}>", owl::MEMBERS).as_bytes(), &object);
        } else {
            write(predicate, &object);
        }
    }
    result
}

pub(crate) fn owl_xml(text: &[u8]) -> Result<String, String> {
    let transcription = || -> Result<Vec<u8>, HornedError> {
        let (mut text, build) = (text, ho::Build::new_rc());
        let ontology: SetOntology<RcStr> = ofn::reader::read(&mut text, ParserConfiguration::new(&build))?.0;
        let ontology = ComponentMappedOntology::<RcStr, RcAnnotatedComponent>::from(ontology);
        owx::writer::write(Vec::new(), &ontology, None)
    };
    let bytes = with_stack(|| transcription().map_err(|error| error.to_string()))
        .map_err(|_| "the OWL/XML writer failed on it".to_owned())??;
    String::from_utf8(bytes).map_err(|error| error.to_string())
}
