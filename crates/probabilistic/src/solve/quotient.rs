//! A component with cycles as the equations of its blocks.

use crate::number::Number;
use crate::solve::chain::Rows;

/// A component with its end components merged into blocks.
pub struct Quotient<N> {
    /// For each block its first row, and the end.
    pub first: Vec<u32>,
    /// What each choice that leaves its block leads to; columns are blocks, own loops are divided out.
    pub rows: Rows<N>,
    /// For each row its local choice.
    pub choices: Vec<u32>,
    /// The most transitions that a row was made of.
    pub widest: usize,
}

impl<N: Number> Quotient<N> {
    /// How many blocks there are.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the end is listed, too, so that the list is never empty"
    )]
    pub fn blocks(&self) -> usize {
        self.first.len() - 1
    }

    /// The rows of a block.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the start of the next one is there, because the end is listed, too"
    )]
    pub fn range(&self, block: usize) -> std::ops::Range<usize> {
        self.first[block] as usize..self.first[block + 1] as usize
    }
}
