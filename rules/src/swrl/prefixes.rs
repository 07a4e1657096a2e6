//! Abbreviations of IRIs in rule text.

use std::collections::BTreeMap;

use crate::builtin::SWRLB;
use crate::literal::XSD;

/// Abbreviations of IRIs. `swrlb`, `swrlm`, `temporal`, `xsd`, `rdf`, `rdfs` and `owl` are always there unless declared otherwise.
///
/// A name without colon takes the empty prefix where that is declared, and else stands for itself.
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
    /// The standard prefixes.
    pub fn new() -> Self {
        Self::default()
    }

    /// Declares a prefix (without colon).
    pub fn insert(&mut self, prefix: &str, iri: &str) {
        self.0.insert(prefix.to_string(), iri.to_string());
    }

    /// Declares a prefix (without colon), for chaining.
    #[must_use]
    pub fn with(mut self, prefix: &str, iri: &str) -> Self {
        self.insert(prefix, iri);
        self
    }

    /// The IRI of a prefix.
    pub fn get(&self, prefix: &str) -> Option<&str> {
        self.0.get(prefix).map(String::as_str)
    }

    /// All prefixes with their IRIs, sorted.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.0.iter().map(|(prefix, iri)| (prefix.as_str(), iri.as_str()))
    }
}
