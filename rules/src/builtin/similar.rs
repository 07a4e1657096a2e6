//! The built-in that somebody may have meant by a name that none has.

use super::library;
use super::signature::{BuiltIn, SWRLB};

impl BuiltIn {
    /// The name of the built-in whose IRI is most like `iri`, if one of the same library is like it at all: at most a third of the
    /// letters differ, and three. Of SWRL's own the local name, of others the IRI.
    pub fn similar(iri: &str) -> Option<&'static str> {
        let local = |iri: &str| iri.rsplit_once('#').map_or(iri, |(_, local)| local).to_ascii_lowercase();
        let written = local(iri);
        let length = written.chars().count();
        let known: Vec<&'static str> = if iri.starts_with(SWRLB) {
            Self::ALL
                .iter()
                .filter(|known| Self::from_name(known.name()).is_some())
                .map(|known| known.name())
                .collect()
        } else {
            library::names_beside(iri)
        };
        let near = known.into_iter().map(|name| (strsim::osa_distance(&written, &local(name)), name));
        let near = near.filter(|(distance, _)| length > 1 && *distance <= (length / 3).clamp(1, 3));
        near.min_by_key(|(distance, _)| *distance).map(|(_, name)| name)
    }
}
