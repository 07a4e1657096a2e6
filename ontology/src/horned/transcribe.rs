//! Transcribes OWL/XML and functional-style documents to N-Triples, and functional-style documents to OWL/XML,
//! with the readers and writers of horned-owl.

use horned_owl::error::{HornedError, Location};
use horned_owl::io::{ParserConfiguration, ofn, owx, rdf};
use horned_owl::model::{self as ho, RcAnnotatedComponent, RcStr};
use horned_owl::ontology::component_mapped::ComponentMappedOntology;
use horned_owl::ontology::set::SetOntology;

use super::stack::with_stack;
use crate::normalize::TRUE;
use crate::read::syntax::Syntax;

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
        let ontology: SetOntology<RcStr> =
            ontology.into_iter().map(|component| without_empty_part(component, &build)).collect();
        let ontology = ComponentMappedOntology::<RcStr, RcAnnotatedComponent>::from(ontology);
        rdf::writer::write_to_rdf_format(Vec::new(), &ontology, "nt")
    };
    let panicked = |_| Fault { offset: 0, message: format!("the {syntax} reader failed on this document") };
    with_stack(|| transcription().map_err(fault)).map_err(panicked)?
}

/// Adds the atom `sameAs(TRUE, TRUE)` to an empty body or head of a rule, because the RDF writer panics on an
/// empty list. `crate::read` removes the atom.
fn without_empty_part(
    mut component: ho::AnnotatedComponent<RcStr>,
    build: &ho::Build<RcStr>,
) -> ho::AnnotatedComponent<RcStr> {
    if let ho::Component::Rule(rule) = &mut component.component {
        let truth = || ho::IArgument::Individual(build.named_individual(TRUE).into());
        for part in [&mut rule.body, &mut rule.head] {
            if part.is_empty() {
                part.push(ho::Atom::SameIndividualAtom(truth(), truth()));
            }
        }
    }
    component
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
