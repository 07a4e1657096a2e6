//! The states of a process in the order of their discovery, with the map from states to state
//! numbers.

use std::hash::{BuildHasher, Hash};

use rustc_hash::FxBuildHasher;

use crate::mdp::{MAX_COUNT, dense};

/// Upper limit on the number of state codes for which a table is used. The operating system provides memory on first
/// access, so unused parts of the table occupy none.
const MAX_TABLE_CODES: usize = 1 << 29;

/// A list of states with an index from states to their positions (state numbers).
#[derive(Debug, Clone)]
pub struct States<S> {
    list: Vec<S>,
    numbers: Numbers,
}

#[derive(Debug)]
enum Numbers {
    /// For each state code, the number of the state plus one, or 0 if the state was not inserted.
    Table(Vec<u32>),
    Hash(HashTable),
}

impl Clone for Numbers {
    fn clone(&self) -> Self {
        match self {
            Self::Table(table) => {
                // Zeros are not written, because the system provides memory for the written parts of a table only.
                let mut copy = vec![0; table.len()];
                for (slot, number) in copy.iter_mut().zip(table).filter(|(_, number)| **number != 0) {
                    *slot = *number;
                }
                Self::Table(copy)
            }
            Self::Hash(hash_table) => Self::Hash(hash_table.clone()),
        }
    }
}

/// A hash table with linear probing. The upper half of an entry is the hash of a state; the lower
/// half is the state's number plus one. The value 0 is a free slot.
///
/// The home slot of a hash is given by its leading bits. Slots are therefore in the order of
/// hashes, and growing writes the larger table sequentially.
#[derive(Debug, Clone)]
struct HashTable {
    entries: Vec<u64>,
    /// Number of trailing bits of a hash that do not determine its home slot.
    shift: u32,
}

const INITIAL_BITS: u32 = 8;

impl HashTable {
    fn new(bits: u32) -> Self {
        Self { entries: vec![0; 1 << bits], shift: 32_u32.saturating_sub(bits) }
    }

    const fn home(&self, hash: u32) -> usize {
        hash as usize >> self.shift
    }

    /// Returns `Ok` with the number of the entry that has this hash and satisfies `is_match`, or
    /// `Err` with the free slot for a new entry.
    #[expect(clippy::arithmetic_side_effects, reason = "there are at least 2^8 entries")]
    fn find(&self, hash: u32, is_match: impl Fn(u32) -> bool) -> Result<u32, usize> {
        let last = self.entries.len() - 1;
        let mut slot = self.home(hash);
        loop {
            match number_of(self.entries[slot], hash) {
                _ if self.entries[slot] == 0 => return Err(slot),
                Some(number) if is_match(number) => return Ok(number),
                _ => slot = slot.wrapping_add(1) & last,
            }
        }
    }

    /// Doubles the table if at most a third of its slots is free. Returns `None` if a larger table
    /// would need more bits than hashes have.
    fn grow_if_full(&mut self, count: usize) -> Option<()> {
        if count.saturating_mul(3) < self.entries.len().saturating_mul(2) {
            return Some(());
        }
        let mut larger = Self::new(33_u32.checked_sub(self.shift).filter(|bits| *bits <= 32)?);
        for entry in self.entries.drain(..).filter(|entry| *entry != 0) {
            if let Err(slot) = larger.find(upper(entry), |_| false) {
                larger.entries[slot] = entry;
            }
        }
        *self = larger;
        Some(())
    }
}

const fn upper(entry: u64) -> u32 {
    (entry >> 32) as u32
}

#[expect(clippy::cast_possible_truncation, reason = "the lower half")]
const fn number_of(entry: u64, hash: u32) -> Option<u32> {
    if upper(entry) == hash { (entry as u32).checked_sub(1) } else { None }
}

fn hash<S: Hash>(state: &S) -> u32 {
    // The best bits of this hash are not the leading ones. The multiplication mixes all bits into the upper
    // half, which is used.
    upper(FxBuildHasher.hash_one(state).wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

/// The result of a first lookup of a state, without following collisions.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Probe {
    /// The code or the hash of the state, depending on the kind of index.
    key: usize,
    /// The number of the state plus one, or 0 if the lookup did not find the state.
    number_plus_one: u32,
}

impl<S: Eq + Hash> States<S> {
    /// Creates an empty list. `codes` is the number of state codes if the generator numbers all
    /// conceivable states.
    pub fn new(codes: Option<usize>) -> Self {
        let numbers = match codes.filter(|codes| *codes <= MAX_TABLE_CODES) {
            Some(codes) => Numbers::Table(vec![0; codes]),
            None => Numbers::Hash(HashTable::new(INITIAL_BITS)),
        };
        Self { list: Vec::new(), numbers }
    }

    /// Looks a state up in its home slot only. The time of a lookup is mostly that of a memory access, and the
    /// memory accesses of successive calls overlap.
    pub(crate) fn probe(&self, state: &S, code: impl FnOnce(&S) -> usize) -> Probe {
        match &self.numbers {
            Numbers::Table(table) => {
                let key = code(state);
                Probe { key, number_plus_one: table[key] }
            }
            Numbers::Hash(hash_table) => {
                let hash = hash(state);
                let number = number_of(hash_table.entries[hash_table.home(hash)], hash);
                let number = number.filter(|number| self.list[*number as usize] == *state);
                Probe {
                    key: hash as usize,
                    number_plus_one: number.map_or(0, |number| number.saturating_add(1)),
                }
            }
        }
    }

    /// Returns the number of a state, and adds the state if it is new. `probe` is the result of
    /// [`Self::probe`] for this state. Returns `None` if there are too many states.
    pub(crate) fn insert(&mut self, state: S, probe: Probe) -> Option<u32> {
        if let Some(number) = probe.number_plus_one.checked_sub(1) {
            return Some(number);
        }
        if self.list.len() >= MAX_COUNT {
            return None;
        }
        let next = dense(self.list.len());
        match &mut self.numbers {
            Numbers::Table(table) => {
                // The state may have been inserted since the probe.
                let number = &mut table[probe.key];
                if let Some(number) = number.checked_sub(1) {
                    return Some(number);
                }
                *number = next.saturating_add(1);
            }
            Numbers::Hash(hash_table) => {
                let hash = dense(probe.key);
                let is_match = |number: u32| self.list[number as usize] == state;
                let slot = match hash_table.find(hash, is_match) {
                    Ok(number) => return Some(number),
                    Err(slot) => slot,
                };
                hash_table.entries[slot] = u64::from(hash) << 32 | u64::from(next.saturating_add(1));
                hash_table.grow_if_full(self.list.len())?;
            }
        }
        self.list.push(state);
        Some(next)
    }

    /// Returns the number of a state, given the state and its code. Returns `None` if the state was
    /// not inserted.
    pub fn number(&self, code: usize, state: &S) -> Option<usize> {
        let number = match &self.numbers {
            Numbers::Table(table) => table.get(code).copied().unwrap_or(0).checked_sub(1),
            Numbers::Hash(hash_table) => {
                hash_table.find(hash(state), |number| self.list[number as usize] == *state).ok()
            }
        };
        number.map(|number| number as usize)
    }

    /// Frees the index from states to numbers. Afterwards, [`number`](Self::number) returns `None`,
    /// and no state may be inserted.
    pub(crate) fn forget_numbers(&mut self) {
        self.numbers = Numbers::Table(Vec::new());
    }

    /// Returns the number of states.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Returns `true` if there are no states.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Iterates over the states in the order of their numbers.
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
