//! Designs of operators in the numbering of the task.

use task::number::dense;
use task::task::{Operator, SlotUse};

/// Slot and design in the numbering of the task, from indices within an operator.
pub(super) fn task_slot(slots: &[SlotUse], slot: u32, design: u32) -> (usize, usize) {
    let usage = &slots[slot as usize];
    (usage.slot.index(), usage.designs[design as usize] as usize)
}

/// All combinations of designs of some slots, in the order of `Table::values` and the numbering of
/// the task.
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
