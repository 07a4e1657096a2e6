//! Symmetry breaking for interchangeable designs and objects: of symmetric plans, at least one
//! stays admitted.
//!
//! - designs: of interchangeable designs of a slot, only the first is used: `¬slot=d@t` (design d is
//!   not selected for the slot at step t) for all others. Designs are chosen independently at every
//!   step, so each step has its own symmetry;
//! - objects: objects x₁ < x₂ < …, any two of which can be exchanged without changing the task \[1\],
//!   are first used in this order: `o@t → s_i@t` for each operator o with x_{i+1} but not `x_i` among
//!   its arguments, where `o@t` means that o is executed at step t. Here `s_i@t → s_i@t−1 ∨ u_i@t`
//!   states that `x_i` has been used, and `u_i@t ↔ ⋁ o@t` that it is used now. Renaming the objects of
//!   a plan in the order of their first use yields a plan that satisfies this at the same cost.
//!
//! Objects are not considered interchangeable if their exchange would also exchange numeric variables, or if the task
//! has derived variables.
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

/// Interchangeable designs and objects of a task.
pub struct Symmetry {
    designs: Vec<(SlotId, u32)>,
    /// For each pair of consecutive interchangeable objects: operators that use the first, and operators that use only
    /// the second.
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
            let mut used_so_far: Lit = !Formula::truth();
            for step in builder.limits.watch(0..horizon) {
                let step = step?;
                let used = builder.group(step, first, Family::Symmetry);
                let longer = builder.formula.fresh(VariableMeaning::Ladder);
                builder.formula.add(Family::Symmetry, [!longer, used_so_far, used]);
                used_so_far = longer;
                for id in only_second {
                    if let Some(literal) = builder.variables.operator(step, *id) {
                        builder.formula.add(Family::Symmetry, [!literal, used_so_far]);
                    }
                }
            }
        }
        Ok(())
    }
}

type Pairs = Vec<(Vec<OperatorId>, Vec<OperatorId>)>;

fn equal_objects(context: Context<'_>) -> Result<Pairs, Interrupted> {
    let task = context.task;
    let pairs = symmetry_generators(context, true)?.into_iter().map(
        |Exchange { objects: (first, second), .. }| {
            let (first_users, second_users) = (uses_of(task, first), uses_of(task, second));
            let only_second =
                second_users.into_iter().filter(|id| first_users.binary_search(id).is_err()).collect();
            (first_users, only_second)
        },
    );
    Ok(pairs.collect())
}

fn uses_of(task: &Task, object: ObjectId) -> Vec<OperatorId> {
    let operators = task.operators.iter().zip(OperatorId::all(task.operators.len()));
    let users = operators.filter(|(operator, _)| operator.arguments.contains(&Argument::Object(object)));
    users.map(|(_, id)| id).collect()
}
