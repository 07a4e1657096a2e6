//! Tiny random tasks with a battery that is charged and discharged. Several runs of a charging action can
//! overlap. The number of overlapping runs of one action that a plan needs depends on effects that other
//! actions undo.

use super::make::{LEVEL, always_true};
use super::model::{
    Action, Atom, Body, Comparison, Condition, Effect, Expression, Fluent, Measure, Operation, Part, Q, Task,
    q,
};

const ATOMS: usize = 3;

fn level() -> Fluent {
    Fluent { function: LEVEL, terms: Vec::new() }
}

fn atom(random: &mut fastrand::Rng) -> Atom {
    Atom { predicate: random.usize(..ATOMS), terms: Vec::new() }
}

fn at_least(value: i64) -> Condition {
    Condition::Compare(Comparison::AtLeast, Expression::Fluent(level()), Expression::Number(q(value)))
}

fn change(operation: Operation, value: i64) -> Effect {
    Effect::Change(operation, level(), Expression::Number(q(value)))
}

fn durative(name: String, length: Q, start: Part, end: Vec<Effect>) -> Action {
    let end = Part { condition: always_true(), effects: end };
    let body = Body::Durative { duration: Expression::Number(length), start, over_all: always_true(), end };
    Action { name, parameters: Vec::new(), body }
}

fn charge(random: &mut fastrand::Rng, number: usize, unit: Q) -> Action {
    let operation = if random.u8(..10) < 8 { Operation::Assign } else { Operation::Increase };
    let condition = if random.u8(..10) < 7 { always_true() } else { Condition::Atom(atom(random)) };
    let length = unit * q(random.i64(2..8));
    let effects = vec![change(operation, random.i64(1..4))];
    durative(format!("charge{number}"), length, Part { condition, effects: Vec::new() }, effects)
}

fn work(random: &mut fastrand::Rng, number: usize, unit: Q) -> Action {
    let mut conditions = vec![at_least(random.i64(0..3))];
    if random.bool() {
        conditions.push(Condition::Atom(atom(random)));
    }
    if random.u8(..10) < 1 {
        let bound = Expression::Number(q(2));
        conditions.push(Condition::Compare(Comparison::AtMost, Expression::Fluent(level()), bound));
    }
    let consumption = change(Operation::Decrease, random.i64(1..3));
    let (mut start, mut end) = (Vec::new(), vec![Effect::Add(atom(random))]);
    if random.u8(..10) < 7 {
        end.push(consumption);
    } else {
        start.push(consumption);
    }
    if random.u8(..10) < 2 {
        let deletion = Effect::Delete(atom(random));
        if random.bool() { end.push(deletion) } else { start.push(deletion) }
    }
    let start = Part { condition: Condition::All(conditions), effects: start };
    durative(format!("work{number}"), unit * q(random.i64(1..4)), start, end)
}

/// Returns a chain of actions and a charging action. Each action of the chain requires an effect of the
/// previous action and a full battery.
fn chain(random: &mut fastrand::Rng, length: usize, unit: Q) -> Vec<Action> {
    let full = random.i64(1..3);
    let no_condition = Part { condition: always_true(), effects: Vec::new() };
    let charging = vec![change(Operation::Assign, full)];
    let mut actions = vec![durative("charge".into(), unit * q(random.i64(3..9)), no_condition, charging)];
    for number in 0..length {
        let atom = |predicate| Atom { predicate, terms: Vec::new() };
        let previous = number.checked_sub(1).map(|previous| Condition::Atom(atom(previous)));
        let condition = Condition::All([at_least(full)].into_iter().chain(previous).collect());
        let consumption = change(Operation::Decrease, random.i64(1..=full));
        let (mut start, mut end) = (Vec::new(), vec![Effect::Add(atom(number))]);
        if random.u8(..10) < 8 {
            end.push(consumption);
        } else {
            start.push(consumption);
        }
        let length = unit * q(random.i64(1..3));
        actions.push(durative(format!("chain{number}"), length, Part { condition, effects: start }, end));
    }
    actions
}

/// Returns an action that increases the level and is applicable only until its first run ends. So all runs
/// must begin before the first one ends.
fn tank(random: &mut fastrand::Rng, unit: Q) -> Action {
    let open = Atom { predicate: 0, terms: Vec::new() };
    let mut effects = vec![Effect::Delete(open.clone())];
    let increase = change(Operation::Increase, 1);
    let start_effects = if random.bool() {
        effects.push(increase);
        Vec::new()
    } else {
        vec![increase]
    };
    let start = Part { condition: Condition::Atom(open), effects: start_effects };
    durative("fill".into(), unit * q(random.i64(2..6)), start, effects)
}

/// Returns a charging action, a pump that requires a full battery, and stages that alternately
/// require water and no water. The charging action usually removes water, and is usually applicable
/// only until its first run ends. So the number of useful runs depends on effects that the runs
/// themselves undo.
fn vent(random: &mut fastrand::Rng, (stages, length): (usize, i64), unit: Q) -> Vec<Action> {
    let atom = |predicate| Atom { predicate, terms: Vec::new() };
    let full = random.i64(1..3);
    let (water, is_powered) = (atom(0), Condition::Atom(atom(stages + 1)));
    let charge_start = Part { condition: is_powered, effects: Vec::new() };
    let (mut charge_effects, mut pump_effects) =
        (vec![change(Operation::Assign, full)], vec![Effect::Add(water.clone())]);
    if random.u8(..10) < 9 {
        charge_effects.push(Effect::Delete(atom(stages + 1)));
    }
    if random.u8(..10) < 9 {
        charge_effects.push(Effect::Delete(water.clone()));
    }
    if random.u8(..10) < 9 {
        pump_effects.push(change(Operation::Decrease, full));
    }
    let pump_start = Part { condition: at_least(full), effects: Vec::new() };
    let mut actions = vec![
        durative("charge".into(), unit * q(length), charge_start, charge_effects),
        durative("pump".into(), unit * q(if random.u8(..10) < 8 { 1 } else { 2 }), pump_start, pump_effects),
    ];
    for stage in 1..=stages {
        let has_water = Condition::Atom(water.clone());
        let mut conditions =
            vec![if stage % 2 == 1 { has_water } else { Condition::Not(Box::new(has_water)) }];
        conditions.extend((stage > 1).then(|| Condition::Atom(atom(stage - 1))));
        let stage_part =
            Part { condition: Condition::All(conditions), effects: vec![Effect::Add(atom(stage))] };
        let (name, body) = (format!("stage{stage}"), Body::Instantaneous(stage_part));
        actions.push(Action { name, parameters: Vec::new(), body });
    }
    actions
}

const CAP: usize = 3000;
/// Maximum number of nodes of the oracle for tasks made by [`vent`], where many runs begin.
const VENT_CAP: usize = 200_000;

/// Returns a random task with durations in multiples of `unit`, and the maximum number of nodes of its
/// oracle.
pub fn make(seed: u64, unit: Q) -> (Task, usize) {
    let random = &mut fastrand::Rng::with_seed(seed);
    let kind = random.u8(..21) / 2;
    let length = if kind < 5 { random.usize(2..=ATOMS) } else { 0 };
    let stages = match kind {
        0..10 => 0,
        _ if random.u8(..10) < 3 => 2,
        _ => 3,
    };
    let charging = random.i64(9..11);
    let is_tank = (5..7).contains(&kind);
    let mut actions = match kind {
        0..5 => chain(random, length, unit),
        5..7 => vec![tank(random, unit)],
        7..10 => Vec::new(),
        _ => vent(random, (stages, charging), unit),
    };
    let ranges = match kind {
        0..7 => [0..1, 0..2],
        7..10 => [1..3, 1..4],
        _ => [0..1, 0..1],
    };
    let [charges, works] = ranges.map(|range| random.usize(range));
    actions.extend((0..charges).map(|number| charge(random, number, unit)));
    actions.extend((0..works).map(|number| work(random, number, unit)));
    let events = if stages == 0 && random.u8(..10) < 2 {
        vec![(unit * q(random.i64(1..12)), vec![(random.bool(), atom(random))])]
    } else {
        Vec::new()
    };
    let mut goal: Vec<_> = (0..random.usize(1..3)).map(|_| Condition::Atom(atom(random))).collect();
    if let Some(predicate) = length.checked_sub(1) {
        goal = vec![Condition::Atom(Atom { predicate, terms: Vec::new() })];
    }
    if stages > 0 {
        let water = Condition::Atom(Atom { predicate: 0, terms: Vec::new() });
        goal = vec![Condition::Atom(Atom { predicate: stages, terms: Vec::new() })];
        goal.push(if random.u8(..10) < 3 { water } else { Condition::Not(Box::new(water)) });
    } else if is_tank {
        goal = vec![at_least(random.i64(2..4))];
    } else if random.u8(..10) < 3 {
        goal.push(at_least(random.i64(1..3)));
    }
    let level_limit = if stages > 0 {
        1
    } else if length > 0 {
        2
    } else {
        3
    };
    let task = Task {
        types: 1,
        objects: vec![0],
        predicates: (0..ATOMS.max(stages + 2)).map(|name| (format!("p{name}"), 0)).collect(),
        functions: vec![("level".to_owned(), 0)],
        axioms: Vec::new(),
        actions,
        atoms: match kind {
            0..5 => Vec::new(),
            5..7 => vec![Atom { predicate: 0, terms: Vec::new() }],
            10.. => vec![Atom { predicate: stages + 1, terms: Vec::new() }],
            _ if random.bool() => vec![atom(random)],
            _ => Vec::new(),
        },
        values: vec![(level(), q(random.i64(0..level_limit)))],
        events,
        goal: Condition::All(goal),
        measure: Measure::Time,
    };
    (task, if stages > 0 { VENT_CAP } else { CAP })
}
