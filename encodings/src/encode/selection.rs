//! Clauses for the selection of function designs, factored by slots.
//!
//! The operators that admit the same designs D of a slot form a group g. Let `g@t` be true if an
//! operator of the group is executed at step t, and `slot=d@t` if design d is selected for the slot at
//! step t. Then `g@t → ⋁_{d ∈ D} slot=d@t`, at most one design of a slot is true, and
//! `slot=d@t → ⋁ {g@t : d ∈ D}`, so an unused slot has no design. Each forbidden combination is
//! excluded for the group `h` of the operators that forbid it, e.g. `¬h@t ∨ ¬slot=d@t ∨ ¬slot'=d'@t`
//! for two slots.

use task::limits::Interrupted;

use crate::encode::builder::Builder;
use crate::encode::designs::task_slot;
use crate::encode::formula::{Family, Formula};
use crate::sat::Lit;

pub(super) fn selection(builder: &mut Builder<'_>, step: usize) -> Result<(), Interrupted> {
    for slot in 0..builder.task.slots.len() {
        let uses = builder.partition(step, |operator| {
            let usages = operator.slots.iter().filter(|usage| usage.slot.index() == slot);
            usages.map(|usage| &usage.designs[..]).collect()
        });
        let literals = builder.variables.designs[step][slot].clone();
        let mut users: Vec<Vec<Lit>> = vec![Vec::new(); literals.len()];
        for item in builder.limits.watch(uses) {
            let (designs, members) = item?;
            let group = builder.group(step, &members, Family::Selection);
            let suitable = designs.iter().map(|design| literals[*design as usize]);
            builder.formula.add(Family::Selection, suitable.chain([!group]));
            for design in designs {
                users[*design as usize].push(group);
            }
        }
        for (literal, users) in literals.iter().zip(users) {
            builder.formula.add(Family::Selection, users.into_iter().chain([!*literal]));
        }
        let falsum = !Formula::truth();
        let possible: Vec<_> = literals.into_iter().filter(|literal| *literal != falsum).collect();
        builder.formula.at_most_one(Family::Selection, &possible);
    }
    forbidden(builder, step)
}

fn forbidden(builder: &mut Builder<'_>, step: usize) -> Result<(), Interrupted> {
    let parts = builder.partition(step, |operator| {
        let rules = operator.forbidden.iter().flat_map(|rule| {
            rule.combinations.iter().map(|combination| {
                let pairs = rule.slots.iter().zip(combination);
                pairs.map(|(slot, design)| task_slot(&operator.slots, *slot, *design)).collect::<Vec<_>>()
            })
        });
        rules.collect()
    });
    for item in builder.limits.watch(parts) {
        let (combination, members) = item?;
        let group = builder.group(step, &members, Family::Selection);
        let chosen: Vec<_> = combination
            .iter()
            .map(|(slot, design)| !builder.variables.designs[step][*slot][*design])
            .collect();
        builder.formula.add(Family::Selection, chosen.into_iter().chain([!group]));
    }
    Ok(())
}
