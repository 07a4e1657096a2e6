//! The libraries `swrlm` and `temporal` of `SWRLTab` as [custom built-ins](super::Definition) ([1], [2]). Their
//! ontologies were published in several versions. The IRIs of all versions are accepted.
//!
//! Only the *basic mode* of `temporal`, on dates and times, is supported. The advanced mode applies to individuals of
//! the temporal ontology. Since a built-in receives literals only, atoms in the advanced mode are false.
//!
//! [1] `SWRLTab` wiki: Mathematical Built-In Library.
//! [2] `SWRLTab` wiki: Temporal Built-In Library, Basic Mode.

mod expression;
mod math;
mod temporal;

use std::sync::LazyLock;

use super::custom::Definition;
use super::signature::BuiltIn;

const LIBRARY_ROOT: &str = "http://swrl.stanford.edu/ontologies/built-ins/";

static ALL: LazyLock<Vec<&'static dyn Definition>> =
    LazyLock::new(|| math::ALL.iter().copied().chain(temporal::all()).collect());

pub(super) fn find(iri: &str) -> Option<BuiltIn> {
    let target = name(iri)?;
    let definition = ALL.iter().find(|definition| name(definition.iri()) == Some(target));
    definition.map(|definition| BuiltIn::custom(*definition))
}

pub(super) fn names_in_library(iri: &str) -> Vec<&'static str> {
    let library = |iri| name(iri).and_then(|name| name.split_once('#')).map(|(library, _)| library);
    let iris = ALL.iter().map(|definition| definition.iri());
    iris.filter(|known| library(iri).is_some() && library(known) == library(iri)).collect()
}

/// Returns the part of an IRI after the version, such as `temporal.owl#add`; `None` for IRIs outside of the
/// libraries.
fn name(iri: &str) -> Option<&str> {
    iri.strip_prefix(LIBRARY_ROOT)?.split_once('/').map(|(_, name)| name)
}
