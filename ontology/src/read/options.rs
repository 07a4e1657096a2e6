//! Options of the reader.

use std::path::PathBuf;

use crate::owl::{EntityKind, Iri};

/// Options of the reader: sources of imports, and accepted documents.
#[derive(Clone, Debug, Default)]
#[allow(clippy::struct_excessive_bools)] // independent choices
pub struct ReadOptions {
    /// Paths of OASIS XML catalogs.
    pub catalogs: Vec<PathBuf>,
    /// Directories to search for imports, with four levels of subdirectories.
    pub directories: Vec<PathBuf>,
    /// If `true`, an unresolved import is a warning instead of an error.
    pub allow_missing_imports: bool,
    /// If `true`, documents may be empty (for documents with additions or retractions).
    pub allow_empty: bool,
    /// If `true`, documents must be N-Triples, and their imports are not resolved. For untrusted documents: they
    /// cannot cause other documents to be opened, and have no XML entities, which expand the text. Normalisation can still
    /// expand shared lists and n-ary axioms to quadratic size.
    pub closed: bool,
    /// If `true`, imports are not followed (for documents that change a knowledge base).
    pub without_imports: bool,
    /// Number of documents that were read before. Blank nodes of the new documents get names that differ
    /// from those of the earlier documents.
    pub documents_before: usize,
    /// Entities that the documents need not declare (those of the knowledge base that they refer to).
    pub known: Vec<(EntityKind, Iri)>,
}
