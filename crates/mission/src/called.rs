//! Entries of `[bindings.names]` and `--name`, which give object names to individuals of the knowledge base.
//!
//! An entry is exact (`fd_spiral_low = "fd_search_low"`), or a pattern with one star on each side
//! (`"fd_spiral_*" = "fd_search_*"`). Module `names` resolves the entries for a knowledge base and
//! a problem.

use std::collections::BTreeMap;
use std::fmt;

use crate::message::Message;

/// Source location of an entry: a file, and optionally a line and column in it.
pub type Place = (String, Option<(usize, usize)>);

/// Entries of `[bindings.names]` and `--name`: assignments of object names to individuals.
#[derive(Clone, Default)]
pub struct Names {
    entries: Vec<Naming>,
}

#[derive(Debug, Clone)]
pub(crate) struct Naming {
    /// The local name or IRI of an individual, or a pattern with one `*`.
    pub(crate) individual: String,
    /// The name of an object, or a pattern with one `*`.
    pub(crate) object: String,
    place: Option<Place>,
}

impl Names {
    /// Adds an entry. `place` is `None` for entries of the command line.
    pub fn add(&mut self, individual: &str, object: &str, place: Option<Place>) {
        self.entries.push(Naming { individual: individual.to_owned(), object: object.to_owned(), place });
    }

    /// Returns `true` if there are no entries.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Returns all entries without their places: object name by individual. Of several entries for one
    /// individual, the last one is returned.
    pub fn written(&self) -> BTreeMap<String, String> {
        self.entries.iter().map(|entry| (entry.individual.clone(), entry.object.clone())).collect()
    }

    pub(crate) fn entries(&self) -> &[Naming] {
        &self.entries
    }
}

impl From<&BTreeMap<String, String>> for Names {
    fn from(written: &BTreeMap<String, String>) -> Self {
        let mut names = Self::default();
        for (individual, object) in written {
            names.add(individual, object, None);
        }
        names
    }
}

/// Omits the places, so that the text does not depend on where the names are written.
impl fmt::Debug for Names {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.written().fmt(f)
    }
}

impl Naming {
    pub(crate) fn is_pattern(&self) -> bool {
        self.individual.contains('*')
    }

    /// Returns the object name that this entry gives to the individual with the local name or IRI `name`. `None` if
    /// the entry does not apply.
    pub(crate) fn call(&self, name: &str) -> Option<String> {
        let Some((head, tail)) = self.individual.split_once('*') else {
            return (self.individual == name).then(|| self.object.clone());
        };
        let middle = name.strip_prefix(head)?.strip_suffix(tail)?;
        Some(self.object.replacen('*', middle, 1))
    }

    pub(crate) fn fault(&self) -> Option<&'static str> {
        let stars = |text: &str| text.matches('*').count();
        match (stars(&self.individual), stars(&self.object)) {
            _ if self.individual.is_empty() || self.object.is_empty() => Some("one of the names is empty"),
            (0, 0) | (1, 1) => None,
            (0 | 1, 0 | 1) => Some("a pattern has a star on both sides"),
            _ => Some("a pattern has one star on each side"),
        }
    }

    pub(crate) fn wrong(&self, code: &str, text: &str) -> Message {
        match &self.place {
            Some((file, place)) => Message::at(code, file, *place, format!("`[bindings.names]`: {text}")),
            None => Message::error(code, format!("`--name {}={}`: {text}", self.individual, self.object)),
        }
    }

    pub(crate) fn questionable(&self, code: &str, text: &str) -> Message {
        match &self.place {
            Some((file, Some(place))) => {
                Message::warning_at(code, file, *place, format!("`[bindings.names]`: {text}"))
            }
            Some((file, None)) => Message::warning(code, format!("`[bindings.names]` of {file}: {text}")),
            None => Message::warning(code, format!("`--name {}={}`: {text}", self.individual, self.object)),
        }
    }
}
