//! Designs and objects that are equal: of plans that differ by exchanging them, one is enough.
//!
//! - designs: of designs of a slot that no operator tells apart, only the first is chosen: `¬slot=d@t`. Designs are chosen anew
//!   at every step, so each step is symmetric by itself;
//! - objects: objects x₁ < x₂ < … any two of which can be exchanged without changing the task \[1\] are used first in this order:
//!   `o@t → s_i@t` for each operator o with x_{i+1} among its arguments and `x_i` not, where `s_i@t → s_i@t−1 ∨ u_i@t` says that
//!   `x_i` has been used, and `u_i@t ↔ ⋁ o@t` that it is used now. Renaming the objects of a plan in the order of their first use
//!   makes one that satisfies this, and costs the same.
//!
//! Objects whose numeric variables differ, and tasks with derived variables, are left alone.
//!
//! \[1\] J. Rintanen: Symmetry reduction for SAT representations of transition systems, ICAPS 2003.

use task::context::Context;
use task::lifted::ObjectId;
use task::limits::Interrupted;
use task::task::object_symmetry::{Exchange, symmetry_generators};
use task::task::{Argument, OperatorId, SlotId, Task};

use crate::encode::builder::Builder;
use crate::encode::formula::{Family, Formula, VariableMeaning};
use crate::encode::interchangeable_designs::equal_designs;
use crate::sat::Lit;

/// What of a task is equal.
pub struct Symmetry {
    /// Designs of a slot that are equal to an earlier one.
    designs: Vec<(SlotId, u32)>,
    /// For pairs of equal objects: the operators that use the first, and those that use only the second.
    objects: Pairs,
}

impl Symmetry {
    pub(crate) fn new(context: Context<'_>) -> Result<Self, Interrupted> {
        let task = context.task;
        let mut designs = Vec::new();
        for slot in SlotId::all(task.slots.len()) {
            designs.extend(equal_designs(context, slot)?.into_iter().map(|design| (slot, design)));
        }
        Ok(Self { designs, objects: equal_objects(context)? })
    }

    /// Equal designs and objects are used in their order.
    pub(super) fn add(&self, builder: &mut Builder<'_>) -> Result<(), Interrupted> {
        let horizon = builder.variables.horizon();
        for step in 0..horizon {
            for design in builder.limits.watch(&self.designs) {
                let (slot, design) = design?;
                let literal = builder.variables.designs[step][slot.index()][*design as usize];
                builder.formula.add(Family::Symmetry, [!literal]);
            }
        }
        for (first, only_second) in &self.objects {
            let mut seen: Lit = !Formula::truth();
            for step in builder.limits.watch(0..horizon) {
                let step = step?;
                let used = builder.group(step, first, Family::Symmetry);
                let longer = builder.formula.fresh(VariableMeaning::Ladder);
                builder.formula.add(Family::Symmetry, [!longer, seen, used]);
                seen = longer;
                for id in only_second {
                    if let Some(literal) = builder.variables.operator(step, *id) {
                        builder.formula.add(Family::Symmetry, [!literal, seen]);
                    }
                }
            }
        }
        Ok(())
    }
}

/// Two lists of operators for each of some pairs of objects.
type Pairs = Vec<(Vec<OperatorId>, Vec<OperatorId>)>;

/// Pairs of neighbours in classes of equal objects.
fn equal_objects(context: Context<'_>) -> Result<Pairs, Interrupted> {
    let task = context.task;
    let pairs = symmetry_generators(context, true)?.into_iter().map(
        |Exchange { objects: (first, second), .. }| {
            let (own, all) = (uses_of(task, first), uses_of(task, second));
            let only = all.into_iter().filter(|id| own.binary_search(id).is_err()).collect();
            (own, only)
        },
    );
    Ok(pairs.collect())
}

/// Ascending.
fn uses_of(task: &Task, object: ObjectId) -> Vec<OperatorId> {
    let all = task.operators.iter().zip(OperatorId::all(task.operators.len()));
    let own = all.filter(|(operator, _)| operator.arguments.contains(&Argument::Object(object)));
    own.map(|(_, id)| id).collect()
}
