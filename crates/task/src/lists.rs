//! A list of lists of numbers. The numbers of all lists are stored in one vector.

use crate::number::dense;

/// Lists of numbers, which are stored one after another in a single vector.
#[derive(Debug, Clone, Default)]
pub struct Lists {
    /// End position of each list in `items`.
    ends: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    pub fn push(&mut self, list: &[u32]) {
        self.items.extend_from_slice(list);
        self.ends.push(dense(self.items.len()));
    }

    /// Returns the number of lists.
    pub fn count(&self) -> usize {
        self.ends.len()
    }

    /// Returns the list at an index.
    #[inline]
    pub fn of(&self, index: u32) -> &[u32] {
        let index = index as usize;
        let start = index.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.items[start as usize..self.ends[index] as usize]
    }

    pub fn iter(&self) -> impl Iterator<Item = &[u32]> {
        (0..dense(self.count())).map(|index| self.of(index))
    }

    /// Returns the inverse relation: list i of the result contains the indices of all lists that contain i,
    /// for each i below `count`.
    #[must_use]
    pub fn inverse(&self, count: usize) -> Self {
        let mut ends = vec![0_u32; count];
        for item in &self.items {
            ends[*item as usize] = ends[*item as usize].saturating_add(1);
        }
        let mut sum = 0_u32;
        let mut next = Vec::with_capacity(count);
        for end in &mut ends {
            next.push(sum);
            sum = sum.saturating_add(*end);
            *end = sum;
        }
        let mut items = vec![0; self.items.len()];
        for (list, index) in self.iter().zip(0..) {
            for item in list {
                let place = &mut next[*item as usize];
                items[*place as usize] = index;
                *place = place.saturating_add(1);
            }
        }
        Self { ends, items }
    }
}
