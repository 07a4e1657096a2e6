//! Caches values that depend on a few variables of a state only.

use std::collections::BTreeSet;

use rustc_hash::FxHashMap;

use crate::prism::state::{Key, Layout, Packed};

/// Upper limit on the bits of a key that indexes a table; longer keys use a hash map. The operating system provides
/// the table's memory on first access.
const MAX_TABLE_BITS: u32 = 20;

#[derive(Debug)]
pub struct Numbers {
    key: Key,
    entries: Entries,
}

#[derive(Debug)]
enum Entries {
    /// For each key, the stored number plus one; 0 if no number is stored.
    Table(Vec<u32>),
    Hash(FxHashMap<u64, u32>),
}

impl Numbers {
    /// Creates an empty map. Returns `None` if the values of the variables need more than 64 bits.
    pub fn new(layout: &Layout, variables: &BTreeSet<u32>) -> Option<Self> {
        let key = layout.key(variables)?;
        let entries = if key.bits <= MAX_TABLE_BITS {
            Entries::Table(vec![0; 1 << key.bits])
        } else {
            Entries::Hash(FxHashMap::default())
        };
        Some(Self { key, entries })
    }

    pub fn get(&self, state: &Packed) -> Option<u32> {
        let key = self.key.of(state);
        match &self.entries {
            Entries::Table(table) => table[usize::try_from(key).ok()?].checked_sub(1),
            Entries::Hash(numbers) => numbers.get(&key).copied(),
        }
    }

    /// Stores a number for the variables' values in `state`. The number must be less than `u32::MAX`.
    pub fn note(&mut self, state: &Packed, number: u32) {
        let key = self.key.of(state);
        match &mut self.entries {
            Entries::Table(table) => {
                if let Some(entry) = usize::try_from(key).ok().and_then(|key| table.get_mut(key)) {
                    *entry = number.saturating_add(1);
                }
            }
            Entries::Hash(numbers) => {
                numbers.insert(key, number);
            }
        }
    }
}

#[derive(Debug)]
pub struct Memo<T> {
    /// Maps the variables' values to positions in `values`. `None` if the variables need more than 64 bits; then
    /// nothing is cached.
    numbers: Option<Numbers>,
    values: Vec<T>,
}

/// Upper limit on the number of cached values. Further values are computed on every request.
const MAX_VALUES: usize = 1 << 16;

impl<T> Memo<T> {
    pub fn new(layout: &Layout, variables: &BTreeSet<u32>) -> Self {
        Self { numbers: Numbers::new(layout, variables), values: Vec::new() }
    }

    /// Returns the cached value for `state`, or computes it with `find`. Returns `None` if `find` does.
    pub fn get(&mut self, state: &Packed, find: impl FnOnce() -> Option<T>) -> Option<&T> {
        if let Some(number) = self.numbers.as_ref().and_then(|numbers| numbers.get(state)) {
            return self.values.get(number as usize);
        }
        let value = find()?;
        let limit = if self.numbers.is_some() { MAX_VALUES } else { 0 };
        // Removes an uncached value that the previous call has returned.
        self.values.truncate(limit);
        self.values.push(value);
        let number = self.values.len().saturating_sub(1);
        if number < limit
            && let (Some(numbers), Ok(number)) = (&mut self.numbers, u32::try_from(number))
        {
            numbers.note(state, number);
        }
        self.values.last()
    }
}
