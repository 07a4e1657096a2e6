//! The metric of a complete plan, including the costs of violated preferences and soft deadlines.

use task::number::Int;
use task::task::{OperatorId, State};

use crate::concurrent::schedule;
use crate::concurrent::search::Sequence;
use crate::concurrent::successors::TemporalState;
use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;

pub(super) struct DeadlineMissed;

impl<T: TimeNumber> TemporalTask<T> {
    /// Returns, for each preference that the final state `state` violates, the first applicable
    /// operator that detects the violation.
    pub(super) fn violated(&self, state: &State) -> impl Iterator<Item = OperatorId> {
        let is_violated = |id: &&OperatorId| self.task.operators[id.index()].applicable(state, &[]);
        self.violations.iter().filter_map(move |ways| ways.iter().find(is_violated).copied())
    }

    /// Integer metric and makespan of a plan that ends in this temporal state. Returns `None` if
    /// the metric overflows.
    pub(super) fn value(&self, TemporalState { state, clocks, cost }: &TemporalState<T>) -> Option<(T, T)> {
        let makespan = clocks.latest();
        Some((self.measure.total(makespan, cost.checked_add(self.penalty(state)?)?)?, makespan))
    }

    /// Cost of the preferences violated in a final state, in the task's cost unit. Returns `None`
    /// if the sum overflows.
    pub(super) fn penalty(&self, state: &State) -> Option<Int> {
        let penalty = |id: OperatorId| self.task.operators[id.index()].cost.constant;
        self.violated(state).try_fold(0, |sum: Int, id| sum.checked_add(penalty(id)))
    }

    /// Final state of a sequence that is followed by an auxiliary operator for each deadline that it
    /// meets. These operators mark soft deadlines as met.
    ///
    /// # Errors
    /// Fails if a hard deadline is missed.
    pub(super) fn last_state(
        &self,
        happenings: &[OperatorId],
        together: &[bool],
    ) -> Result<State, DeadlineMissed> {
        let next = |state: &State, id: OperatorId| {
            let next = self.task.successor(&self.task.operators[id.index()], state, &[]);
            next.expect("invariant: the search has been there")
        };
        if self.deadlines.is_empty() {
            return Ok(happenings.iter().fold(self.task.initial.clone(), |state, id| next(&state, *id)));
        }
        let durations = schedule::durations(self, happenings);
        let times = schedule::schedule(self, happenings, together, &durations);
        let mut order: Vec<usize> = (0..happenings.len()).collect();
        order.sort_by_key(|position| times[*position]);
        let mut trajectory = vec![(T::ZERO, self.task.initial.clone())];
        let mut state = self.task.initial.clone();
        for (index, position) in order.iter().enumerate() {
            state = next(&state, happenings[*position]);
            let is_last =
                order.get(index.saturating_add(1)).is_none_or(|next| times[*next] > times[*position]);
            if is_last {
                trajectory.push((times[*position], state.clone()));
            }
        }
        for deadline in &self.deadlines {
            if !deadline.is_kept(&self.task, &trajectory) {
                if deadline.is_hard {
                    return Err(DeadlineMissed);
                }
            } else if let Some(end) = deadline.ends.first() {
                state = next(&state, *end);
            }
        }
        Ok(state)
    }

    /// Updates the metric of a complete plan with the preferences and deadlines that it violates.
    /// `cost` is the cost of its actions. Returns the plan unchanged if the task has no deadlines,
    /// and `None` if the plan misses a hard deadline or the metric overflows.
    pub(super) fn judge(&self, sequence: Sequence<T>, cost: Int) -> Option<Sequence<T>> {
        if self.deadlines.is_empty() {
            return Some(sequence);
        }
        let last = self.last_state(&sequence.happenings, &sequence.together).ok()?;
        let makespan = sequence.value.1;
        let total = self.measure.total(makespan, cost.checked_add(self.penalty(&last)?)?)?;
        Some(Sequence { value: (total, makespan), ..sequence })
    }
}
