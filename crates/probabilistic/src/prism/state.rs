//! Bit-packed states of PRISM models.

use std::collections::BTreeSet;
use std::hash::{Hash, Hasher};

use crate::mdp::dense;

/// A state of a model: the values of the variables, each stored in the number of bits that its range requires.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Packed(Words);

// Exploration mostly copies, compares and hashes states. Small states are therefore stored inline in two words, and
// are copied without a branch on the number of words.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Words {
    Inline([u64; INLINE_WORDS]),
    Boxed(Box<[u64]>),
}

const INLINE_WORDS: usize = 2;

impl Default for Words {
    fn default() -> Self {
        Self::Inline([0; INLINE_WORDS])
    }
}

impl Packed {
    fn new(words: usize) -> Self {
        Self(if words <= INLINE_WORDS { Words::default() } else { Words::Boxed(vec![0; words].into()) })
    }

    fn words(&self) -> &[u64] {
        match &self.0 {
            Words::Inline(words) => words,
            Words::Boxed(words) => words,
        }
    }

    fn words_mut(&mut self) -> &mut [u64] {
        match &mut self.0 {
            Words::Inline(words) => words,
            Words::Boxed(words) => words,
        }
    }
}

impl Hash for Packed {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.words().iter().for_each(|word| state.write_u64(*word));
    }
}

/// A change of one word of a packed state: first clears bits, then sets bits.
#[derive(Debug, Clone, Copy)]
pub struct Edit {
    word: u32,
    clear: u64,
    set: u64,
}

impl Edit {
    pub const fn joins(&self, other: &Self) -> bool {
        self.word == other.word
    }

    /// Extends this edit so that it has the effect of itself followed by `after`, an edit of the same word.
    pub const fn join(&mut self, after: &Self) {
        self.clear |= after.clear;
        self.set = self.set & !after.clear | after.set;
    }
}

impl Packed {
    /// Applies edits in their order.
    pub fn edit(&mut self, edits: &[Edit]) {
        let words = self.words_mut();
        for Edit { word, clear, set } in edits {
            let word = &mut words[*word as usize];
            *word = *word & !clear | set;
        }
    }
}

/// A selection of variables whose values are concatenated to a number of at most 64 bits.
#[derive(Debug, Clone, Default)]
pub struct Key {
    pieces: Vec<Piece>,
    pub bits: u32,
}

/// Contiguous bits of a word of a packed state that are copied to a key.
#[derive(Debug, Clone, Copy)]
struct Piece {
    word: u32,
    shift: u32,
    mask: u64,
    /// Position of the lowest bit in the key.
    at: u32,
}

impl Key {
    pub fn of(&self, packed: &Packed) -> u64 {
        let words = packed.words();
        self.pieces.iter().fold(0, |number, piece| {
            number | (words[piece.word as usize] >> piece.shift & piece.mask) << piece.at
        })
    }
}

/// The values of all variables of a model; truth values are 0 and 1.
pub type Valuation = Vec<i64>;

/// Returns the distance of a value from the least value of its range, as an index. If the value is less, returns
/// `usize::MAX`, which is no valid index.
pub fn above_least(value: i64, least: i64) -> usize {
    if value < least { usize::MAX } else { usize::try_from(value.abs_diff(least)).unwrap_or(usize::MAX) }
}

#[derive(Debug, Clone, Default)]
pub struct Layout {
    fields: Vec<Field>,
    words: usize,
    used: u32,
    /// The indices of the variables, by descending size of their ranges.
    order: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
struct Field {
    least: i64,
    /// Size of the range: greatest value minus least value.
    greatest: u64,
    word: u32,
    shift: u32,
    mask: u64,
}

impl Layout {
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "used is at most 64 and so is bits; words counts variables"
    )]
    pub fn push(&mut self, least: i64, greatest: i64) {
        let size = greatest.abs_diff(least);
        let bits = size.checked_ilog2().map_or(0, |log| log + 1);
        // The bits of a variable never cross the boundary of a word.
        if self.words == 0 || self.used + bits > 64 {
            self.words += 1;
            self.used = 0;
        }
        let mask = if bits == 64 { u64::MAX } else { (1 << bits) - 1 };
        // A variable with a single value has no bits, but its shift must still be less than 64.
        let shift = if bits == 0 { 0 } else { self.used };
        self.fields.push(Field { least, greatest: size, word: dense(self.words - 1), shift, mask });
        self.used += bits;
        self.order.push(dense(self.order.len()));
        self.order.sort_by_key(|number| std::cmp::Reverse(self.fields[*number as usize].greatest));
    }

    /// Packs the values of all variables into a state. Each value must be in the range of its variable.
    pub fn pack(&self, values: &[i64]) -> Packed {
        let mut packed = Packed::new(self.words);
        let words = packed.words_mut();
        for (field, value) in self.fields.iter().zip(values) {
            words[field.word as usize] |= value.abs_diff(field.least) << field.shift;
        }
        packed
    }

    pub fn values(&self, packed: &Packed) -> impl Iterator<Item = i64> {
        self.fields.iter().map(|field| field.least.wrapping_add_unsigned(field.raw(packed)))
    }

    /// Replaces the contents of `values` by the values of all variables in a state.
    pub fn unpack(&self, packed: &Packed, values: &mut Valuation) {
        values.clear();
        values.extend(self.values(packed));
    }

    pub fn set(&self, packed: &mut Packed, variable: u32, value: i64) {
        packed.edit(&[self.edit(variable, value)]);
    }

    pub fn edit(&self, variable: u32, value: i64) -> Edit {
        let field = &self.fields[variable as usize];
        let set = value.abs_diff(field.least) << field.shift;
        Edit { word: field.word, clear: field.mask << field.shift, set }
    }

    /// Returns a [`Key`] that selects these variables, or `None` if their values need more than 64
    /// bits. [`Key::of`] concatenates the values in a state to a number.
    pub fn key(&self, variables: &BTreeSet<u32>) -> Option<Key> {
        let mut key = Key::default();
        for field in variables.iter().map(|variable| &self.fields[*variable as usize]) {
            let bits = field.mask.count_ones();
            // Adjacent variables in the same word are copied together.
            if let Some(last) = key.pieces.last_mut()
                && last.word == field.word
                && last.shift.saturating_add(last.mask.count_ones()) == field.shift
            {
                last.mask = last.mask << bits | field.mask;
            } else if bits > 0 {
                let (word, shift, mask) = (field.word, field.shift, field.mask);
                key.pieces.push(Piece { word, shift, mask, at: key.bits });
            }
            key.bits = key.bits.saturating_add(bits);
        }
        (key.bits <= 64).then_some(key)
    }

    /// Returns the number of combinations of values of all variables, or `None` if it exceeds `usize`.
    pub fn codes(&self) -> Option<usize> {
        self.fields.iter().try_fold(1_usize, |product, field| product.checked_mul(field.size()?))
    }

    /// Returns the index of a state among all combinations of values (mixed radix). The variable with the greatest
    /// range is the most significant digit. The result is meaningless if [`Self::codes`] returns `None`.
    pub fn code(&self, packed: &Packed) -> usize {
        self.order.iter().fold(0, |code, number| {
            let field = &self.fields[*number as usize];
            code.wrapping_mul(field.size().unwrap_or(0))
                .wrapping_add(usize::try_from(field.raw(packed)).unwrap_or(0))
        })
    }
}

impl Field {
    fn raw(&self, packed: &Packed) -> u64 {
        packed.words()[self.word as usize] >> self.shift & self.mask
    }

    fn size(&self) -> Option<usize> {
        usize::try_from(self.greatest).ok()?.checked_add(1)
    }
}
