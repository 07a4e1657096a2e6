//! Rescheduling: moves actions of a plan with timed events to earlier starts, one action at a time.
//!
//! Waiting is free, so an optimal plan may delay an action until an event that only a later action needs. For
//! each action, the operators for its other timeline windows are therefore tried, with the necessary waits. A
//! change is kept if the result is still a plan, costs no more, and has lexicographically smaller start times.

use num_traits::Zero;

use crate::context::Context;
use crate::number::Rational;
use crate::plan::ground::{GroundPlan, GroundStep, replay};
use crate::task::number::TaskNumber;
use crate::task::{Operator, OperatorId, Task};

/// Returns a plan with the same actions and possibly earlier starts. The operator of one action is replaced at
/// a time, as long as this makes the start times lexicographically smaller. Stops improving once the deadline
/// passes or the run is interrupted.
pub fn earliest<N: TaskNumber>(context: Context<'_, N>, plan: &GroundPlan<N>) -> GroundPlan<N> {
    let Context { task, limits } = context;
    let mut plan = plan.clone();
    // Without timed events, sequential execution has no gaps.
    if task.operators.iter().all(|operator| operator.wait.is_none()) {
        return plan;
    }
    let mut position = 0;
    while position < plan.steps.len() && !limits.reached() {
        let id = plan.steps[position].operator;
        if task.operators[id.index()].wait.is_none() {
            let current_starts = starts(task, &plan.steps);
            let tried = same_action(task, id).filter_map(|operator| with(task, &plan, position, operator));
            let best = tried.map(|tried| (starts(task, &tried.steps), tried)).min_by(|a, b| a.0.cmp(&b.0));
            if let Some((_, tried)) = best.filter(|(times, _)| *times < current_starts) {
                plan = tried;
                // The change may have removed waits before earlier actions, so all actions are tried again.
                position = 0;
                continue;
            }
        }
        position = position.saturating_add(1);
    }
    plan
}

fn same_action<N: TaskNumber>(task: &Task<N>, id: OperatorId) -> impl Iterator<Item = OperatorId> + '_ {
    let operator = &task.operators[id.index()];
    let is_same_action = move |other: &Operator<N>| {
        other.schema == operator.schema
            && other.arguments == operator.arguments
            && other.slots == operator.slots
    };
    let operators = task.operators.iter().zip((0..).map(OperatorId));
    operators.filter(move |(other, other_id)| *other_id != id && is_same_action(other)).map(|(_, id)| id)
}

/// Replaces the operator at `position` by `other`, drops all waits and inserts the necessary waits again.
/// Returns `None` if the result is not a plan or costs more than `plan`.
fn with<N: TaskNumber>(
    task: &Task<N>,
    plan: &GroundPlan<N>,
    position: usize,
    other: OperatorId,
) -> Option<GroundPlan<N>> {
    let waits: Vec<OperatorId> = task
        .operators
        .iter()
        .zip((0..).map(OperatorId))
        .filter(|(operator, _)| operator.wait.is_some())
        .map(|(_, id)| id)
        .collect();
    let is_wait = |step: &GroundStep| task.operators[step.operator.index()].wait.is_some();
    let mut steps: Vec<GroundStep> = Vec::new();
    let mut state = task.initial.clone();
    for (at, step) in plan.steps.iter().enumerate().filter(|(_, step)| !is_wait(step)) {
        let step = if at == position { GroundStep { operator: other, ..step.clone() } } else { step.clone() };
        let operator = &task.operators[step.operator.index()];
        // At most one wait is applicable in a state, and each wait leads to a later event.
        while !operator.applicable(&state, &step.choice) {
            let wait = waits.iter().find(|wait| task.operators[wait.index()].applicable(&state, &[]))?;
            state = task.successor(&task.operators[wait.index()], &state, &[])?;
            steps.push(GroundStep { operator: *wait, choice: Vec::new() });
        }
        if !operator.admits(&step.choice) {
            return None;
        }
        state = task.successor(operator, &state, &step.choice)?;
        steps.push(step);
    }
    let (_, cost) = replay(task, &steps)?;
    (cost <= plan.cost).then_some(GroundPlan { steps, cost })
}

/// Returns the start times of the actions (without waits) for sequential execution, in the task's time unit.
pub fn starts<N: TaskNumber>(task: &Task<N>, steps: &[GroundStep]) -> Vec<Rational> {
    let mut clock = Rational::zero();
    let mut times = Vec::new();
    for step in steps {
        let operator = &task.operators[step.operator.index()];
        if let Some(time) = &operator.wait {
            clock = clock.max(time.to_rational());
            continue;
        }
        let duration = operator.duration.at(&step.choice, &operator.sizes()).to_rational();
        let by_end = operator.timing.end.as_ref().map(|end| end.to_rational() - &duration);
        let by_start = operator.timing.start.as_ref().map(TaskNumber::to_rational);
        let start = by_start.into_iter().chain(by_end).fold(clock, Rational::max);
        times.push(start.clone());
        clock = start + &duration;
    }
    times
}
