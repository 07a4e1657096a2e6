//! Deadlines of trajectory constraints, checked on the scheduled states of a complete plan.

use num_rational::BigRational;
use task::compile;
use task::number::Int;
use task::task::{OperatorId, State, Task};

use crate::concurrent::time_number::TimeNumber;

/// A deadline: in each state that satisfies a begin condition, or in a later state within a time
/// limit, an end condition must hold. Both conditions are encoded as operators that never occur in
/// a plan.
#[derive(Debug, Clone)]
pub(super) struct Deadline<T: TimeNumber = Int> {
    /// Time limit in internal time units.
    within: T,
    pub(super) is_hard: bool,
    begins: Vec<OperatorId>,
    /// Operators that encode the end condition. Applying the first of them marks a soft deadline as
    /// met.
    pub(super) ends: Vec<OperatorId>,
}

impl<T: TimeNumber> Deadline<T> {
    /// Converts a deadline; `unit` is the number of internal time units per PDDL time unit.
    pub(super) fn new(task: &Task, deadline: &compile::Deadline, unit: T) -> Self {
        let [begins, ends] = deadline.actions().map(|name| {
            let named = |id: &OperatorId| {
                task.schema_names[task.operators[id.index()].schema as usize].as_ref() == name
            };
            OperatorId::all(task.operators.len()).filter(named).collect()
        });
        let units = &deadline.within * BigRational::from_integer(unit.to_big());
        let within = T::from_big(&units.floor().to_integer());
        Self { within: within.unwrap_or(T::MAX), is_hard: deadline.is_hard, begins, ends }
    }

    /// Returns `true` if the plan keeps the deadline: in or after each state in which a begin
    /// condition holds, there is a state with an end condition, at most `within` later.
    /// `trajectory` contains the states of the plan with their times, in ascending order.
    #[expect(clippy::arithmetic_side_effects, reason = "times are not negative")]
    pub(super) fn is_kept(&self, task: &Task, trajectory: &[(T, State)]) -> bool {
        let holds = |ways: &[OperatorId], state: &State| {
            ways.iter().any(|id| task.operators[id.index()].applicable(state, &[]))
        };
        // Time of the nearest state, from the visited one on, in which an end condition holds; the states are
        // visited in reverse order.
        let mut next: Option<T> = None;
        trajectory.iter().rev().all(|(time, state)| {
            if holds(&self.ends, state) {
                next = Some(*time);
            }
            let is_in_time = next.is_some_and(|next| next - *time <= self.within);
            is_in_time || !holds(&self.begins, state)
        })
    }
}
