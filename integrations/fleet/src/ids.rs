//! Message ids of a robot's decided events, by which repeated messages are recognised without a
//! time limit. The servers recognise repetitions only for some minutes.
//!
//! An id is a text followed by a number, as in `ugv-1:17` and `ugv-1:7f3a.17`. For each text, the numbers are stored as
//! ranges; numbers that grow by one are a single range. A text that is longer than `MAX_LENGTH` is stored as its SHA-256
//! digest. Only the `MAX_SESSIONS` texts with the latest insertions are kept.
//!
//! If there are more ranges than `MAX_RANGES`, the two lowest ones are merged. The merged range also contains numbers
//! that were not inserted. So an event with such a number may have been decided, and must not be decided (again).

use std::borrow::Cow;

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

const MAX_SESSIONS: usize = 16;

const MAX_RANGES: usize = 16;

const MAX_LENGTH: usize = 128;

/// Set of message ids. Texts without recent insertions are dropped, and low numbers are merged.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ids(Vec<Session>);

/// Membership of an id in [`Ids`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Membership {
    /// The id was not inserted, or was dropped with its text.
    Absent,
    /// The id was inserted.
    Present,
    /// The number lies in a merged range, so the id may have been inserted.
    Unclear,
}

/// The text before the numbers of ids, the inclusive ranges of the inserted numbers in ascending order, and the merged
/// range. The merged range can also contain numbers that were not inserted.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Session(
    String,
    Vec<(u64, u64)>,
    #[serde(default, skip_serializing_if = "Option::is_none")] Option<(u64, u64)>,
);

impl Session {
    fn membership(&self, number: u64) -> Membership {
        let contains = |(first, last): &(u64, u64)| (*first..=*last).contains(&number);
        match self {
            Self(_, ranges, _) if ranges.iter().any(contains) => Membership::Present,
            Self(_, _, Some(merged)) if contains(merged) => Membership::Unclear,
            _ => Membership::Absent,
        }
    }

    fn insert(&mut self, number: u64) {
        if self.membership(number) != Membership::Absent {
            return;
        }
        let Self(_, ranges, merged) = self;
        let position = ranges.partition_point(|(_, last)| *last < number);
        ranges.insert(position, (number, number));
        // If a range follows, `number` is less than its first number, so `number + 1` cannot overflow.
        if ranges.get(position + 1).is_some_and(|(first, _)| *first == number + 1) {
            ranges[position].1 = ranges.remove(position + 1).1;
        }
        if position > 0 && ranges[position - 1].1 + 1 == number {
            ranges[position - 1].1 = ranges.remove(position).1;
        }
        if ranges.len() > MAX_RANGES {
            let lowest = ranges.remove(0);
            let second = merged.unwrap_or_else(|| ranges.remove(0));
            *merged = Some((lowest.0.min(second.0), lowest.1.max(second.1)));
        }
    }
}

impl Ids {
    /// Returns `true` if no id is stored.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the membership of an id.
    pub fn membership(&self, id: &str) -> Membership {
        let (text, number) = split(id);
        let text = stored_text(text);
        let session = self.0.iter().find(|session| session.0 == text);
        session.map_or(Membership::Absent, |session| session.membership(number))
    }

    /// Adds an id.
    pub fn insert(&mut self, id: &str) {
        let (text, number) = split(id);
        let text = stored_text(text);
        let position = self.0.iter().position(|session| session.0 == text);
        let session = position.map(|position| self.0.remove(position));
        let mut session = session.unwrap_or_else(|| Session(text.into_owned(), Vec::new(), None));
        session.insert(number);
        self.0.push(session);
        if self.0.len() > MAX_SESSIONS {
            self.0.remove(0);
        }
    }
}

/// Returns a short text as it is, and the digest of a longer one. Ids of robots do not begin with `#`.
fn stored_text(text: &str) -> Cow<'_, str> {
    if text.len() > MAX_LENGTH { format!("#{:x}", Sha256::digest(text)).into() } else { text.into() }
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
    fn growing_numbers_are_one_range_in_the_last_sessions() {
        let mut ids = Ids::default();
        for number in 1..=100_000 {
            ids.insert(&format!("r:s.{number}"));
        }
        assert_eq!(serde_json::to_string(&ids).expect("plain data"), r#"[["r:s.",[[1,100000]]]]"#);
        for session in 0..100 {
            ids.insert(&format!("r:{session}.1"));
        }
        assert_eq!(ids.0.len(), MAX_SESSIONS);
        assert_eq!(ids.membership("r:84.1"), Membership::Present);
        assert_eq!(ids.membership("r:83.1"), Membership::Absent);
    }

    #[test]
    fn the_two_lowest_ranges_are_merged_and_stored_after_the_others() {
        use Membership::{Absent, Present, Unclear};
        let mut ids = Ids::default();
        // 17 ranges, of which the two lowest ones are merged to 10..=12.
        for number in (10..=42).step_by(2) {
            ids.insert(&format!("r:{number}"));
        }
        let stored = serde_json::to_string(&ids).expect("plain data");
        assert!(stored.ends_with(",[42,42]],[10,12]]]"), "{stored}");
        for (number, expected) in [(9, Absent), (11, Unclear), (13, Absent), (14, Present), (42, Present)] {
            assert_eq!(ids.membership(&format!("r:{number}")), expected, "{number}");
        }
    }

    /// Compares with the set of all inserted numbers.
    #[test]
    fn inserted_numbers_are_present_or_lie_in_the_merged_range() {
        let mut random = fastrand::Rng::with_seed(3);
        // Within the ranges that are kept apart, numbers can arrive in any order.
        for (step, distance, may_be_unclear) in [(3, 4, false), (10, 400, true), (100, 5000, true)] {
            let (mut ids, mut inserted, mut base) = (Ids::default(), BTreeSet::new(), 10_000);
            let mut unclear = 0;
            for _ in 0..5_000 {
                base += random.u64(..step);
                let number = base - random.u64(..distance);
                let id = format!("r:{number}");
                match ids.membership(&id) {
                    Membership::Absent => assert!(inserted.insert(number), "{number}"),
                    Membership::Present => assert!(inserted.contains(&number), "{number}"),
                    Membership::Unclear => unclear += 1,
                }
                ids.insert(&id);
                let stored = serde_json::to_string(&ids).expect("plain data");
                assert_eq!(serde_json::from_str::<Ids>(&stored).expect("it is stored so"), ids);
                let Session(_, ranges, merged) = &ids.0[0];
                assert!(
                    ranges.len() <= MAX_RANGES && ranges.windows(2).all(|pair| pair[0].1 + 1 < pair[1].0)
                );
                let mut ends = merged.iter().chain(ranges).flat_map(|(first, last)| [first, last]);
                assert!(ends.all(|end| inserted.contains(end)), "{ids:?}");
                assert_eq!(
                    ids.membership("r:1"),
                    Membership::Absent,
                    "it is less than all that were inserted"
                );
            }
            assert_eq!(unclear > 0, may_be_unclear);
        }
    }

    #[test]
    fn long_texts_are_stored_as_digests() {
        let mut ids = Ids::default();
        let texts = ["x".repeat(1000), "x".repeat(1001), "y".repeat(1000)];
        ids.insert(&format!("{}7", texts[0]));
        let stored = serde_json::to_string(&ids).expect("plain data");
        assert!(stored.len() < 100, "{stored}");
        let ids: Ids = serde_json::from_str(&stored).expect("it is stored so");
        let is_present =
            |text: &str, number: u64| ids.membership(&format!("{text}{number}")) == Membership::Present;
        let contained = texts.map(|text| [7, 8].map(|number| is_present(&text, number)));
        assert_eq!(contained, [[true, false], [false, false], [false, false]]);
    }
}
