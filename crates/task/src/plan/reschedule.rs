//! Rescheduling: moves actions of a plan with timed events to earlier starts, one action at a time.
//!
//! Waiting is free, so an optimal plan may delay an action until an event that only a later action needs. For
//! each action, the operators for its other timeline windows are therefore tried, with the necessary waits. A
//! change is kept if the result is still a plan with the same values under all objectives, and has lexicographically
//! smaller start times.

use num_traits::Zero;

use crate::context::Context;
use crate::number::Rational;
use crate::plan::ground::{GroundPlan, GroundStep, replay, state_dependent_cost};
use crate::task::number::TaskNumber;
use crate::task::{OperatorId, Task};

/// Returns a plan with the same actions, the same values under all objectives, and possibly earlier starts. The
/// operator of one action is replaced at a time, as long as this makes the start times lexicographically smaller. Stops
/// improving once the deadline passes or the run is interrupted.
pub fn earliest<N: TaskNumber>(context: Context<'_, N>, plan: &GroundPlan<N>) -> GroundPlan<N> {
    let Context { task, limits } = context;
    let mut plan = plan.clone();
    // Without timed events, sequential execution has no gaps.
    let waits: Vec<OperatorId> = ids(task).filter(|id| task.operators[id.index()].wait.is_some()).collect();
    if waits.is_empty() {
        return plan;
    }
    let Some(values) = values(task, &plan.steps) else { return plan };
    let mut position = 0;
    while position < plan.steps.len() && !limits.reached() {
        let id = plan.steps[position].operator;
        if task.operators[id.index()].wait.is_none() {
            let current_starts = starts(task, &plan.steps);
            let operators = same_action(task, id).take_while(|_| !limits.reached());
            let tried =
                operators.filter_map(|operator| with(task, &plan.steps, (position, operator), &waits));
            let tried = tried.map(|steps| (starts(task, &steps), steps));
            let earlier = tried.filter(|(times, _)| *times < current_starts);
            let equal = earlier.filter(|(_, steps)| self::values(task, steps).as_ref() == Some(&values));
            if let Some((_, steps)) = equal.min_by(|a, b| a.0.cmp(&b.0)) {
                plan.steps = steps;
                // The change may have removed waits before earlier actions, so all actions are tried again.
                position = 0;
                continue;
            }
        }
        position = position.saturating_add(1);
    }
    plan
}

fn ids<N>(task: &Task<N>) -> impl Iterator<Item = OperatorId> {
    OperatorId::all(task.operators.len())
}

fn same_action<N: TaskNumber>(task: &Task<N>, id: OperatorId) -> impl Iterator<Item = OperatorId> + '_ {
    let operator = &task.operators[id.index()];
    ids(task).filter(move |candidate_id| {
        let candidate = &task.operators[candidate_id.index()];
        *candidate_id != id
            && candidate.schema == operator.schema
            && candidate.arguments == operator.arguments
            && candidate.slots == operator.slots
    })
}

/// Replaces the operator at a position, drops all waits and inserts the necessary waits again. Returns `None` if a step
/// is not applicable.
fn with<N: TaskNumber>(
    task: &Task<N>,
    plan: &[GroundStep],
    (position, operator): (usize, OperatorId),
    waits: &[OperatorId],
) -> Option<Vec<GroundStep>> {
    let is_wait = |step: &GroundStep| task.operators[step.operator.index()].wait.is_some();
    let mut steps: Vec<GroundStep> = Vec::new();
    let mut state = task.initial.clone();
    for (at, step) in plan.iter().enumerate().filter(|(_, step)| !is_wait(step)) {
        let step = if at == position { GroundStep { operator, ..step.clone() } } else { step.clone() };
        let operator = &task.operators[step.operator.index()];
        // At most one wait is applicable in a state, and each wait leads to a later event.
        while !operator.applicable(&state, &step.choice) {
            let wait = waits.iter().find(|wait| task.operators[wait.index()].applicable(&state, &[]))?;
            state = task.successor(&task.operators[wait.index()], &state, &[])?;
            steps.push(GroundStep { operator: *wait, choice: Vec::new() });
        }
        state = task.successor(operator, &state, &step.choice)?;
        steps.push(step);
    }
    Some(steps)
}

/// Returns the sum of the operator costs under each objective, and the state-dependent part of the metric. Returns
/// `None` if the steps are not a plan, or a number overflows.
fn values<N: TaskNumber>(task: &Task<N>, steps: &[GroundStep]) -> Option<(Vec<N>, Rational)> {
    let (states, cost) = replay(task, steps)?;
    let mut costs = vec![cost];
    for objective in 0..task.others.len() {
        costs.push(steps.iter().try_fold(N::zero(), |sum, step| {
            let operator = &task.operators[step.operator.index()];
            sum.plus(&operator.others[objective].at(&step.choice, &operator.sizes()))
        })?);
    }
    Some((costs, state_dependent_cost(task, states.last()?)))
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
