//! Which rows lead to a column.

use crate::mdp::dense;
use crate::solve::chain::Rows;

/// For each column the rows with an entry there, in ascending order, once for each entry.
pub struct Users {
    /// Where each column starts in `rows`, and the end.
    starts: Vec<u32>,
    rows: Vec<u32>,
}

impl Users {
    /// The rows that lead to each of so many columns.
    pub fn new<N>(rows: &Rows<N>, columns: usize) -> Self {
        let mut starts = vec![0_u32; columns.saturating_add(1)];
        for column in &rows.columns {
            starts[*column as usize] = starts[*column as usize].saturating_add(1);
        }
        let mut end = 0_u32;
        for start in &mut starts {
            end = end.saturating_add(*start);
            *start = end;
        }
        // From behind, so that each start gets to the first row of its column.
        let mut users = vec![0_u32; rows.columns.len()];
        for (row, window) in rows.first.windows(2).enumerate().rev() {
            for column in &rows.columns[window[0] as usize..window[1] as usize] {
                let at = &mut starts[*column as usize];
                *at = at.saturating_sub(1);
                users[*at as usize] = dense(row);
            }
        }
        Self { starts, rows: users }
    }

    /// The rows that lead to a column.
    pub fn of(&self, column: u32) -> &[u32] {
        let next = (column as usize).saturating_add(1);
        &self.rows[self.starts[column as usize] as usize..self.starts[next] as usize]
    }
}

/// For each row the place that it belongs to; `first` has the first row of each place, and the end.
pub fn owners(first: &[u32]) -> Vec<u32> {
    let rows = first.last().copied().unwrap_or(0);
    let mut owners = vec![0; rows as usize];
    for (place, window) in first.windows(2).enumerate() {
        owners[window[0] as usize..window[1] as usize].fill(dense(place));
    }
    owners
}
