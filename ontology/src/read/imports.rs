//! Where an imported IRI lies on this machine. Never the network.
//!
//! Real knowledge bases import by URL (`https://raw.githubusercontent.com/…/ros2/owl/tomasys.owl`) what declares
//! another ontology IRI (`http://metacontrol.org/tomasys`). So an import is looked for, in this order:
//!
//! 1. as a file, if it is a `file:` IRI or was written relative to its document;
//! 2. among the documents already read, by ontology or version IRI;
//! 3. in the catalogs given, then in `catalog-v001.xml` beside the importing document (OASIS XML Catalogs);
//! 4. beside the importing document, then in the directories given and below: by ontology IRI, then by the last
//!    segment of the URL; among several files of that name, the one whose path has most segments of the URL;
//! 5. in a directory that is named as a part of the URL, beside those that the importing document lies in, as
//!    repositories are that were checked out side by side;
//! 6. among the documents already read, by file name;
//! 7. among the knowledge bases that this crate embeds ([`crate::kb`]), by IRI or by where they have been published.

use std::cell::OnceCell;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::document;
use super::options::ReadOptions;
use crate::error::{Error, Errors};
use crate::kb;
use crate::triples::Document;

/// The catalog that Protégé writes beside an ontology.
const CATALOG: &str = "catalog-v001.xml";

/// How deep directories are searched.
const DEPTH: usize = 4;

/// In so many directories above that of a document, others are looked for by the segments of a URL.
const LEVELS: usize = 3;

/// Only the start of a file is searched for its ontology IRI, in bytes.
const HEAD: usize = 1 << 16;

/// What an import resolves to.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Resolution {
    /// A document that has been read.
    Loaded,
    /// A file.
    File(PathBuf),
    /// A text embedded in this crate, with a name for messages.
    Embedded(&'static str, &'static str),
}

pub(crate) struct Resolver {
    catalogs: Vec<horned_catalog::Catalog>,
    /// Ontology files under the directories given, found when first needed.
    below: OnceCell<Vec<Candidate>>,
    directories: Vec<PathBuf>,
}

struct Candidate {
    path: PathBuf,
    iri: Option<String>,
}

impl Resolver {
    /// Reads the catalogs named in `options`.
    pub(crate) fn new(options: &ReadOptions) -> Result<Self, Errors> {
        let (mut catalogs, mut errors) = (Vec::new(), Vec::new());
        for file in &options.catalogs {
            match horned_catalog::Catalog::from_path(file) {
                Ok(catalog) => catalogs.push(catalog),
                Err(error) => errors.push(Error::Catalog { file: file.clone(), reason: error.to_string() }),
            }
        }
        if !errors.is_empty() {
            return Err(errors.into());
        }
        Ok(Self { catalogs, below: OnceCell::new(), directories: options.directories.clone() })
    }

    /// Where `import` lies, which the document at `importer` (`None` for a text) imports.
    pub(crate) fn resolve(
        &self,
        import: &str,
        importer: Option<&Path>,
        documents: &[Document],
    ) -> Result<Option<Resolution>, Error> {
        if let Some(path) = import.strip_prefix("file://").map(PathBuf::from).filter(|path| path.is_file()) {
            return Ok(Some(Resolution::File(path)));
        }
        if is_loaded(import, documents) {
            return Ok(Some(Resolution::Loaded));
        }
        if let Some(path) = self.in_catalogs(import, importer)? {
            return Ok(Some(Resolution::File(path)));
        }
        let beside = importer.and_then(Path::parent).map(|directory| candidates(directory, 0));
        let found = beside.and_then(|files| best(import, &files)).or_else(|| best(import, self.below()));
        let found = found.or_else(|| checked_out(import, importer?));
        let named = || is_named_alike(import, documents).then_some(Resolution::Loaded);
        Ok(found.map(Resolution::File).or_else(named).or_else(|| embedded(import)))
    }

    fn in_catalogs(&self, import: &str, importer: Option<&Path>) -> Result<Option<PathBuf>, Error> {
        let given = self.catalogs.iter().find_map(|catalog| catalog.resolve(import));
        if let Some(path) = given.filter(|path| path.is_file()) {
            return Ok(Some(path));
        }
        let Some(file) = importer.and_then(Path::parent).map(|directory| directory.join(CATALOG)) else {
            return Ok(None);
        };
        if !file.is_file() {
            return Ok(None);
        }
        let catalog = horned_catalog::Catalog::from_path(&file)
            .map_err(|error| Error::Catalog { file: file.clone(), reason: error.to_string() })?;
        Ok(catalog.resolve(import).filter(|path| path.is_file()))
    }

    fn below(&self) -> &[Candidate] {
        self.below.get_or_init(|| self.directories.iter().flat_map(|root| candidates(root, DEPTH)).collect())
    }
}

fn embedded(import: &str) -> Option<Resolution> {
    let published = is_published_tomasys(import).then_some(kb::EMBEDDED[0].0);
    let (iri, text) = kb::EMBEDDED.iter().find(|(iri, _)| same_iri(iri, published.unwrap_or(import)))?;
    Some(Resolution::Embedded(iri, text))
}

/// Whether an IRI is a place where the TOMASys metamodel has been published: its repository, on whatever branch.
fn is_published_tomasys(import: &str) -> bool {
    let hosts = ["https://raw.githubusercontent.com/", "https://github.com/"];
    let path = hosts.iter().find_map(|host| import.strip_prefix(host));
    path.is_some_and(|path| {
        path.starts_with("meta-control/mc_mdl_tomasys/") && path.ends_with("/tomasys.owl")
    })
}

/// The file that an import means in a checked-out repository beside that of its importer.
fn checked_out(import: &str, importer: &Path) -> Option<PathBuf> {
    let plain = |segment: &&str| {
        !segment.starts_with('.') && segment.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c))
    };
    let (_, path) = import.split_once("://")?;
    let segments: Vec<&str> = path.split('/').skip(1).filter(plain).collect();
    let (_, directories) = segments.split_last()?;
    for above in importer.ancestors().skip(2).take(LEVELS) {
        // An owner and a repository.
        for segment in directories.iter().take(2) {
            let beside = above.join(segment);
            if beside.is_dir()
                && let Some(path) = best(import, &candidates(&beside, DEPTH))
            {
                return Some(path);
            }
        }
    }
    None
}

/// IRIs of ontologies are written with and without a final `#` or `/`.
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

/// Ontology files in a directory, down to `depth` levels below it, sorted by path. Unreadable directories and symbolic
/// links to directories are passed over (so that a loop of links ends).
fn candidates(directory: &Path, depth: usize) -> Vec<Candidate> {
    let Ok(entries) = std::fs::read_dir(directory) else { return Vec::new() };
    let mut entries: Vec<_> = entries.filter_map(Result::ok).collect();
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
            files.push(Candidate { path, iri });
        }
    }
    files
}

/// The ontology IRI that a file declares, or `None` where its start declares none.
fn declared_iri(path: &Path) -> Option<String> {
    use std::io::Read;
    if !path.is_file() {
        return None;
    }
    let mut head = Vec::with_capacity(HEAD);
    std::fs::File::open(path).ok()?.take(HEAD as u64).read_to_end(&mut head).ok()?;
    document::ontology_iri(&head)
}

/// The file that stands for `import`, by ontology IRI or else by name.
fn best(import: &str, files: &[Candidate]) -> Option<PathBuf> {
    let by_iri: Vec<_> =
        files.iter().filter(|file| file.iri.as_deref().is_some_and(|iri| same_iri(iri, import))).collect();
    let name = last_segment(import);
    let by_name =
        || files.iter().filter(|file| file.path.file_name().is_some_and(|file_name| file_name == name));
    let among: Vec<_> = if by_iri.is_empty() { by_name().collect() } else { by_iri };
    let segments: Vec<&str> = import.split('/').filter(|segment| !segment.is_empty()).collect();
    let shared = |file: &Candidate| {
        let parts = file.path.iter().filter_map(|part| part.to_str());
        parts.filter(|part| segments.contains(part)).count()
    };
    let mut best: Option<(usize, &Candidate)> = None;
    for file in among {
        let count = shared(file);
        if best.is_none_or(|(most, _)| count > most) {
            best = Some((count, file));
        }
    }
    best.map(|(_, file)| file.path.clone())
}
