//! Plans over operators, and their execution.

use crate::number::Int;
use crate::task::number::TaskNumber;
use crate::task::{OperatorId, State, Task};

/// A step of a plan over operators.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct GroundStep {
    pub operator: OperatorId,
    /// An index into `SlotUse::designs` for each slot of the operator.
    pub choice: Vec<u32>,
}

/// A plan and the sum of its operator costs, in the task's integer unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GroundPlan<N = Int> {
    pub steps: Vec<GroundStep>,
    pub cost: N,
}

impl GroundPlan {
    /// Greatest cost of strictly cheaper plans.
    pub fn below(&self) -> Int {
        self.cost.saturating_sub(1)
    }
}

/// Returns the states of a plan, beginning with the initial one, and its cost. `None` if a step is
/// not applicable, the last state is no goal state, or the cost overflows.
pub fn replay<N: TaskNumber>(task: &Task<N>, plan: &[GroundStep]) -> Option<(Vec<State<N>>, N)> {
    replay_from(task, &task.initial, plan)
}

/// Replays a plan from a given state, see [`replay`].
pub fn replay_from<N: TaskNumber>(
    task: &Task<N>,
    initial: &State<N>,
    plan: &[GroundStep],
) -> Option<(Vec<State<N>>, N)> {
    let states = pass(task, initial, plan)?;
    Some((states, cost(task, plan)?))
}

/// Returns the sum of the costs of steps, or `None` on overflow.
pub fn cost<N: TaskNumber>(task: &Task<N>, plan: &[GroundStep]) -> Option<N> {
    plan.iter().try_fold(N::zero(), |sum, step| {
        let operator = &task.operators[step.operator.index()];
        sum.plus(&operator.cost.at(&step.choice, &operator.sizes())).filter(N::is_moderate)
    })
}

/// Returns the states of a plan from a state on. `None` if a step is not applicable, or the last
/// state is no goal state.
pub fn pass<N: TaskNumber>(task: &Task<N>, initial: &State<N>, plan: &[GroundStep]) -> Option<Vec<State<N>>> {
    let mut states = vec![initial.clone()];
    for step in plan {
        let operator = &task.operators[step.operator.index()];
        let state = states.last()?;
        if !operator.admits(&step.choice) || !operator.applicable(state, &step.choice) {
            return None;
        }
        let next = task.successor(operator, state, &step.choice)?;
        states.push(next);
    }
    task.is_goal(states.last()?).then_some(states)
}
