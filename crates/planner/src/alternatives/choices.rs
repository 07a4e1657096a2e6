//! Other cheapest plans that are known, and the choices that all cheapest plans share.

use task::lifted::ObjectId;
use task::number::dense;
use task::plan::Plan;
use task::plan::ground::GroundStep;
use task::task::{Argument, Task};

/// Other cheapest plans of a task, and the choices that every cheapest plan makes.
///
/// Idle actions are not counted: they cost nothing, and neither the goal, the metric nor an action
/// that is not idle depends on their effects. Grounding removes them. A plan stays a plan with the
/// same cost if they are removed from it.
#[derive(Debug, Clone)]
pub struct Alternatives {
    /// Plans with the cost of the first plan, without the first plan itself.
    pub plans: Vec<Plan>,
    /// Whether it is proved that there are no others, idle actions apart.
    pub complete: bool,
    /// For each step of the first plan, the choices that every cheapest plan without idle actions
    /// makes at that step. `None` if a limit was reached, if cheapest plans may be longer than the
    /// longest one that was searched for, if the task has waits, or if only an external solver
    /// claims the result.
    pub forced: Option<Vec<Forced>>,
}

/// Choices at a step that are the same in every cheapest plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Forced {
    /// Whether the action is the same, designs among its arguments apart.
    pub action: bool,
    /// The functions whose design is the same.
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
        let choices = plan.iter().enumerate().flat_map(|(step, content)| {
            let slots = (0..dense(content.choice.len())).map(Some);
            std::iter::once(None).chain(slots).map(move |slot| Self { step, slot })
        });
        choices.collect()
    }
}

/// Returns `true` if both steps have the same operator, or, with a slot, if `other` also uses the
/// design that `one` has in that slot.
pub(super) fn shares(task: &Task, first: &GroundStep, second: &GroundStep, slot: Option<u32>) -> bool {
    match slot {
        None => second.operator == first.operator,
        Some(slot) => {
            let first_design = design(task, first, slot as usize);
            (0..second.choice.len()).any(|position| design(task, second, position) == first_design)
        }
    }
}

/// Slot and design in the task's numbering.
fn design(task: &Task, step: &GroundStep, position: usize) -> (usize, u32) {
    let usage = &task.operators[step.operator.index()].slots[position];
    (usage.slot.index(), usage.designs[step.choice[position] as usize])
}

/// Names of the choices that all cheapest plans make, for each step of the first plan.
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
