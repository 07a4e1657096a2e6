//! Enumerates the reachable states up to a limit, with the cost of each step.
//!
//! A *counter* is a number that nothing reads and that actions only increase and decrease. Counters are not
//! part of the state; their changes are part of the step's cost. Metrics are linear, so this cost does not
//! depend on the values of the counters. All other numbers contribute their difference to the cost. So the
//! costs of the steps of a plan always add up to its metric (minus the initial value).

use std::collections::HashMap;

use num_bigint::BigInt;
use num_traits::{One as _, Signed as _, Zero as _};

use super::ground::{Act, Ground, Instance, Moment, Test, Value};
use super::model::{Change, Number};
use super::step::{State, all_hold, execute, number};

#[derive(Debug, Clone)]
pub struct Edge {
    pub to: usize,
    pub instance: usize,
    /// Contribution of the step to the metric and to each objective.
    pub costs: Vec<Number>,
}

/// Functions by which plans are measured: the metric of the task, then further objectives.
pub struct Measures<'g> {
    ground: &'g Ground,
    values: Vec<Measure<'g>>,
    counters: Vec<bool>,
}

enum Measure<'g> {
    Expression(&'g Value),
    Steps,
    Time,
}

impl<'g> Measures<'g> {
    /// Prepares the exploration. Without a metric in the task, the first measure is the default metric
    /// (definition, 9).
    pub fn new(ground: &'g Ground) -> Self {
        let has_durations = ground.instances.iter().any(|instance| !instance.duration.is_zero());
        let metric_measure = match &ground.metric {
            Some(metric) => Measure::Expression(metric),
            None if has_durations => Measure::Time,
            None => Measure::Steps,
        };
        let objectives = ground.objectives.iter().map(Measure::Expression);
        let values = std::iter::once(metric_measure).chain(objectives).collect();
        Self { ground, values, counters: counters(ground) }
    }

    pub fn initial(&self) -> State {
        let Ground { atoms, numbers, .. } = self.ground;
        State { atoms: atoms.clone(), numbers: numbers.clone(), time: Number::zero() }
    }

    pub fn of(&self, state: &State, steps: i64) -> Option<Vec<Number>> {
        let results = self.values.iter().map(|measure| match measure {
            Measure::Expression(value) => number(value, state),
            Measure::Steps => Some(super::model::whole(steps)),
            Measure::Time => Some(state.time.clone()),
        });
        results.collect()
    }

    /// Returns the state after a step, with counters reset, and the contribution of the step to
    /// each measure. `None` if the step is not applicable or a measure is undefined afterwards.
    ///
    /// `old` contains the values of the measures in the state `before`.
    pub fn step(
        &self,
        instance: &Instance,
        (before, old): (&State, &[Number]),
    ) -> Option<(State, Vec<Number>)> {
        let mut after = execute(instance, before)?;
        let new = self.of(&after, 1)?;
        let costs = new.into_iter().zip(old).map(|(new, old)| new - old).collect();
        // Total time is part of the costs instead of the state.
        after.time = Number::zero();
        for (fluent, counter) in self.counters.iter().enumerate() {
            if *counter {
                after.numbers[fluent].clone_from(&self.ground.numbers[fluent]);
            }
        }
        Some((after, costs))
    }

    /// Returns `true` if the effects alone show that no step lowers a measure (with `maximize`, raises it).
    pub fn never_improves(&self, measure: usize, maximize: bool) -> bool {
        let Measure::Expression(value) = self.values[measure] else { return true };
        // Measures are linear. So the weight of a number is the difference of the measure between the unit
        // state and the zero state.
        let zero = State {
            atoms: Vec::new(),
            numbers: vec![Some(Number::zero()); self.counters.len()],
            time: Number::zero(),
        };
        let base = number(value, &zero);
        let weight = |state: &State| Some(number(value, state)? - base.clone()?);
        let improves = |change: Number| if maximize { change.is_positive() } else { change.is_negative() };
        let mut weights = Vec::new();
        for fluent in 0..self.counters.len() {
            let mut state = zero.clone();
            state.numbers[fluent] = Some(Number::one());
            let Some(weight) = weight(&state) else { return false };
            if !weight.is_zero() && !self.counters[fluent] {
                return false;
            }
            weights.push(weight);
        }
        let Some(time) = weight(&State { time: Number::one(), ..zero }) else { return false };
        let never_improving = |acts: &[Act]| {
            all_acts(acts).into_iter().all(|act| match act {
                Act::Number(change, fluent, value) if !weights[*fluent].is_zero() => match (change, value) {
                    (Change::Increase, Value::Known(value)) => !improves(&weights[*fluent] * value),
                    (Change::Decrease, Value::Known(value)) => !improves(-(&weights[*fluent] * value)),
                    _ => false,
                },
                _ => true,
            })
        };
        self.ground.instances.iter().all(|instance| {
            !improves(&time * &instance.duration)
                && never_improving(&instance.start.acts)
                && instance.end.as_ref().is_none_or(|end| never_improving(&end.acts))
        })
    }
}

fn all_acts<'a>(acts: &'a [Act]) -> Vec<&'a Act> {
    let flattened = |act: &'a Act| if let Act::When(_, inner) = act { all_acts(inner) } else { vec![act] };
    acts.iter().flat_map(flattened).collect()
}

fn counters(ground: &Ground) -> Vec<bool> {
    let mut counters: Vec<bool> = ground.numbers.iter().map(Option::is_some).collect();
    ground.goal.iter().for_each(|test| mark_test(test, &mut counters));
    for instance in &ground.instances {
        instance.over_all.iter().for_each(|test| mark_test(test, &mut counters));
        for moment in std::iter::once(&instance.start).chain(&instance.end) {
            let Moment { tests, acts } = moment;
            for test in tests {
                mark_test(test, &mut counters);
            }
            for act in acts {
                mark_act(act, &mut counters);
            }
        }
    }
    counters
}

fn mark_act(act: &Act, counters: &mut [bool]) {
    match act {
        Act::Add(_) | Act::Delete(_) => {}
        Act::Number(change, fluent, value) => {
            if !matches!(change, Change::Increase | Change::Decrease) {
                counters[*fluent] = false;
            }
            mark(value, counters);
        }
        Act::When(tests, inner) => {
            for test in tests {
                mark_test(test, counters);
            }
            for act in inner {
                mark_act(act, counters);
            }
        }
    }
}

fn mark_test(test: &Test, counters: &mut [bool]) {
    match test {
        Test::Known(_) | Test::Atom(_) => {}
        Test::Not(inner) => mark_test(inner, counters),
        Test::Any(parts) => parts.iter().for_each(|part| mark_test(part, counters)),
        Test::Compare(_, left, right) => {
            mark(left, counters);
            mark(right, counters);
        }
        Test::Open(_, value) => mark(value, counters),
    }
}

fn mark(value: &Value, counters: &mut [bool]) {
    match value {
        Value::Known(_) | Value::Undefined | Value::Time => {}
        Value::Fluent(fluent) => counters[*fluent] = false,
        Value::Sum(parts) | Value::Product(parts) => parts.iter().for_each(|part| mark(part, counters)),
        Value::Minus(left, right) | Value::Quotient(left, right) => {
            mark(left, counters);
            mark(right, counters);
        }
        Value::Negative(inner) => mark(inner, counters),
    }
}

#[derive(Default)]
pub struct States {
    pub by_number: Vec<State>,
    index: HashMap<(Vec<bool>, Vec<u32>), usize>,
    numbers: HashMap<(BigInt, BigInt), u32>,
}

impl States {
    /// Returns the number of a state. The flag is `true` if the state is new. Total time does not distinguish
    /// states.
    pub fn number(&mut self, state: State) -> (usize, bool) {
        let mut ids = Vec::with_capacity(state.numbers.len());
        // 0 means undefined; distinct numbers have distinct positive ids.
        for value in &state.numbers {
            let next = u32::try_from(self.numbers.len()).expect("few numbers") + 1;
            ids.push(value.as_ref().map_or(0, |value| {
                *self.numbers.entry((value.numer().clone(), value.denom().clone())).or_insert(next)
            }));
        }
        let next = self.by_number.len();
        let number = *self.index.entry((state.atoms.clone(), ids)).or_insert(next);
        if number == next {
            self.by_number.push(state);
        }
        (number, number == next)
    }
}

/// The explored part of the state space, in breadth-first order.
pub struct Space {
    /// Values of the measures in the initial state.
    pub initial: Vec<Number>,
    pub edges: Vec<Vec<Edge>>,
    pub goals: Vec<bool>,
    pub depths: Vec<usize>,
    /// Whether all reachable states are included, because no budget was exceeded.
    pub complete: bool,
}

#[derive(Debug, Clone, Copy)]
pub struct Budget {
    pub states: usize,
    /// Maximum number of attempts to execute an instance.
    pub attempts: usize,
}

/// Explores the state space breadth-first, within the budget. Returns `None` if a measure is undefined
/// in the initial state.
pub fn explore(ground: &Ground, measures: &Measures<'_>, budget: Budget) -> Option<Space> {
    let mut states = States::default();
    let first = measures.initial();
    let mut space = Space {
        initial: measures.of(&first, 0)?,
        edges: Vec::new(),
        goals: Vec::new(),
        depths: vec![0],
        complete: true,
    };
    states.number(first);
    let mut attempts = 0;
    while space.edges.len() < states.by_number.len() {
        let current = space.edges.len();
        attempts += ground.instances.len();
        if current >= budget.states || attempts > budget.attempts {
            space.complete = false;
            break;
        }
        let state = states.by_number[current].clone();
        space.goals.push(all_hold(&ground.goal, &state));
        let mut edges = Vec::new();
        let old = measures.of(&state, 0)?;
        for (position, instance) in ground.instances.iter().enumerate() {
            if let Some((after, costs)) = measures.step(instance, (&state, &old)) {
                let (to, is_new) = states.number(after);
                if is_new {
                    space.depths.push(space.depths[current] + 1);
                }
                edges.push(Edge { to, instance: position, costs });
            }
        }
        space.edges.push(edges);
    }
    // States that were reached but not expanded get no edges.
    for state in &states.by_number[space.goals.len()..] {
        space.goals.push(all_hold(&ground.goal, state));
        space.edges.push(Vec::new());
    }
    Some(space)
}
