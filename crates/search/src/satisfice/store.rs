//! Bit-packed states of a satisficing search. Each state is stored once.

use std::hash::{BuildHasher as _, Hash as _, Hasher as _};

use hashbrown::HashTable;
use rustc_hash::FxBuildHasher;

use task::task::{State, Task};

#[derive(Debug, Clone, Copy)]
struct Field {
    word: usize,
    shift: u32,
    mask: u64,
}

pub(super) struct Store<N> {
    fields: Vec<Field>,
    stride: usize,
    numbers: usize,
    packed: Vec<u64>,
    stored_numbers: Vec<N>,
    table: HashTable<u32>,
    count: u32,
}

impl<N: Clone + Eq + std::hash::Hash> Store<N> {
    pub(super) fn new(task: &Task<N>) -> Self {
        let (mut fields, mut word, mut used) = (Vec::with_capacity(task.variables.len()), 0_usize, 0_u32);
        for variable in &task.variables {
            let max_value = variable.values.len().saturating_sub(1).max(1);
            let bits = usize::BITS.saturating_sub(max_value.leading_zeros());
            if used.saturating_add(bits) > 64 {
                (word, used) = (word.saturating_add(1), 0);
            }
            let mask = u64::MAX >> 64_u32.saturating_sub(bits);
            fields.push(Field { word, shift: used, mask });
            used = used.saturating_add(bits);
        }
        Self {
            fields,
            stride: word.saturating_add(1),
            numbers: task.initial.numbers.len(),
            packed: Vec::new(),
            stored_numbers: Vec::new(),
            table: HashTable::new(),
            count: 0,
        }
    }

    pub(super) fn insert(&mut self, state: &State<N>) -> (u32, bool) {
        let mut key = vec![0_u64; self.stride];
        for (field, value) in self.fields.iter().zip(&state.values) {
            key[field.word] |= u64::from(*value) << field.shift;
        }
        let hash = hash(&key, &state.numbers);
        let (stride, numbers) = (self.stride, self.numbers);
        let (packed, stored) = (&self.packed, &self.stored_numbers);
        let at = |id: u32| {
            let id = id as usize;
            let words = &packed[id.saturating_mul(stride)..id.saturating_add(1).saturating_mul(stride)];
            let state_numbers =
                &stored[id.saturating_mul(numbers)..id.saturating_add(1).saturating_mul(numbers)];
            (words, state_numbers)
        };
        if let Some(id) = self.table.find(hash, |candidate| at(*candidate) == (&key[..], &state.numbers[..]))
        {
            return (*id, false);
        }
        let id = self.count;
        let rehash = |id: &u32| {
            let (words, numbers) = at(*id);
            self::hash(words, numbers)
        };
        self.table.insert_unique(hash, id, rehash);
        self.packed.extend(key);
        self.stored_numbers.extend(state.numbers.iter().cloned());
        self.count = self.count.checked_add(1).expect("invariant: fewer than 2^32 states are in memory");
        (id, true)
    }

    pub(super) fn get(&self, id: u32) -> State<N> {
        let start = (id as usize).saturating_mul(self.stride);
        let words = &self.packed[start..start.saturating_add(self.stride)];
        let value = |field: &Field| {
            u32::try_from(words[field.word] >> field.shift & field.mask)
                .expect("invariant: it was a value of 32 bits")
        };
        let start = (id as usize).saturating_mul(self.numbers);
        let numbers = self.stored_numbers[start..start.saturating_add(self.numbers)].to_vec();
        State { values: self.fields.iter().map(value).collect(), numbers }
    }

    /// Returns the approximate memory use in 64-bit words. The table takes about a word for each state.
    pub(super) fn size(&self) -> usize {
        let numbers = self.stored_numbers.len().saturating_mul(2);
        self.packed.len().saturating_add(numbers).saturating_add(self.count as usize)
    }
}

fn hash<N: std::hash::Hash>(words: &[u64], numbers: &[N]) -> u64 {
    let mut hasher = FxBuildHasher.build_hasher();
    words.hash(&mut hasher);
    numbers.hash(&mut hasher);
    hasher.finish()
}
