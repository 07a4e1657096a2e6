//! Restricts a task that was grounded with all designs to the available designs.
//!
//! Operators that require an unavailable object are removed. Tables and forbidden combinations of slots
//! (parameters whose designs are not grounded) keep only the rows of available designs. The result has the same
//! plans as the task that grounding would produce with these designs, but may contain unreachable operators and
//! facts.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use task::lifted::ObjectId;
use task::limits::{Interrupted, Limits};
use task::number::{Int, dense};
use task::task::quantity::{Linear, Quantity, SlotSet, Table};
use task::task::{Argument, ForbiddenCombinations, NumericEffect, Operator, SlotUse, Task};

/// For each slot of an operator (parameter whose design is not grounded): the indices of the
/// remaining designs.
type KeptDesigns = Arc<[Vec<u32>]>;

type RestrictedSlots = (KeptDesigns, Arc<[SlotUse]>);

/// Restricted data that several operators share. The keys are addresses: equal addresses mean equal data. The
/// data outlives the cache, because it belongs to the original task or is a list of kept designs in `slots`.
#[derive(Default)]
struct SharedTables {
    slots: FxHashMap<(*const SlotUse, u32), RestrictedSlots>,
    tables: FxHashMap<(*const Int, *const Vec<u32>), Arc<[Int]>>,
    forbidden: FxHashMap<(*const ForbiddenCombinations, *const Vec<u32>), Arc<[ForbiddenCombinations]>>,
}

/// Keeps only operators with allowed arguments. The arguments of `is_allowed` are the schema, the
/// index of the parameter, and the object.
pub(super) fn restrict(
    task: &Task,
    is_allowed: &dyn Fn(u32, usize, ObjectId) -> bool,
    limits: &Limits,
) -> Result<Task, Interrupted> {
    let mut shared = SharedTables::default();
    let mut operators = Vec::with_capacity(task.operators.len());
    for operator in limits.watch(&task.operators) {
        let operator = operator?;
        let allowed = |position: usize, object| is_allowed(operator.schema, position, object);
        let fixed = operator.arguments.iter().enumerate().all(|(position, argument)| match argument {
            Argument::Object(object) => allowed(position, *object),
            Argument::Slot(_) => true,
        });
        if fixed {
            operators.extend(shared.operator(task, operator, &allowed));
        }
    }
    // All parts of the task except the operators are unchanged.
    Ok(Task {
        operators,
        object_names: task.object_names.clone(),
        schema_names: task.schema_names.clone(),
        number_multiples: task.number_multiples.clone(),
        variables: task.variables.clone(),
        exclusive: task.exclusive.clone(),
        axioms: task.axioms.clone(),
        slots: task.slots.clone(),
        number_names: task.number_names.clone(),
        initial: task.initial.clone(),
        goal: task.goal.clone(),
        objective: task.objective.clone(),
        others: task.others.clone(),
        unreachable: task.unreachable.clone(),
        ..*task
    })
}

impl SharedTables {
    /// Restricts the slots of an operator to the allowed designs. Returns `None` if a slot has no remaining
    /// design.
    fn operator(
        &mut self,
        task: &Task,
        operator: &Operator,
        allowed: &dyn Fn(usize, ObjectId) -> bool,
    ) -> Option<Operator> {
        if operator.slots.is_empty() {
            return Some(operator.clone());
        }
        let entry = self.slots.entry((operator.slots.as_ptr(), operator.schema));
        let (remaining, slots) = entry.or_insert_with(|| left(task, operator, allowed)).clone();
        if remaining.iter().any(Vec::is_empty) {
            return None;
        }
        if remaining
            .iter()
            .zip(operator.slots.iter())
            .all(|(designs, slot)| designs.len() == slot.designs.len())
        {
            return Some(operator.clone());
        }
        let sizes = operator.sizes();
        let mut copy = operator.clone();
        copy.slots = slots;
        copy.forbidden = self.forbidden(&operator.forbidden, &remaining);
        copy.cost = self.quantity(&operator.cost, &remaining, &sizes);
        copy.duration = self.quantity(&operator.duration, &remaining, &sizes);
        copy.others =
            operator.others.iter().map(|objective| self.quantity(objective, &remaining, &sizes)).collect();
        copy.condition.comparisons = operator
            .condition
            .comparisons
            .iter()
            .map(|linear| self.linear(linear, &remaining, &sizes))
            .collect();
        let effects = operator.numeric_effects.iter().map(|effect| NumericEffect {
            variable: effect.variable,
            value: self.linear(&effect.value, &remaining, &sizes),
        });
        copy.numeric_effects = effects.collect();
        Some(copy)
    }

    fn linear(&mut self, linear: &Linear<Int>, kept: &KeptDesigns, sizes: &[usize]) -> Linear<Int> {
        Linear {
            coefficients: linear.coefficients.clone(),
            quantity: self.quantity(&linear.quantity, kept, sizes),
        }
    }

    fn quantity(&mut self, quantity: &Quantity<Int>, kept: &KeptDesigns, sizes: &[usize]) -> Quantity<Int> {
        let table = |table: &Table<Int>| {
            let entry = self.tables.entry((table.values.as_ptr(), kept.as_ptr()));
            let values = entry.or_insert_with(|| rows(table, kept, sizes)).clone();
            Table { slots: table.slots.clone(), values }
        };
        Quantity { constant: quantity.constant, tables: quantity.tables.iter().map(table).collect() }
    }

    fn forbidden(
        &mut self,
        all: &Arc<[ForbiddenCombinations]>,
        kept: &KeptDesigns,
    ) -> Arc<[ForbiddenCombinations]> {
        let entry = self.forbidden.entry((all.as_ptr(), kept.as_ptr()));
        entry.or_insert_with(|| all.iter().map(|rule| exclusions(rule, kept)).collect()).clone()
    }
}

fn left(task: &Task, operator: &Operator, allowed: &dyn Fn(usize, ObjectId) -> bool) -> RestrictedSlots {
    let arguments = |slot: usize| {
        let is_in_slot = move |argument: &Argument| *argument == Argument::Slot(dense(slot));
        operator
            .arguments
            .iter()
            .enumerate()
            .filter(move |(_, argument)| is_in_slot(argument))
            .map(|(at, _)| at)
    };
    let remaining: KeptDesigns = operator
        .slots
        .iter()
        .enumerate()
        .map(|(position, slot)| {
            let fits = |index: &u32| {
                let design = task.slots[slot.slot.index()].designs[slot.designs[*index as usize] as usize];
                arguments(position).all(|argument| allowed(argument, design))
            };
            (0..dense(slot.designs.len())).filter(fits).collect()
        })
        .collect();
    let uses = operator.slots.iter().zip(remaining.iter()).map(|(slot, indices)| SlotUse {
        slot: slot.slot,
        designs: indices.iter().map(|index| slot.designs[*index as usize]).collect(),
    });
    let uses = uses.collect();
    (remaining, uses)
}

#[expect(clippy::arithmetic_side_effects, reason = "a position in the table, which is in memory")]
fn rows(table: &Table<Int>, kept: &KeptDesigns, sizes: &[usize]) -> Arc<[Int]> {
    let mut positions = vec![0_usize];
    for slot in &table.slots {
        let (size, kept) = (sizes[*slot as usize], &kept[*slot as usize]);
        positions = positions
            .iter()
            .flat_map(|position| kept.iter().map(move |index| position * size + *index as usize))
            .collect();
    }
    positions.into_iter().map(|position| table.values[position]).collect()
}

fn exclusions(rule: &ForbiddenCombinations, kept: &KeptDesigns) -> ForbiddenCombinations {
    let moved = |(slot, index): (&u32, &u32)| {
        kept[*slot as usize].iter().position(|candidate| candidate == index).map(dense)
    };
    let combination = |bad: &SlotSet| rule.slots.iter().zip(bad).map(moved).collect::<Option<SlotSet>>();
    ForbiddenCombinations {
        slots: rule.slots.clone(),
        combinations: rule.combinations.iter().filter_map(combination).collect(),
    }
}
