//! Novelty of states \[1\], as a criterion of an open list \[2\].
//!
//! A state is novel if it has a fact that no earlier state of its partition has. States with the same values
//! of both heuristics form a partition. Novel states are expanded first, so the search leaves plateaus in
//! directions that it has not explored. Numbers are ignored. Only novelty 1 is distinguished, because novelty 2
//! would require tables of pairs of facts.
//!
//! - \[1\] N. Lipovetzky, H. Geffner: Best-first width search: exploration and exploitation in classical
//!   planning, AAAI 2017.
//! - \[2\] A. B. Corrêa, J. Seipp: Alternation-based novelty search, ICAPS 2025.

use std::collections::hash_map::Entry;

use rustc_hash::FxHashMap;

use crate::satisfice::delete_relaxation::Proposition;

pub(super) struct NoveltyTable {
    stride: usize,
    positions: FxHashMap<(u32, u32), usize>,
    seen: Vec<u64>,
}

impl NoveltyTable {
    pub(super) fn new(propositions: usize) -> Self {
        Self { stride: propositions.div_ceil(64), positions: FxHashMap::default(), seen: Vec::new() }
    }

    /// Adds the facts of a state to its partition. Returns `true` if the state is novel, i.e. if a fact was
    /// not in the partition before.
    pub(super) fn add(
        &mut self,
        partition: (u32, u32),
        facts: impl IntoIterator<Item = Proposition>,
    ) -> bool {
        let position = match self.positions.entry(partition) {
            Entry::Occupied(entry) => *entry.get(),
            Entry::Vacant(entry) => {
                let position = self.seen.len();
                self.seen.resize(position.saturating_add(self.stride), 0);
                *entry.insert(position)
            }
        };
        let bits = &mut self.seen[position..position.saturating_add(self.stride)];
        let mut is_novel = false;
        for fact in facts {
            let (word, bit) = (&mut bits[(fact >> 6) as usize], 1 << (fact & 63));
            is_novel |= *word & bit == 0;
            *word |= bit;
        }
        is_novel
    }

    /// Returns the approximate memory use in 64-bit words.
    pub(super) fn size(&self) -> usize {
        self.seen.len().saturating_add(self.positions.len().saturating_mul(4))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::random::Random;

    #[test]
    fn a_state_is_novel_if_no_earlier_state_of_its_partition_has_one_of_its_facts() {
        let mut random = Random(1);
        for propositions in [1, 5, 64, 65, 130] {
            let mut table = NoveltyTable::new(propositions);
            let mut states: Vec<((u32, u32), Vec<Proposition>)> = Vec::new();
            let mut counts = [0, 0];
            for _ in 0..200 {
                let mut number = |limit: usize| task::number::dense(random.below(limit));
                let partition = (number(2), number(2));
                let facts: Vec<Proposition> = (0..number(4)).map(|_| number(propositions)).collect();
                let earlier = states.iter().filter(|(other, _)| *other == partition);
                let earlier: BTreeSet<&Proposition> = earlier.flat_map(|(_, facts)| facts).collect();
                let is_novel = facts.iter().any(|fact| !earlier.contains(fact));
                assert_eq!(table.add(partition, facts.iter().copied()), is_novel, "{facts:?} {partition:?}");
                counts[usize::from(is_novel)] += 1;
                states.push((partition, facts));
            }
            assert!(counts.iter().all(|count| *count > 0), "{counts:?}");
        }
    }
}
