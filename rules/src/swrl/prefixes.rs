//! Namespace prefixes of rule texts.

use std::collections::BTreeMap;

use crate::builtin::SWRLB;
use crate::literal::XSD;

/// Prefixes that abbreviate IRIs in rule texts. `swrlb`, `swrlm`, `temporal`, `xsd`, `rdf`, `rdfs` and
/// `owl` are predefined and may be redeclared.
///
/// A name without a colon has the empty prefix if the empty prefix is declared. Otherwise the name is
/// used unchanged.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Prefixes(BTreeMap<String, String>);

impl Default for Prefixes {
    fn default() -> Self {
        let standard = [
            ("owl", "http://www.w3.org/2002/07/owl#"),
            ("rdf", "http://www.w3.org/1999/02/22-rdf-syntax-ns#"),
            ("rdfs", "http://www.w3.org/2000/01/rdf-schema#"),
            ("swrlb", SWRLB),
            ("swrlm", "http://swrl.stanford.edu/ontologies/built-ins/3.4/swrlm.owl#"),
            ("temporal", "http://swrl.stanford.edu/ontologies/built-ins/3.3/temporal.owl#"),
            ("xsd", XSD),
        ];
        Self(standard.into_iter().map(|(prefix, iri)| (prefix.to_string(), iri.to_string())).collect())
    }
}

impl Prefixes {
    /// Creates the standard prefixes.
    pub fn new() -> Self {
        Self::default()
    }

    /// Declares a prefix (without colon).
    pub fn insert(&mut self, prefix: &str, iri: &str) {
        self.0.insert(prefix.to_string(), iri.to_string());
    }

    /// Declares a prefix (without colon) and returns the prefixes.
    #[must_use]
    pub fn with(mut self, prefix: &str, iri: &str) -> Self {
        self.insert(prefix, iri);
        self
    }

    /// Returns the IRI of a prefix, if the prefix is declared.
    pub fn get(&self, prefix: &str) -> Option<&str> {
        self.0.get(prefix).map(String::as_str)
    }

    /// Returns all prefixes with their IRIs, sorted.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.0.iter().map(|(prefix, iri)| (prefix.as_str(), iri.as_str()))
    }
}
