//! The texts of documents after they have been parsed: they are only looked at again where a message needs a place, and may be
//! large. What lies in a file is read again then.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasher, RandomState};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::document;
use super::file::regular_file;

/// The text of a document.
#[derive(Clone, Debug)]
pub(super) enum Text {
    /// In a file.
    File(PathBuf),
    /// Nowhere else.
    Memory(Arc<Vec<u8>>),
}

impl Text {
    /// The text in UTF-8; nothing where its file is not there any more.
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

/// The files and texts that have been read.
#[derive(Default)]
pub(super) struct Seen {
    pub paths: HashSet<PathBuf>,
    hash: RandomState,
    texts: HashMap<u64, Vec<Text>>,
}

impl Seen {
    /// Remembers a text; `None` if the same has been seen.
    pub(super) fn text(&mut self, text: Vec<u8>, file: Option<&Path>) -> Option<Text> {
        let known = self.texts.entry(self.hash.hash_one(&text)).or_default();
        if known.iter().any(|other| *other.get() == *text) {
            return None;
        }
        let text = match file {
            Some(path) => Text::File(path.to_owned()),
            None => Text::Memory(Arc::new(text)),
        };
        known.push(text.clone());
        Some(text)
    }
}
