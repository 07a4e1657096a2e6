//! Successors of a temporal state: one happening, or the start and the end of an action at once.

use search::search::successor_generator::SuccessorGenerator;
use task::number::Int;
use task::task::{OperatorId, State};

use crate::concurrent::happening::{Happening, Role};
use crate::concurrent::interference::InterferenceConstraints;
use crate::concurrent::simple_temporal_network::{self, Kind, SimpleTemporalNetwork};
use crate::concurrent::temporal_task::TemporalTask;

/// More runs of an instance at a time are not looked for: where so many can make a difference, and where no bound is known.
const MAX_PARALLEL_RUNS: u32 = 16;
const UNBOUNDED_RUNS: u32 = 4;

/// Where a sequence of happenings has led.
#[derive(Debug, Clone)]
pub(super) struct TemporalState {
    pub(super) state: State,
    pub(super) clocks: SimpleTemporalNetwork,
    /// In the task's cost unit.
    pub(super) cost: Int,
}

/// Why a happening leads nowhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DeadEnd {
    /// It cannot happen here.
    Impossible,
    /// Timed initial literals come first.
    TooLate,
    /// Numbers do not fit their type, or runs of an instance are too many or of different length: it is left out.
    Unfit,
}

/// What follows what.
pub(super) struct Expansion<'a> {
    concurrent: &'a TemporalTask,
    index: SuccessorGenerator,
}

impl<'a> Expansion<'a> {
    pub(super) fn new(concurrent: &'a TemporalTask) -> Self {
        let begins = |id: &OperatorId| {
            matches!(concurrent.happenings[id.index()].role, Role::Start(_) | Role::Whole | Role::Timed(_))
        };
        let operators = OperatorId::all(concurrent.task.operators.len()).filter(begins);
        Self { concurrent, index: SuccessorGenerator::over(&concurrent.task, operators) }
    }

    /// When nothing has happened yet.
    pub(super) fn root(&self) -> TemporalState {
        TemporalState {
            state: self.concurrent.task.initial.clone(),
            clocks: SimpleTemporalNetwork::new(),
            cost: 0,
        }
    }

    /// The happenings whose propositional condition holds: starts, and ends of what is under way.
    pub(super) fn candidates(&self, situation: &TemporalState) -> Vec<OperatorId> {
        let mut next = self.starts(&situation.state);
        let mut opens: Vec<u32> = situation.clocks.opens().iter().map(|open| open.instance).collect();
        opens.dedup();
        next.extend(opens.into_iter().map(|open| self.concurrent.instances[open as usize].end));
        next
    }

    /// The happenings but ends whose propositional condition holds.
    pub(super) fn starts(&self, state: &State) -> Vec<OperatorId> {
        self.index.applicable(&self.concurrent.task, state)
    }

    /// The timed initial literals that come next.
    pub(super) fn next_event(&self, clocks: &SimpleTemporalNetwork) -> Option<(Int, OperatorId)> {
        let events = &self.concurrent.events;
        events.get(events.partition_point(|(time, _)| *time <= clocks.floor())).copied()
    }

    /// Whether a plan can end here.
    pub(super) fn is_goal(&self, TemporalState { state, clocks, .. }: &TemporalState) -> bool {
        let concurrent = self.concurrent;
        // What happens by itself up to the end has taken place, and nothing after the end; what comes soon after keeps apart.
        let mut to_come = concurrent.events.iter().filter(|(time, _)| *time > clocks.floor());
        let is_apart = |(time, event): &(Int, OperatorId)| {
            let after = &concurrent.happenings[event.index()].accesses.after;
            *time > clocks.latest() && clocks.are_apart(*time, after)
        };
        clocks.opens().is_empty()
            && !clocks.unsettled()
            && !clocks.waits()
            && concurrent.task.is_goal(state)
            && to_come.all(is_apart)
    }

    /// The situation after a happening, and whether its action has ended as well: where that loses nothing, an end
    /// comes right after its start. A plan may have to wait for timed initial literals with its last end, so while some are to come
    /// this loses a plan now and then; `exact` is without that.
    pub(super) fn after(
        &self,
        situation: &TemporalState,
        operator: OperatorId,
        exact: bool,
    ) -> Result<(TemporalState, bool), DeadEnd> {
        let started = self.step(situation, operator)?;
        let Some(end) = self.compressed(situation, &started, operator) else { return Ok((started, false)) };
        let Ok(ended) = self.step(&started, end) else { return Ok((started, false)) };
        // Were timed initial literals to come in between, the action could not be put off.
        let in_time =
            self.next_event(&ended.clocks).is_none_or(|(time, _)| !exact && ended.clocks.finishes_by(time));
        Ok(if in_time && !ended.clocks.unsettled() { (ended, true) } else { (started, false) })
    }

    /// The end that comes right after a start. The first run ends first, so it is not that of another run.
    fn compressed(
        &self,
        before: &TemporalState,
        started: &TemporalState,
        operator: OperatorId,
    ) -> Option<OperatorId> {
        let Role::Start(instance) = self.concurrent.happenings[operator.index()].role else { return None };
        let is_first = before.clocks.runs(instance) == 0;
        let instance = &self.concurrent.instances[instance as usize];
        (is_first && instance.compressible && !started.clocks.unsettled()).then_some(instance.end)
    }

    /// The situation after one happening.
    pub(super) fn step(
        &self,
        situation: &TemporalState,
        operator_id: OperatorId,
    ) -> Result<TemporalState, DeadEnd> {
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
            // Those that happen by themselves are told apart below.
            Role::Whole | Role::Timed(_) => (Kind::Whole, u32::MAX),
            Role::Never => return Err(DeadEnd::Impossible),
        };
        let own = concurrent.instances.get(instance as usize);
        let counts_by_end = own.is_some_and(|own| own.counts_by_end);
        let most = own.map_or(u32::MAX, |own| own.most);
        if kind == Kind::Start && clocks.runs(instance) >= most || self.clashes(clocks, happening) {
            return Err(DeadEnd::Impossible);
        }
        let looked_for = if most == u32::MAX { UNBOUNDED_RUNS } else { MAX_PARALLEL_RUNS };
        if kind == Kind::Start && clocks.runs(instance) >= looked_for {
            return Err(DeadEnd::Unfit);
        }
        let mut after = concurrent.task.successor(operator, state, &[]).ok_or(DeadEnd::Unfit)?;
        // Without such a run everything else is as it was.
        if kind == Kind::End && counts_by_end && after == *state {
            return Err(DeadEnd::Impossible);
        }
        // Of the runs of an instance the first one ends first.
        let runs = || clocks.opens().iter().map(|open| open.instance);
        let ended = if kind == Kind::End { runs().position(|open| open == instance) } else { None };
        let going_on = || (0..).zip(runs()).filter(|(position, _)| Some(*position) != ended);
        if kind == Kind::End && going_on().all(|(_, open)| open != instance) {
            concurrent.end_last_run(instance, &mut after);
        }
        let mut all = going_on().map(|(_, open)| open).chain((kind == Kind::Start).then_some(instance));
        let settled = all.all(|open| concurrent.holds_over_all(open, &after));
        let sets = happening.sets.iter().copied();
        let changes: Vec<u32> = sets
            .filter(|variable| state.values[*variable as usize] != after.values[*variable as usize])
            .collect();
        let clocks = if let Role::Timed(time) = happening.role {
            let InterferenceConstraints { after, marks } = &happening.accesses;
            clocks.timed(&simple_temporal_network::Event { time, after, marks, changes: &changes, settled })
        } else {
            let started = own.filter(|_| kind == Kind::Start);
            let duration = started.map_or(Some(0), |own| concurrent.duration(own, &after));
            // The first run ends first only if all take as long.
            let mut runs = clocks.opens().iter().filter(|open| open.instance == instance);
            if started.is_some() && runs.any(|open| Some(open.duration) != duration) {
                return Err(DeadEnd::Unfit);
            }
            clocks.after(&simple_temporal_network::Happening {
                kind,
                instance,
                duration: duration.ok_or(DeadEnd::Unfit)?,
                after: &happening.accesses.after,
                marks: &happening.accesses.marks,
                joint: own.is_some_and(|own| !own.joint.is_empty()),
                touches: &|instance| concurrent.touches(operator_id, instance),
                changes: &changes,
                settled,
            })
        };
        let mut clocks = clocks.ok_or(DeadEnd::Impossible)?;
        for position in 0..clocks.opens().len() {
            let own = &concurrent.instances[clocks.opens()[position].instance as usize];
            let after = &concurrent.happenings[own.end.index()].accesses.after;
            clocks.expect_end(position, after).ok_or(DeadEnd::Impossible)?;
        }
        // Nothing can happen after what comes later in the sequence.
        if self.next_event(&clocks).is_some_and(|(time, _)| clocks.latest() > time) {
            return Err(DeadEnd::TooLate);
        }
        clocks.forget(&concurrent.guards, concurrent.separation);
        let cost = cost.checked_add(operator.cost.constant).ok_or(DeadEnd::Unfit)?;
        Ok(TemporalState { state: after, clocks, cost })
    }

    /// Whether an action under way uses a function with another design.
    fn clashes(&self, clocks: &SimpleTemporalNetwork, happening: &Happening) -> bool {
        happening.designs.iter().any(|(function, design)| {
            clocks.opens().iter().any(|open| {
                let other = &self.concurrent.instances[open.instance as usize].designs;
                other.iter().any(|(own, used)| own == function && used != design)
            })
        })
    }
}
