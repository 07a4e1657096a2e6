//! Interference constraints between happenings, computed from their read and write sets.

use indexmap::IndexMap;
use rustc_hash::{FxBuildHasher, FxHashSet};
use task::ground::vocabulary::atom::AtomId;
use task::lifted::ObjectId;
use task::number::{Int, dense};
use task::task::quantity::NumericId;

use crate::concurrent::footprint::{Footprint, Way};
use crate::concurrent::simple_temporal_network::Key;
use crate::concurrent::time_number::TimeNumber;

/// Kind of access to an atom or number, or use of a design for a function. Each value has a
/// [`Key`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Access {
    Read(AtomId),
    Added(AtomId),
    Deleted(AtomId),
    Held(AtomId),
    ReadNumber(NumericId),
    Changed(NumericId, Way),
    HeldNumber(NumericId),
    /// An action with duration used the function (first) with the design (second).
    Used(ObjectId, ObjectId),
    /// An instantaneous happening used the function (first) with the design (second).
    UsedAtOnce(ObjectId, ObjectId),
}

/// Earlier accesses that constrain a happening (`after`), each with the least distance in time, and
/// the accesses that the happening itself makes (`marks`).
#[derive(Debug, Clone, Default)]
pub(super) struct InterferenceConstraints<T: TimeNumber = Int> {
    pub(super) after: Vec<(Key, T)>,
    pub(super) marks: Vec<Key>,
}

/// Pairs of a function that an action requires and the design that the action uses for the
/// function.
pub(super) type Designs = Vec<(ObjectId, ObjectId)>;

pub(super) struct Keys<T: TimeNumber = Int> {
    known: IndexMap<Access, (), FxBuildHasher>,
    separation: T,
    designs: FxHashSet<(ObjectId, ObjectId)>,
}

impl<T: TimeNumber> Keys<T> {
    pub(super) fn new(separation: T, designs: FxHashSet<(ObjectId, ObjectId)>) -> Self {
        Self { known: IndexMap::default(), separation, designs }
    }

    pub(super) fn len(&self) -> usize {
        self.known.len()
    }

    fn key(&mut self, access: Access) -> Key {
        dense(self.known.insert_full(access, ()).0)
    }

    pub(super) fn of(&mut self, footprint: &Footprint) -> InterferenceConstraints<T> {
        use Access::{Added, Changed, Deleted, Held, HeldNumber, Read, ReadNumber};
        let mut collector = InterferenceCollector::default();
        for atom in &footprint.reads {
            collector.interferes(&[Added(*atom), Deleted(*atom)], Read(*atom));
        }
        for atom in &footprint.added {
            collector.interferes(&[Read(*atom), Deleted(*atom)], Added(*atom));
            collector.not_before.push(Held(*atom));
        }
        for atom in &footprint.deleted {
            collector.interferes(&[Read(*atom), Added(*atom)], Deleted(*atom));
            collector.not_before.push(Held(*atom));
        }
        for number in &footprint.reads_numbers {
            let ways = [Way::Assign, Way::Add, Way::Scale].map(|way| Changed(*number, way));
            collector.interferes(&ways, ReadNumber(*number));
        }
        for (number, way) in &footprint.numbers {
            let other_ways = [Way::Assign, Way::Add, Way::Scale].into_iter();
            let other_ways = other_ways.filter(|candidate| candidate != way || *way == Way::Assign);
            let mut conflicting: Vec<_> = other_ways.map(|candidate| Changed(*number, candidate)).collect();
            conflicting.push(ReadNumber(*number));
            collector.interferes(&conflicting, Changed(*number, *way));
            collector.not_before.push(HeldNumber(*number));
        }
        self.resolve(&collector)
    }

    /// Constraints of an over-all condition with the given reads. The start waits for the accesses
    /// in `after`; start and end make the accesses in `marks`.
    pub(super) fn over_all(&mut self, reads: &(Vec<AtomId>, Vec<NumericId>)) -> InterferenceConstraints<T> {
        let mut collector = InterferenceCollector::default();
        for atom in &reads.0 {
            collector.not_before.extend([Access::Added(*atom), Access::Deleted(*atom)]);
            collector.marks.push(Access::Held(*atom));
        }
        for number in &reads.1 {
            collector
                .not_before
                .extend([Way::Assign, Way::Add, Way::Scale].map(|way| Access::Changed(*number, way)));
            collector.marks.push(Access::HeldNumber(*number));
        }
        self.resolve(&collector)
    }

    /// Constraints that prevent a function from having two designs at one time. Returns the earlier
    /// uses that an action with these designs waits for.
    pub(super) fn designs(&mut self, designs: &Designs) -> Vec<(Key, T)> {
        let mut collector = InterferenceCollector::default();
        for (function, design) in designs {
            let mut other_designs: Vec<_> =
                self.designs.iter().filter(|(f, d)| f == function && d != design).copied().collect();
            other_designs.sort_unstable();
            collector.not_before.extend(other_designs.iter().map(|(f, d)| Access::Used(*f, *d)));
            collector.apart.extend(other_designs.iter().map(|(f, d)| Access::UsedAtOnce(*f, *d)));
        }
        self.resolve(&collector).after
    }

    /// Accesses that record the use of designs, made by the end of an action or, if `at_once`, by
    /// an instantaneous happening.
    pub(super) fn used(&mut self, designs: &Designs, at_once: bool) -> Vec<Key> {
        let kind = if at_once { Access::UsedAtOnce } else { Access::Used };
        let access = |(function, design): &(ObjectId, ObjectId)| kind(*function, *design);
        let accesses: Vec<_> = designs.iter().map(access).collect();
        accesses.into_iter().map(|access| self.key(access)).collect()
    }

    /// Translates accesses to keys. Accesses in `apart` require the separation as distance, those
    /// in `not_before` distance 0.
    fn resolve(&mut self, collector: &InterferenceCollector) -> InterferenceConstraints<T> {
        let separation = self.separation;
        let apart: Vec<_> = collector.apart.iter().map(|access| (self.key(*access), separation)).collect();
        let not_before = collector.not_before.iter().map(|access| (self.key(*access), T::ZERO));
        let mut after: Vec<(Key, T)> = not_before.collect();
        after.extend(apart);
        let marks = collector.marks.iter().map(|access| self.key(*access)).collect();
        InterferenceConstraints { after, marks }
    }
}

#[derive(Default)]
struct InterferenceCollector {
    apart: Vec<Access>,
    not_before: Vec<Access>,
    marks: Vec<Access>,
}

impl InterferenceCollector {
    fn interferes(&mut self, with: &[Access], access: Access) {
        self.apart.extend(with);
        self.marks.push(access);
    }
}

impl<T: TimeNumber> InterferenceConstraints<T> {
    pub(super) fn join(&mut self, other: &Self) {
        self.after.extend(&other.after);
        self.marks.extend(&other.marks);
    }

    /// Sorts `after` and `marks` and removes duplicates. Of several distances for the same access in `after`,
    /// the largest is kept.
    pub(super) fn tidy(&mut self) {
        self.after.sort_unstable_by(|a, b| (a.0, b.1).cmp(&(b.0, a.1)));
        self.after.dedup_by_key(|(key, _)| *key);
        self.marks.sort_unstable();
        self.marks.dedup();
    }
}

/// Sorts the constraints. Removes the accesses that no happening must follow from `marks`, and the accesses
/// that no happening makes from `after`.
pub(super) fn prune<'a, T: TimeNumber>(
    constraints: impl Iterator<Item = &'a mut InterferenceConstraints<T>>,
) {
    let mut constraints: Vec<_> = constraints.collect();
    let waited: FxHashSet<Key> =
        constraints.iter().flat_map(|happening| happening.after.iter().map(|(key, _)| *key)).collect();
    let marked: FxHashSet<Key> =
        constraints.iter().flat_map(|happening| happening.marks.iter().copied()).collect();
    for happening in &mut constraints {
        happening.tidy();
        happening.after.retain(|(key, _)| marked.contains(key));
        happening.marks.retain(|key| waited.contains(key));
    }
}
