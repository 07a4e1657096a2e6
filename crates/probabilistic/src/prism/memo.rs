//! Values that depend on a few variables, by the values of these.

use std::collections::BTreeSet;

use rustc_hash::FxHashMap;

use crate::prism::state::{Key, Layout, Packed};

/// Bits of keys up to which a table is laid out. Its memory is taken as it is touched.
const TABLE: u32 = 20;

/// Numbers by the values of some variables.
#[derive(Debug)]
pub struct Numbers {
    key: Key,
    found: Found,
}

#[derive(Debug)]
enum Found {
    /// The number plus one of each key, 0 where there is none.
    Table(Vec<u32>),
    Hash(FxHashMap<u64, u32>),
}

impl Numbers {
    /// No numbers yet; none where the variables have too many values.
    pub fn new(layout: &Layout, variables: &BTreeSet<u32>) -> Option<Self> {
        let key = layout.key(variables)?;
        let found = if key.bits <= TABLE {
            Found::Table(vec![0; 1 << key.bits])
        } else {
            Found::Hash(FxHashMap::default())
        };
        Some(Self { key, found })
    }

    /// The number that was noted for a state's values.
    pub fn get(&self, state: &Packed) -> Option<u32> {
        let key = self.key.of(state);
        match &self.found {
            Found::Table(table) => table[usize::try_from(key).ok()?].checked_sub(1),
            Found::Hash(numbers) => numbers.get(&key).copied(),
        }
    }

    /// Notes a number, which must be less than the greatest one.
    pub fn note(&mut self, state: &Packed, number: u32) {
        let key = self.key.of(state);
        match &mut self.found {
            Found::Table(table) => {
                if let Some(entry) = usize::try_from(key).ok().and_then(|key| table.get_mut(key)) {
                    *entry = number.saturating_add(1);
                }
            }
            Found::Hash(numbers) => {
                numbers.insert(key, number);
            }
        }
    }
}

/// Values that a function of some variables has.
#[derive(Debug)]
pub struct Memo<T> {
    /// None where the variables have too many values for keys.
    numbers: Option<Numbers>,
    values: Vec<T>,
}

/// How many values are kept; what comes later is found anew each time.
const KEPT: usize = 1 << 16;

impl<T> Memo<T> {
    /// No values yet.
    pub fn new(layout: &Layout, variables: &BTreeSet<u32>) -> Self {
        Self { numbers: Numbers::new(layout, variables), values: Vec::new() }
    }

    /// The value for a state; none where there is none.
    pub fn get(&mut self, state: &Packed, find: impl FnOnce() -> Option<T>) -> Option<&T> {
        if let Some(known) = self.numbers.as_ref().and_then(|numbers| numbers.get(state)) {
            return self.values.get(known as usize);
        }
        let value = find()?;
        let most = if self.numbers.is_some() { KEPT } else { 0 };
        self.values.truncate(most);
        self.values.push(value);
        let number = self.values.len().saturating_sub(1);
        if number < most
            && let (Some(numbers), Ok(number)) = (&mut self.numbers, u32::try_from(number))
        {
            numbers.note(state, number);
        }
        self.values.last()
    }
}
