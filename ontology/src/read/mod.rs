//! Reads documents to an [`Ontology`]: parses them, follows imports on this machine, merges, normalises, and
//! builds the OWL structures.
//!
//! ```text
//! file ── document ──┐
//!   └ imports ───────┼── normalize ── one N-Triples document ── horned ── Ontology
//! file ── document ──┘
//! ```

mod document;
mod encoding;
mod entities;
mod file;
mod foreign;
mod imports;
mod message;
mod options;
mod spelling;
mod structural;
pub(crate) mod syntax;
mod text;
pub use options::ReadOptions;
pub use syntax::Syntax;

use std::borrow::Cow;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use oxrdf::Triple;
use tracing::field::Empty;
use tracing::info_span;

use crate::error::{Error, Errors, Warning};
use crate::horned;
use crate::names::{Compact, Names};
use crate::normalize::{self, Merged, Normal};
use crate::owl::{Iri, Ontology, Source};
use crate::triples::Document;
use file::{regular_file, standard_input};
use imports::{Resolution, Resolver};
use text::{Text, Visited};

/// Reads documents and their imports into one ontology. The file `-` is standard input.
///
/// A document that is reached several times, possibly under different names, is read once.
///
/// # Errors
/// Returns the errors of all documents, such as unreadable files, syntax errors and unresolved imports. (After at
/// most ten syntax errors, the rest of a document is not read.) Without them, returns the first error of the merged
/// documents (O105, O112). If catalogs in the options cannot be used (O104), returns only these errors.
pub fn read_files<P: AsRef<Path>>(files: &[P], options: &ReadOptions) -> Result<Ontology, Errors> {
    let roots = files.iter().map(|file| Pending::File(file.as_ref().to_owned()));
    read(roots.collect(), options)
}

/// Reads an ontology from a text in any supported syntax. Messages use `name` as the file name.
///
/// ```
/// use ontology::{ReadOptions, read_text};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let text = "@prefix : <http://e.org/#> . @prefix owl: <http://www.w3.org/2002/07/owl#> . :Robot a owl:Class . :r2 a :Robot .";
/// let read = read_text(text, "robots.ttl", &ReadOptions::default())?;
/// assert_eq!(read.axioms.len(), 1);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// See [`read_files`].
pub fn read_text(text: &str, name: &str, options: &ReadOptions) -> Result<Ontology, Errors> {
    let root = Pending::Text(name.to_owned(), text.as_bytes().to_vec());
    read(VecDeque::from([root]), options)
}

/// Reads documents and their imports, and returns the merged triples. Only the first document keeps its header,
/// and the result has no imports. Annotations of the other headers are kept.
pub(crate) fn merged<P: AsRef<Path>>(
    files: &[P],
    options: &ReadOptions,
) -> Result<(Vec<Triple>, Vec<Warning>), Errors> {
    let roots = files.iter().map(|file| Pending::File(file.as_ref().to_owned()));
    let mut names = Names::default();
    let (documents, warnings) = closure(roots.collect(), options, &mut Vec::new(), &mut names)?;
    let keep_all = |_: &Compact| false;
    let Merged { mut graph, dropped_headers, .. } = normalize::merge(documents, &names, keep_all);
    normalize::declare_header_annotations(&mut graph, &dropped_headers);
    Ok((graph.into_triples(), warnings))
}

enum Pending {
    File(PathBuf),
    Text(String, Vec<u8>),
}

fn read(roots: VecDeque<Pending>, options: &ReadOptions) -> Result<Ontology, Errors> {
    let (mut texts, mut names) = (Vec::new(), Names::default());
    let span = info_span!("parse", documents = Empty);
    let (documents, mut warnings) = span.in_scope(|| closure(roots, options, &mut texts, &mut names))?;
    span.record("documents", documents.len());
    let sources: Vec<Source> = documents.iter().map(source).collect();
    let about = sources.first().and_then(|source| source.iri.clone()).unwrap_or_default();
    let Normal { ntriples, plain, names, rules, warnings: normalization_warnings } = info_span!("normalize")
        .in_scope(|| normalize::normalize(documents, names, &options.known))
        .map_err(|error| vec![spelling::placed(error, &texts)])?;
    warnings.extend(normalization_warnings);
    let parts = info_span!("axioms").in_scope(|| horned::build(&ntriples, &about, &rules, plain, names));
    let parts = parts.map_err(|reason| {
        let place = spelling::place(&reason, &texts);
        let file = sources.first().map(|source| source.name.clone()).unwrap_or_default();
        vec![Error::NotAnOntology { file, position: place, reason }]
    })?;
    warnings.extend(parts.warnings);
    spelling::locate(&mut warnings, &texts);
    // Warnings of several stages may be equal.
    warnings.sort();
    warnings.dedup();
    Ok(Ontology {
        sources,
        entities: parts.entities,
        axioms: parts.axioms,
        annotations: parts.annotations,
        annotation_annotations: parts.annotation_annotations,
        rules: parts.rules,
        warnings,
    })
}

fn source(document: &Document) -> Source {
    Source {
        name: document.name.clone(),
        iri: document.iri.clone(),
        version: document.version.clone(),
        syntax: document.syntax,
    }
}

fn closure(
    mut pending: VecDeque<Pending>,
    options: &ReadOptions,
    texts: &mut Vec<(String, Text)>,
    names: &mut Names,
) -> Result<(Vec<Document>, Vec<Warning>), Errors> {
    let resolver = Resolver::new(options)?;
    let (mut documents, mut paths) = (Vec::<Document>::new(), Vec::<Option<PathBuf>>::new());
    let (mut visited, mut errors, mut warnings) = (Visited::default(), Vec::new(), Vec::new());
    let mut next = 0;
    loop {
        // All pending documents are read before the next imports are resolved, because an import may mean
        // one of them.
        while let Some(item) = pending.pop_front() {
            match load(item, &documents, &mut visited, options, names) {
                Ok(Some((document, path, text))) => {
                    texts.push((document.name.clone(), text));
                    warnings.extend(duplicate_ontology(&document, &documents));
                    documents.push(document);
                    paths.push(path);
                }
                Ok(None) => {}
                Err(document_errors) => errors.extend(document_errors),
            }
        }
        let Some(importer) = documents.get(next) else { break };
        for (import, position) in &importer.imports {
            if options.without_imports {
                let (file, import) = (importer.name.clone(), import.clone());
                warnings.push(Warning::ImportOfUpdate { file, position: position.clone(), import });
                continue;
            }
            let resolution = if options.closed {
                Ok(None)
            } else {
                resolver.resolve(import, paths[next].as_deref(), next, &documents)
            };
            match resolution {
                Ok(Some(Resolution::Loaded)) => {}
                Ok(Some(Resolution::File(path))) => pending.push_back(Pending::File(path)),
                Ok(Some(Resolution::Embedded(name, text))) => {
                    pending.push_back(Pending::Text(name.to_owned(), text.as_bytes().to_vec()));
                }
                Ok(None) if options.allow_missing_imports => {
                    let (file, position) = (importer.name.clone(), position.clone());
                    warnings.push(Warning::MissingImport { file, position, import: import.clone() });
                }
                Ok(None) => {
                    let (file, position) = (importer.name.clone(), position.clone());
                    let target = resolver.missing_target(import, paths[next].as_deref());
                    errors.push(Error::UnresolvedImport { file, position, import: import.clone(), target });
                }
                Err(error) => errors.push(error),
            }
        }
        next += 1;
    }
    if errors.is_empty() { Ok((documents, warnings)) } else { Err(errors.into()) }
}

type Loaded = Option<(Document, Option<PathBuf>, Text)>;

/// Reads and parses one document. Returns `None` if the same file was read before, or an equal text with the same
/// meaning. Equal texts in two directories differ in meaning if they have relative IRIs.
fn load(
    item: Pending,
    documents: &[Document],
    visited: &mut Visited,
    options: &ReadOptions,
    names: &mut Names,
) -> Result<Loaded, Errors> {
    let (name, text, path) = match item {
        Pending::Text(name, text) => (name, text, None),
        Pending::File(file) if file.as_os_str() == "-" => ("-".to_owned(), standard_input()?, None),
        Pending::File(file) => {
            let unreadable = |error: std::io::Error| {
                vec![Error::Unreadable { file: file.clone(), reason: error.to_string() }]
            };
            // Symbolic links and relative paths must not cause a second reading.
            let path = file.canonicalize().map_err(unreadable)?;
            if !visited.paths.insert(path.clone()) {
                return Ok(None);
            }
            let text = regular_file(&path).map_err(unreadable)?;
            (file.display().to_string(), text, Some(path))
        }
    };
    let base = path.as_deref().map_or_else(|| "file:///".to_owned(), imports::iri_of_file);
    // Reject other syntaxes before decoding: this mode is for untrusted documents.
    if options.closed {
        document::require_ntriples(&text, &name)?;
    }
    let text = match document::decoded(&text, &name)? {
        Cow::Borrowed(decoded) if decoded.len() == text.len() => text,
        decoded => decoded.into_owned(),
    };
    if !options.allow_empty || !text.trim_ascii().is_empty() {
        document::require_syntax(&text, &name)?;
    }
    let prefix = format!("d{}", options.documents_before + documents.len());
    let document = document::parse(&text, &name, &base, &prefix, names)?;
    let is_repeated = |index: usize| document.has_equal_triples(&documents[index], names);
    let text = visited.text(text, path.as_deref(), documents.len(), is_repeated);
    Ok(text.map(|text| (document, path, text)))
}

fn duplicate_ontology(document: &Document, documents: &[Document]) -> Option<Warning> {
    let iri: &Iri = document.iri.as_ref()?;
    let first = documents
        .iter()
        .find(|other| other.iri.as_ref() == Some(iri) && other.version == document.version)?;
    let (first, second) = (first.name.clone(), document.name.clone());
    Some(Warning::SameOntologyTwice { iri: iri.to_string(), first, second })
}
