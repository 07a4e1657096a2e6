//! The values of all variables to a few machine words, and back.

use std::hash::{Hash, Hasher};

use smallvec::SmallVec;

use crate::mdp::dense;

/// A state: the values of the variables, each in as many bits as its range needs.
#[derive(Debug, Default)]
pub struct Packed(SmallVec<[u64; 2]>);

// What follows is written by hand because it is what exploration spends its time on.

impl Clone for Packed {
    fn clone(&self) -> Self {
        Self(SmallVec::from_slice(&self.0))
    }
}

impl PartialEq for Packed {
    fn eq(&self, other: &Self) -> bool {
        self.0.iter().eq(&other.0)
    }
}

impl Eq for Packed {}

impl Hash for Packed {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.0.iter().for_each(|word| state.write_u64(*word));
    }
}

/// The values of the variables, truth values as 0 and 1.
pub type Valuation = Vec<i64>;

/// How far a value is above the least one of its range; more than there are positions in any list, where it is below.
pub fn above_least(value: i64, least: i64) -> usize {
    if value < least { usize::MAX } else { usize::try_from(value.abs_diff(least)).unwrap_or(usize::MAX) }
}

/// Where each variable lies.
#[derive(Debug, Clone, Default)]
pub struct Layout {
    fields: Vec<Field>,
    words: usize,
    used: u32,
    /// The variables, greatest range first.
    order: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
struct Field {
    least: i64,
    /// Above the least one.
    greatest: u64,
    word: u32,
    shift: u32,
    mask: u64,
}

impl Layout {
    /// Adds a variable with its range.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "used is at most 64 and so is bits; words counts variables"
    )]
    pub fn push(&mut self, least: i64, greatest: i64) {
        let size = greatest.abs_diff(least);
        let bits = size.checked_ilog2().map_or(0, |log| log + 1);
        if self.words == 0 || self.used + bits > 64 {
            self.words += 1;
            self.used = 0;
        }
        let mask = if bits == 64 { u64::MAX } else { (1 << bits) - 1 };
        // A variable of one value takes no bits; its shift must stay below the word's size.
        let shift = if bits == 0 { 0 } else { self.used };
        self.fields.push(Field { least, greatest: size, word: dense(self.words - 1), shift, mask });
        self.used += bits;
        self.order.push(dense(self.order.len()));
        self.order.sort_by_key(|number| std::cmp::Reverse(self.fields[*number as usize].greatest));
    }

    /// Packs values, each in its range.
    pub fn pack(&self, values: &[i64]) -> Packed {
        let mut packed = Packed(SmallVec::from_elem(0, self.words.max(1)));
        for (field, value) in self.fields.iter().zip(values) {
            packed.0[field.word as usize] |= value.abs_diff(field.least) << field.shift;
        }
        packed
    }

    /// The values of all variables.
    pub fn values(&self, packed: &Packed) -> impl Iterator<Item = i64> {
        self.fields.iter().map(|field| field.least.wrapping_add_unsigned(field.raw(packed)))
    }

    /// Unpacks all values into a buffer.
    pub fn unpack(&self, packed: &Packed, values: &mut Valuation) {
        values.clear();
        values.extend(self.values(packed));
    }

    /// Changes one variable.
    pub fn set(&self, packed: &mut Packed, variable: u32, value: i64) {
        let field = &self.fields[variable as usize];
        let word = &mut packed.0[field.word as usize];
        *word = *word & !(field.mask << field.shift) | value.abs_diff(field.least) << field.shift;
    }

    /// How many combinations of values there are, if they can be counted.
    pub fn codes(&self) -> Option<usize> {
        self.fields.iter().try_fold(1_usize, |product, field| product.checked_mul(field.size()?))
    }

    /// The number of a combination, which means nothing where they cannot be counted; the variable with the greatest range weighs most.
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
        packed.0[self.word as usize] >> self.shift & self.mask
    }

    /// How many values there are.
    fn size(&self) -> Option<usize> {
        usize::try_from(self.greatest).ok()?.checked_add(1)
    }
}
