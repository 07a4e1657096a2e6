//! Makespan heuristic: lower bound on the remaining time, for each goal variable separately.
//!
//! A variable changes its values one after another. A change that requires the old value reads the
//! variable, so it takes place at least a separation after the previous change; other changes can
//! follow at once. An action that requires a value from its start to its end takes its duration. The
//! bound is the length of a shortest path to the goal value, counted from the time of the last
//! change.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use task::limits::Limits;
use task::number::{Int, dense};
use task::task::{Fact, OperatorId, State, Task, VariableId};

use crate::concurrent::happening::Role;
use crate::concurrent::simple_temporal_network::SimpleTemporalNetwork;
use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;

/// Least time from the last change of a variable to its goal value, by current value. `None` if the
/// goal value is unreachable.
struct Path<T: TimeNumber = Int> {
    variable: usize,
    left: Vec<Option<T>>,
}

pub(super) struct Estimate<T: TimeNumber = Int> {
    paths: Vec<Path<T>>,
    separation: T,
}

/// A change of a variable: source value (`None` for any), target value, and least time since the
/// previous change.
type Edge<T> = (Option<u32>, u32, T);

#[derive(Debug, Clone, Copy)]
pub(super) struct RemainingTime<T: TimeNumber = Int> {
    pub(super) makespan: T,
    /// Sum of the remaining times of the goal variables; not a lower bound.
    pub(super) sum: T,
}

impl<T: TimeNumber> Estimate<T> {
    /// Computes the least remaining times of each goal variable. At a limit, the remaining goal
    /// variables are omitted, which keeps the estimates lower bounds.
    pub(super) fn new(concurrent: &TemporalTask<T>, limits: &Limits) -> Self {
        let task = &concurrent.task;
        let goals = task.goal.facts.iter().filter(|fact| fact.variable.index() < task.basic);
        let setting = setting(task);
        let path = |goal: &Fact| path(concurrent, *goal, &setting[goal.variable.index()]);
        let paths = limits.watch(goals).map_while(Result::ok).map(path).collect();
        Self { paths, separation: concurrent.separation }
    }

    /// Evaluates a temporal state. Returns `None` if the goal is unreachable.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`, and a variable has fewer than 2^32 values"
    )]
    pub(super) fn left(&self, state: &State, clocks: &SimpleTemporalNetwork<T>) -> Option<RemainingTime<T>> {
        // A plan ends with an action, and not before the timed literals that have taken place.
        let mut remaining = RemainingTime { makespan: clocks.latest().max(clocks.floor()), sum: T::ZERO };
        for open in clocks.opens() {
            let end = clocks.start(open) + open.duration;
            remaining.makespan = remaining.makespan.max(end);
        }
        for path in &self.paths {
            let remaining_time = path.left[state.values[path.variable] as usize]?;
            if remaining_time > T::ZERO {
                let since = clocks.changed(dense(path.variable)).unwrap_or(-self.separation);
                remaining.makespan = remaining.makespan.max(since + remaining_time);
                remaining.sum += remaining_time;
            }
        }
        Some(remaining)
    }
}

#[expect(
    clippy::arithmetic_side_effects,
    reason = "a path takes fewer steps than the variable has values, each a time of at most `TIME_BITS` bits"
)]
fn path<T: TimeNumber>(concurrent: &TemporalTask<T>, goal: Fact, setting: &[OperatorId]) -> Path<T> {
    let variable = goal.variable;
    let values = concurrent.task.variables[variable.index()].values.len();
    let edges = edges(concurrent, variable, setting);
    let mut into: Vec<Vec<usize>> = vec![Vec::new(); values];
    for (index, (_, to, _)) in edges.iter().enumerate() {
        into[*to as usize].push(index);
    }
    let mut distances = vec![None; values];
    let mut open = BinaryHeap::from([Reverse((T::ZERO, goal.value))]);
    while let Some(Reverse((distance, value))) = open.pop() {
        if distances[value as usize].is_some() {
            continue;
        }
        distances[value as usize] = Some(distance);
        for (from, _, weight) in into[value as usize].iter().map(|index| edges[*index]) {
            let all_values = 0..dense(values);
            let sources = from.map_or(all_values, |from| from..from + 1);
            for source in sources.filter(|source| distances[*source as usize].is_none()) {
                open.push(Reverse((distance + weight, source)));
            }
        }
    }
    Path { variable: variable.index(), left: distances }
}

fn setting(task: &Task) -> Vec<Vec<OperatorId>> {
    let mut setting: Vec<Vec<OperatorId>> = vec![Vec::new(); task.variables.len()];
    for (operator, id) in task.operators.iter().zip((0..).map(OperatorId)) {
        let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
        for fact in operator.effects.iter().chain(conditional) {
            let setters = &mut setting[fact.variable.index()];
            if setters.last() != Some(&id) {
                setters.push(id);
            }
        }
    }
    setting
}

#[expect(
    clippy::arithmetic_side_effects,
    reason = "durations and the separation have at most `TIME_BITS` bits; setters are counted in memory"
)]
fn edges<T: TimeNumber>(
    concurrent: &TemporalTask<T>,
    variable: VariableId,
    setting: &[OperatorId],
) -> Vec<Edge<T>> {
    let task = &concurrent.task;
    let operators =
        setting.iter().map(|id| (&task.operators[id.index()], &concurrent.happenings[id.index()]));
    let value_in =
        |facts: &[Fact]| facts.iter().find(|fact| fact.variable == variable).map(|fact| fact.value);
    let apart = concurrent.separation;
    let mut setters = vec![0_u32; task.variables[variable.index()].values.len()];
    for (operator, _) in operators.clone() {
        let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
        let effects = operator.effects.iter().chain(conditional);
        for fact in effects.filter(|fact| fact.variable == variable) {
            setters[fact.value as usize] += 1;
        }
    }
    let mut edges = Vec::new();
    for (operator, happening) in operators.filter(|(_, happening)| happening.role != Role::Never) {
        let conditional = operator.conditional.iter().filter_map(|effect| value_in(&effect.effects));
        edges.extend(conditional.map(|to| (None, to, T::ZERO)));
        let Some(to) = value_in(&operator.effects) else { continue };
        let from = value_in(&operator.condition.facts);
        match happening.role {
            Role::Never => {}
            Role::Timed(_) => edges.push((from, to, T::ZERO)),
            Role::Start(_) | Role::Whole => edges.push((from, to, from.map_or(T::ZERO, |_| apart))),
            Role::End(instance) => {
                let instance = &concurrent.instances[instance as usize];
                let start = &task.operators[instance.start.index()];
                let over_all = instance.over_all.map(|id| &task.operators[id.index()]);
                let required_value = over_all.and_then(|over_all| value_in(&over_all.condition.facts));
                edges.push(match (value_in(&start.effects), from) {
                    // The start's value persists until the end: either the over-all condition
                    // requires it, or no other happening sets it, including other runs of the
                    // instance.
                    (Some(set), Some(from))
                        if set == from
                            && (required_value == Some(set)
                                || instance.under_way.is_none() && setters[set as usize] == 1) =>
                    {
                        (Some(from), to, instance.duration)
                    }
                    // The value persists from before the start to the end.
                    (None, None) => {
                        match value_in(&start.condition.facts)
                            .filter(|required| required_value == Some(*required))
                        {
                            Some(value) => (Some(value), to, instance.duration + apart),
                            None => (None, to, T::ZERO),
                        }
                    }
                    (_, from) => (from, to, from.map_or(T::ZERO, |_| apart)),
                });
            }
        }
    }
    edges
}
