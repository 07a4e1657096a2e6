//! The numbers of lines: which were seen, and which are too old or too far ahead to tell.
//!
//! Senders count, but lines of several senders with one counter come out of order. So the numbers that were seen are
//! kept, as ranges without holes: one range where nothing is missing. A sender that leaves very many holes makes the
//! oldest ranges be forgotten; of numbers up to there nobody knows any more whether they were seen.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::mapek::answer::Answer;

/// So many ranges are kept.
const RANGES: usize = 256;

/// A number may be so far ahead of the greatest one. Whoever sends what follows the greatest would send nothing any more
/// after a number that is wrong.
const AHEAD: u64 = 1_000_000;

/// The greatest number with which a sender may begin.
const FIRST: u64 = 1 << 62;

/// What a number is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    /// It was not seen.
    New,
    /// It was seen.
    Seen,
    /// It is not above this mark, up to which nobody knows.
    Stale(u64),
    /// It is greater than this, which is the most that can be.
    Ahead(u64),
}

/// The numbers that were seen.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Numbers {
    /// The first number of a range to its last.
    ranges: BTreeMap<u64, u64>,
    /// Up to here ranges were forgotten.
    mark: Option<u64>,
}

impl Numbers {
    /// What a number is.
    fn place(&self, number: u64) -> Place {
        let range = self.ranges.range(..=number).next_back();
        if range.is_some_and(|(_, &last)| number <= last) {
            return Place::Seen;
        }
        let most = self.greatest().map_or(FIRST, |greatest| greatest.saturating_add(AHEAD));
        match self.mark {
            Some(mark) if number <= mark => Place::Stale(mark),
            _ if number > most => Place::Ahead(most),
            _ => Place::New,
        }
    }

    /// The answer to a line with this number that is not taken over, if it is not.
    pub(crate) fn refused(&self, sequence: u64) -> Option<Answer> {
        match self.place(sequence) {
            Place::New => None,
            Place::Seen => Some(Answer::Duplicate { sequence }),
            Place::Stale(mark) => Some(Answer::Stale { sequence, mark }),
            Place::Ahead(most) => {
                let text = format!(
                    "`seq` is {sequence}, but may be {most} at most: numbers grow from line to line, and skip a million at most"
                );
                Some(Answer::Error { code: "M307".to_owned(), message: text })
            }
        }
    }

    /// Notes a number that is new.
    pub(crate) fn insert(&mut self, number: u64) {
        let last = number.checked_add(1).and_then(|next| self.ranges.remove(&next)).unwrap_or(number);
        let before = self.ranges.range_mut(..number).next_back();
        match before.filter(|(_, end)| **end + 1 == number) {
            Some((_, end)) => *end = last,
            None => {
                self.ranges.insert(number, last);
            }
        }
        if self.ranges.len() > RANGES
            && let Some((_, last)) = self.ranges.pop_first()
        {
            self.mark = Some(last);
        }
    }

    /// The greatest number that was seen.
    pub(crate) fn greatest(&self) -> Option<u64> {
        self.ranges.last_key_value().map(|(_, last)| *last)
    }

    /// The numbers that are missing between those that were seen, as ranges with both ends.
    pub(crate) fn missing(&self) -> Vec<[u64; 2]> {
        let ends = self.ranges.values().map(|last| last + 1);
        let starts = self.ranges.keys().skip(1).map(|first| first - 1);
        ends.zip(starts).map(|(from, to)| [from, to]).collect()
    }

    /// For a snapshot.
    pub(crate) fn to_record(&self) -> Value {
        json!([self.mark, self.ranges.iter().collect::<Vec<_>>()])
    }

    /// The inverse of [`Numbers::to_record`].
    pub(crate) fn from_record(record: &Value) -> Option<Self> {
        let range = |pair: &Value| Some((pair.get(0)?.as_u64()?, pair.get(1)?.as_u64()?));
        let ranges = record.get(1)?.as_array()?.iter().map(range).collect::<Option<_>>()?;
        Some(Self { ranges, mark: record.get(0)?.as_u64() })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::{AHEAD, FIRST, Numbers, Place, RANGES};

    #[test]
    fn a_number_that_was_never_seen_is_never_seen() {
        let mut random = fastrand::Rng::with_seed(5);
        for spread in [2, 40, 3000] {
            let (mut numbers, mut seen) = (Numbers::default(), BTreeSet::new());
            let mut base = 1000;
            for _ in 0..5000 {
                base += random.u64(..spread);
                let number = base.saturating_sub(random.u64(..4 * spread));
                match numbers.place(number) {
                    Place::New => {
                        assert!(seen.insert(number), "{number}");
                        numbers.insert(number);
                    }
                    Place::Seen => assert!(seen.contains(&number), "{number}"),
                    Place::Stale(mark) => assert!(number <= mark && seen.len() > RANGES, "{number}"),
                    Place::Ahead(most) => assert!(number > most, "{number}"),
                }
                assert_eq!(numbers.greatest(), seen.last().copied());
                assert!(numbers.ranges.len() <= RANGES);
                let record = numbers.to_record();
                assert_eq!(Numbers::from_record(&record).as_ref(), Some(&numbers));
            }
        }
    }

    #[test]
    fn a_number_is_not_far_ahead() {
        let mut numbers = Numbers::default();
        assert_eq!(numbers.place(u64::MAX), Place::Ahead(FIRST));
        numbers.insert(5);
        assert_eq!(numbers.place(u64::MAX), Place::Ahead(5 + AHEAD));
        assert_eq!(numbers.place(5 + AHEAD), Place::New);
        assert_eq!(numbers.place(4), Place::New);
        numbers.insert(4);
        numbers.insert(6);
        assert_eq!(numbers.to_record().to_string(), "[null,[[4,6]]]");
        assert!(numbers.missing().is_empty());
        for number in [9, 12, 10] {
            numbers.insert(number);
        }
        assert_eq!(numbers.missing(), [[7, 8], [11, 11]]);
    }
}
