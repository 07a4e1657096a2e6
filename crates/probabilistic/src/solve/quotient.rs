//! Equations of the blocks of a component with cycles.

use crate::number::Number;
use crate::solve::chain::Rows;

/// A component with its end components merged into blocks.
pub struct Quotient<N> {
    /// First row of each block, and the end.
    pub first: Vec<u32>,
    /// One row per choice that leaves its block; columns are blocks, and loops are divided out.
    pub rows: Rows<N>,
    /// Local choice of each row.
    pub choices: Vec<u32>,
    /// Greatest number of transitions that a row was built from.
    pub widest: usize,
}

impl<N: Number> Quotient<N> {
    /// Number of blocks.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the end is listed, too, so that the list is never empty"
    )]
    pub fn blocks(&self) -> usize {
        self.first.len() - 1
    }

    /// Returns the rows of a block.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the start of the next one is there, because the end is listed, too"
    )]
    pub fn range(&self, block: usize) -> std::ops::Range<usize> {
        self.first[block] as usize..self.first[block + 1] as usize
    }
}
