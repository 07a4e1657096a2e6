//! Texts of parsed documents. After parsing, they are needed only to find positions for messages and to
//! recognise equal documents. They may be large, so the text of a file is read again on demand.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasher, RandomState};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::document;
use super::file::regular_file;

#[derive(Clone, Debug)]
pub(super) enum Text {
    File(PathBuf),
    Memory(Arc<Vec<u8>>),
}

impl Text {
    /// Returns the text in UTF-8; empty if the file can no longer be read or decoded.
    pub(super) fn get(&self) -> Cow<'_, [u8]> {
        match self {
            Self::Memory(text) => Cow::Borrowed(text),
            Self::File(path) => {
                let bytes = regular_file(path).unwrap_or_default();
                Cow::Owned(document::decoded(&bytes, "").map(Cow::into_owned).unwrap_or_default())
            }
        }
    }
}

#[derive(Default)]
pub(super) struct Visited {
    /// Canonical paths of the files.
    pub paths: HashSet<PathBuf>,
    hash: RandomState,
    /// Texts with the indices of their documents, by hash.
    texts: HashMap<u64, Vec<(Text, usize)>>,
}

impl Visited {
    /// Adds the text of the document `index`. Returns `None` if an equal text was added before for a document that
    /// fulfils `is_repeated`.
    pub(super) fn text(
        &mut self,
        text: Vec<u8>,
        file: Option<&Path>,
        index: usize,
        is_repeated: impl Fn(usize) -> bool,
    ) -> Option<Text> {
        let same_hash = self.texts.entry(self.hash.hash_one(&text)).or_default();
        // Equal hashes do not imply equal texts.
        if same_hash.iter().any(|(other, index)| *other.get() == *text && is_repeated(*index)) {
            return None;
        }
        let text = match file {
            Some(path) => Text::File(path.to_owned()),
            None => Text::Memory(Arc::new(text)),
        };
        same_hash.push((text.clone(), index));
        Some(text)
    }
}
