//! Successors of a temporal state: by one happening, or by the start and the end of an action in
//! one step.

use search::search::successor_generator::SuccessorGenerator;
use task::number::Int;
use task::task::{OperatorId, State};

use crate::concurrent::happening::{Happening, Role};
use crate::concurrent::interference::InterferenceConstraints;
use crate::concurrent::simple_temporal_network::{self, Kind, SimpleTemporalNetwork};
use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;

/// Limit on searched simultaneous runs of an instance if the number of useful runs is bounded.
const MAX_PARALLEL_RUNS: u32 = 16;
/// Limit on searched simultaneous runs of an instance if no bound on the number of useful runs is
/// known.
const UNBOUNDED_RUNS: u32 = 4;

#[derive(Debug, Clone)]
pub(super) struct TemporalState<T: TimeNumber = Int> {
    pub(super) state: State,
    pub(super) clocks: SimpleTemporalNetwork<T>,
    /// Sum of the costs of the happenings, in the task's cost unit.
    pub(super) cost: Int,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DeadEnd {
    /// The happening is not applicable or certainly useless, or its temporal constraints are inconsistent.
    Impossible,
    /// Timed initial literals must take place before the happening.
    TooLate,
    /// Numbers overflow, a duration is shorter than the separation, or an instance has too many simultaneous
    /// runs or simultaneous runs of different durations. Discarding such a successor makes the search
    /// incomplete.
    Unfit,
}

pub(super) struct Expansion<'a, T: TimeNumber = Int> {
    concurrent: &'a TemporalTask<T>,
    index: SuccessorGenerator,
}

impl<'a, T: TimeNumber> Expansion<'a, T> {
    pub(super) fn new(concurrent: &'a TemporalTask<T>) -> Self {
        let begins = |id: &OperatorId| {
            matches!(concurrent.happenings[id.index()].role, Role::Start(_) | Role::Whole | Role::Timed(_))
        };
        let operators = OperatorId::all(concurrent.task.operators.len()).filter(begins);
        Self { concurrent, index: SuccessorGenerator::over(&concurrent.task, operators) }
    }

    pub(super) fn root(&self) -> TemporalState<T> {
        TemporalState {
            state: self.concurrent.task.initial.clone(),
            clocks: SimpleTemporalNetwork::new(),
            cost: 0,
        }
    }

    /// Candidate happenings: starts, instantaneous actions and timed initial literals whose
    /// propositional condition holds, and ends of running actions.
    pub(super) fn candidates(&self, situation: &TemporalState<T>) -> Vec<OperatorId> {
        let mut next = self.starts(&situation.state);
        let mut opens: Vec<u32> = situation.clocks.opens().iter().map(|open| open.instance).collect();
        opens.dedup();
        next.extend(opens.into_iter().map(|open| self.concurrent.instances[open as usize].end));
        next
    }

    /// Candidate happenings other than ends: those whose propositional condition holds.
    pub(super) fn starts(&self, state: &State) -> Vec<OperatorId> {
        self.index.applicable(&self.concurrent.task, state)
    }

    pub(super) fn next_event(&self, clocks: &SimpleTemporalNetwork<T>) -> Option<(T, OperatorId)> {
        let events = &self.concurrent.events;
        events.get(events.partition_point(|(time, _)| *time <= clocks.floor())).copied()
    }

    pub(super) fn is_goal(&self, TemporalState { state, clocks, .. }: &TemporalState<T>) -> bool {
        let concurrent = self.concurrent;
        // All timed initial literals up to the end of the plan have taken place, no later ones
        // have, and the later ones keep the separation.
        let mut to_come = concurrent.events.iter().filter(|(time, _)| *time > clocks.floor());
        let is_apart = |(time, event): &(T, OperatorId)| {
            let after = &concurrent.happenings[event.index()].accesses.after;
            *time > clocks.latest() && clocks.are_apart(*time, after)
        };
        clocks.opens().is_empty()
            && !clocks.unsettled()
            && !clocks.waits()
            && concurrent.task.is_goal(state)
            && to_come.all(is_apart)
    }

    /// Returns the successor of a state by a happening, and whether the end of the started action
    /// was applied as well. An end is applied together with its start if this preserves
    /// completeness. A plan may have to delay its last end until timed initial literals have taken
    /// place. While some are pending, start and end are therefore combined only if `exact` is not
    /// set.
    pub(super) fn after(
        &self,
        situation: &TemporalState<T>,
        operator: OperatorId,
        exact: bool,
    ) -> Result<(TemporalState<T>, bool), DeadEnd> {
        let after_start = self.step(situation, operator)?;
        let Some(end) = self.compressed(situation, &after_start, operator) else {
            return Ok((after_start, false));
        };
        let Ok(ended) = self.step(&after_start, end) else { return Ok((after_start, false)) };
        // If timed initial literals came in between, the action could not be delayed.
        let in_time =
            self.next_event(&ended.clocks).is_none_or(|(time, _)| !exact && ended.clocks.finishes_by(time));
        Ok(if in_time && !ended.clocks.unsettled() { (ended, true) } else { (after_start, false) })
    }

    /// Returns the end to apply directly after a start, or `None` if the start and the end are
    /// separate steps. Only the first run of an instance qualifies, because the first run also ends
    /// first.
    fn compressed(
        &self,
        before: &TemporalState<T>,
        started: &TemporalState<T>,
        operator: OperatorId,
    ) -> Option<OperatorId> {
        let Role::Start(instance) = self.concurrent.happenings[operator.index()].role else { return None };
        let is_first = before.clocks.runs(instance) == 0;
        let instance = &self.concurrent.instances[instance as usize];
        (is_first && instance.compressible && !started.clocks.unsettled()).then_some(instance.end)
    }

    pub(super) fn step(
        &self,
        situation: &TemporalState<T>,
        operator_id: OperatorId,
    ) -> Result<TemporalState<T>, DeadEnd> {
        let concurrent = self.concurrent;
        let TemporalState { state, clocks, cost } = situation;
        let (operator, happening) =
            (&concurrent.task.operators[operator_id.index()], &concurrent.happenings[operator_id.index()]);
        if !operator.applicable(state, &[]) {
            return Err(DeadEnd::Impossible);
        }
        let (kind, instance) = match happening.role {
            Role::Start(instance) => (Kind::Start, instance),
            Role::End(instance) => (Kind::End, instance),
            // Timed initial literals are distinguished below.
            Role::Whole | Role::Timed(_) => (Kind::Whole, u32::MAX),
            Role::Never => return Err(DeadEnd::Impossible),
        };
        let instance_data = concurrent.instances.get(instance as usize);
        let counts_by_end = instance_data.is_some_and(|instance| instance.counts_by_end);
        let useful_runs = instance_data.map_or(u32::MAX, |instance| instance.most);
        if kind == Kind::Start && clocks.runs(instance) >= useful_runs || self.clashes(clocks, happening) {
            return Err(DeadEnd::Impossible);
        }
        let max_runs = if useful_runs == u32::MAX { UNBOUNDED_RUNS } else { MAX_PARALLEL_RUNS };
        if kind == Kind::Start && clocks.runs(instance) >= max_runs {
            return Err(DeadEnd::Unfit);
        }
        let mut after = concurrent.task.successor(operator, state, &[]).ok_or(DeadEnd::Unfit)?;
        // The run changes nothing, so the plan without the run is as good.
        if kind == Kind::End && counts_by_end && after == *state {
            return Err(DeadEnd::Impossible);
        }
        // The first run of an instance ends first.
        let runs = || clocks.opens().iter().map(|open| open.instance);
        let ended = if kind == Kind::End { runs().position(|open| open == instance) } else { None };
        let going_on = || (0..).zip(runs()).filter(|(position, _)| Some(*position) != ended);
        if kind == Kind::End && going_on().all(|(_, open)| open != instance) {
            concurrent.end_last_run(instance, &mut after);
        }
        let mut running = going_on().map(|(_, open)| open).chain((kind == Kind::Start).then_some(instance));
        let settled = running.all(|open| concurrent.holds_over_all(open, &after));
        let sets = happening.sets.iter().copied();
        let changes: Vec<u32> = sets
            .filter(|variable| state.values[*variable as usize] != after.values[*variable as usize])
            .collect();
        let clocks = if let Role::Timed(event) = happening.role {
            let time = concurrent.events[event as usize].0;
            let InterferenceConstraints { after, marks } = &happening.accesses;
            clocks.timed(&simple_temporal_network::Event { time, after, marks, changes: &changes, settled })
        } else {
            let starting = instance_data.filter(|_| kind == Kind::Start);
            let duration = starting.map_or(Some(T::ZERO), |instance| concurrent.duration(instance, &after));
            // The first run ends first only if all runs have the same duration.
            let mut runs = clocks.opens().iter().filter(|open| open.instance == instance);
            if starting.is_some() && runs.any(|open| Some(open.duration) != duration) {
                return Err(DeadEnd::Unfit);
            }
            clocks.after(&simple_temporal_network::Happening {
                kind,
                instance,
                duration: duration.ok_or(DeadEnd::Unfit)?,
                after: &happening.accesses.after,
                marks: &happening.accesses.marks,
                joint: instance_data.is_some_and(|instance| !instance.joint.is_empty()),
                touches: &|instance| concurrent.touches(operator_id, instance),
                changes: &changes,
                settled,
            })
        };
        let mut clocks = clocks.ok_or(DeadEnd::Impossible)?;
        for position in 0..clocks.opens().len() {
            let running = &concurrent.instances[clocks.opens()[position].instance as usize];
            let after = &concurrent.happenings[running.end.index()].accesses.after;
            clocks.expect_end(position, after).ok_or(DeadEnd::Impossible)?;
        }
        // Happenings that the network places after the next event must not precede it in the
        // sequence.
        if self.next_event(&clocks).is_some_and(|(time, _)| clocks.latest() > time) {
            return Err(DeadEnd::TooLate);
        }
        clocks.forget(&concurrent.guards, concurrent.separation);
        let cost = cost.checked_add(operator.cost.constant).ok_or(DeadEnd::Unfit)?;
        Ok(TemporalState { state: after, clocks, cost })
    }

    /// Returns `true` if a running action uses a function of the happening with another design.
    fn clashes(&self, clocks: &SimpleTemporalNetwork<T>, happening: &Happening<T>) -> bool {
        happening.designs.iter().any(|(function, design)| {
            clocks.opens().iter().any(|open| {
                let running_designs = &self.concurrent.instances[open.instance as usize].designs;
                running_designs.iter().any(|(candidate, used)| candidate == function && used != design)
            })
        })
    }
}
