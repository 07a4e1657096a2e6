//! Spelling suggestions for unknown built-ins.

use super::library;
use super::signature::{BuiltIn, SWRLB};

impl BuiltIn {
    /// Returns the name of the built-in of the same library with the most similar name, if at most a third
    /// of the letters and at most three letters differ (one letter may always differ). The result is the
    /// local name of a SWRL built-in, or the IRI of another built-in.
    pub fn similar(iri: &str) -> Option<&'static str> {
        let local = |iri: &str| iri.rsplit_once('#').map_or(iri, |(_, local)| local).to_ascii_lowercase();
        let written = local(iri);
        let length = written.chars().count();
        let candidates: Vec<&'static str> = if iri.starts_with(SWRLB) {
            Self::ALL
                .iter()
                .filter(|known| Self::from_name(known.name()).is_some())
                .map(|known| known.name())
                .collect()
        } else {
            library::names_in_library(iri)
        };
        // Optimal string alignment distance: transposed neighbours count as one difference.
        let scored = candidates.into_iter().map(|name| (strsim::osa_distance(&written, &local(name)), name));
        let scored = scored.filter(|(distance, _)| length > 1 && *distance <= (length / 3).clamp(1, 3));
        scored.min_by_key(|(distance, _)| *distance).map(|(_, name)| name)
    }
}
