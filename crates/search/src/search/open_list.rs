//! Open list of a best-first search: one bucket for each key. Nodes with the smallest key are popped first;
//! among nodes of one bucket, the node that was added last.

use std::collections::BTreeMap;

pub(super) struct OpenList<K> {
    buckets: BTreeMap<K, Vec<u32>>,
    length: usize,
}

impl<K: Ord + Clone> OpenList<K> {
    pub(super) fn new() -> Self {
        Self { buckets: BTreeMap::new(), length: 0 }
    }

    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    pub(super) fn push(&mut self, key: K, node: u32) {
        self.buckets.entry(key).or_default().push(node);
        self.length += 1;
    }

    #[expect(clippy::arithmetic_side_effects, reason = "nothing is taken that was not counted")]
    pub(super) fn pop(&mut self) -> Option<(K, u32)> {
        loop {
            let mut first = self.buckets.first_entry()?;
            if let Some(node) = first.get_mut().pop() {
                self.length -= 1;
                return Some((first.key().clone(), node));
            }
            first.remove();
        }
    }

    pub(super) fn bytes(&self) -> usize {
        let nodes = self.length.saturating_mul(size_of::<u32>());
        nodes.saturating_add(self.buckets.len().saturating_mul(size_of::<(K, Vec<u32>)>()))
    }
}
