//! The metric of a complete plan, with violated preferences.

use task::number::Int;
use task::task::{OperatorId, State};

use crate::concurrent::schedule;
use crate::concurrent::search::Sequence;
use crate::concurrent::successors::TemporalState;
use crate::concurrent::temporal_task::TemporalTask;

/// Error: a plan violates a hard deadline.
pub(super) struct DeadlineMissed;

impl TemporalTask {
    /// Operators of the preferences that are violated in a state.
    pub(super) fn violated(&self, state: &State) -> impl Iterator<Item = OperatorId> {
        let is_violated = |id: &&OperatorId| self.task.operators[id.index()].applicable(state, &[]);
        self.violations.iter().filter_map(move |ways| ways.iter().find(is_violated).copied())
    }

    /// Metric in integers and makespan of a plan that ends in this state. Returns `None` if they
    /// overflow.
    pub(super) fn value(&self, TemporalState { state, clocks, cost }: &TemporalState) -> Option<(Int, Int)> {
        let makespan = clocks.latest();
        Some((self.measure.total(makespan, cost.checked_add(self.penalty(state)?)?)?, makespan))
    }

    /// Cost of the preferences violated in a final state, in the task's cost unit. Returns `None`
    /// if it overflows.
    pub(super) fn penalty(&self, state: &State) -> Option<Int> {
        let penalty = |id: OperatorId| self.task.operators[id.index()].cost.constant;
        self.violated(state).try_fold(0, |sum: Int, id| sum.checked_add(penalty(id)))
    }

    /// Final state of a sequence, in which the satisfied soft deadlines are marked.
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
        let mut trajectory = vec![(0, self.task.initial.clone())];
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

    /// Adds the cost of violated preferences and deadlines to the value of a sequence; `cost` is
    /// the cost of its actions. Returns `None` if a hard deadline is missed or the metric
    /// overflows.
    pub(super) fn judge(&self, sequence: Sequence, cost: Int) -> Option<Sequence> {
        if self.deadlines.is_empty() {
            return Some(sequence);
        }
        let last = self.last_state(&sequence.happenings, &sequence.together).ok()?;
        let makespan = sequence.value.1;
        let total = self.measure.total(makespan, cost.checked_add(self.penalty(&last)?)?)?;
        Some(Sequence { value: (total, makespan), ..sequence })
    }
}
