//! The states of a process in the order in which they were found, and the way back from a state to its number.

use std::hash::{BuildHasher, Hash};

use hashbrown::HashTable;
use rustc_hash::FxBuildHasher;

/// Codes up to which a table is laid out. Its memory is taken as it is touched, so that a sparse one costs less.
const TABLE: usize = 1 << 29;

/// States and their numbers.
#[derive(Debug, Clone)]
pub struct States<S> {
    list: Vec<S>,
    numbers: Numbers,
}

#[derive(Debug, Clone)]
enum Numbers {
    /// For each code the number of its state plus one, 0 where there is none.
    Table(Vec<u32>),
    /// Numbers by the hash of their states.
    Hash(HashTable<u32>),
}

fn hash<S: Hash>(state: &S) -> u64 {
    FxBuildHasher.hash_one(state)
}

impl<S: Eq + Hash> States<S> {
    /// No states; `codes` says how many codes they have, if they have.
    pub fn new(codes: Option<usize>) -> Self {
        let numbers = match codes.filter(|codes| *codes <= TABLE) {
            Some(codes) => Numbers::Table(vec![0; codes]),
            None => Numbers::Hash(HashTable::new()),
        };
        Self { list: Vec::new(), numbers }
    }

    /// The number of a state, which it gets if it has none; none where there are too many states to number them. The code is
    /// asked for where there are codes.
    pub(crate) fn insert(&mut self, state: S, code: impl FnOnce(&S) -> usize) -> Option<u32> {
        let next = u32::try_from(self.list.len()).ok()?;
        let after = next.checked_add(1)?;
        match &mut self.numbers {
            Numbers::Table(table) => {
                let number = &mut table[code(&state)];
                if let Some(known) = number.checked_sub(1) {
                    return Some(known);
                }
                *number = after;
            }
            Numbers::Hash(table) => {
                let list = &self.list;
                let entry = table.entry(
                    hash(&state),
                    |number| list[*number as usize] == state,
                    |number| hash(&list[*number as usize]),
                );
                match entry {
                    hashbrown::hash_table::Entry::Occupied(known) => return Some(*known.get()),
                    hashbrown::hash_table::Entry::Vacant(place) => place.insert(next),
                };
            }
        }
        self.list.push(state);
        Some(next)
    }

    /// The number of a state with its code, if it was found.
    pub fn number(&self, code: usize, state: &S) -> Option<usize> {
        let found = match &self.numbers {
            Numbers::Table(table) => table.get(code).copied().unwrap_or(0).checked_sub(1),
            Numbers::Hash(table) => {
                table.find(hash(state), |number| self.list[*number as usize] == *state).copied()
            }
        };
        found.map(|number| number as usize)
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The states by number.
    pub fn iter(&self) -> std::slice::Iter<'_, S> {
        self.list.iter()
    }
}

impl<S> std::ops::Index<usize> for States<S> {
    type Output = S;

    fn index(&self, number: usize) -> &S {
        &self.list[number]
    }
}

impl<'a, S: Eq + Hash> IntoIterator for &'a States<S> {
    type Item = &'a S;
    type IntoIter = std::slice::Iter<'a, S>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}
