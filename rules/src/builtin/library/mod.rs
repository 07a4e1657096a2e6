//! The libraries `swrlm` and `temporal` of `SWRLTab` as [custom built-ins](super::Definition) ([1], [2]). Their ontologies
//! have been published in several versions; the built-ins are those of any of them.
//!
//! `temporal` is there in its *basic mode*, about dates and times. Its advanced mode is about individuals of the temporal
//! ontology, and a built-in sees values only: such atoms are false.
//!
//! [1] `SWRLTab` wiki: Mathematical Built-In Library.
//! [2] `SWRLTab` wiki: Temporal Built-In Library, Basic Mode.

mod expression;
mod math;
mod temporal;

use std::sync::LazyLock;

use super::custom::Definition;
use super::signature::BuiltIn;

/// Where the libraries of `SWRLTab` live, followed by a version.
const ROOT: &str = "http://swrl.stanford.edu/ontologies/built-ins/";

/// All built-ins of the libraries.
static ALL: LazyLock<Vec<&'static dyn Definition>> =
    LazyLock::new(|| math::ALL.iter().copied().chain(temporal::all()).collect());

/// The built-in of an IRI, whichever version of its library the IRI names.
pub(super) fn find(iri: &str) -> Option<BuiltIn> {
    let wanted = name(iri)?;
    let found = ALL.iter().find(|definition| name(definition.iri()) == Some(wanted));
    found.map(|definition| BuiltIn::custom(*definition))
}

/// The IRIs of all built-ins of the library that an IRI is in, whichever version it names.
pub(super) fn names_beside(iri: &str) -> Vec<&'static str> {
    let library = |iri| name(iri).and_then(|name| name.split_once('#')).map(|(library, _)| library);
    let all = ALL.iter().map(|definition| definition.iri());
    all.filter(|known| library(iri).is_some() && library(known) == library(iri)).collect()
}

/// Library and local name, without the version.
fn name(iri: &str) -> Option<&str> {
    iri.strip_prefix(ROOT)?.split_once('/').map(|(_, name)| name)
}
