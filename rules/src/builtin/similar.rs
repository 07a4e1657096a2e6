//! Spelling suggestions for unknown built-ins.

use super::library;
use super::signature::{BuiltIn, SWRLB};

impl BuiltIn {
    /// Returns the name of the built-in that is most similar to `iri`, among the built-ins of the same
    /// library; `None` if no name is similar enough (see [`diagnostics::nearest`]), or if the IRI belongs to no
    /// library. The result is the local name of a SWRL built-in, or the IRI of another built-in.
    pub fn similar(iri: &str) -> Option<&'static str> {
        let candidates: Vec<&'static str> = if iri.starts_with(SWRLB) {
            Self::ALL
                .iter()
                .filter(|known| Self::from_name(known.name()).is_some())
                .map(|known| known.name())
                .collect()
        } else {
            library::names_in_library(iri)
        };
        let nearest = diagnostics::nearest(local(iri), candidates.iter().map(|name| local(name)))?;
        candidates.into_iter().find(|name| local(name) == nearest)
    }
}

fn local(iri: &str) -> &str {
    iri.rsplit_once('#').map_or(iri, |(_, local)| local)
}
