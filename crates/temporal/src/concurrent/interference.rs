//! Interference constraints from footprints: which accesses a happening waits for, and which wait for it.

use indexmap::IndexMap;
use rustc_hash::{FxBuildHasher, FxHashSet};
use task::ground::vocabulary::atom::AtomId;
use task::lifted::ObjectId;
use task::number::{Int, dense};
use task::task::quantity::NumericId;

use crate::concurrent::footprint::{Footprint, Way};
use crate::concurrent::simple_temporal_network::Key;

/// A kind of access.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Access {
    Read(AtomId),
    Added(AtomId),
    Deleted(AtomId),
    /// A condition over all reads it.
    Held(AtomId),
    ReadNumber(NumericId),
    Changed(NumericId, Way),
    HeldNumber(NumericId),
    /// A function was used with a design, until an end.
    Used(ObjectId, ObjectId),
    /// A function was used with a design for a moment.
    UsedAtOnce(ObjectId, ObjectId),
}

/// What a happening waits for, each with how long after it, and the accesses that it makes.
#[derive(Debug, Clone, Default)]
pub(super) struct InterferenceConstraints {
    pub(super) after: Vec<(Key, Int)>,
    pub(super) marks: Vec<Key>,
}

/// The functions that an action requires, each with its design.
pub(super) type Designs = Vec<(ObjectId, ObjectId)>;

/// Numbers kinds of access.
pub(super) struct Keys {
    known: IndexMap<Access, (), FxBuildHasher>,
    /// In the task's time unit.
    separation: Int,
    /// All designs with which some action uses each function.
    designs: FxHashSet<(ObjectId, ObjectId)>,
}

impl Keys {
    pub(super) fn new(separation: Int, designs: FxHashSet<(ObjectId, ObjectId)>) -> Self {
        Self { known: IndexMap::default(), separation, designs }
    }

    pub(super) fn len(&self) -> usize {
        self.known.len()
    }

    fn key(&mut self, access: Access) -> Key {
        dense(self.known.insert_full(access, ()).0)
    }

    /// The accesses of a happening by what it reads and writes.
    pub(super) fn of(&mut self, footprint: &Footprint) -> InterferenceConstraints {
        use Access::{Added, Changed, Deleted, Held, HeldNumber, Read, ReadNumber};
        let mut own = InterferenceCollector::default();
        for atom in &footprint.reads {
            own.interferes(&[Added(*atom), Deleted(*atom)], Read(*atom));
        }
        for atom in &footprint.added {
            own.interferes(&[Read(*atom), Deleted(*atom)], Added(*atom));
            own.not_before.push(Held(*atom));
        }
        for atom in &footprint.deleted {
            own.interferes(&[Read(*atom), Added(*atom)], Deleted(*atom));
            own.not_before.push(Held(*atom));
        }
        for number in &footprint.reads_numbers {
            let ways = [Way::Assign, Way::Add, Way::Scale].map(|way| Changed(*number, way));
            own.interferes(&ways, ReadNumber(*number));
        }
        for (number, way) in &footprint.numbers {
            let others = [Way::Assign, Way::Add, Way::Scale].into_iter();
            let others = others.filter(|other| other != way || *way == Way::Assign);
            let mut all: Vec<_> = others.map(|other| Changed(*number, other)).collect();
            all.push(ReadNumber(*number));
            own.interferes(&all, Changed(*number, *way));
            own.not_before.push(HeldNumber(*number));
        }
        self.resolve(&own)
    }

    /// What the start of an action waits for so that its condition over all holds, and what it marks, as does its end.
    pub(super) fn over_all(&mut self, reads: &(Vec<AtomId>, Vec<NumericId>)) -> InterferenceConstraints {
        let mut own = InterferenceCollector::default();
        for atom in &reads.0 {
            own.not_before.extend([Access::Added(*atom), Access::Deleted(*atom)]);
            own.marks.push(Access::Held(*atom));
        }
        for number in &reads.1 {
            own.not_before
                .extend([Way::Assign, Way::Add, Way::Scale].map(|way| Access::Changed(*number, way)));
            own.marks.push(Access::HeldNumber(*number));
        }
        self.resolve(&own)
    }

    /// What an action waits for so that at any time each function has one design.
    pub(super) fn designs(&mut self, designs: &Designs) -> Vec<(Key, Int)> {
        let mut own = InterferenceCollector::default();
        for (function, design) in designs {
            let mut others: Vec<_> =
                self.designs.iter().filter(|(f, d)| f == function && d != design).copied().collect();
            others.sort_unstable();
            own.not_before.extend(others.iter().map(|(f, d)| Access::Used(*f, *d)));
            own.apart.extend(others.iter().map(|(f, d)| Access::UsedAtOnce(*f, *d)));
        }
        self.resolve(&own).after
    }

    /// What the end of an action marks, or an action that takes no time.
    pub(super) fn used(&mut self, designs: &Designs, at_once: bool) -> Vec<Key> {
        let kind = if at_once { Access::UsedAtOnce } else { Access::Used };
        let access = |(function, design): &(ObjectId, ObjectId)| kind(*function, *design);
        let accesses: Vec<_> = designs.iter().map(access).collect();
        accesses.into_iter().map(|access| self.key(access)).collect()
    }

    fn resolve(&mut self, own: &InterferenceCollector) -> InterferenceConstraints {
        let separation = self.separation;
        let apart: Vec<_> = own.apart.iter().map(|access| (self.key(*access), separation)).collect();
        let not_before = own.not_before.iter().map(|access| (self.key(*access), 0));
        let mut after: Vec<(Key, Int)> = not_before.collect();
        after.extend(apart);
        let marks = own.marks.iter().map(|access| self.key(*access)).collect();
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
    fn interferes(&mut self, with: &[Access], own: Access) {
        self.apart.extend(with);
        self.marks.push(own);
    }
}

impl InterferenceConstraints {
    pub(super) fn join(&mut self, other: &Self) {
        self.after.extend(&other.after);
        self.marks.extend(&other.marks);
    }

    /// Sorts, and keeps the longest wait for each kind of access.
    pub(super) fn tidy(&mut self) {
        self.after.sort_unstable_by(|a, b| (a.0, b.1).cmp(&(b.0, a.1)));
        self.after.dedup_by_key(|(key, _)| *key);
        self.marks.sort_unstable();
        self.marks.dedup();
    }
}

/// Drops what nothing waits for, and what nothing ever does.
pub(super) fn prune<'a>(all: impl Iterator<Item = &'a mut InterferenceConstraints>) {
    let mut all: Vec<_> = all.collect();
    let waited: FxHashSet<Key> = all.iter().flat_map(|own| own.after.iter().map(|(key, _)| *key)).collect();
    let marked: FxHashSet<Key> = all.iter().flat_map(|own| own.marks.iter().copied()).collect();
    for own in &mut all {
        own.tidy();
        own.after.retain(|(key, _)| marked.contains(key));
        own.marks.retain(|key| waited.contains(key));
    }
}
