//! The ground task as a transition system with PDDL names, used for simulation, inspection and tests.
//!
//! Designs are chosen as part of an action, so an operator yields one action for each combination of its
//! designs.

use crate::context::Context;
use crate::limits::Limits;
use crate::number::Int;
use crate::plan::ground::{GroundPlan, GroundStep, state_dependent_cost};
use crate::plan::named_plan::{Exact, Step, decode, metric};
use crate::task::number::TaskNumber as _;
use crate::task::{OperatorId, State, Task};

/// A state of the task, with the cost of the path that leads to it.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct TaskState {
    state: State,
    /// Cost in the task's integer unit.
    cost: Int,
}

impl TaskState {
    /// Returns the state with cost 0, for callers that compare states independent of their paths.
    #[must_use]
    pub fn unpaid(mut self) -> Self {
        self.cost = 0;
        self
    }
}

/// An applicable action with its successor state.
#[derive(Debug, Clone)]
pub struct Transition {
    /// Name of the action schema.
    pub action: String,
    /// Arguments in the order of the schema's parameters, including designs.
    pub arguments: Vec<String>,
    /// Successor state.
    pub after: TaskState,
}

impl Task {
    /// Returns the initial state.
    pub fn start(&self) -> TaskState {
        TaskState { state: self.initial.clone(), cost: 0 }
    }

    /// Returns the fluent atoms that are values of the task's variables, in PDDL, as `(predicate objects)`. The
    /// auxiliary atoms of timed events and of trajectory constraints are included.
    pub fn atoms(&self) -> impl Iterator<Item = &str> {
        // The last value of each variable represents "none of its atoms". Atoms that represent subconditions are named
        // without parentheses.
        self.variables
            .iter()
            .filter_map(|variable| variable.values.split_last())
            .flat_map(|(_, atoms)| atoms)
            .map(String::as_str)
            .filter(|atom| atom.starts_with('('))
    }

    /// Returns the actions of all operators with their arguments and designs, whether applicable or not. Waits and
    /// auxiliary actions are omitted. An action with several operators is repeated.
    pub fn actions(&self) -> impl Iterator<Item = (String, Vec<String>)> {
        let steps = self.ids().flat_map(move |id| {
            self.operators[id.index()].admitted_combinations().filter_map(move |choice| self.step(id, choice))
        });
        steps.map(|step| (step.action, step.arguments))
    }

    fn ids(&self) -> impl Iterator<Item = OperatorId> {
        OperatorId::all(self.operators.len())
    }

    fn step(&self, operator: OperatorId, choice: Vec<u32>) -> Option<Step> {
        // The code for plans determines the names: the action is decoded as a plan of one step.
        let plan = GroundPlan { steps: vec![GroundStep { operator, choice }], cost: 0 };
        decode(Context::new(self, &Limits::none()), &plan).steps.pop()
    }

    /// Returns the number of operators. An operator represents all combinations of designs for its slots.
    pub fn operator_count(&self) -> usize {
        self.operators.len()
    }

    /// Returns the atoms among [`Task::atoms`] that are true in a state.
    #[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
    pub fn holding(&self, situation: &TaskState) -> Vec<&str> {
        let values = self.variables.iter().zip(&situation.state.values);
        values
            .filter(|(variable, value)| **value as usize + 1 < variable.values.len())
            .map(|(variable, value)| variable.values[*value as usize].as_str())
            .filter(|atom| atom.starts_with('('))
            .collect()
    }

    /// Returns the reason why the goal is unreachable if grounding found one, and `None` otherwise. In the
    /// first case, the transitions may be incomplete.
    pub fn unreachable(&self) -> Option<&str> {
        self.unreachable.as_deref()
    }

    /// Returns `true` if the state satisfies the goal; `false` if grounding found that the goal is unreachable.
    pub fn reaches_goal(&self, situation: &TaskState) -> bool {
        self.unreachable.is_none() && self.is_goal(&situation.state)
    }

    /// Returns the value of the metric for the path that leads to this state.
    pub fn metric(&self, situation: &TaskState) -> Exact {
        metric(self, &(situation.cost.to_rational() + state_dependent_cost(self, &situation.state)))
    }

    /// Returns the transitions from a state by all applicable actions, without waits and auxiliary actions.
    /// Returns `None` on numeric overflow.
    pub fn transitions(&self, situation: &TaskState) -> Option<Vec<Transition>> {
        let TaskState { state, cost } = situation;
        let mut transitions = Vec::new();
        for id in self.ids() {
            let operator = &self.operators[id.index()];
            for choice in operator.admitted_combinations().filter(|choice| operator.applicable(state, choice))
            {
                let cost = cost.checked_add(operator.cost.at(&choice, &operator.sizes()))?;
                let after = TaskState { state: self.successor(operator, state, &choice)?, cost };
                let Some(Step { action, arguments, .. }) = self.step(id, choice) else { continue };
                transitions.push(Transition { action, arguments, after });
            }
        }
        Some(transitions)
    }
}
