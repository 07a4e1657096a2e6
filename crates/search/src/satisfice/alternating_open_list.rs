//! Alternating open list: several lists in turns, each sorted by its heuristic value.
//!
//! The search is lazy: the operators applicable in a state inherit its value \[1\]. A list
//! therefore holds states, each with its operators. Lists of preferred operators are boosted after
//! progress.
//!
//! \[1\] M. Helmert: The Fast Downward planning system, JAIR 26, 2006, section 5.

use std::collections::{BTreeMap, VecDeque};

/// Untried operators of a state: a range of the stored steps.
#[derive(Debug, Clone, Copy)]
struct Entry {
    state: u32,
    next: u32,
    end: u32,
}

/// Turns that progress gives to each list of preferred operators.
const PREFERRED_BOOST: i64 = 1_000;

#[derive(Debug)]
struct List<K> {
    buckets: BTreeMap<K, VecDeque<Entry>>,
    /// Number of turns taken. The non-empty list with the fewest comes next.
    turns: i64,
    preferred: bool,
}

/// Open lists for all operators and for preferred ones, each sorted by its own values.
#[derive(Debug)]
pub struct AlternatingOpenList<K> {
    lists: Vec<List<K>>,
    /// Steps of all entries: operators with their designs.
    steps: Vec<u32>,
}

impl<K: Ord> AlternatingOpenList<K> {
    /// Creates one list per item; the item says whether the list holds preferred operators only.
    pub fn new(lists: impl IntoIterator<Item = bool>) -> Self {
        let list = |preferred| List { preferred, buckets: BTreeMap::new(), turns: 0 };
        Self { lists: lists.into_iter().map(list).collect(), steps: Vec::new() }
    }

    /// Adds a state with its value in each list, all of its steps, and its preferred steps.
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
            }
        }
    }

    /// Returns a state and its next untried step.
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
            if entries.is_empty() {
                bucket.remove();
            }
        }
        Some(step)
    }

    /// Approximate memory use in words.
    pub fn size(&self) -> usize {
        self.steps.len() / 2
    }

    /// Gives the lists of preferred operators extra turns after some heuristic has improved.
    pub fn boost(&mut self) {
        for list in self.lists.iter_mut().filter(|list| list.preferred) {
            list.turns = list.turns.saturating_sub(PREFERRED_BOOST);
        }
    }
}
