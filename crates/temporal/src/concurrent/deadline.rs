//! Deadlines of trajectory constraints, checked on the scheduled states of a complete plan.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::ToPrimitive;

use task::compile;
use task::number::Int;
use task::task::{OperatorId, State, Task};

/// A deadline: each state in which an operator of `begins` is applicable must be followed, within a
/// time limit, by a state in which an operator of `ends` is applicable. The operators only encode
/// conditions and never occur in a plan.
#[derive(Debug, Clone)]
pub(super) struct Deadline {
    /// Time limit in internal time units.
    within: Int,
    pub(super) is_hard: bool,
    begins: Vec<OperatorId>,
    /// Operators that encode the end condition. Applying the first of them marks a soft deadline as
    /// met.
    pub(super) ends: Vec<OperatorId>,
}

impl Deadline {
    pub(super) fn new(task: &Task, deadline: &compile::Deadline) -> Self {
        let [begins, ends] = deadline.actions().map(|name| {
            let named = |id: &OperatorId| {
                task.schema_names[task.operators[id.index()].schema as usize].as_ref() == name
            };
            OperatorId::all(task.operators.len()).filter(named).collect()
        });
        let units = &deadline.within * BigRational::from(BigInt::from(task.time_scale));
        let within = units.floor().to_integer().to_i128();
        Self { within: within.unwrap_or(Int::MAX), is_hard: deadline.is_hard, begins, ends }
    }

    /// Returns `true` if a plan meets the deadline. `trajectory` contains the states of the plan
    /// with their times, ascending.
    pub(super) fn is_kept(&self, task: &Task, trajectory: &[(Int, State)]) -> bool {
        let holds = |ways: &[OperatorId], state: &State| {
            ways.iter().any(|id| task.operators[id.index()].applicable(state, &[]))
        };
        // Time of the nearest later state in which an end condition holds; the states are visited
        // in reverse order.
        let mut next: Option<Int> = None;
        trajectory.iter().rev().all(|(time, state)| {
            if holds(&self.ends, state) {
                next = Some(*time);
            }
            let is_in_time =
                next.and_then(|next| next.checked_sub(*time)).is_some_and(|after| after <= self.within);
            is_in_time || !holds(&self.begins, state)
        })
    }
}
