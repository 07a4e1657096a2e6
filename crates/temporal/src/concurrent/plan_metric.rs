//! The metric of a complete plan, with violated preferences.

use task::number::Int;
use task::task::{OperatorId, State};

use crate::concurrent::schedule;
use crate::concurrent::search::Sequence;
use crate::concurrent::successors::TemporalState;
use crate::concurrent::temporal_task::TemporalTask;

/// A plan does not keep what it has to.
pub(super) struct DeadlineMissed;

impl TemporalTask {
    /// The preferences that are violated in the last state of a plan.
    pub(super) fn violated(&self, state: &State) -> impl Iterator<Item = OperatorId> {
        let is_violated = |id: &&OperatorId| self.task.operators[id.index()].applicable(state, &[]);
        self.violations.iter().filter_map(move |ways| ways.iter().find(is_violated).copied())
    }

    /// The metric in integers and the makespan of a plan that ends in a situation; none if they do not fit.
    pub(super) fn value(&self, TemporalState { state, clocks, cost }: &TemporalState) -> Option<(Int, Int)> {
        let makespan = clocks.latest();
        Some((self.measure.total(makespan, cost.checked_add(self.penalty(state)?)?)?, makespan))
    }

    /// What it costs that a plan ends in a state, in the task's cost unit; none if that does not fit.
    pub(super) fn penalty(&self, state: &State) -> Option<Int> {
        let penalty = |id: OperatorId| self.task.operators[id.index()].cost.constant;
        self.violated(state).try_fold(0, |sum: Int, id| sum.checked_add(penalty(id)))
    }

    /// The last state of a sequence, in which it is noted which deadlines were kept.
    ///
    /// # Errors
    /// One was not that has to be.
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
                order.get(index.saturating_add(1)).is_none_or(|other| times[*other] > times[*position]);
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

    /// A sequence that costs so much without what is violated, measured by its times, too; none if it does not keep what it has to.
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
