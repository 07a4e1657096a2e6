//! The values of all variables to a few machine words, and back.

use smallvec::SmallVec;

/// A state: the values of the variables, each in as many bits as its range needs.
pub type Packed = SmallVec<[u64; 2]>;

/// The values of the variables, truth values as 0 and 1.
pub type Valuation = Vec<i64>;

/// Where each variable lies.
#[derive(Debug, Clone, Default)]
pub struct Layout {
    fields: Vec<Field>,
    words: usize,
    used: u32,
}

#[derive(Debug, Clone, Copy)]
struct Field {
    least: i64,
    word: u32,
    shift: u32,
    mask: u64,
}

impl Layout {
    /// Adds a variable with its range.
    pub fn push(&mut self, least: i64, greatest: i64) {
        let size = greatest.wrapping_sub(least) as u64;
        let bits = 64 - size.leading_zeros();
        if self.words == 0 || self.used + bits > 64 {
            self.words += 1;
            self.used = 0;
        }
        let mask = if bits == 64 { u64::MAX } else { (1 << bits) - 1 };
        // A variable of one value takes no bits; its shift must stay below the word's size.
        let shift = if bits == 0 { 0 } else { self.used };
        self.fields.push(Field { least, word: self.words as u32 - 1, shift, mask });
        self.used += bits;
    }

    /// Packs values, each in its range.
    pub fn pack(&self, values: &[i64]) -> Packed {
        let mut packed: Packed = SmallVec::from_elem(0, self.words.max(1));
        for (field, value) in self.fields.iter().zip(values) {
            packed[field.word as usize] |= (value.wrapping_sub(field.least) as u64) << field.shift;
        }
        packed
    }

    /// Unpacks all values into a buffer.
    pub fn unpack(&self, packed: &Packed, values: &mut Valuation) {
        values.clear();
        values.extend(self.fields.iter().map(|field| {
            let raw = packed[field.word as usize] >> field.shift & field.mask;
            field.least.wrapping_add(raw as i64)
        }));
    }
}
