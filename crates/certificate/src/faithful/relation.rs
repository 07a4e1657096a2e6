//! Sets of ground atoms, indexed by predicate and by each argument.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::faithful::key::Key;

#[derive(Debug, Clone, Default)]
pub(super) struct Relation {
    atoms: FxHashSet<Key>,
    rows: FxHashMap<u32, Vec<Key>>,
    rows_with: FxHashMap<(u32, usize, u32), Vec<usize>>,
}

impl Relation {
    pub(super) fn insert(&mut self, key: Key) -> bool {
        if !self.atoms.insert(key.clone()) {
            return false;
        }
        let rows = self.rows.entry(key.0).or_default();
        for (place, object) in key.1.iter().enumerate() {
            self.rows_with.entry((key.0, place, *object)).or_default().push(rows.len());
        }
        rows.push(key);
        true
    }

    pub(super) fn contains(&self, key: &Key) -> bool {
        self.atoms.contains(key)
    }

    pub(super) fn len(&self) -> usize {
        self.atoms.len()
    }

    pub(super) fn count(&self, predicate: u32, place: Option<(usize, u32)>) -> usize {
        match place {
            None => self.rows.get(&predicate).map_or(0, Vec::len),
            Some((place, object)) => self.rows_with.get(&(predicate, place, object)).map_or(0, Vec::len),
        }
    }

    pub(super) fn rows(&self, predicate: u32, place: Option<(usize, u32)>) -> impl Iterator<Item = &Key> {
        let rows = self.rows.get(&predicate).map_or(&[][..], Vec::as_slice);
        let (all, some) = match place {
            None => (rows, None),
            Some((place, object)) => (&[][..], self.rows_with.get(&(predicate, place, object))),
        };
        all.iter().chain(some.into_iter().flatten().map(|row| &rows[*row]))
    }

    pub(super) fn atoms(&self) -> impl Iterator<Item = &Key> {
        self.atoms.iter()
    }
}

impl FromIterator<Key> for Relation {
    fn from_iter<I: IntoIterator<Item = Key>>(atoms: I) -> Self {
        let mut relation = Self::default();
        for atom in atoms {
            relation.insert(atom);
        }
        relation
    }
}
