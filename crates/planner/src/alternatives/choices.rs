//! The result of a search for alternative cheapest plans, and the choices that all cheapest plans share.

use task::lifted::ObjectId;
use task::number::dense;
use task::plan::Plan;
use task::plan::ground::GroundStep;
use task::task::{Argument, Task};

/// Cheapest plans other than the first plan, and the choices that all cheapest plans share.
///
/// Idle actions are ignored: grounding removes them, because nothing depends on their effects and they cannot improve
/// the metric. Removing them from a cheapest plan yields a cheapest plan.
#[derive(Debug, Clone)]
pub struct Alternatives {
    /// Cheapest plans other than the first plan, at most the requested number.
    pub plans: Vec<Plan>,
    /// `true` if it is proved that every cheapest plan is the first plan or in `plans`, apart from idle actions.
    pub complete: bool,
    /// For each step of the first plan: the choices that every cheapest plan without idle actions makes at this
    /// step. `None` if they are not determined. Examples: a limit was reached, longer cheapest plans may exist,
    /// the task has waits (steps that only advance the time), or an external solver was used, whose claims are not
    /// verified.
    pub forced: Option<Vec<Forced>>,
}

/// Choices at one step that every cheapest plan makes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Forced {
    /// `true` if it is proved that every cheapest plan has the same action with the same arguments at this step.
    /// Designs among the arguments are ignored if grounding leaves them open (slots).
    pub action: bool,
    /// Names of the functions for which it is proved that every cheapest plan selects the same design at this step.
    pub functions: Vec<String>,
}

/// A choice of the first plan: the operator of a step (if `slot` is `None`), or the design of a
/// slot (parameter whose design is not grounded), given by its position in the operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Choice {
    pub(super) step: usize,
    pub(super) slot: Option<u32>,
}

impl Choice {
    pub(super) fn all(plan: &[GroundStep]) -> Vec<Self> {
        let choices = plan.iter().enumerate().flat_map(|(step, content)| {
            let slots = (0..dense(content.choice.len())).map(Some);
            std::iter::once(None).chain(slots).map(move |slot| Self { step, slot })
        });
        choices.collect()
    }
}

/// Returns `true` if two steps agree in a choice. If `slot` is `None`, they must have the same
/// operator. Otherwise, `second` must use the slot at position `slot` of `first`, with the same
/// design.
pub(super) fn shares(task: &Task, first: &GroundStep, second: &GroundStep, slot: Option<u32>) -> bool {
    match slot {
        None => second.operator == first.operator,
        Some(slot) => {
            let first_design = design(task, first, slot as usize);
            (0..second.choice.len()).any(|position| design(task, second, position) == first_design)
        }
    }
}

fn design(task: &Task, step: &GroundStep, position: usize) -> (usize, u32) {
    let usage = &task.operators[step.operator.index()].slots[position];
    (usage.slot.index(), usage.designs[step.choice[position] as usize])
}

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
