//! Bucket queue: numbers sorted by small integer costs.

/// Costs from here on are kept together, in no order but that of their costs once it is their turn.
const BUCKET_COUNT: usize = 1 << 16;

/// Numbers in buckets by cost. What is put in while it is emptied costs no less than what was taken out last.
#[derive(Debug, Default)]
pub struct Queue {
    buckets: Vec<Vec<u32>>,
    at: usize,
    /// How many of the cheapest bucket [`Queue::pop_first`] has taken.
    taken: usize,
    /// How many are in buckets.
    count: usize,
    dear: std::collections::BinaryHeap<std::cmp::Reverse<(u32, u32)>>,
}

impl Queue {
    pub fn clear(&mut self) {
        for bucket in &mut self.buckets {
            bucket.clear();
        }
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
        self.count = self.count.saturating_add(1);
    }

    /// One of the cheapest, those that came last first.
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

    /// One of the cheapest, those that came first first. A queue is emptied by this or by `pop`, never by both.
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
