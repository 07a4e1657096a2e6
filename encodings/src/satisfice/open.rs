//! What is still to be tried: several lists that take turns, each the most promising first.
//!
//! All operators that are applicable in a state have its estimate, as states are looked at only when it is their turn [1]; so a
//! list holds states, each with its operators. Lists of preferred operators get more turns when there is progress.
//!
//! [1] M. Helmert: The Fast Downward planning system, JAIR 26, 2006, section 5.

use std::collections::{BTreeMap, VecDeque};

/// Operators of a state that are still to be tried: a part of all that were noted.
#[derive(Debug, Clone, Copy)]
struct Entry {
    state: u32,
    next: u32,
    end: u32,
}

/// Turns that progress brings to lists of preferred operators.
const BOOST: i64 = 1_000;

#[derive(Debug, Default)]
struct List {
    buckets: BTreeMap<u64, VecDeque<Entry>>,
    /// The list with the least has its turn.
    turns: i64,
    preferred: bool,
}

/// Lists by several estimates, of all operators and of preferred ones.
#[derive(Debug, Default)]
pub(super) struct Open {
    lists: Vec<List>,
    /// Operators, with their designs, of entries.
    steps: Vec<u32>,
}

impl Open {
    /// Lists for so many estimates.
    pub(super) fn new(estimates: usize) -> Self {
        let list = |preferred| List { preferred, ..List::default() };
        let lists = (0..estimates).flat_map(|_| [list(false), list(true)]).collect();
        Self { lists, steps: Vec::new() }
    }

    /// Notes a state: its value by each estimate, all of its steps, and those that are preferred.
    pub(super) fn push(&mut self, state: u32, values: &[u64], steps: &[u32], preferred: &[u32]) {
        for (own, is_preferred) in [(steps, false), (preferred, true)] {
            if own.is_empty() {
                continue;
            }
            let next = crate::number::dense(self.steps.len());
            self.steps.extend_from_slice(own);
            let end = crate::number::dense(self.steps.len());
            let lists = self.lists.iter_mut().filter(|list| list.preferred == is_preferred);
            for (list, value) in lists.zip(values) {
                list.buckets.entry(*value).or_default().push_back(Entry { state, next, end });
            }
        }
    }

    /// A state and the step to be tried next.
    pub(super) fn pop(&mut self) -> Option<(u32, u32)> {
        let waiting = self.lists.iter_mut().filter(|list| !list.buckets.is_empty());
        let list = waiting.min_by_key(|list| list.turns)?;
        list.turns = list.turns.saturating_add(1);
        let mut bucket = list.buckets.first_entry()?;
        let entries = bucket.get_mut();
        let entry = entries.front_mut()?;
        let found = (entry.state, self.steps[entry.next as usize]);
        entry.next = entry.next.saturating_add(1);
        if entry.next == entry.end {
            entries.pop_front();
            if entries.is_empty() {
                bucket.remove();
            }
        }
        Some(found)
    }

    /// Words that all that was noted occupies, about.
    pub(super) fn size(&self) -> usize {
        self.steps.len() / 2
    }

    /// There is progress by some estimate.
    pub(super) fn boost(&mut self) {
        for list in self.lists.iter_mut().filter(|list| list.preferred) {
            list.turns = list.turns.saturating_sub(BOOST);
        }
    }
}
