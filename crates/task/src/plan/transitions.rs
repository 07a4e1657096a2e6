//! The ground task as a transition system in the names of the files: for simulation, inspection and tests.
//!
//! Every function design is chosen here, so an action appears once for each combination of its designs.

use crate::context::Context;
use crate::limits::Limits;
use crate::number::Int;
use crate::plan::ground::{GroundPlan, GroundStep};
use crate::plan::named_plan::{Exact, Step, decode, metric, rest};
use crate::task::number::TaskNumber as _;
use crate::task::{OperatorId, State, Task};

/// A state of a task, with what was paid on the way to it.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct TaskState {
    state: State,
    /// In the task's integer unit.
    cost: Int,
}

impl TaskState {
    /// The same state with nothing paid so far, for those to whom only states matter.
    #[must_use]
    pub fn unpaid(mut self) -> Self {
        self.cost = 0;
        self
    }
}

/// An action that can be executed in some state.
#[derive(Debug, Clone)]
pub struct Transition {
    /// The name of the action schema.
    pub action: String,
    /// All arguments in the order of the schema's parameters, designs among them.
    pub arguments: Vec<String>,
    /// The state after it.
    pub after: TaskState,
}

impl Task {
    /// The state before any action.
    pub fn start(&self) -> TaskState {
        TaskState { state: self.initial.clone(), cost: 0 }
    }

    /// The atoms that the task keeps track of, as `(predicate objects)`: those that can change and that matter.
    pub fn atoms(&self) -> impl Iterator<Item = &str> {
        // The last value of each variable stands for none of its atoms; parts of conditions have no parentheses.
        self.variables
            .iter()
            .filter_map(|variable| variable.values.split_last())
            .flat_map(|(_, atoms)| atoms)
            .map(String::as_str)
            .filter(|atom| atom.starts_with('('))
    }

    /// All actions with their arguments, whether or not they can be executed.
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
        let plan = GroundPlan { steps: vec![GroundStep { operator, choice }], cost: 0 };
        decode(Context::new(self, &Limits::none()), &plan).steps.pop()
    }

    /// How many operators there are, each standing for all combinations of its designs.
    pub fn operator_count(&self) -> usize {
        self.operators.len()
    }

    /// The atoms of [`Task::atoms`] that hold.
    #[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
    pub fn holding(&self, situation: &TaskState) -> Vec<&str> {
        let values = self.variables.iter().zip(&situation.state.values);
        values
            .filter(|(variable, value)| **value as usize + 1 < variable.values.len())
            .map(|(variable, value)| variable.values[*value as usize].as_str())
            .filter(|atom| atom.starts_with('('))
            .collect()
    }

    /// Why the goal is out of reach, if grounding has found that out; what can be done may then be incomplete.
    pub fn unreachable(&self) -> Option<&str> {
        self.unreachable.as_deref()
    }

    /// Whether the goal holds.
    pub fn reaches_goal(&self, situation: &TaskState) -> bool {
        self.unreachable.is_none() && self.is_goal(&situation.state)
    }

    /// The metric of a plan that leads here.
    pub fn metric(&self, situation: &TaskState) -> Exact {
        metric(self, &(situation.cost.to_rational() + rest(self, &situation.state)))
    }

    /// Everything that can be done; none if numbers grow too large for it.
    pub fn transitions(&self, situation: &TaskState) -> Option<Vec<Transition>> {
        let TaskState { state, cost } = situation;
        let mut found = Vec::new();
        for id in self.ids() {
            let operator = &self.operators[id.index()];
            for choice in operator.admitted_combinations().filter(|choice| operator.applicable(state, choice))
            {
                let cost = cost.checked_add(operator.cost.at(&choice, &operator.sizes()))?;
                let after = TaskState { state: self.successor(operator, state, &choice)?, cost };
                let Some(Step { action, arguments, .. }) = self.step(id, choice) else { continue };
                found.push(Transition { action, arguments, after });
            }
        }
        Some(found)
    }
}
