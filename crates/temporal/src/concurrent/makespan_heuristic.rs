//! Makespan heuristic: lower bound on the remaining time, for each goal variable separately.
//!
//! A variable changes its values one after another. A change reads the variable, so it takes place
//! at least a separation after the previous change. An action that requires a value from its start
//! to its end takes its duration. The bound is the length of a shortest path to the goal value,
//! counted from the time of the last change.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use task::number::{Int, dense};
use task::task::{Fact, State, VariableId};

use crate::concurrent::happening::Role;
use crate::concurrent::simple_temporal_network::SimpleTemporalNetwork;
use crate::concurrent::temporal_task::TemporalTask;

/// Least time from the last change of a variable to its goal value, by current value. `None` if the
/// goal value is unreachable.
struct Path {
    variable: usize,
    left: Vec<Option<Int>>,
}

pub(super) struct Estimate {
    paths: Vec<Path>,
    separation: Int,
}

/// A change of a variable: source value (`None` for any), target value, and least time since the
/// previous change.
type Edge = (Option<u32>, u32, Int);

#[derive(Debug, Clone, Copy)]
pub(super) struct RemainingTime {
    /// Lower bound on the makespan.
    pub(super) makespan: Int,
    /// Sum of the remaining times of the goal variables; not a lower bound.
    pub(super) sum: Int,
}

impl Estimate {
    pub(super) fn new(concurrent: &TemporalTask) -> Self {
        let task = &concurrent.task;
        let goals = task.goal.facts.iter().filter(|fact| fact.variable.index() < task.basic);
        let paths = goals.map(|goal| path(concurrent, *goal)).collect();
        Self { paths, separation: concurrent.separation }
    }

    /// Evaluates a temporal state. Returns `None` if the goal is unreachable.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "fewer than 2^32 happenings, less than 2^91 apart, and a variable has fewer than 2^32 values"
    )]
    pub(super) fn left(&self, state: &State, clocks: &SimpleTemporalNetwork) -> Option<RemainingTime> {
        // A plan ends with an action, so pending timed literals alone do not delay its end.
        let mut remaining = RemainingTime { makespan: clocks.latest().max(clocks.floor()), sum: 0 };
        for open in clocks.opens() {
            let end = clocks.start(open) + open.duration;
            remaining.makespan = remaining.makespan.max(end);
        }
        for path in &self.paths {
            let remaining_time = path.left[state.values[path.variable] as usize]?;
            if remaining_time > 0 {
                let since = clocks.changed(dense(path.variable)).unwrap_or(-self.separation);
                remaining.makespan = remaining.makespan.max(since + remaining_time);
                remaining.sum += remaining_time;
            }
        }
        Some(remaining)
    }
}

/// Least times to the goal value of a variable, by backward Dijkstra search from the goal value.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "a path takes fewer steps than the variable has values, each less than 2^91"
)]
fn path(concurrent: &TemporalTask, goal: Fact) -> Path {
    let variable = goal.variable;
    let values = concurrent.task.variables[variable.index()].values.len();
    let edges = edges(concurrent, variable);
    let mut into: Vec<Vec<usize>> = vec![Vec::new(); values];
    for (index, (_, to, _)) in edges.iter().enumerate() {
        into[*to as usize].push(index);
    }
    let mut distances = vec![None; values];
    let mut open = BinaryHeap::from([Reverse((0, goal.value))]);
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

/// All changes of a variable by happenings, with their least distances from the previous change.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "durations and the separation are below 2^90; setters are counted in memory"
)]
fn edges(concurrent: &TemporalTask, variable: VariableId) -> Vec<Edge> {
    let task = &concurrent.task;
    let operators = || task.operators.iter().zip(&concurrent.happenings);
    let value_in =
        |facts: &[Fact]| facts.iter().find(|fact| fact.variable == variable).map(|fact| fact.value);
    let apart = concurrent.separation;
    let mut setters = vec![0_u32; task.variables[variable.index()].values.len()];
    for operator in &task.operators {
        let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
        let effects = operator.effects.iter().chain(conditional);
        for fact in effects.filter(|fact| fact.variable == variable) {
            setters[fact.value as usize] += 1;
        }
    }
    let mut edges = Vec::new();
    for (operator, happening) in operators().filter(|(_, happening)| happening.role != Role::Never) {
        let conditional = operator.conditional.iter().filter_map(|effect| value_in(&effect.effects));
        edges.extend(conditional.map(|to| (None, to, 0)));
        let Some(to) = value_in(&operator.effects) else { continue };
        let from = value_in(&operator.condition.facts);
        match happening.role {
            Role::Never => {}
            Role::Timed(_) => edges.push((from, to, 0)),
            Role::Start(_) | Role::Whole => edges.push((from, to, from.map_or(0, |_| apart))),
            Role::End(instance) => {
                let instance = &concurrent.instances[instance as usize];
                let start = &task.operators[instance.start.index()];
                let over_all = instance.over_all.map(|id| &task.operators[id.index()]);
                let required_value = over_all.and_then(|over_all| value_in(&over_all.condition.facts));
                edges.push(match (value_in(&start.effects), from) {
                    // The start's value persists until the end: either the condition over all
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
                            None => (None, to, 0),
                        }
                    }
                    (_, from) => (from, to, from.map_or(0, |_| apart)),
                });
            }
        }
    }
    edges
}
