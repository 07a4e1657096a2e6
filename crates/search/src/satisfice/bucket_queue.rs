//! Bucket queue: a priority queue for items with small integer costs.

/// Items with a cost of at least this number are stored in a heap.
const BUCKET_COUNT: usize = 1 << 16;

/// Monotone bucket queue: every added item must cost at least as much as the item that was removed last.
#[derive(Debug, Default)]
pub struct Queue {
    buckets: Vec<Vec<u32>>,
    /// Number of buckets that may contain items: all later buckets are empty.
    end: usize,
    at: usize,
    /// Number of items of the cheapest bucket that [`Queue::pop_first`] has already returned.
    taken: usize,
    count: usize,
    dear: std::collections::BinaryHeap<std::cmp::Reverse<(u32, u32)>>,
}

impl Queue {
    pub fn clear(&mut self) {
        for bucket in self.buckets.iter_mut().take(self.end) {
            bucket.clear();
        }
        self.end = 0;
        self.dear.clear();
        (self.at, self.taken, self.count) = (0, 0, 0);
    }

    pub fn push(&mut self, cost: u32, item: u32) {
        let place = cost as usize;
        if place >= BUCKET_COUNT {
            self.dear.push(std::cmp::Reverse((cost, item)));
            return;
        }
        if self.buckets.len() <= place {
            self.buckets.resize_with(place.saturating_add(1), Vec::new);
        }
        self.buckets[place].push(item);
        self.end = self.end.max(place.saturating_add(1));
        self.count = self.count.saturating_add(1);
    }

    /// Removes and returns an item with the lowest cost, as (cost, item). Among equal costs, the last item
    /// added comes first; for costs of at least `BUCKET_COUNT`, the smallest item.
    pub(crate) fn pop(&mut self) -> Option<(u32, u32)> {
        if self.count == 0 {
            return self.dear.pop().map(|std::cmp::Reverse(least)| least);
        }
        loop {
            if let Some(item) = self.buckets[self.at].pop() {
                self.count = self.count.saturating_sub(1);
                return Some((task::number::dense(self.at), item));
            }
            self.at = self.at.saturating_add(1);
        }
    }

    /// Removes and returns an item with the lowest cost, as (cost, item). Among equal costs, the first item
    /// added comes first; for costs of at least `BUCKET_COUNT`, the smallest item. A queue must be emptied
    /// either by this method or by `pop`, never by both.
    pub fn pop_first(&mut self) -> Option<(u32, u32)> {
        if self.count == 0 {
            return self.dear.pop().map(|std::cmp::Reverse(least)| least);
        }
        loop {
            if let Some(item) = self.buckets[self.at].get(self.taken) {
                (self.taken, self.count) = (self.taken.saturating_add(1), self.count.saturating_sub(1));
                return Some((task::number::dense(self.at), *item));
            }
            (self.at, self.taken) = (self.at.saturating_add(1), 0);
        }
    }
}
