//! Situations to those that can follow them: one happening on, or the start and the end of an action at once.

use search::search::generator::OperatorIndex;
use task::number::Int;
use task::task::{OperatorId, State};

use crate::concurrent::access::Accesses;
use crate::concurrent::clocks::{self, Clocks, Kind};
use crate::concurrent::compile::Concurrent;
use crate::concurrent::happening::{Happening, Role};

/// More runs of an instance at a time are not looked for: where so many can make a difference, and where no bound is known.
const RUNS: u32 = 16;
const UNBOUNDED_RUNS: u32 = 4;

/// Where a sequence of happenings has led.
#[derive(Debug, Clone)]
pub(super) struct Situation {
    pub(super) state: State,
    pub(super) clocks: Clocks,
    /// In the task's cost unit.
    pub(super) cost: Int,
}

/// Why a happening leads nowhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Nowhere {
    /// It cannot happen here.
    Impossible,
    /// Timed initial literals come first.
    TooLate,
    /// Numbers do not fit their type, or runs of an instance are too many or of different length: it is left out.
    Unfit,
}

/// What follows what.
pub(super) struct Expansion<'a> {
    concurrent: &'a Concurrent,
    index: OperatorIndex,
}

impl<'a> Expansion<'a> {
    pub(super) fn new(concurrent: &'a Concurrent) -> Self {
        let begins = |id: &OperatorId| {
            matches!(concurrent.happenings[id.index()].role, Role::Start(_) | Role::Whole | Role::Timed(_))
        };
        let operators = OperatorId::all(concurrent.task.operators.len()).filter(begins);
        Self { concurrent, index: OperatorIndex::over(&concurrent.task, operators) }
    }

    /// When nothing has happened yet.
    pub(super) fn root(&self) -> Situation {
        Situation { state: self.concurrent.task.initial.clone(), clocks: Clocks::new(), cost: 0 }
    }

    /// The happenings whose propositional condition holds: starts, and ends of what is under way.
    pub(super) fn candidates(&self, situation: &Situation) -> Vec<OperatorId> {
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
    pub(super) fn next_event(&self, clocks: &Clocks) -> Option<(Int, OperatorId)> {
        let events = &self.concurrent.events;
        events.get(events.partition_point(|(time, _)| *time <= clocks.floor())).copied()
    }

    /// Whether a plan can end here.
    pub(super) fn is_goal(&self, Situation { state, clocks, .. }: &Situation) -> bool {
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
        situation: &Situation,
        operator: OperatorId,
        exact: bool,
    ) -> Result<(Situation, bool), Nowhere> {
        let started = self.step(situation, operator)?;
        let Some(end) = self.compressed(situation, &started, operator) else { return Ok((started, false)) };
        let Ok(ended) = self.step(&started, end) else { return Ok((started, false)) };
        // Were timed initial literals to come in between, the action could not be put off.
        let in_time =
            self.next_event(&ended.clocks).is_none_or(|(time, _)| !exact && ended.clocks.is_by(time));
        Ok(if in_time && !ended.clocks.unsettled() { (ended, true) } else { (started, false) })
    }

    /// The end that comes right after a start. The first run ends first, so it is not that of another run.
    fn compressed(
        &self,
        before: &Situation,
        started: &Situation,
        operator: OperatorId,
    ) -> Option<OperatorId> {
        let Role::Start(instance) = self.concurrent.happenings[operator.index()].role else { return None };
        let is_first = before.clocks.runs(instance) == 0;
        let instance = &self.concurrent.instances[instance as usize];
        (is_first && instance.compressible && !started.clocks.unsettled()).then_some(instance.end)
    }

    /// The situation after one happening.
    pub(super) fn step(&self, situation: &Situation, operator_id: OperatorId) -> Result<Situation, Nowhere> {
        let concurrent = self.concurrent;
        let Situation { state, clocks, cost } = situation;
        let (operator, happening) =
            (&concurrent.task.operators[operator_id.index()], &concurrent.happenings[operator_id.index()]);
        if !operator.applicable(state, &[]) {
            return Err(Nowhere::Impossible);
        }
        let (kind, instance) = match happening.role {
            Role::Start(instance) => (Kind::Start, instance),
            Role::End(instance) => (Kind::End, instance),
            // Those that happen by themselves are told apart below.
            Role::Whole | Role::Timed(_) => (Kind::Whole, u32::MAX),
            Role::Never => return Err(Nowhere::Impossible),
        };
        let own = concurrent.instances.get(instance as usize);
        let counts_by_end = own.is_some_and(|own| own.counts_by_end);
        let most = own.map_or(u32::MAX, |own| own.most);
        if kind == Kind::Start && clocks.runs(instance) >= most || self.clashes(clocks, happening) {
            return Err(Nowhere::Impossible);
        }
        let looked_for = if most == u32::MAX { UNBOUNDED_RUNS } else { RUNS };
        if kind == Kind::Start && clocks.runs(instance) >= looked_for {
            return Err(Nowhere::Unfit);
        }
        let mut after = concurrent.task.successor(operator, state, &[]).ok_or(Nowhere::Unfit)?;
        // Without such a run everything else is as it was.
        if kind == Kind::End && counts_by_end && after == *state {
            return Err(Nowhere::Impossible);
        }
        // Of the runs of an instance the first one ends first.
        let runs = || clocks.opens().iter().map(|open| open.instance);
        let ended = if kind == Kind::End { runs().position(|open| open == instance) } else { None };
        let going_on = || (0..).zip(runs()).filter(|(position, _)| Some(*position) != ended);
        if kind == Kind::End && going_on().all(|(_, open)| open != instance) {
            concurrent.cease(instance, &mut after);
        }
        let mut all = going_on().map(|(_, open)| open).chain((kind == Kind::Start).then_some(instance));
        let settled = all.all(|open| concurrent.holds_over_all(open, &after));
        let sets = happening.sets.iter().copied();
        let changes: Vec<u32> = sets
            .filter(|variable| state.values[*variable as usize] != after.values[*variable as usize])
            .collect();
        let clocks = if let Role::Timed(time) = happening.role {
            let Accesses { after, marks } = &happening.accesses;
            clocks.timed(&clocks::Event { time, after, marks, changes: &changes, settled })
        } else {
            let started = own.filter(|_| kind == Kind::Start);
            let duration = started.map_or(Some(0), |own| concurrent.duration(own, &after));
            // The first run ends first only if all take as long.
            let mut runs = clocks.opens().iter().filter(|open| open.instance == instance);
            if started.is_some() && runs.any(|open| Some(open.duration) != duration) {
                return Err(Nowhere::Unfit);
            }
            clocks.after(&clocks::Happening {
                kind,
                instance,
                duration: duration.ok_or(Nowhere::Unfit)?,
                after: &happening.accesses.after,
                marks: &happening.accesses.marks,
                joint: own.is_some_and(|own| !own.joint.is_empty()),
                touches: &|instance| concurrent.touches(operator_id, instance),
                changes: &changes,
                settled,
            })
        };
        let mut clocks = clocks.ok_or(Nowhere::Impossible)?;
        for position in 0..clocks.opens().len() {
            let own = &concurrent.instances[clocks.opens()[position].instance as usize];
            let after = &concurrent.happenings[own.end.index()].accesses.after;
            clocks.expect_end(position, after).ok_or(Nowhere::Impossible)?;
        }
        // Nothing can happen after what comes later in the sequence.
        if self.next_event(&clocks).is_some_and(|(time, _)| clocks.latest() > time) {
            return Err(Nowhere::TooLate);
        }
        clocks.forget(&concurrent.guards, concurrent.separation);
        let cost = cost.checked_add(operator.cost.constant).ok_or(Nowhere::Unfit)?;
        Ok(Situation { state: after, clocks, cost })
    }

    /// Whether an action under way uses a function with another design.
    fn clashes(&self, clocks: &Clocks, happening: &Happening) -> bool {
        happening.designs.iter().any(|(function, design)| {
            clocks.opens().iter().any(|open| {
                let other = &self.concurrent.instances[open.instance as usize].designs;
                other.iter().any(|(own, used)| own == function && used != design)
            })
        })
    }
}
