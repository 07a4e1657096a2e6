//! Index from the columns of sparse rows to the rows.

use crate::mdp::dense;
use crate::solve::chain::Rows;

/// For each column, the rows with an entry in this column, in ascending order. A row is listed once
/// per entry.
pub struct Users {
    starts: Vec<u32>,
    rows: Vec<u32>,
}

impl Users {
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
        // Rows are inserted from last to first, so each start moves down to the first row of its
        // column.
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

    pub fn of(&self, column: u32) -> &[u32] {
        let next = (column as usize).saturating_add(1);
        &self.rows[self.starts[column as usize] as usize..self.starts[next] as usize]
    }
}

/// Returns the owner (state or block) of each row, as a number. `first` contains the first row of
/// each owner, followed by the number of rows.
pub fn owners(first: &[u32]) -> Vec<u32> {
    let rows = first.last().copied().unwrap_or(0);
    let mut owners = vec![0; rows as usize];
    for (owner, window) in first.windows(2).enumerate() {
        owners[window[0] as usize..window[1] as usize].fill(dense(owner));
    }
    owners
}
