//! Resolves imports to files on this machine. The network is never used.
//!
//! Real knowledge bases import a URL (`https://raw.githubusercontent.com/…/ros2/owl/tomasys.owl`) whose document
//! declares another ontology IRI (`http://metacontrol.org/tomasys`). Therefore an import is searched in this order:
//!
//! 1. as a file, if it is a `file:` IRI or was written relative to its document;
//! 2. among the documents already read, by ontology or version IRI;
//! 3. in the given catalogs, then in `catalog-v001.xml` in the directory of the importing document (OASIS XML
//!    Catalogs);
//! 4. in the directory of the importing document, then in the given directories and their subdirectories: by ontology
//!    IRI, then by the last segment of the URL; among several matching files, the one whose path has most segments of
//!    the URL. The importing document itself and its copies are no matches by name;
//! 5. in a directory that is named like one of the first two segments of the URL's path and lies next to the
//!    directory of the importing document or next to a near ancestor of it, because repositories are often checked
//!    out side by side;
//! 6. among the documents already read, by file name;
//! 7. among the embedded knowledge bases ([`crate::kb`]), by IRI or by the URL of their publication.

use std::cell::OnceCell;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use percent_encoding::{AsciiSet, CONTROLS, percent_decode_str, utf8_percent_encode};

use super::document;
use super::file::regular_file;
use super::options::ReadOptions;
use super::syntax;
use crate::error::{Error, Errors};
use crate::kb;
use crate::triples::Document;

const CATALOG: &str = "catalog-v001.xml";

/// Maximum depth of the subdirectories that are searched for imports.
const MAX_DEPTH: usize = 4;

/// Number of ancestor directories in which directories named like the first segments of the URL's path are
/// searched.
const MAX_ANCESTORS: usize = 3;

/// Number of bytes at the start of a file that are searched for its ontology IRI.
const HEAD_BYTES: usize = 1 << 16;

#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Resolution {
    Loaded,
    File(PathBuf),
    /// An embedded document: its name for messages, and its text.
    Embedded(&'static str, &'static str),
}

pub(crate) struct Resolver {
    catalogs: Vec<horned_catalog::Catalog>,
    files: OnceCell<Vec<OntologyFile>>,
    directories: Vec<PathBuf>,
}

struct OntologyFile {
    path: PathBuf,
    iri: Option<String>,
}

impl Resolver {
    pub(crate) fn new(options: &ReadOptions) -> Result<Self, Errors> {
        let (mut catalogs, mut errors) = (Vec::new(), Vec::new());
        for file in &options.catalogs {
            match catalog(file) {
                Ok(catalog) => catalogs.push(catalog),
                Err(error) => errors.push(error),
            }
        }
        if !errors.is_empty() {
            return Err(errors.into());
        }
        Ok(Self { catalogs, files: OnceCell::new(), directories: options.directories.clone() })
    }

    /// Finds the document of an import of `documents[index]`, if there is one. `importer` is the canonical path of that
    /// document, if it has one. Returns an error if the catalog next to that document cannot be used.
    pub(crate) fn resolve(
        &self,
        import: &str,
        importer: Option<&Path>,
        index: usize,
        documents: &[Document],
    ) -> Result<Option<Resolution>, Error> {
        if let Some(path) = file_of_iri(import).filter(|path| path.is_file()) {
            return Ok(Some(Resolution::File(path)));
        }
        if is_loaded(import, documents) {
            return Ok(Some(Resolution::Loaded));
        }
        if let Some(path) = self.in_catalogs(import, importer)? {
            return Ok(Some(Resolution::File(path)));
        }
        let siblings = importer.and_then(Path::parent).map(|directory| candidates(directory, 0));
        let file = siblings
            .and_then(|files| best_match(import, importer, &files))
            .or_else(|| best_match(import, importer, self.files()));
        let file = file.or_else(|| checked_out(import, importer?));
        let (before, after) = (&documents[..index], &documents[index + 1..]);
        let is_named_alike = || is_named_alike(import, before) || is_named_alike(import, after);
        let named = || is_named_alike().then_some(Resolution::Loaded);
        Ok(file.map(Resolution::File).or_else(named).or_else(|| embedded(import)))
    }

    fn in_catalogs(&self, import: &str, importer: Option<&Path>) -> Result<Option<PathBuf>, Error> {
        // A faulty catalog next to the document does not matter if a given catalog has the file.
        if let Some(path) = self.given_target(import).filter(|path| path.is_file()) {
            return Ok(Some(path));
        }
        let targets = self.targets(import, importer)?;
        Ok(targets.into_iter().flatten().find(|path| path.is_file()))
    }

    fn given_target(&self, import: &str) -> Option<PathBuf> {
        self.catalogs.iter().find_map(|catalog| catalog.resolve(import))
    }

    fn targets(&self, import: &str, importer: Option<&Path>) -> Result<[Option<PathBuf>; 2], Error> {
        let given = self.given_target(import);
        let file = importer.and_then(Path::parent).map(|directory| directory.join(CATALOG));
        let sibling = match file.filter(|file| file.is_file()) {
            Some(file) => catalog(&file)?.resolve(import),
            None => None,
        };
        Ok([given, sibling])
    }

    /// Returns the path that a catalog assigns to an import without a document.
    pub(crate) fn missing_target(&self, import: &str, importer: Option<&Path>) -> Option<PathBuf> {
        self.targets(import, importer).ok()?.into_iter().flatten().next()
    }

    fn files(&self) -> &[OntologyFile] {
        self.files
            .get_or_init(|| self.directories.iter().flat_map(|root| candidates(root, MAX_DEPTH)).collect())
    }
}

/// Reads a catalog. Applies `xml:base` of the root element here, because the library supports this attribute only
/// for groups.
fn catalog(file: &Path) -> Result<horned_catalog::Catalog, Error> {
    let unusable = |reason: String| Error::Catalog { file: file.to_owned(), reason };
    let text = std::fs::read_to_string(file).map_err(|error| unusable(error.to_string()))?;
    let directory = file.parent().unwrap_or_else(|| Path::new("."));
    let catalog = match syntax::root_attribute(text.as_bytes(), b"xml:base") {
        Some(base) => {
            let base = base.strip_prefix("file://").or_else(|| base.strip_prefix("file:")).unwrap_or(base);
            horned_catalog::Catalog::from_str(&text, directory.join(base))
        }
        None => horned_catalog::Catalog::from_path(file),
    };
    catalog.map_err(|error| unusable(error.to_string()))
}

/// Characters that a path can contain, but the path of an IRI contains only in escaped form.
const ENCODED: &AsciiSet = &CONTROLS
    .add(b' ')
    .add(b'"')
    .add(b'#')
    .add(b'%')
    .add(b'<')
    .add(b'>')
    .add(b'?')
    .add(b'[')
    .add(b'\\')
    .add(b']')
    .add(b'^')
    .add(b'`')
    .add(b'{')
    .add(b'|')
    .add(b'}');

pub(crate) fn iri_of_file(path: &Path) -> String {
    let path = path.to_string_lossy();
    // On Windows, canonical paths have the form `\\?\C:\kb\robot.ttl`; the IRI is `file:///C:/kb/robot.ttl`.
    let path =
        if cfg!(windows) { path.trim_start_matches(r"\\?\").replace('\\', "/") } else { path.into_owned() };
    let root = if path.starts_with('/') { "" } else { "/" };
    format!("file://{root}{}", utf8_percent_encode(&path, ENCODED))
}

fn file_of_iri(iri: &str) -> Option<PathBuf> {
    let path = percent_decode_str(iri.strip_prefix("file://")?).decode_utf8().ok()?;
    let drive = if cfg!(windows) { path.strip_prefix('/') } else { None };
    Some(PathBuf::from(drive.unwrap_or(&path)))
}

fn embedded(import: &str) -> Option<Resolution> {
    let published = is_published_tomasys(import).then_some(kb::EMBEDDED[0].0);
    let (iri, text) = kb::EMBEDDED.iter().find(|(iri, _)| same_iri(iri, published.unwrap_or(import)))?;
    Some(Resolution::Embedded(iri, text))
}

/// Returns `true` if the IRI is a URL of the published TOMASys metamodel: its repository on any branch.
fn is_published_tomasys(import: &str) -> bool {
    let hosts = ["https://raw.githubusercontent.com/", "https://github.com/"];
    let path = hosts.iter().find_map(|host| import.strip_prefix(host));
    path.is_some_and(|path| {
        path.starts_with("meta-control/mc_mdl_tomasys/") && path.ends_with("/tomasys.owl")
    })
}

fn checked_out(import: &str, importer: &Path) -> Option<PathBuf> {
    let plain = |segment: &&str| {
        !segment.starts_with('.') && segment.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c))
    };
    let (_, path) = import.split_once("://")?;
    let segments: Vec<&str> = path.split('/').skip(1).filter(plain).collect();
    let (_, directories) = segments.split_last()?;
    for ancestor in importer.ancestors().skip(2).take(MAX_ANCESTORS) {
        // The first segments of the URL are usually owner and repository.
        for segment in directories.iter().take(2) {
            let repository = ancestor.join(segment);
            if repository.is_dir()
                && let Some(path) = best_match(import, Some(importer), &candidates(&repository, MAX_DEPTH))
            {
                return Some(path);
            }
        }
    }
    None
}

fn same_iri(left: &str, right: &str) -> bool {
    left.trim_end_matches(['#', '/']) == right.trim_end_matches(['#', '/'])
}

fn is_loaded(import: &str, documents: &[Document]) -> bool {
    let declares = |iri: &Option<Arc<str>>| iri.as_deref().is_some_and(|iri| same_iri(iri, import));
    documents.iter().any(|document| declares(&document.iri) || declares(&document.version))
}

fn is_named_alike(import: &str, documents: &[Document]) -> bool {
    let name = last_segment(import);
    let mut paths = documents.iter().map(|document| Path::new(&document.name));
    paths.any(|path| is_ontology_file(path) && path.file_name().is_some_and(|file| file == name))
}

fn last_segment(import: &str) -> &str {
    import.trim_end_matches(['#', '/']).rsplit('/').next().unwrap_or(import)
}

fn is_ontology_file(path: &Path) -> bool {
    let extension = path.extension().and_then(|extension| extension.to_str());
    extension.is_some_and(|extension| {
        ["owl", "ttl", "rdf", "nt", "owx", "ofn", "xml"].contains(&extension) && !path.ends_with(CATALOG)
    })
}

/// Returns the ontology files in a directory and `depth` levels of subdirectories, sorted by path. Skips
/// unreadable directories, and symbolic links to directories, which could form a cycle.
fn candidates(directory: &Path, depth: usize) -> Vec<OntologyFile> {
    let Ok(entries) = std::fs::read_dir(directory) else { return Vec::new() };
    let mut entries: Vec<_> = entries.filter_map(Result::ok).collect();
    // The order of directory entries depends on the file system.
    entries.sort_by_key(std::fs::DirEntry::path);
    let mut files = Vec::new();
    for entry in entries {
        let path = entry.path();
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            if depth > 0 {
                files.extend(candidates(&path, depth - 1));
            }
        } else if is_ontology_file(&path) && path.is_file() {
            let iri = declared_iri(&path);
            files.push(OntologyFile { path, iri });
        }
    }
    files
}

fn declared_iri(path: &Path) -> Option<String> {
    use std::io::Read;
    if !path.is_file() {
        return None;
    }
    let mut head = Vec::with_capacity(HEAD_BYTES);
    std::fs::File::open(path).ok()?.take(HEAD_BYTES as u64).read_to_end(&mut head).ok()?;
    document::ontology_iri(&head)
}

/// Returns the file that fits an import best: by IRI, otherwise by name. By name, a file imports neither itself nor a
/// copy of itself.
fn best_match(import: &str, importer: Option<&Path>, files: &[OntologyFile]) -> Option<PathBuf> {
    let by_iri: Vec<_> =
        files.iter().filter(|file| file.iri.as_deref().is_some_and(|iri| same_iri(iri, import))).collect();
    let name = last_segment(import);
    let is_importer = |path: &Path| {
        importer.is_some_and(|importer| {
            path.canonicalize().is_ok_and(|path| path == importer)
                || matches!((regular_file(path), regular_file(importer)), (Ok(a), Ok(b)) if a == b)
        })
    };
    let fits =
        |path: &Path| path.file_name().is_some_and(|file_name| file_name == name) && !is_importer(path);
    let by_name = || files.iter().filter(|file| fits(&file.path));
    let matching: Vec<_> = if by_iri.is_empty() { by_name().collect() } else { by_iri };
    let segments: Vec<&str> = import.split('/').filter(|segment| !segment.is_empty()).collect();
    let shared = |file: &OntologyFile| {
        let parts = file.path.iter().filter_map(|part| part.to_str());
        parts.filter(|part| segments.contains(part)).count()
    };
    let mut best: Option<(usize, &OntologyFile)> = None;
    for file in matching {
        let count = shared(file);
        if best.is_none_or(|(max_count, _)| count > max_count) {
            best = Some((count, file));
        }
    }
    best.map(|(_, file)| file.path.clone())
}
