//! Relaxed plans with times: the soonest way to reach some facts if nothing is deleted.
//!
//! A rule fires when its last condition holds (h^max over time). The end of an action fires a duration after
//! its start, and timed initial literals at their time. If the time at which a fact of the state was achieved
//! is recorded, the fact holds from this time. So objects that are free early, such as the robot that finishes
//! first, achieve a fact sooner. Each proposition is supported by the rule that adds it first; among these, by
//! one with the smaller relaxed plan. The actions are sorted by their latest start, as in critical path
//! scheduling, so the longest chain is executed first.
//!
//! Similar relaxed plans guide Sapa \[1\].
//!
//! \[1\] M. Do, S. Kambhampati: Sapa: a multi-objective metric temporal planner, JAIR 20, 2003.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rustc_hash::FxHashMap;
use task::number::Int;
use task::task::quantity::Linear;
use task::task::{NumericId, OperatorId, State};

use crate::concurrent::happening::Role;
use crate::concurrent::relaxed_plan_heuristic::repetitions;
use crate::concurrent::rule::Proposition;
use crate::concurrent::successors::TemporalState;
use crate::concurrent::temporal_relaxation::TemporalRelaxation;
use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;

/// A time of the relaxation. Times only guide the search, so larger ones saturate.
type Time = i64;

/// Constant times are rounded down so that they have at most this number of bits. Sums of thousands of them
/// then fit.
const TIME_BITS: u64 = 48;
const NEVER: Time = Time::MAX;
const MAX_REPETITIONS: u32 = 8;

#[derive(Debug, Clone)]
pub(super) struct TimedRelaxedPlan {
    /// Time at which the last target holds, in the unit of the relaxation.
    pub(super) finish: i64,
    /// Starts, actions without duration, and timed initial literals, sorted by the latest time at which they
    /// must happen. A happening occurs once for each of its repetitions, at most `MAX_REPETITIONS` times.
    pub(super) happenings: Vec<OperatorId>,
}

#[derive(Debug, Clone, Copy)]
enum Timing {
    Immediate,
    Start(u32),
    End(u32),
    At(Time),
}

enum Duration<T: TimeNumber> {
    Constant(Time),
    /// Expression that the start assigns to the number holding the duration, and the factor from this number
    /// to internal time units.
    Assigned(Linear<Int>, T),
}

pub(super) struct TimedRelaxation<'a, T: TimeNumber = Int> {
    concurrent: &'a TemporalTask<T>,
    relaxed: &'a TemporalRelaxation,
    timings: Vec<Timing>,
    durations: Vec<Duration<T>>,
    separation: Time,
    /// Times are in units of 2^`shift` internal time units, rounded down.
    shift: u64,
    /// For each proposition: the time from which it holds, and an estimate of the number of actions of its relaxed plan.
    values: Vec<(Time, u32)>,
    /// Rule that adds each proposition, and the number of its repetitions.
    supporters: Vec<Option<(u32, u32)>>,
    is_settled: Vec<bool>,
    unmet: Vec<u32>,
    sums: Vec<u32>,
    /// For each rule: its position in the order in which rules fire.
    order: Vec<u32>,
    latest: Vec<Time>,
    is_used: Vec<bool>,
    fired: u32,
    /// Per instance: relaxed time of its start, and its duration then.
    starts: Vec<(Time, Time)>,
    /// Per numeric condition: amount that is missing. `None` if unknown; the condition then counts as
    /// satisfied.
    missing: Vec<Option<Int>>,
    queue: BinaryHeap<Reverse<(Time, u32, Proposition)>>,
}

/// Converts a time to units of 2^`shift` internal time units, rounded down.
fn time<T: TimeNumber>(time: T, shift: u64) -> Time {
    // A saturated time is below `NEVER`, so it still counts as reachable.
    Time::try_from(time.shifted_down(shift)).unwrap_or(NEVER / 4)
}

fn assigned<T: TimeNumber>(
    concurrent: &TemporalTask<T>,
    start: OperatorId,
    number: NumericId,
) -> Option<Linear<Int>> {
    let effects = &concurrent.task.operators[start.index()].numeric_effects;
    effects.iter().find(|effect| effect.variable == number).map(|effect| effect.value.clone())
}

impl<'a, T: TimeNumber> TimedRelaxation<'a, T> {
    pub(super) fn new(concurrent: &'a TemporalTask<T>, relaxed: &'a TemporalRelaxation) -> Self {
        let durations = concurrent.instances.iter().map(|instance| instance.duration);
        let times = durations.chain(concurrent.events.iter().map(|(time, _)| *time));
        let longest = times.max().unwrap_or(concurrent.separation);
        let shift = longest.bits().saturating_sub(TIME_BITS);
        let timing = |origin: &Option<OperatorId>| match origin {
            Some(id) => match concurrent.happenings[id.index()].role {
                Role::Start(instance) => Timing::Start(instance),
                Role::End(instance) => Timing::End(instance),
                Role::Timed(event) => Timing::At(time(concurrent.events[event as usize].0, shift)),
                Role::Whole | Role::Never => Timing::Immediate,
            },
            None => Timing::Immediate,
        };
        let durations = concurrent.instances.iter().map(|instance| {
            let assigned = instance.timer.and_then(|(number, factor)| {
                Some(Duration::Assigned(assigned(concurrent, instance.start, number)?, factor))
            });
            assigned.unwrap_or_else(|| Duration::Constant(time(instance.duration, shift)))
        });
        let (propositions, rules) = (relaxed.propositions, relaxed.unmet.len());
        Self {
            concurrent,
            relaxed,
            timings: relaxed.origins.iter().map(timing).collect(),
            durations: durations.collect(),
            separation: time(concurrent.separation, shift),
            shift,
            values: vec![(NEVER, 0); propositions],
            supporters: vec![None; propositions],
            is_settled: vec![false; propositions],
            unmet: vec![0; rules],
            sums: vec![0; rules],
            order: vec![0; rules],
            latest: vec![NEVER; rules],
            is_used: vec![false; rules],
            fired: 0,
            starts: vec![(NEVER, 0); concurrent.instances.len()],
            missing: vec![None; relaxed.numeric.len()],
            queue: BinaryHeap::new(),
        }
    }

    /// Relaxed plan from a state without running actions. Returns `None` if a target is
    /// unreachable.
    pub(super) fn plan(
        &mut self,
        situation: &TemporalState<T>,
        targets: &[Proposition],
    ) -> Option<TimedRelaxedPlan> {
        self.reach(situation, targets);
        let is_reached = |target: &Proposition| self.values[*target as usize].0 < NEVER;
        targets.iter().all(is_reached).then(|| self.extract(targets))
    }

    fn reach(&mut self, TemporalState { state, clocks, .. }: &TemporalState<T>, targets: &[Proposition]) {
        let relaxed = self.relaxed;
        self.values.fill((NEVER, 0));
        self.supporters.fill(None);
        self.is_settled.fill(false);
        self.sums.fill(0);
        self.unmet.copy_from_slice(&relaxed.unmet);
        self.starts.fill((NEVER, 0));
        self.queue.clear();
        self.fired = 0;
        for (missing, numeric) in self.missing.iter_mut().zip(&relaxed.numeric) {
            *missing = numeric.linear.value(&state.numbers, &[], &[]).map(Int::saturating_neg);
        }
        let now = time(clocks.floor(), self.shift).max(0);
        for ((variable, first), value) in (0..).zip(&relaxed.first).zip(&state.values) {
            let changed = clocks.changed(variable);
            let since =
                changed.map_or(0, |changed| time(changed, self.shift).saturating_add(self.separation));
            self.improve(first.saturating_add(*value), (since.max(now), 0), None);
        }
        for default in &relaxed.defaults {
            self.improve(*default, (now, 0), None);
        }
        for position in 0..relaxed.numeric.len() {
            if self.missing[position].is_none_or(|missing| missing <= 0) {
                self.improve(relaxed.numeric[position].proposition, (now, 0), None);
            }
        }
        for [conjunction, first, second] in &relaxed.conjunctions {
            let values = [first, second].map(|fact| self.values[*fact as usize]);
            if values.iter().all(|(time, count)| *time < NEVER && *count == 0) {
                self.improve(*conjunction, values[0].max(values[1]), None);
            }
        }
        for rule in &relaxed.free {
            self.fire(*rule, now, state);
        }
        let mut unsettled = targets.to_vec();
        unsettled.sort_unstable();
        unsettled.dedup();
        let mut unsettled = unsettled.len();
        while let Some(Reverse((at, count, proposition))) = self.queue.pop() {
            if self.is_settled[proposition as usize] {
                continue;
            }
            self.is_settled[proposition as usize] = true;
            if targets.contains(&proposition) {
                unsettled = unsettled.saturating_sub(1);
                if unsettled == 0 {
                    return;
                }
            }
            for rule in relaxed.needing.of(proposition) {
                let sum = &mut self.sums[*rule as usize];
                *sum = sum.saturating_add(count);
                let unmet = &mut self.unmet[*rule as usize];
                *unmet = unmet.saturating_sub(1);
                if *unmet == 0 {
                    self.fire(*rule, at, state);
                }
            }
        }
    }

    fn improve(&mut self, proposition: Proposition, value: (Time, u32), by: Option<(u32, u32)>) {
        let current = &mut self.values[proposition as usize];
        if (value.0, value.1) < *current {
            *current = value;
            self.supporters[proposition as usize] = by;
            self.queue.push(Reverse((value.0, value.1, proposition)));
        }
    }

    fn fire(&mut self, rule: u32, at: Time, state: &State) {
        let relaxed = self.relaxed;
        self.order[rule as usize] = self.fired;
        self.fired = self.fired.saturating_add(1);
        let (mut at, mut period) = (at, 0);
        let mut is_action = 1;
        match self.timings[rule as usize] {
            Timing::Immediate => is_action = u32::from(relaxed.origins[rule as usize].is_some()),
            Timing::Start(instance) => {
                let duration = self.duration(instance, state);
                period = duration.saturating_add(self.separation);
                let start = &mut self.starts[instance as usize];
                *start = (*start).min((at, duration));
            }
            Timing::End(instance) => {
                let (start, duration) = self.starts[instance as usize];
                let end = if start < NEVER { start } else { at }.saturating_add(duration);
                // Other happenings can use facts that the end achieves only one separation after the end.
                at = at.max(end).saturating_add(self.separation);
                period = duration.saturating_add(self.separation);
                is_action = 0;
            }
            Timing::At(time) => at = at.max(time),
        }
        let count = self.sums[rule as usize].saturating_add(is_action);
        for add in relaxed.adds.of(rule) {
            self.improve(*add, (at, count), Some((rule, 1)));
        }
        for (position, by) in &relaxed.raises[rule as usize] {
            let times = repetitions(self.missing[*position as usize], *by);
            let later = at.saturating_add(period.saturating_mul(Time::from(times.saturating_sub(1))));
            let count = self.sums[rule as usize].saturating_add(times);
            let proposition = relaxed.numeric[*position as usize].proposition;
            self.improve(proposition, (later, count), Some((rule, times.min(MAX_REPETITIONS))));
        }
    }

    /// Duration of an instance that starts in a state; a duration that depends on other numbers is
    /// estimated by its value in this state.
    fn duration(&self, instance: u32, state: &State) -> Time {
        match &self.durations[instance as usize] {
            Duration::Constant(duration) => *duration,
            Duration::Assigned(value, factor) => {
                let value = value.value(&state.numbers, &[], &[]);
                let duration = value.and_then(|value| T::from(value).checked_mul(*factor));
                time(duration.unwrap_or_default().max(self.concurrent.separation), self.shift)
            }
        }
    }

    fn extract(&mut self, targets: &[Proposition]) -> TimedRelaxedPlan {
        let relaxed = self.relaxed;
        let finish = targets.iter().map(|target| self.values[*target as usize].0).max().unwrap_or_default();
        let mut used: Vec<(u32, u32)> = Vec::new();
        let mut stack: Vec<Proposition> = targets.to_vec();
        while let Some(proposition) = stack.pop() {
            let Some((rule, times)) = self.supporters[proposition as usize] else { continue };
            if !std::mem::replace(&mut self.is_used[rule as usize], true) {
                self.latest[rule as usize] = NEVER;
                used.push((rule, times));
                stack.extend(relaxed.needs.of(rule));
            }
        }
        for target in targets {
            self.limit(*target, finish, finish);
        }
        // A rule fires after the supporters of its conditions.
        used.sort_unstable_by_key(|(rule, _)| Reverse(self.order[*rule as usize]));
        for (rule, _) in &used {
            let by = self.latest[*rule as usize];
            let before = match self.timings[*rule as usize] {
                Timing::End(instance) => by.saturating_sub(self.starts[instance as usize].1),
                _ => by,
            };
            for need in relaxed.needs.of(*rule) {
                self.limit(*need, by, before);
            }
        }
        // An end is attributed to the start of its action. The rules for the conditional effects of an
        // operator are one action.
        let mut timed: FxHashMap<OperatorId, (Time, u32, u32)> = FxHashMap::default();
        for (rule, times) in used {
            self.is_used[rule as usize] = false;
            let Some(origin) = relaxed.origins[rule as usize] else { continue };
            let (latest, order) = (self.latest[rule as usize], self.order[rule as usize]);
            let (action, latest) = match self.timings[rule as usize] {
                Timing::End(instance) => {
                    let duration = self.starts[instance as usize].1;
                    (self.concurrent.instances[instance as usize].start, latest.saturating_sub(duration))
                }
                _ => (origin, latest),
            };
            let entry = timed.entry(action).or_insert((latest, order, times));
            *entry = (entry.0.min(latest), entry.1.min(order), entry.2.max(times));
        }
        let mut timed: Vec<_> =
            timed.into_iter().map(|(id, (latest, order, times))| (latest, order, id, times)).collect();
        timed.sort_unstable();
        let repeated = |(_, _, id, times)| std::iter::repeat_n(id, times as usize);
        TimedRelaxedPlan { finish, happenings: timed.into_iter().flat_map(repeated).collect() }
    }

    /// Limits the latest time of the rule that supports a proposition: `before` if the rule starts
    /// an action, else `by`.
    fn limit(&mut self, proposition: Proposition, by: Time, before: Time) {
        if let Some((rule, _)) = self.supporters[proposition as usize] {
            let is_start = matches!(self.timings[rule as usize], Timing::Start(_));
            let latest = &mut self.latest[rule as usize];
            *latest = (*latest).min(if is_start { before } else { by });
        }
    }
}
