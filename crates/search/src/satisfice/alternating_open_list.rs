//! Alternating open list: several open lists that take turns, each sorted by its own heuristic value.
//!
//! The search is lazy: the operators that are applicable in a state get the heuristic value of this state
//! \[1\]. An entry of a list is therefore a state with its untried operators. Lists of preferred operators
//! get extra turns (a boost) after progress.
//!
//! \[1\] M. Helmert: The Fast Downward planning system, JAIR 26, 2006, section 5.

use std::collections::{BTreeMap, VecDeque};

#[derive(Debug, Clone, Copy)]
struct Entry {
    state: u32,
    next: u32,
    end: u32,
}

const PREFERRED_BOOST: i64 = 1_000;

#[derive(Debug)]
struct List<K> {
    buckets: BTreeMap<K, VecDeque<Entry>>,
    /// Number of turns taken, minus the extra turns that `boost` has granted. The non-empty list with the
    /// lowest number is used next.
    turns: i64,
    preferred: bool,
}

/// Open lists for all operators and for preferred operators. Each list is sorted by its own heuristic values.
#[derive(Debug)]
pub struct AlternatingOpenList<K> {
    lists: Vec<List<K>>,
    /// Steps of all entries: numbers that the caller chooses, such as ids of operators with designs.
    steps: Vec<u32>,
    entries: usize,
}

impl<K: Ord> AlternatingOpenList<K> {
    /// Creates one list for each item. The item is `true` if the list contains preferred operators only.
    pub fn new(lists: impl IntoIterator<Item = bool>) -> Self {
        let list = |preferred| List { preferred, buckets: BTreeMap::new(), turns: 0 };
        Self { lists: lists.into_iter().map(list).collect(), steps: Vec::new(), entries: 0 }
    }

    /// Adds a state with its heuristic value for each list. Lists of preferred operators get its preferred
    /// steps, and the other lists get all its applicable steps. A list that would get no steps gets no entry.
    pub fn push(
        &mut self,
        state: u32,
        values: impl IntoIterator<Item = K>,
        steps: &[u32],
        preferred: &[u32],
    ) {
        let [all_steps, preferred] = [steps, preferred].map(|range| {
            let next = task::number::dense(self.steps.len());
            self.steps.extend_from_slice(range);
            Entry { state, next, end: task::number::dense(self.steps.len()) }
        });
        for (list, value) in self.lists.iter_mut().zip(values) {
            let entry = if list.preferred { preferred } else { all_steps };
            if entry.next < entry.end {
                list.buckets.entry(value).or_default().push_back(entry);
                self.entries = self.entries.saturating_add(1);
            }
        }
    }

    /// Removes the next untried step from its list, and returns it with its state, as (state, step). Returns
    /// `None` if all lists are empty.
    pub fn pop(&mut self) -> Option<(u32, u32)> {
        let waiting = self.lists.iter_mut().filter(|list| !list.buckets.is_empty());
        let list = waiting.min_by_key(|list| list.turns)?;
        list.turns = list.turns.saturating_add(1);
        let mut bucket = list.buckets.first_entry()?;
        let entries = bucket.get_mut();
        let entry = entries.front_mut()?;
        let step = (entry.state, self.steps[entry.next as usize]);
        entry.next = entry.next.saturating_add(1);
        if entry.next == entry.end {
            entries.pop_front();
            self.entries = self.entries.saturating_sub(1);
            if entries.is_empty() {
                bucket.remove();
            }
        }
        Some(step)
    }

    /// Returns the approximate memory use in 64-bit words. The entries are not counted.
    pub fn size(&self) -> usize {
        self.steps.len() / 2
    }

    /// Returns the approximate memory use of the entries in 64-bit words: 12 bytes each, and unused capacity.
    pub(super) fn size_of_entries(&self) -> usize {
        self.entries.saturating_mul(2)
    }

    /// Gives each list of preferred operators `PREFERRED_BOOST` extra turns. Called when a heuristic has
    /// found a new best value.
    pub fn boost(&mut self) {
        for list in self.lists.iter_mut().filter(|list| list.preferred) {
            list.turns = list.turns.saturating_sub(PREFERRED_BOOST);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_counted_until_their_last_step_is_removed() {
        let mut open = AlternatingOpenList::new([false, true]);
        // The list of preferred steps gets no entry for a state without such steps.
        let preferred: [&[u32]; 3] = [&[7], &[], &[5, 6]];
        for (state, preferred) in (0..).zip(preferred) {
            open.push(state, [state, state], &[5, 6, 7], preferred);
        }
        let mut removed = 0;
        loop {
            let in_lists: usize =
                open.lists.iter().flat_map(|list| list.buckets.values()).map(VecDeque::len).sum();
            assert_eq!(open.size_of_entries(), 2 * in_lists, "after {removed} steps");
            if open.pop().is_none() {
                break;
            }
            removed += 1;
        }
        assert_eq!(removed, 3 * 3 + 3);
    }
}
