//! Plans over ground operators, and their execution.

use num_traits::Zero;

use crate::number::{Int, Rational};
use crate::task::number::TaskNumber;
use crate::task::{OperatorId, State, Task};

/// A step of a plan: an operator, and a design for each of its slots.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct GroundStep {
    pub operator: OperatorId,
    /// For each slot of the operator: an index into `SlotUse::designs`.
    pub choice: Vec<u32>,
}

/// A plan over ground operators, with the sum of its operator costs. For `N = Int`, the cost is in the task's
/// integer unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GroundPlan<N = Int> {
    pub steps: Vec<GroundStep>,
    pub cost: N,
}

impl GroundPlan {
    /// Returns the greatest integer that is less than the cost of this plan.
    pub fn below(&self) -> Int {
        self.cost.saturating_sub(1)
    }
}

/// Executes a plan in the initial state. Returns all states, beginning with the initial state, and the cost
/// of the plan. Returns `None` if a step is not applicable, the last state is not a goal state, or a number
/// or the cost overflows.
pub fn replay<N: TaskNumber>(task: &Task<N>, plan: &[GroundStep]) -> Option<(Vec<State<N>>, N)> {
    replay_from(task, &task.initial, plan)
}

/// Executes a plan in the state `initial`. Returns its states and its cost, see [`replay`].
pub fn replay_from<N: TaskNumber>(
    task: &Task<N>,
    initial: &State<N>,
    plan: &[GroundStep],
) -> Option<(Vec<State<N>>, N)> {
    let states = pass(task, initial, plan)?;
    Some((states, cost(task, plan)?))
}

/// Returns the sum of the operator costs of the steps, or `None` on overflow.
pub fn cost<N: TaskNumber>(task: &Task<N>, plan: &[GroundStep]) -> Option<N> {
    plan.iter().try_fold(N::zero(), |sum, step| {
        let operator = &task.operators[step.operator.index()];
        sum.plus(&operator.cost.at(&step.choice, &operator.sizes())).filter(N::is_moderate)
    })
}

/// Executes a plan in the state `initial` and returns all states, beginning with `initial`. Returns `None` if
/// a step is not applicable, a number overflows, or the last state is not a goal state.
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

/// Returns the value of the state-dependent part of the metric in a state, in the task's cost unit. The value
/// is negated if the metric is maximised.
pub fn state_dependent_cost<N: TaskNumber>(task: &Task<N>, state: &State<N>) -> Rational {
    let unit = Rational::from_integer(task.objective.scale) / Rational::from_integer(task.number_scale);
    let terms = task.objective.rest.iter();
    let terms = terms.map(|(variable, factor)| state.numbers[variable.index()].to_rational() * factor);
    terms.fold(Rational::zero(), |sum, term| sum + term) * &unit
}
