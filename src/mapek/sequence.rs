//! Duplicate detection by the sequence numbers of input lines.
//!
//! Lines of several senders that share a counter can arrive out of order. Therefore, the seen numbers are stored as
//! ranges without gaps; if no line is missing, there is one range. Above [`MAX_RANGES`] ranges, the lowest range is
//! dropped. Numbers up to the end of a dropped range are *stale*: it is unknown whether they were seen.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::mapek::answer::Answer;

const MAX_RANGES: usize = 256;

/// Upper limit on the distance from the greatest seen number to a new number. Numbers further ahead are refused as
/// erroneous.
const MAX_AHEAD: u64 = 1_000_000;

/// Upper limit on the sequence number of the first line.
const MAX_FIRST: u64 = 1 << 62;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Classification {
    New,
    Seen,
    /// The number is at most the given mark, the end of the dropped ranges: it is unknown whether the number was seen.
    Stale(u64),
    Ahead(u64),
}

#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Numbers {
    /// Ranges of seen numbers: maps the first number of each range to the last.
    ranges: BTreeMap<u64, u64>,
    /// Greatest number in the dropped ranges; `None` if no range was dropped.
    mark: Option<u64>,
}

impl Numbers {
    fn classify(&self, number: u64) -> Classification {
        let range = self.ranges.range(..=number).next_back();
        if range.is_some_and(|(_, &last)| number <= last) {
            return Classification::Seen;
        }
        let limit = self.greatest().map_or(MAX_FIRST, |greatest| greatest.saturating_add(MAX_AHEAD));
        match self.mark {
            Some(mark) if number <= mark => Classification::Stale(mark),
            _ if number > limit => Classification::Ahead(limit),
            _ => Classification::New,
        }
    }

    pub(crate) fn refused(&self, sequence: u64) -> Option<Answer> {
        match self.classify(sequence) {
            Classification::New => None,
            Classification::Seen => Some(Answer::Duplicate { sequence }),
            Classification::Stale(mark) => Some(Answer::Stale { sequence, mark }),
            Classification::Ahead(limit) => {
                let text = format!(
                    "`seq` is {sequence}, but may be at most {limit}: numbers increase from line to line by at \
                     most a million"
                );
                Some(Answer::Error { code: "M307".to_owned(), message: text })
            }
        }
    }

    pub(crate) fn insert(&mut self, number: u64) {
        // The number may close the gap to the next range, to the previous range, or both.
        let last = number.checked_add(1).and_then(|next| self.ranges.remove(&next)).unwrap_or(number);
        let before = self.ranges.range_mut(..number).next_back();
        match before.filter(|(_, end)| **end + 1 == number) {
            Some((_, end)) => *end = last,
            None => {
                self.ranges.insert(number, last);
            }
        }
        if self.ranges.len() > MAX_RANGES
            && let Some((_, last)) = self.ranges.pop_first()
        {
            self.mark = Some(last);
        }
    }

    pub(crate) fn greatest(&self) -> Option<u64> {
        self.ranges.last_key_value().map(|(_, last)| *last)
    }

    pub(crate) fn missing(&self) -> Vec<[u64; 2]> {
        let ends = self.ranges.values().map(|last| last + 1);
        let starts = self.ranges.keys().skip(1).map(|first| first - 1);
        ends.zip(starts).map(|(from, to)| [from, to]).collect()
    }

    pub(crate) fn to_record(&self) -> Value {
        json!([self.mark, self.ranges.iter().collect::<Vec<_>>()])
    }

    pub(crate) fn from_record(record: &Value) -> Option<Self> {
        let range = |pair: &Value| Some((pair.get(0)?.as_u64()?, pair.get(1)?.as_u64()?));
        let ranges = record.get(1)?.as_array()?.iter().map(range).collect::<Option<_>>()?;
        Some(Self { ranges, mark: record.get(0)?.as_u64() })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::{Classification, MAX_AHEAD, MAX_FIRST, MAX_RANGES, Numbers};

    #[test]
    fn unseen_numbers_are_never_duplicates() {
        let mut random = fastrand::Rng::with_seed(5);
        for spread in [2, 40, 3000] {
            let (mut numbers, mut seen) = (Numbers::default(), BTreeSet::new());
            let mut base = 1000;
            for _ in 0..5000 {
                base += random.u64(..spread);
                let number = base.saturating_sub(random.u64(..4 * spread));
                match numbers.classify(number) {
                    Classification::New => {
                        assert!(seen.insert(number), "{number}");
                        numbers.insert(number);
                    }
                    Classification::Seen => assert!(seen.contains(&number), "{number}"),
                    Classification::Stale(mark) => {
                        assert!(number <= mark && seen.len() > MAX_RANGES, "{number}");
                    }
                    Classification::Ahead(limit) => assert!(number > limit, "{number}"),
                }
                assert_eq!(numbers.greatest(), seen.last().copied());
                assert!(numbers.ranges.len() <= MAX_RANGES);
                let record = numbers.to_record();
                assert_eq!(Numbers::from_record(&record).as_ref(), Some(&numbers));
            }
        }
    }

    #[test]
    fn numbers_far_ahead_are_refused() {
        let mut numbers = Numbers::default();
        assert_eq!(numbers.classify(u64::MAX), Classification::Ahead(MAX_FIRST));
        numbers.insert(5);
        assert_eq!(numbers.classify(u64::MAX), Classification::Ahead(5 + MAX_AHEAD));
        assert_eq!(numbers.classify(5 + MAX_AHEAD), Classification::New);
        assert_eq!(numbers.classify(4), Classification::New);
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
