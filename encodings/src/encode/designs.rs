//! Converts the index of a design among the designs that are suitable for an operator to its index among all designs of
//! the slot.

use task::number::dense;
use task::task::{Operator, SlotUse};

/// Returns slot and design in the numbering of the task: indices into the slots of the task and into the
/// designs of this slot. `slot` and `design` are indices within an operator with the slots `slots`.
pub(super) fn task_slot(slots: &[SlotUse], slot: u32, design: u32) -> (usize, usize) {
    let usage = &slots[slot as usize];
    (usage.slot.index(), usage.designs[design as usize] as usize)
}

/// Returns all combinations of designs for some slots of an operator, in the order of
/// `Table::values`. Each combination lists pairs (slot, design) in the numbering of the task.
pub(super) fn combinations(operator: &Operator, slots: &[u32]) -> Vec<Vec<(usize, usize)>> {
    let mut combinations = vec![Vec::new()];
    for slot in slots {
        let designs = 0..dense(operator.slots[*slot as usize].designs.len());
        combinations = combinations
            .iter()
            .flat_map(|prefix: &Vec<(usize, usize)>| {
                designs.clone().map(move |design| {
                    let mut longer = prefix.clone();
                    longer.push(task_slot(&operator.slots, *slot, design));
                    longer
                })
            })
            .collect();
    }
    combinations
}
