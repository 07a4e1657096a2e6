//! How documents are read.

use std::path::PathBuf;

use crate::owl::{EntityKind, Iri};

/// Where to look for what a document imports.
#[derive(Clone, Debug, Default)]
#[allow(clippy::struct_excessive_bools)] // independent choices
pub struct ReadOptions {
    /// OASIS XML catalogs.
    pub catalogs: Vec<PathBuf>,
    /// Directories to search, with those below them.
    pub directories: Vec<PathBuf>,
    /// Whether an import that is found nowhere is a warning instead of an error.
    pub allow_missing_imports: bool,
    /// Whether a document may be empty, as one with what is added or removed.
    pub allow_empty: bool,
    /// Whether documents are N-Triples that import nothing, as for those that nobody vouches for: no file is opened but those
    /// that are named, and no text is larger when it has been read.
    pub closed: bool,
    /// Whether imports are not followed, as those of a document that changes a knowledge base.
    pub without_imports: bool,
    /// The number of documents that have been read before, whose individuals without a name are not those of these documents.
    pub documents_before: usize,
    /// Entities that documents need not declare, as those of the knowledge base that they ask about.
    pub known: Vec<(EntityKind, Iri)>,
}
