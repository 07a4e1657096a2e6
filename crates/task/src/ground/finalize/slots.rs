//! Collects the slots of a task, i.e. the functions for which operators have a choice of designs.

use std::collections::BTreeMap;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ground::vocabulary::operator::{GroundOperator, GroundSlots};
use crate::lifted::ObjectId;
use crate::number::dense;
use crate::task::{Slot, SlotId, SlotUse};

/// Identifies a slot: a function, and a counter that distinguishes several slots of one operator for the
/// function.
type SlotKey = (ObjectId, usize);

fn slot_keys(slots: &GroundSlots) -> impl Iterator<Item = (SlotKey, &Vec<ObjectId>)> {
    slots.iter().enumerate().map(|(position, (function, suitable))| {
        let earlier = slots[..position].iter().filter(|(other, _)| other == function).count();
        ((*function, earlier), suitable)
    })
}

pub(super) struct Slots {
    pub(super) all: Vec<Slot>,
    ids: FxHashMap<SlotKey, SlotId>,
    /// Cache of converted slots, by address of the slot list that several ground operators share.
    uses: FxHashMap<*const (ObjectId, Vec<ObjectId>), Arc<[SlotUse]>>,
}

impl Slots {
    pub(super) fn new(operators: &[GroundOperator]) -> Self {
        let mut visited = FxHashSet::default();
        let distinct = operators.iter().filter(|operator| visited.insert(operator.slots.as_ptr()));
        let mut designs: BTreeMap<SlotKey, Vec<ObjectId>> = BTreeMap::new();
        for (key, suitable) in distinct.flat_map(|operator| slot_keys(&operator.slots)) {
            designs.entry(key).or_default().extend(suitable);
        }
        let mut slots = Self { all: Vec::new(), ids: FxHashMap::default(), uses: FxHashMap::default() };
        for (key, mut designs) in designs {
            designs.sort_unstable();
            designs.dedup();
            slots.ids.insert(key, SlotId::of(slots.all.len()));
            slots.all.push(Slot { designs });
        }
        slots
    }

    pub(super) fn uses(&mut self, ground: &Arc<GroundSlots>) -> Arc<[SlotUse]> {
        if let Some(uses) = self.uses.get(&ground.as_ptr()) {
            return uses.clone();
        }
        let uses: Arc<[SlotUse]> = slot_keys(ground)
            .map(|(key, suitable)| {
                let slot = self.ids[&key];
                let slot_designs = &self.all[slot.index()].designs;
                let designs = suitable.iter().filter_map(|design| slot_designs.binary_search(design).ok());
                SlotUse { slot, designs: designs.map(dense).collect() }
            })
            .collect();
        self.uses.insert(ground.as_ptr(), uses.clone());
        uses
    }
}
