//! What can be done in a state: operators by what they require, and the designs worth choosing.

use rustc_hash::FxHashMap;

use crate::task::{Operator, OperatorId, State, Task};

/// Operators by that fact of their condition whose variable has the most values.
pub(crate) struct OperatorIndex {
    by_fact: FxHashMap<(u32, u32), Vec<OperatorId>>,
    always: Vec<OperatorId>,
}

impl OperatorIndex {
    pub(crate) fn new(task: &Task) -> Self {
        let mut index = Self { by_fact: FxHashMap::default(), always: Vec::new() };
        for (operator, id) in task.operators.iter().zip((0..).map(OperatorId)) {
            let widest = operator
                .condition
                .facts
                .iter()
                .max_by_key(|fact| task.variables[fact.variable.index()].values.len());
            match widest {
                Some(fact) => index.by_fact.entry((fact.variable.0, fact.value)).or_default().push(id),
                None => index.always.push(id),
            }
        }
        index
    }

    /// The operators whose propositional condition holds, ascending.
    pub(crate) fn applicable(&self, task: &Task, state: &State) -> Vec<OperatorId> {
        let mut found = self.always.clone();
        for (variable, value) in state.values.iter().enumerate() {
            found.extend(self.by_fact.get(&(variable as u32, *value)).into_iter().flatten());
        }
        found.retain(|id| task.operators[id.index()].condition.holds_propositionally(&state.values));
        found.sort_unstable();
        found
    }
}

/// The combinations of an operator's designs that no other one dominates, with their costs: none is cheaper or
/// leaves more of the numeric variables. Of equal ones the first stands for all, unless `all` are asked for.
pub(crate) fn undominated(operator: &Operator, monotone: bool, all: bool) -> Vec<(Vec<u16>, i64)> {
    let sizes = operator.sizes();
    let profile = |choice: &[u16]| -> Vec<i64> {
        let effects = operator.numeric_effects.iter().map(|effect| effect.value.quantity.at(choice, &sizes));
        let conditions =
            operator.condition.comparisons.iter().map(|linear| linear.quantity.at(choice, &sizes));
        effects.chain(conditions).collect()
    };
    let mut front: Vec<(Vec<u16>, i64, Vec<i64>)> = Vec::new();
    let no_worse =
        |a: &[i64], b: &[i64]| if monotone { a.iter().zip(b).all(|(a, b)| a >= b) } else { a == b };
    for choice in operator.choices() {
        let (cost, profile) = (operator.cost.at(&choice, &sizes), profile(&choice));
        let equal = |other: i64, numbers: &[i64]| all && other == cost && *numbers == profile;
        if front.iter().any(|(_, other, numbers)| {
            *other <= cost && no_worse(numbers, &profile) && !equal(*other, numbers)
        }) {
            continue;
        }
        front.retain(|(_, other, numbers)| {
            !(cost <= *other && no_worse(&profile, numbers)) || equal(*other, numbers)
        });
        front.push((choice, cost, profile));
    }
    front.into_iter().map(|(choice, cost, _)| (choice, cost)).collect()
}
