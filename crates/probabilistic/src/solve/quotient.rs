//! The equations of a component with merged end components.

use crate::number::Number;
use crate::solve::chain::Rows;

/// The equations of a strongly connected component in which each end component is merged into one
/// block. Each other state is a block by itself.
pub struct Quotient<N> {
    /// First row of each block, followed by the number of rows.
    pub first: Vec<u32>,
    /// One row for each choice that leaves its block. Columns are blocks, and self-loops are
    /// eliminated.
    pub rows: Rows<N>,
    /// The local choice from which each row was built.
    pub choices: Vec<u32>,
    /// Greatest number of transitions of a local choice.
    pub widest: usize,
}

impl<N: Number> Quotient<N> {
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the end is listed, too, so that the list is never empty"
    )]
    pub fn blocks(&self) -> usize {
        self.first.len() - 1
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the start of the next one is there, because the end is listed, too"
    )]
    pub fn range(&self, block: usize) -> std::ops::Range<usize> {
        self.first[block] as usize..self.first[block + 1] as usize
    }
}
