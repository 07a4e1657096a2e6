//! What is known of other cheapest plans, and the choices that plans share.

use crate::lifted::ObjectId;
use crate::number::dense;
use crate::plan::Plan;
use crate::plan::ground::GroundStep;
use crate::task::{Argument, Task};

/// What is known of the other cheapest plans.
#[derive(Debug, Clone)]
pub struct Alternatives {
    /// Plans that cost as much as the first one; not the first one itself.
    pub plans: Vec<Plan>,
    /// Whether it is proved that there are no others.
    pub complete: bool,
    /// For each step of the first plan which of its choices every cheapest plan makes at that step; none if a limit was
    /// reached, or if cheapest plans may be longer than any that was looked for.
    pub forced: Option<Vec<Forced>>,
}

/// Choices at a step that are the same in every cheapest plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Forced {
    /// Whether the action is, with its arguments apart from designs.
    pub action: bool,
    /// The functions whose design is.
    pub functions: Vec<String>,
}

/// A choice of the first plan: an operator at a step, or the design of one of its slots (by position).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Choice {
    pub(super) step: usize,
    pub(super) slot: Option<u32>,
}

impl Choice {
    /// All choices of a plan.
    pub(super) fn all(plan: &[GroundStep]) -> Vec<Self> {
        let choices = plan.iter().enumerate().flat_map(|(step, own)| {
            let slots = (0..dense(own.choice.len())).map(Some);
            std::iter::once(None).chain(slots).map(move |slot| Self { step, slot })
        });
        choices.collect()
    }
}

/// Whether two steps have the same operator, or one has the design of a slot of the other.
pub(super) fn shares(task: &Task, one: &GroundStep, other: &GroundStep, slot: Option<u32>) -> bool {
    match slot {
        None => other.operator == one.operator,
        Some(slot) => {
            let own = design(task, one, slot as usize);
            (0..other.choice.len()).any(|position| design(task, other, position) == own)
        }
    }
}

/// Slot and design in the task's numbering.
fn design(task: &Task, step: &GroundStep, position: usize) -> (usize, u32) {
    let usage = &task.operators[step.operator.index()].slots[position];
    (usage.slot.index(), usage.designs[step.choice[position] as usize])
}

/// The choices that all cheapest plans make, in names, step by step.
pub(super) fn forced(task: &Task, first: &[GroundStep], choices: &[Choice]) -> Vec<Forced> {
    let of_step = |(at, step): (usize, &GroundStep)| {
        let is_shared = |slot: Option<u32>| choices.contains(&Choice { step: at, slot });
        let operator = &task.operators[step.operator.index()];
        let is_forced = |argument: &Argument| match argument {
            Argument::Object(_) => is_shared(None),
            Argument::Slot(slot) => is_shared(Some(*slot)),
        };
        let functions = operator.configuration.iter().filter(|(_, argument)| is_forced(argument));
        let name = |function: ObjectId| task.object_names[function.index()].clone();
        Forced {
            action: is_shared(None),
            functions: functions.map(|(function, _)| name(*function)).collect(),
        }
    };
    first.iter().enumerate().map(of_step).collect()
}
