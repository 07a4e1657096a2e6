//! Packs a simple temporal network into bytes and unpacks it.

use smallvec::SmallVec;
use task::number::{Int, dense};

use crate::concurrent::simple_temporal_network::{RunningAction, SimpleTemporalNetwork, Start};
use crate::concurrent::time::TimeExpression;
use crate::concurrent::time_number::TimeNumber;

#[derive(Default)]
struct Writer(Vec<u8>);

struct Reader<'a>(std::iter::Copied<std::slice::Iter<'a, u8>>);

impl Writer {
    fn number<T: TimeNumber>(&mut self, number: T) {
        number.write(&mut self.0);
    }

    fn index(&mut self, index: u32) {
        self.number(Int::from(index));
    }

    fn length(&mut self, length: usize) {
        self.index(dense(length));
    }

    fn time<T: TimeNumber>(&mut self, time: &TimeExpression<T>) {
        self.number(time.base);
        self.length(time.lags.len());
        for (float, lag) in &time.lags {
            self.index(*float);
            self.number(*lag);
        }
    }

    fn maybe<I>(&mut self, item: Option<I>, write: impl FnOnce(&mut Self, I)) {
        self.length(usize::from(item.is_some()));
        if let Some(item) = item {
            write(self, item);
        }
    }
}

impl Reader<'_> {
    fn number<T: TimeNumber>(&mut self) -> T {
        T::read(&mut self.0)
    }

    fn index(&mut self) -> u32 {
        u32::try_from(self.number::<Int>()).expect("invariant: an index was written")
    }

    fn list<I>(&mut self, mut read: impl FnMut(&mut Self) -> I) -> Vec<I> {
        (0..self.index()).map(|_| read(self)).collect()
    }

    fn time<T: TimeNumber>(&mut self) -> TimeExpression<T> {
        let base = self.number();
        let lags: SmallVec<_> = (0..self.index()).map(|_| (self.index(), self.number())).collect();
        TimeExpression { base, lags }
    }

    fn maybe<I>(&mut self, read: impl FnOnce(&mut Self) -> I) -> Option<I> {
        (self.index() > 0).then(|| read(self))
    }
}

impl<T: TimeNumber> SimpleTemporalNetwork<T> {
    pub(in crate::concurrent) fn pack(&self) -> Box<[u8]> {
        let mut writer = Writer::default();
        writer.number(self.floor);
        writer.time(&self.latest);
        writer.length(self.floats.len());
        for Start { lower, upper } in &self.floats {
            writer.time(lower);
            writer.maybe(Some(*upper).filter(|upper| *upper < T::MAX), Writer::number);
        }
        writer.length(self.opens.len());
        for open in &self.opens {
            writer.index(open.instance);
            writer.index(open.float);
            writer.number(open.offset);
            writer.number(open.duration);
            writer.maybe(open.last.as_ref(), Writer::time);
        }
        writer.maybe(self.group, |writer, (float, offset)| {
            writer.index(float);
            writer.number(offset);
        });
        for list in [&self.entries, &self.changed] {
            writer.length(list.len());
            for (key, time) in list {
                writer.index(*key);
                writer.time(time);
            }
        }
        writer.0.into_boxed_slice()
    }

    pub(in crate::concurrent) fn unpack(bytes: &[u8]) -> Self {
        let mut packed = Self::unpack_head(bytes);
        packed.finish();
        packed.clocks
    }

    /// Unpacks only the head: all parts except the times of accesses and changes.
    /// [`SimpleTemporalNetwork::dominates_ignoring_accesses`] reads only the head, which is small
    /// and decides most comparisons.
    pub(in crate::concurrent) fn unpack_head(bytes: &[u8]) -> PackedStn<'_, T> {
        let mut reader = Reader(bytes.iter().copied());
        let (floor, latest) = (reader.number(), reader.time());
        let floats = reader.list(|reader| {
            let lower = reader.time();
            Start { lower, upper: reader.maybe(Reader::number).unwrap_or(T::MAX) }
        });
        let opens = reader.list(|reader| {
            let (instance, float) = (reader.index(), reader.index());
            let (offset, duration) = (reader.number(), reader.number());
            RunningAction { instance, float, offset, duration, last: reader.maybe(Reader::time) }
        });
        let group = reader.maybe(|reader| (reader.index(), reader.number()));
        let (entries, changed) = (Vec::new(), Vec::new());
        PackedStn { clocks: Self { entries, changed, floats, opens, group, latest, floor }, rest: reader }
    }
}

pub(in crate::concurrent) struct PackedStn<'a, T: TimeNumber = Int> {
    pub(in crate::concurrent) clocks: SimpleTemporalNetwork<T>,
    rest: Reader<'a>,
}

impl<T: TimeNumber> PackedStn<'_, T> {
    pub(in crate::concurrent) fn finish(&mut self) {
        let reader = &mut self.rest;
        let mut times = || reader.list(|times| (times.index(), times.time()));
        (self.clocks.entries, self.clocks.changed) = (times(), times());
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn time() -> impl Strategy<Value = TimeExpression> {
        let lags = proptest::collection::vec((0_u32..9, -(1_i128 << 91)..1 << 91), 0..3);
        (-1..1_i128 << 100, lags).prop_map(|(base, lags)| TimeExpression { base, lags: lags.into() })
    }

    proptest! {
        #[test]
        fn packing_and_unpacking_preserves_a_network(
            entries in proptest::collection::vec((any::<u32>(), time()), 0..4),
            changed in proptest::collection::vec((any::<u32>(), time()), 0..4),
            floats in proptest::collection::vec((time(), prop_oneof![Just(Int::MAX), -9_i128..1 << 99]), 0..3),
            opens in proptest::collection::vec((any::<u32>(), 0_u32..9, -9_i128..1 << 99, proptest::option::of(time())), 0..3),
            group in proptest::option::of((0_u32..9, -9_i128..1 << 99)),
            latest in time(),
            floor in -1_i128..1 << 99,
        ) {
            let floats = floats.into_iter().map(|(lower, upper)| Start { lower, upper }).collect();
            let opens = opens.into_iter().map(|(instance, float, offset, last)| {
                RunningAction { instance, float, offset, duration: offset ^ 5, last }
            });
            let clocks = SimpleTemporalNetwork { entries, changed, floats, opens: opens.collect(), group, latest, floor };
            let unpacked = SimpleTemporalNetwork::<Int>::unpack(&clocks.pack());
            prop_assert_eq!(format!("{unpacked:?}"), format!("{clocks:?}"));
        }
    }
}
