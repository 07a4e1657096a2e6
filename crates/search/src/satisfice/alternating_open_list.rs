//! Alternating open list: several lists in turns, each sorted by its heuristic value.
//!
//! The search is lazy: the operators applicable in a state inherit its value \[1\]. A list therefore holds states,
//! each with its operators. Lists of preferred operators are boosted after progress.
//!
//! \[1\] M. Helmert: The Fast Downward planning system, JAIR 26, 2006, section 5.

use std::collections::{BTreeMap, VecDeque};

/// Operators of a state that are still to be tried: a part of all that were noted.
#[derive(Debug, Clone, Copy)]
struct Entry {
    state: u32,
    next: u32,
    end: u32,
}

/// Turns that progress brings to lists of preferred operators.
const PREFERRED_BOOST: i64 = 1_000;

#[derive(Debug)]
struct List<K> {
    buckets: BTreeMap<K, VecDeque<Entry>>,
    /// The list with the least has its turn.
    turns: i64,
    preferred: bool,
}

/// Lists of all operators and of preferred ones, each in the order of its own values.
#[derive(Debug)]
pub struct AlternatingOpenList<K> {
    lists: Vec<List<K>>,
    /// Operators, with their designs, of entries.
    steps: Vec<u32>,
}

impl<K: Ord> AlternatingOpenList<K> {
    /// A list for each of these: whether it is of preferred operators.
    pub fn new(lists: impl IntoIterator<Item = bool>) -> Self {
        let list = |preferred| List { preferred, buckets: BTreeMap::new(), turns: 0 };
        Self { lists: lists.into_iter().map(list).collect(), steps: Vec::new() }
    }

    /// Notes a state: its value in each list, all of its steps, and those that are preferred.
    pub fn push(
        &mut self,
        state: u32,
        values: impl IntoIterator<Item = K>,
        steps: &[u32],
        preferred: &[u32],
    ) {
        let [all, preferred] = [steps, preferred].map(|own| {
            let next = task::number::dense(self.steps.len());
            self.steps.extend_from_slice(own);
            Entry { state, next, end: task::number::dense(self.steps.len()) }
        });
        for (list, value) in self.lists.iter_mut().zip(values) {
            let entry = if list.preferred { preferred } else { all };
            if entry.next < entry.end {
                list.buckets.entry(value).or_default().push_back(entry);
            }
        }
    }

    /// A state and the step to be tried next.
    pub fn pop(&mut self) -> Option<(u32, u32)> {
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
    pub fn size(&self) -> usize {
        self.steps.len() / 2
    }

    /// There is progress by some estimate.
    pub fn boost(&mut self) {
        for list in self.lists.iter_mut().filter(|list| list.preferred) {
            list.turns = list.turns.saturating_sub(PREFERRED_BOOST);
        }
    }
}
