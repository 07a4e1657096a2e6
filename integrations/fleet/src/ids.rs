//! Message ids of a robot's decided events, by which repeated messages are recognised without a
//! time limit. The servers recognise repetitions only for some minutes.
//!
//! An id is a text followed by a number, as in `ugv-1:17` and `ugv-1:7f3a.17`. For each text, the
//! numbers are stored as ranges; numbers that grow by one are a single range. If there are more
//! ranges than `MAX_RANGES`, the lowest ones count as one range. Only the `MAX_SESSIONS` texts with
//! the latest insertions are kept.

use serde::{Deserialize, Serialize};

const MAX_SESSIONS: usize = 16;

const MAX_RANGES: usize = 16;

const MAX_LENGTH: usize = 128;

/// Approximate set of message ids. It forgets the texts whose last insertion is longest ago, and
/// also contains the numbers between merged ranges.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ids(Vec<Session>);

/// Inclusive ranges of the numbers that follow a text, in ascending order.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Session(String, Vec<(u64, u64)>);

impl Ids {
    /// Returns `true` if no id is stored.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns `true` if the id was inserted and is not forgotten, or if its number lies between
    /// merged ranges.
    pub fn contains(&self, id: &str) -> bool {
        let (text, number) = split(id);
        let session = self.0.iter().find(|session| session.0 == text);
        session.is_some_and(|Session(_, ranges)| {
            ranges.iter().any(|(first, last)| (*first..=*last).contains(&number))
        })
    }

    /// Adds an id, if there is one.
    pub fn extend(&mut self, id: Option<&str>) {
        if let Some(id) = id {
            self.insert(id);
        }
    }

    /// Adds an id, unless its text is longer than 128 bytes.
    pub fn insert(&mut self, id: &str) {
        let (text, number) = split(id);
        if text.len() > MAX_LENGTH {
            return;
        }
        let position = self.0.iter().position(|session| session.0 == text);
        let mut session = match position {
            Some(position) => self.0.remove(position),
            None => Session(text.to_owned(), Vec::new()),
        };
        add(&mut session.1, number);
        self.0.push(session);
        if self.0.len() > MAX_SESSIONS {
            self.0.remove(0);
        }
    }
}

/// Splits an id into a text and the number at its end (up to 19 digits). Leading zeros belong to the text. The number
/// of an id without digits at its end is [`u64::MAX`], which is greater than all others.
fn split(id: &str) -> (&str, u64) {
    let digits = id.len() - id.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    // A number of 19 digits has 64 bits at most.
    let mut start = id.len() - digits.min(19);
    while id.len() - start > 1 && id.as_bytes()[start] == b'0' {
        start += 1;
    }
    match id[start..].parse() {
        Ok(number) => (&id[..start], number),
        Err(_) => (id, u64::MAX),
    }
}

fn add(ranges: &mut Vec<(u64, u64)>, number: u64) {
    let position = ranges.partition_point(|(_, last)| *last < number);
    if ranges.get(position).is_some_and(|(first, _)| *first <= number) {
        return;
    }
    ranges.insert(position, (number, number));
    // If a range follows, `number` is less than its first number, so `number + 1` cannot overflow.
    if ranges.get(position + 1).is_some_and(|(first, _)| *first == number + 1) {
        ranges[position].1 = ranges.remove(position + 1).1;
    }
    if position > 0 && ranges[position - 1].1 + 1 == number {
        ranges[position - 1].1 = ranges.remove(position).1;
    }
    if ranges.len() > MAX_RANGES {
        let first = ranges.remove(0).0;
        ranges[0].0 = first;
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn different_ids_are_split_differently() {
        let ids = ["r:7", "r:07", "r:007", "r:", "r:0", "r:00", "r:a", "r:1:1", "r:11", "7", "", "r:ü7"];
        let long = ["r:12345678901234567890", "r:99999999999999999999", "r:18446744073709551616"];
        let mut ids: Vec<&str> = ids.into_iter().chain(long).collect();
        ids.sort_unstable();
        let parts: BTreeSet<(&str, u64)> = ids.iter().map(|id| split(id)).collect();
        assert_eq!(parts.len(), ids.len(), "{parts:?}");
        assert_eq!(split("r:7f3a.17"), ("r:7f3a.", 17));
    }

    #[test]
    fn growing_numbers_are_remembered_in_one_range() {
        let mut ids = Ids::default();
        for number in 1..=100_000 {
            let id = format!("r:s.{number}");
            assert!(!ids.contains(&id));
            ids.insert(&id);
        }
        assert_eq!(serde_json::to_string(&ids).expect("plain data"), r#"[["r:s.",[[1,100000]]]]"#);
        assert!(ids.contains("r:s.1") && ids.contains("r:s.99999") && !ids.contains("r:s.100001"));
        assert!(!ids.contains("r:t.1"));
    }

    #[test]
    fn memory_is_bounded_and_new_numbers_are_never_duplicates() {
        let mut random = fastrand::Rng::with_seed(3);
        let (mut ids, mut seen) = (Ids::default(), BTreeSet::new());
        let mut base = 100;
        for _ in 0..20_000 {
            base += random.u64(0..3);
            // Within the ranges that are kept apart, numbers can arrive in any order.
            let number = base - random.u64(0..4);
            let id = format!("r:{number}");
            assert_eq!(ids.contains(&id), !seen.insert(number), "{number}");
            ids.insert(&id);
            assert!(ids.0[0].1.len() <= MAX_RANGES);
            assert!(ids.0[0].1.windows(2).all(|pair| pair[0].1 + 1 < pair[1].0), "{ids:?}");
        }
        for session in 0..100 {
            ids.insert(&format!("r:{session}.1"));
        }
        assert_eq!(ids.0.len(), MAX_SESSIONS);
        assert!(ids.contains("r:99.1") && !ids.contains("r:83.1"));
        ids.insert(&"x".repeat(1000));
        assert_eq!(ids.0.len(), MAX_SESSIONS);
    }
}
