//! IRIs as shared text: each is kept once, however often a document names it.

use rustc_hash::FxHashSet;

use crate::owl::Iri;

/// The IRIs met so far.
#[derive(Debug, Default)]
pub(crate) struct Names(FxHashSet<Iri>);

impl Names {
    /// The shared text of an IRI.
    pub(crate) fn iri(&mut self, name: &str) -> Iri {
        if let Some(iri) = self.0.get(name) {
            return iri.clone();
        }
        let iri = Iri::from(name);
        self.0.insert(iri.clone());
        iri
    }
}
