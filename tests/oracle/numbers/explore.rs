//! All states that can be reached, up to a limit, and what every step costs.
//!
//! A number that nothing reads and that is only increased and decreased is a *counter*: it is left out of the state, and what a
//! step adds to it goes into the step's cost. Metrics are linear, so a step costs the same wherever its counters stand; numbers
//! that stay in the state enter the cost as a difference, so that the costs of the steps add up to the metric either way.

use std::collections::HashMap;

use num_bigint::BigInt;
use num_traits::{One as _, Signed as _, Zero as _};

use super::ground::{Act, Ground, Instance, Moment, Test, Value};
use super::model::{Change, Number};
use super::step::{State, all_hold, execute, number};

/// A step from one state to another.
#[derive(Debug, Clone)]
pub struct Edge {
    pub to: usize,
    pub instance: usize,
    /// What it adds to the metric and to each objective.
    pub costs: Vec<Number>,
}

/// What plans are measured by: the metric of the task and further objectives.
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
    /// The metric, or what stands in for it (definition, 9), and the objectives.
    pub fn new(ground: &'g Ground) -> Self {
        let lasts = ground.instances.iter().any(|instance| !instance.duration.is_zero());
        let first = match &ground.metric {
            Some(metric) => Measure::Expression(metric),
            None if lasts => Measure::Time,
            None => Measure::Steps,
        };
        let others = ground.objectives.iter().map(Measure::Expression);
        let values = std::iter::once(first).chain(others).collect();
        Self { ground, values, counters: counters(ground) }
    }

    /// The initial state.
    pub fn initial(&self) -> State {
        let Ground { atoms, numbers, .. } = self.ground;
        State { atoms: atoms.clone(), numbers: numbers.clone(), time: Number::zero() }
    }

    /// What the measures are in a state after so many steps; nothing where one has no value.
    pub fn of(&self, state: &State, steps: i64) -> Option<Vec<Number>> {
        let each = self.values.iter().map(|measure| match measure {
            Measure::Expression(value) => number(value, state),
            Measure::Steps => Some(super::model::whole(steps)),
            Measure::Time => Some(state.time.clone()),
        });
        each.collect()
    }

    /// The state after a step without its counters, and what the step adds to each measure.
    ///
    /// `old` is what the measures are before it.
    pub fn step(
        &self,
        instance: &Instance,
        (before, old): (&State, &[Number]),
    ) -> Option<(State, Vec<Number>)> {
        let mut after = execute(instance, before)?;
        let new = self.of(&after, 1)?;
        let costs = new.into_iter().zip(old).map(|(new, old)| new - old).collect();
        after.time = Number::zero();
        for (fluent, counter) in self.counters.iter().enumerate() {
            if *counter {
                after.numbers[fluent].clone_from(&self.ground.numbers[fluent]);
            }
        }
        Some((after, costs))
    }

    /// Whether it is certain, without looking at states, that no step lowers a measure (raises it, if it is to be maximised).
    pub fn never_improves(&self, measure: usize, maximize: bool) -> bool {
        let Measure::Expression(value) = self.values[measure] else { return true };
        let zero = State {
            atoms: Vec::new(),
            numbers: vec![Some(Number::zero()); self.counters.len()],
            time: Number::zero(),
        };
        let base = number(value, &zero);
        let weight = |state: &State| Some(number(value, state)? - base.clone()?);
        let bad = |change: Number| if maximize { change.is_positive() } else { change.is_negative() };
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
        let safe = |acts: &[Act]| {
            all_acts(acts).into_iter().all(|act| match act {
                Act::Number(change, fluent, value) if !weights[*fluent].is_zero() => match (change, value) {
                    (Change::Increase, Value::Known(value)) => !bad(&weights[*fluent] * value),
                    (Change::Decrease, Value::Known(value)) => !bad(-(&weights[*fluent] * value)),
                    _ => false,
                },
                _ => true,
            })
        };
        self.ground.instances.iter().all(|instance| {
            !bad(&time * &instance.duration)
                && safe(&instance.start.acts)
                && instance.end.as_ref().is_none_or(|end| safe(&end.acts))
        })
    }
}

fn all_acts<'a>(acts: &'a [Act]) -> Vec<&'a Act> {
    let each = |act: &'a Act| if let Act::When(_, inner) = act { all_acts(inner) } else { vec![act] };
    acts.iter().flat_map(each).collect()
}

/// Which numbers are counters.
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

/// Gives equal states one number.
#[derive(Default)]
pub struct States {
    pub all: Vec<State>,
    known: HashMap<(Vec<bool>, Vec<u32>), usize>,
    numbers: HashMap<(BigInt, BigInt), u32>,
}

impl States {
    /// The number of a state, and whether it is new.
    pub fn number(&mut self, state: State) -> (usize, bool) {
        let mut ids = Vec::with_capacity(state.numbers.len());
        for value in &state.numbers {
            let next = u32::try_from(self.numbers.len()).expect("few numbers") + 1;
            ids.push(value.as_ref().map_or(0, |value| {
                *self.numbers.entry((value.numer().clone(), value.denom().clone())).or_insert(next)
            }));
        }
        let next = self.all.len();
        let number = *self.known.entry((state.atoms.clone(), ids)).or_insert(next);
        if number == next {
            self.all.push(state);
        }
        (number, number == next)
    }
}

/// What was reached, breadth first.
pub struct Space {
    /// What the measures are in the initial state.
    pub initial: Vec<Number>,
    pub edges: Vec<Vec<Edge>>,
    pub goals: Vec<bool>,
    /// Fewest steps to each state.
    pub depths: Vec<usize>,
    /// Whether that is all.
    pub complete: bool,
}

/// How much is done before the search gives up.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    pub states: usize,
    /// Attempts to execute an instance.
    pub attempts: usize,
}

/// Visits states, those with fewest steps first.
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
    while space.edges.len() < states.all.len() {
        let at = space.edges.len();
        attempts += ground.instances.len();
        if at >= budget.states || attempts > budget.attempts {
            space.complete = false;
            break;
        }
        let state = states.all[at].clone();
        space.goals.push(all_hold(&ground.goal, &state));
        let mut edges = Vec::new();
        let old = measures.of(&state, 0)?;
        for (position, instance) in ground.instances.iter().enumerate() {
            if let Some((after, costs)) = measures.step(instance, (&state, &old)) {
                let (to, new) = states.number(after);
                if new {
                    space.depths.push(space.depths[at] + 1);
                }
                edges.push(Edge { to, instance: position, costs });
            }
        }
        space.edges.push(edges);
    }
    for state in &states.all[space.goals.len()..] {
        space.goals.push(all_hold(&ground.goal, state));
        space.edges.push(Vec::new());
    }
    Some(space)
}
