//! The states of a process in the order in which they were found, and the way back from a state to its number.

use std::hash::{BuildHasher, Hash};

use rustc_hash::FxBuildHasher;

use crate::mdp::{MOST, dense};

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
    Hash(Places),
}

/// A hash table with open addresses: the upper half of an entry is the hash of a state, the lower half its number plus one.
///
/// The place of a hash are its first bits, so that places have the order of hashes, and a greater table is written from one end to the
/// other.
#[derive(Debug, Clone)]
struct Places {
    entries: Vec<u64>,
    /// How many bits of a hash are not part of its place.
    shift: u32,
}

/// Bits of the place in the first table.
const FIRST: u32 = 8;

impl Places {
    fn new(bits: u32) -> Self {
        Self { entries: vec![0; 1 << bits], shift: 32_u32.saturating_sub(bits) }
    }

    /// The place at which a hash is looked for first.
    const fn home(&self, hash: u32) -> usize {
        hash as usize >> self.shift
    }

    /// The number of a state with this hash, or the place that is free for it.
    #[expect(clippy::arithmetic_side_effects, reason = "there are at least 2^8 entries")]
    fn find(&self, hash: u32, is_it: impl Fn(u32) -> bool) -> Result<u32, usize> {
        let last = self.entries.len() - 1;
        let mut place = self.home(hash);
        loop {
            match number_of(self.entries[place], hash) {
                _ if self.entries[place] == 0 => return Err(place),
                Some(number) if is_it(number) => return Ok(number),
                _ => place = place.wrapping_add(1) & last,
            }
        }
    }

    /// Twice as many places where less than a third is free. None where hashes have no more bits for that.
    fn make_room(&mut self, taken: usize) -> Option<()> {
        if taken.saturating_mul(3) < self.entries.len().saturating_mul(2) {
            return Some(());
        }
        let mut more = Self::new(33_u32.checked_sub(self.shift).filter(|bits| *bits <= 32)?);
        for entry in self.entries.drain(..).filter(|entry| *entry != 0) {
            if let Err(place) = more.find(upper(entry), |_| false) {
                more.entries[place] = entry;
            }
        }
        *self = more;
        Some(())
    }
}

const fn upper(entry: u64) -> u32 {
    (entry >> 32) as u32
}

/// The number of an entry, if it has this hash.
#[expect(clippy::cast_possible_truncation, reason = "the lower half")]
const fn number_of(entry: u64, hash: u32) -> Option<u32> {
    if upper(entry) == hash { (entry as u32).checked_sub(1) } else { None }
}

fn hash<S: Hash>(state: &S) -> u32 {
    // The first bits of what the hasher has before it turns them around are the best ones.
    upper(FxBuildHasher.hash_one(state).wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

/// What a first look at a state tells.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Look {
    /// Its code, or its hash.
    key: usize,
    /// Its number plus one, 0 if it was not seen at once.
    after: u32,
}

impl<S: Eq + Hash> States<S> {
    /// No states; `codes` says how many codes they have, if they have.
    pub fn new(codes: Option<usize>) -> Self {
        let numbers = match codes.filter(|codes| *codes <= TABLE) {
            Some(codes) => Numbers::Table(vec![0; codes]),
            None => Numbers::Hash(Places::new(FIRST)),
        };
        Self { list: Vec::new(), numbers }
    }

    /// A first look at a state. Looks at several states wait for memory at the same time, which takes most of the time of finding one.
    pub(crate) fn look(&self, state: &S, code: impl FnOnce(&S) -> usize) -> Look {
        match &self.numbers {
            Numbers::Table(table) => {
                let key = code(state);
                Look { key, after: table[key] }
            }
            Numbers::Hash(places) => {
                let hash = hash(state);
                let number = number_of(places.entries[places.home(hash)], hash);
                let number = number.filter(|number| self.list[*number as usize] == *state);
                Look { key: hash as usize, after: number.map_or(0, |number| number.saturating_add(1)) }
            }
        }
    }

    /// The number of a state that was looked at, which it gets if it has none; none where there are too many states to number them.
    pub(crate) fn insert(&mut self, state: S, look: Look) -> Option<u32> {
        if let Some(known) = look.after.checked_sub(1) {
            return Some(known);
        }
        if self.list.len() >= MOST {
            return None;
        }
        let next = dense(self.list.len());
        match &mut self.numbers {
            Numbers::Table(table) => {
                let number = &mut table[look.key];
                if let Some(known) = number.checked_sub(1) {
                    return Some(known);
                }
                *number = next.saturating_add(1);
            }
            Numbers::Hash(places) => {
                let hash = dense(look.key);
                let is_it = |number: u32| self.list[number as usize] == state;
                let place = match places.find(hash, is_it) {
                    Ok(known) => return Some(known),
                    Err(place) => place,
                };
                places.entries[place] = u64::from(hash) << 32 | u64::from(next.saturating_add(1));
                places.make_room(self.list.len())?;
            }
        }
        self.list.push(state);
        Some(next)
    }

    /// The number of a state with its code, if it was found.
    pub fn number(&self, code: usize, state: &S) -> Option<usize> {
        let found = match &self.numbers {
            Numbers::Table(table) => table.get(code).copied().unwrap_or(0).checked_sub(1),
            Numbers::Hash(places) => {
                places.find(hash(state), |number| self.list[number as usize] == *state).ok()
            }
        };
        found.map(|number| number as usize)
    }

    /// Forgets how to find the numbers of states, which takes memory: [`number`](Self::number) finds none any more.
    pub(crate) fn forget_numbers(&mut self) {
        self.numbers = Numbers::Table(Vec::new());
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
